"""A kernel's C source: generated from symbols and joined with hand-written files."""
