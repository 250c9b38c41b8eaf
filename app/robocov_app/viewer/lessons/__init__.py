"""Lessons: playing them, drawing them, and handling the user's input."""
