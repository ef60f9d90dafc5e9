"""Where walks run: in threads of this process, or on Ray."""
