"""Searches that improve one design, or a few, from where they are."""
