"""Evidence: a file that proves a run and can be checked without its database."""
