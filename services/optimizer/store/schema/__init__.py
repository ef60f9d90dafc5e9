"""The schema's revisions, and what is done to a whole database: upgrade, check, backup."""
