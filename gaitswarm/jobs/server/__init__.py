"""Jobs of a gaitswarm server, over its HTTP API."""
