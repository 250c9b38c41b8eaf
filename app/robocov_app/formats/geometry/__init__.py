"""Conversion of rings, cells and strokes to free space, and of free space to a map."""
