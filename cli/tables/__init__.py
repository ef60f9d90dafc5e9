"""Views as tables for people."""
