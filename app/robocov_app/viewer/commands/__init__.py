"""Commands of the viewer, with their keys."""
