"""The sheet and all that is drawn on it."""
