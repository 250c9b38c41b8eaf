"""The distance to the nearest robot at every pixel, and the geodesic cells.

- `site_lattice`: squares between the sites of the coverage cost.
- `pixel_distances`: exact distances at pixels, and the borders of geodesic cells.
- `colors`: the color scale, its ticks and its palette.
"""
