"""Proposed robot.toml for a URDF: legs, stance, actuators and gaits, each guess with its reason."""
