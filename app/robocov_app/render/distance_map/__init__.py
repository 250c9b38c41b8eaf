"""The distance to the nearest robot at every pixel, and the geodesic cells.

- `lattice`: squares between the sites of the coverage cost.
- `field`: exact distances at pixels, and the borders of geodesic cells.
- `colors`: the color scale, its ticks and its palette.
"""
