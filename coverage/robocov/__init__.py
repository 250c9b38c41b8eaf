"""robocov: multi-robot coverage control among unknown obstacles."""
