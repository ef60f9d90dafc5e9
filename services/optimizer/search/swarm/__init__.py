"""Searches by a population whose members learn from one another."""
