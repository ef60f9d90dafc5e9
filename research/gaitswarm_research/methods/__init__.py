"""Search methods for jobs and comparisons, registered as plug-ins of gaitswarm."""
