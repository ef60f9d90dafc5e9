"""Foot trajectories, inverse kinematics and the smoothing of desired angles."""
