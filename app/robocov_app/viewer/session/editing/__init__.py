"""Edits of a session, their effects on the map and its passages, and the spring that pulls robots."""
