"""The compiled kernel: loaded, called, and kept busy."""
