"""Simulation of walking robots: what a walk is worth. The entry point is `simulate`"""
