"""The map editor: a model that works without a window, and the window on top of it."""
