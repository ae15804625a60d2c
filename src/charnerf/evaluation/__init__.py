"""Error against the truth and against what a user has without learning; seconds and memory."""
