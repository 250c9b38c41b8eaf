"""Texts and scales around the arena.

- `scale_bar`: the scale bar, in the strip below the arena or in the caption of a low pane.
- `captions`: the caption above a pane, and the status line below the arena.
- `legend_strip`: the legend above the arena.
- `color_bar`: the color scale of the distance map.
"""
