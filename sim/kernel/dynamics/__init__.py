"""A physics step as symbols: rigid bodies, motors and contact, derived from Pinocchio's model."""
