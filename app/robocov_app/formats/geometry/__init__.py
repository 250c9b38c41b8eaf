"""From rings, cells and strokes to free space, and from free space to a map."""
