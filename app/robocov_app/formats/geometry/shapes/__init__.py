"""Shapes of drawings: their `collection` by a reader, and the `interpretation` of them as free space."""
