"""Connections to SQLite and PostgreSQL, their transactions, and news of commits."""
