"""Inputs of commands: options, specs, designs, robots."""
