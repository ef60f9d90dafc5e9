"""A robot.toml from a URDF: legs, stance, actuators and gaits, each guess with its reason."""
