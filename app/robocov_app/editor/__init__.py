"""The map editor: a model without a window, and the window on top of it."""
