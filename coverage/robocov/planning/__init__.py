"""Plans of one robot: what it has discovered of the obstacles, ways and places among them, safe driving."""
