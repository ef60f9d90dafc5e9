"""What monitoring systems are told of a process."""
