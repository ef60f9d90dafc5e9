"""Parameters of a robot from measured walks (thesis 2.4)."""
