"""The command line `gaitswarm`: how people ask."""
