"""Tournaments between search methods: plan, runs, report."""
