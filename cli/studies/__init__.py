"""Studies of several jobs, and what they come to."""
