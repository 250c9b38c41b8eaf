"""The user's actions, grouped by subject."""
