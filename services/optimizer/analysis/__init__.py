"""Questions about whole histories of jobs."""
