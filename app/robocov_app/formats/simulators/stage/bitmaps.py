"""Bitmaps of models, whose dark pixels are walls."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from shapely import MultiPolygon

from robocov.errors import MapError, to_one_line
from robocov_app.formats import files
from robocov_app.formats.geometry.cells.vectorize import outline_free_cells
from robocov_app.formats.raster.picture import describe_transparency, read_picture

_MAX_DARK_LEVEL = 127 / 255
"""Maximum brightness, from 0 to 1, of dark pixels."""


class Bitmap(NamedTuple):
    """The free part of a picture.

    Attributes
    ----------
    free : MultiPolygon
        Scaled so that the bounding box of all dark pixels is the unit square around the origin.
    columns, rows : int
        Size of that bounding box, in pixels.
    """

    free: MultiPolygon
    columns: int
    rows: int


class BitmapReader:
    """Reads the pictures of a world; each file is read only once.

    Parameters
    ----------
    notes : list of str
        List to which remarks about pictures are added.
    """

    def __init__(self, notes: list[str]) -> None:
        self._notes = notes
        self._bitmaps: dict[Path, Bitmap] = {}
        self._pixel_count = 0

    def read(self, file: Path) -> Bitmap:
        """Read a picture.

        Raises
        ------
        MapError
            If it cannot be read, has no dark or no light pixels, or if all pictures together are too large.
        """
        if file not in self._bitmaps:
            self._bitmaps[file] = self._read(file, to_one_line(file))
        return self._bitmaps[file]

    def _read(self, file: Path, source_name: str) -> Bitmap:
        """Decode a picture, and crop it to the bounding box of its dark pixels."""
        picture = read_picture(file, source_name)
        self._pixel_count += picture.level.size
        if self._pixel_count > files.MAX_CELLS:
            millions = files.MAX_CELLS // 1_000_000
            expected = f"expected at most {millions} million pixels in all bitmaps"
            raise MapError(f"{source_name}: {expected}, got more")
        is_dark = picture.level <= _MAX_DARK_LEVEL * picture.max_level
        transparency = describe_transparency(picture)
        if transparency:
            self._notes.append(f"{to_one_line(file.name)}: {transparency}")
        if not is_dark.any() or (transparency and is_dark.all()):
            shade = "light"
            if is_dark.any():
                shade = "dark"
            cause = f": {transparency}" if transparency else ""
            raise MapError(
                f"{source_name}: expected an image with dark walls, got only {shade} pixels{cause}"
            )
        row = np.flatnonzero(is_dark.any(axis=1))
        column = np.flatnonzero(is_dark.any(axis=0))
        is_free = ~is_dark[row[0] : row[-1] + 1, column[0] : column[-1] + 1]
        rows, columns = is_free.shape
        free = MultiPolygon()
        if is_free.any():
            free = outline_free_cells(is_free, (1 / columns, 1 / rows), (-0.5, -0.5), source_name)
        return Bitmap(free, columns, rows)
