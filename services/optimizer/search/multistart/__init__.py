"""Searches that start local ones from several places."""
