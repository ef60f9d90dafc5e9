"""Commands that compare: drives, search methods, machines."""
