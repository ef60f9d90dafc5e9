"""Evidence: one file that proves a run, written from what is stored and checked without it."""
