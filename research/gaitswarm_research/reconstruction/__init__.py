"""Reconstruction of conventions that the thesis leaves open, from its printed results."""
