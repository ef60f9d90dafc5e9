"""Fitting a robot and conventions to a table of what walks came to."""
