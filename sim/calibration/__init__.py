"""Fitting of a robot and conventions to a table of measured or published results."""
