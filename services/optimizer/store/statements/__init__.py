"""Statements inside a transaction that someone else began."""
