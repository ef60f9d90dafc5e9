"""The port of the memory: what it promises, whatever database is behind it."""
