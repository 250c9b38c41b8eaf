"""Sweeps: many runs in parallel, each done once, and their table."""
