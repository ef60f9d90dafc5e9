"""Measurements of speed, as ratios of things that take turns in one run."""
