"""Edits: pure functions from a sketch to a `Change`; a MapError, one sentence, where it cannot be done."""
