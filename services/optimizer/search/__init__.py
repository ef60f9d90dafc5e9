"""The search methods: ask, tell, dump, load."""
