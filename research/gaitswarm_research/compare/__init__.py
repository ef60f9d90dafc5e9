"""Comparison of search methods on test functions and walking jobs."""
