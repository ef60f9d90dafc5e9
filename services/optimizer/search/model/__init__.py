"""Methods that model the fitness, or are led by a library's own search."""
