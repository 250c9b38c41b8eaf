"""The canvas: panes of the controllers, the legend, and overlays of tools."""
