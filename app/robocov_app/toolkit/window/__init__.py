"""The main loop of a window, its display, its layout, and how it ends."""
