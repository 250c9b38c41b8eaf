"""Shapes of drawings: their `collection` by a reader, and their `interpretation` as free space."""
