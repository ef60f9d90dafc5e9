"""Commands that bring a robot's model nearer to measured walks and printed tables."""
