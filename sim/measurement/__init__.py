"""Logs of walks: measured on a robot, simulated, or synthetic (thesis 2.3)."""
