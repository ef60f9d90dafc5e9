"""The domain: what a job is, and what its designs are worth."""
