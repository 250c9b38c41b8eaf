"""Runs of a result grouped by controller and gains, scaled, compared in pairs, and selected for display."""
