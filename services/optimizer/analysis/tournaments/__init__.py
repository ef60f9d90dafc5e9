"""Which search method is better, from the runs of tournaments."""
