"""Cells of grids: as free space (`grid_map`, `vectorize`), and the free space as cells (`rasterize`)."""
