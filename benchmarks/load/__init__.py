"""The API under load: a large store, many readers, and a job that runs meanwhile."""
