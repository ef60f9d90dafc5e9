"""A plug-in for gaitswarm: designs walk in MuJoCo."""
