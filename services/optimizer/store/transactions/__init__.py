"""What is done in transactions of its own: runs, history, deletion, tokens, notifications."""
