"""Removal of thin strokes from a raster by a morphological opening that keeps the corners of wider shapes."""

import math

import numpy as np
from scipy import ndimage

from robocov.typing import BoolArray, FloatArray

MAX_STROKE_PIXELS = 200
"""Wider shapes are not strokes. The overlap of the tiles grows with this width."""
_CORNER_DISTANCE = 0.3
"""Distance, in widths, between a square corner and its opening by a disc, with some margin."""
_TILE_CELLS = 1000
"""Rows and columns that are processed at once, to limit the memory."""
_MARGIN_CELLS = 2
"""Cells around a window that are not solid."""
_SQUARE = np.ones((2, 2), dtype=bool)


def remove_thin_strokes(solid: BoolArray, width: int) -> BoolArray:
    """Remove shapes that are narrower than a width.

    This is the morphological opening by a disc of that width (Serra 1982, Image Analysis and Mathematical
    Morphology), extended into the corners that the disc does not reach.

    Parameters
    ----------
    solid : (rows, columns) array of bool
    width : int, cells

    Returns
    -------
    wide : (rows, columns) array of bool
        The cells of wider shapes.
    """
    if width <= 1:
        return solid.copy()
    wide = np.empty_like(solid)
    # Tiles overlap by the distance from which surroundings affect the result of a cell.
    halo = 3 * width
    size = max(_TILE_CELLS, halo)
    for top in range(0, solid.shape[0], size):
        for left in range(0, solid.shape[1], size):
            rows = slice(top, min(top + size, solid.shape[0]))
            columns = slice(left, min(left + size, solid.shape[1]))
            low_row = max(top - halo, 0)
            low_column = max(left - halo, 0)
            window = solid[low_row : rows.stop + halo, low_column : columns.stop + halo]
            opened = _open(window, width)
            inner_rows = slice(top - low_row, rows.stop - low_row)
            inner_columns = slice(left - low_column, columns.stop - low_column)
            wide[rows, columns] = opened[inner_rows, inner_columns]
    return wide


def _open(solid: BoolArray, width: int) -> BoolArray:
    """Open a window of a raster by a disc.

    Beyond the window nothing is solid, so that a frame along the edge of an image is thin, too.
    """
    padded = np.pad(solid, _MARGIN_CELLS)
    # A disc of even width is centered on a corner of cells. It is composed of a disc around a cell and a
    # square of 2 x 2 cells.
    is_even = width % 2 == 0
    core = padded
    if is_even:
        core = ndimage.binary_erosion(padded, _SQUARE)
    radius = (width - is_even - 1) / 2
    core = _compute_distance(core) > radius
    opened = _compute_distance(~core) <= radius
    if is_even:
        opened = ndimage.binary_dilation(opened, _SQUARE)
    opened = (_compute_distance(~opened) <= math.ceil(_CORNER_DISTANCE * width)) & padded
    inner = slice(_MARGIN_CELLS, -_MARGIN_CELLS)
    return opened[inner, inner]


def _compute_distance(cells: BoolArray) -> FloatArray:
    """Return the distance of each cell to the nearest false cell; infinite if there is none."""
    if cells.all():
        return np.full(cells.shape, np.inf)
    return np.asarray(ndimage.distance_transform_edt(cells))
