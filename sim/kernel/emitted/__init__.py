"""A kernel's C: emitted from symbols, and joined with what is written by hand."""
