"""Studies of the model and of searches, one module each."""
