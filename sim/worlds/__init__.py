"""Simulation in worlds that differ from the model."""
