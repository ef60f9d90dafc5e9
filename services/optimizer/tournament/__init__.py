"""Races between search methods, and the functions to race on."""
