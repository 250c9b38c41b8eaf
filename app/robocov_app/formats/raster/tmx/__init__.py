"""Tile maps of Tiled: the map (`reading`), its layers, their grids of tiles, tilesets and objects."""

from robocov_app.formats.raster.tmx.reading import read, sniff

__all__ = ["read", "sniff"]
