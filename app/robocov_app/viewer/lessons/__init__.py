"""Lessons: played, drawn, and used with the mouse and keys."""
