"""The panel at the right of the window."""
