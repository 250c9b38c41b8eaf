"""The panel on the right of the window."""
