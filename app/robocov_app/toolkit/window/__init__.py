"""The main loop of a window, its display, its size and its end."""
