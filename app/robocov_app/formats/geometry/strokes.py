"""Thin strokes of a raster: found by a morphological opening, which keeps the corners of what is wider."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from robocov.arrays import BoolArray

MAX_STROKE_PIXELS = 200  # wider strokes are no strokes; the halo of a strip grows with it
_CORNER = 0.3  # of the width: how far an opening by a disc stays away from square corners, with some to spare
_STRIP_CELLS = 1_000_000  # cells that are looked at together, which bounds the memory


def remove_thin_strokes(solid: BoolArray, width: int) -> BoolArray:
    """Return the cells of `solid` that belong to something at least as wide as a stroke.

    The opening by a disc of that width (Serra 1982, Image Analysis and Mathematical Morphology), grown
    back into the corners that the disc does not reach.

    Parameters
    ----------
    solid : (rows, columns) array of bool
    width : int, cells
        What is narrower goes.

    Returns
    -------
    kept : (rows, columns) array of bool
    """
    if width <= 1:
        return solid.copy()
    kept = np.empty_like(solid)
    halo = 3 * width
    rows = max(_STRIP_CELLS // solid.shape[1], halo)
    for top in range(0, len(solid), rows):
        low, high = max(top - halo, 0), min(top + rows + halo, len(solid))
        opened = _open(solid[low:high], width, above=top == 0, below=high == len(solid))
        kept[top : top + rows] = opened[top - low : top - low + rows]
    return kept


def _open(solid: BoolArray, width: int, *, above: bool, below: bool) -> BoolArray:
    # a frame along the edge of the picture is thin, too
    margin = ((width if above else 0, width if below else 0), (width, width))
    padded = np.pad(solid, margin)
    # a disc around the corner of four cells has an even width: a square of four, then a disc around a cell
    is_even = width % 2 == 0
    core = ndimage.binary_erosion(padded, _SQUARE) if is_even else padded
    radius = (width - is_even - 1) / 2
    core = _distance(core) > radius
    opened = _distance(~core) <= radius
    if is_even:
        opened = ndimage.binary_dilation(opened, _SQUARE)
    opened = (_distance(~opened) <= math.ceil(_CORNER * width)) & padded
    rows = slice(margin[0][0], len(padded) - margin[0][1])
    return np.asarray(opened[rows, width : padded.shape[1] - width])


_SQUARE = np.ones((2, 2), dtype=bool)


def _distance(cells: BoolArray) -> NDArray[np.float64]:
    """Return the distance of each cell to the nearest one that is not set; infinite where there is none."""
    if cells.all():
        return np.full(cells.shape, np.inf)
    return np.asarray(ndimage.distance_transform_edt(cells))
