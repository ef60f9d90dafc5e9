"""The memory: jobs, iterations and evaluations in SQL."""
