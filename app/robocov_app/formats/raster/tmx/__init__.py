"""Tile maps of Tiled: `reading` of maps, their layers, grids of tiles, tilesets, and shapes of objects."""

from robocov_app.formats.raster.tmx.reading import read, sniff

__all__ = ["read", "sniff"]
