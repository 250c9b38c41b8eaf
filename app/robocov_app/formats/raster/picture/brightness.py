"""The brightness of a picture, its thumbnail, and its transparency."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

OPAQUE_ALPHA = 128
"""Pixels with a smaller alpha (0 to 255) count as transparent."""
STRIP_ROWS = 512
"""Number of rows that are converted at a time, to limit the memory."""
_MAX_THUMBNAIL_PX = 640
"""Longer side of a thumbnail, unless a picture is enormous."""


@dataclass(frozen=True, eq=False)
class Brightness:
    """A picture without its colors, the top row first.

    Attributes
    ----------
    level : (rows, columns) array of unsigned integers
        The sum of red, green and blue, from 0 (black) to `max_level` (white).
    max_level : int
        Level of white.
    alpha : (rows, columns) array of uint8 or None
        Opacity, from 0 to 255 (opaque).
    texts : mapping of str to str
        Text chunks of a PNG, by key.
    lossy : bool
        Whether saving may change pixels, as in a JPEG.
    roles : (rows, columns) array of uint8 or None
        Role of each pixel's color, as returned by `ColorKey.classify`.
    thumbnail : (h, w, 3) array of uint8 or None
        The reduced picture, in color.
    """

    level: NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.uint32]
    max_level: int
    alpha: NDArray[np.uint8] | None = None
    texts: Mapping[str, str] = field(default_factory=dict)
    lossy: bool = False
    roles: NDArray[np.uint8] | None = None
    thumbnail: NDArray[np.uint8] | None = None


def to_rgb(pixels: Any, maximum: int) -> NDArray[np.uint8]:
    """Convert pixels to red, green and blue from 0 to 255.

    Parameters
    ----------
    pixels : (rows, columns, 1 or 3) array
    maximum : int
        Level of white in `pixels`.
    """
    levels = pixels if maximum == 255 else pixels.astype(np.uint32) * 255 // maximum
    return np.broadcast_to(levels.astype(np.uint8), (*pixels.shape[:2], 3))


def choose_thumbnail_step(width: int, height: int) -> int:
    """Return the factor by which a thumbnail is reduced: a power of 2 that divides the rows of a strip."""
    step = 1
    while max(width, height) > step * _MAX_THUMBNAIL_PX and step < STRIP_ROWS:
        step *= 2
    return step


def describe_transparency(picture: Brightness) -> str:
    """Describe the share of transparent pixels, for formats that ignore transparency; empty without any."""
    if picture.alpha is None:
        return ""
    percentage = 100 * np.count_nonzero(picture.alpha < OPAQUE_ALPHA) / picture.alpha.size
    if percentage == 0.0:
        return ""
    return f"{percentage:.3g}% of the pixels are transparent; their hidden color is used"
