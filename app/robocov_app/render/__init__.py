"""Drawing with pygame: pictures of an environment and a team at one time of a run.

Modules
-------
painter, layer_catalog, layers
    `Painter`, which draws a scene, and the layers that it can show.
scene, record_scene, moving_obstacles, sensed_points
    The content of a picture.
annotations
    Texts and scales around the arena.
camera, canvas, clipping, sprites, fonts, pixel_arrays, surface_cache
    The tools that layers draw with.
distance_map
    Distances to the nearest robot.
density_shading, density_text
    The density as colors and as text.
crowding, panel_grid
    Sizes of marks in a crowd, and grids of several pictures.
"""

import os

# pygame prints a greeting to stdout, which is reserved for the output of commands.
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
