"""Removal of thin strokes from a raster by a morphological opening that keeps the corners of wider shapes."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from robocov.arrays import BoolArray

MAX_STROKE_PIXELS = 200
"""Wider shapes are not strokes. The overlap of the strips grows with this width."""
_CORNER_DISTANCE = 0.3
"""Distance, in widths, between a square corner and its opening by a disc, with some margin."""
_STRIP_CELLS = 1_000_000
"""Number of cells processed at once, to limit the memory."""
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
    # Strips overlap by as much as the result of a cell depends on its surroundings.
    halo = 3 * width
    rows = max(_STRIP_CELLS // solid.shape[1], halo)
    for top in range(0, len(solid), rows):
        low = max(top - halo, 0)
        high = min(top + rows + halo, len(solid))
        opened = _open(solid[low:high], width, above=top == 0, below=high == len(solid))
        kept[top : top + rows] = opened[top - low : top - low + rows]
    return kept


def _open(solid: BoolArray, width: int, *, above: bool, below: bool) -> BoolArray:
    """Open a strip of a raster by a disc.

    `above` and `below` say whether the strip contains the first and the last row of the image.
    """
    # Beyond the edge of the image nothing is solid, so that a frame along the edge is thin, too.
    margin_above = width if above else 0
    margin_below = width if below else 0
    padded = np.pad(solid, ((margin_above, margin_below), (width, width)))
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
    rows = slice(margin_above, len(padded) - margin_below)
    return np.asarray(opened[rows, width : padded.shape[1] - width])


def _compute_distance(cells: BoolArray) -> NDArray[np.float64]:
    """Return the distance of each cell to the nearest false cell; infinite if there is none."""
    if cells.all():
        return np.full(cells.shape, np.inf)
    return np.asarray(ndimage.distance_transform_edt(cells))
