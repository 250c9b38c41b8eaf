"""Tools for a map: gestures, snapping, zooming and outlines."""
