"""Research on the public library of gaitswarm."""
