"""MuJoCo as a second engine: models of a robot, their export, and walks."""
