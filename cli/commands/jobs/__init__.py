"""Commands about jobs, and the processes that run them."""
