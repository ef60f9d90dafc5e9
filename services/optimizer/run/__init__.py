"""A job under way: the coordinator decides, the runner does."""
