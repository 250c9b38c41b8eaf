"""Removal of thin strokes from a raster by a morphological opening that keeps the corners of wider shapes."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from robocov.arrays import BoolArray

MAX_STROKE_PIXELS = 200
"""Wider shapes are not strokes. The overlap of the tiles grows with this width."""
_CORNER_DISTANCE = 0.3
"""Distance, in widths, between a square corner and its opening by a disc, with some margin."""
_TILE_CELLS = 1000
"""Rows and columns that are processed at once, to limit the memory."""
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
    kept : (rows, columns) array of bool
        The cells of wider shapes.
    """
    if width <= 1:
        return solid.copy()
    kept = np.empty_like(solid)
    # Tiles overlap by as much as the result of a cell depends on its surroundings.
    halo = 3 * width
    size = max(_TILE_CELLS, halo)
    for top in range(0, solid.shape[0], size):
        for left in range(0, solid.shape[1], size):
            rows = slice(top, min(top + size, solid.shape[0]))
            columns = slice(left, min(left + size, solid.shape[1]))
            opened = _open(_take_window(solid, rows, columns, halo), width)
            kept[rows, columns] = opened[halo:-halo, halo:-halo]
    return kept


def _take_window(solid: BoolArray, rows: slice, columns: slice, halo: int) -> BoolArray:
    """Return a tile of a raster with its surroundings.

    Beyond the edge of the image nothing is solid, so that a frame along the edge is thin, too.
    """
    low_row = max(rows.start - halo, 0)
    low_column = max(columns.start - halo, 0)
    part = solid[low_row : rows.stop + halo, low_column : columns.stop + halo]
    window = np.zeros((rows.stop - rows.start + 2 * halo, columns.stop - columns.start + 2 * halo), dtype=bool)
    row = low_row - (rows.start - halo)
    column = low_column - (columns.start - halo)
    window[row : row + part.shape[0], column : column + part.shape[1]] = part
    return window


def _open(solid: BoolArray, width: int) -> BoolArray:
    """Open a window of a raster by a disc. Cells closer than three widths to its sides may be wrong."""
    # A disc of even width is centered on a corner of cells. It is composed of a disc around a cell and a
    # square of 2 x 2 cells.
    is_even = width % 2 == 0
    core = solid
    if is_even:
        core = ndimage.binary_erosion(solid, _SQUARE)
    radius = (width - is_even - 1) / 2
    core = _compute_distance(core) > radius
    opened = _compute_distance(~core) <= radius
    if is_even:
        opened = ndimage.binary_dilation(opened, _SQUARE)
    return (_compute_distance(~opened) <= math.ceil(_CORNER_DISTANCE * width)) & solid


def _compute_distance(cells: BoolArray) -> NDArray[np.float64]:
    """Return the distance of each cell to the nearest false cell; infinite if there is none."""
    if cells.all():
        return np.full(cells.shape, np.inf)
    return np.asarray(ndimage.distance_transform_edt(cells))
