"""What commands are given: options, specs, designs, robots, files."""
