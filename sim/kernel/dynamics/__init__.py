"""Symbolic physics step: rigid bodies, motors and contact, derived from Pinocchio's model."""
