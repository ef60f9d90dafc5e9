"""Searches that go from a point to a better one near it."""
