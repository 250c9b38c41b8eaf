"""Actions of the user, grouped by subject."""
