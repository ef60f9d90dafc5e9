"""Foot trajectories, inverse kinematics and smoothing of the desired angles."""
