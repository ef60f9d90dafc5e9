"""Jobs in a database or behind a server, by the same methods."""
