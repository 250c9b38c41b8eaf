"""Verifying a result: runs are repeated, and each robot decides from its own observations alone."""
