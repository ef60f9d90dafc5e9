"""How far a design holds: in other worlds and scenarios, near it, under other preferences."""
