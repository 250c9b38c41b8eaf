"""Widgets, dialogs, commands and the main loop of both windows, independent of robots and maps."""
