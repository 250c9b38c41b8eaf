"""Sweeps: many runs in parallel, each executed only once, and a table of their results."""
