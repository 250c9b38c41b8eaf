"""The drawing sheet and everything that is drawn on it."""
