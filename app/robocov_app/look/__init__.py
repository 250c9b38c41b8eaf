"""The look of pictures: colors, axes, labels and legends, defined once for all back ends.

Pictures are drawn with pygame (windows and videos, in `render`), matplotlib (files, in `figures`) and
JavaScript (the replay in `report`). All of them use these definitions, so that a run looks the same
everywhere. Nothing in this package draws.

- `colors`, `theme`: colors, their contrast, and the light and the dark theme.
- `hues`: hues of robots and of their cells; colors of trajectories.
- `curve_styles`: color, dashes and marker of the curve of each controller.
- `axes`: limits and ticks of axes.
- `lengths`: round lengths of scale bars and grids, and their labels.
- `labels`: positions of labels that do not overlap, and shortened texts.
- `legend`: names of the elements of a picture, and one legend for several pictures.
"""
