"""Commands about designs: what they are worth, and their way onto the robot."""
