"""Validation: how far a simulated walk is from a measured one (thesis 2.3)."""
