"""The Python library: typed results, and jobs here or on a server."""
