"""The session: a run with its past, and every way to touch it. Knows no pygame."""
