"""What people write: choices, names and fields, and what they are told where one is wrong."""
