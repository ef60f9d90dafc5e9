"""What a job's designs trade: its Pareto front, and preferences under which designs win."""
