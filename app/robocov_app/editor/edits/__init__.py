"""Edits: pure functions that take a sketch and return a `Change`, or raise a MapError if impossible."""
