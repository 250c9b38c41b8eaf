"""Files: read strictly, written whole or not at all, and every mistake in them named by its place."""
