"""Simulation of walking robots: what a walk is worth.

One pure entry point, `simulate`: a batch of designs in one scenario -> raw objectives and
statuses, and the 500 Hz log on request.
"""
