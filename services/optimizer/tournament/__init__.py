"""Runs of one search method on one problem, with its rivals."""
