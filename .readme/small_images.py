"""Images of few colors, whose files are small."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PIL import Image

PALETTE_SIZE = 256
EXACT_COLORS = 64
"""Number of the most frequent colors that images contain exactly."""


def reduce_colors(pixels: NDArray[np.uint8]) -> Image.Image:
    """Reduce an image to 256 colors: the most frequent ones exactly, and an approximation of the rest.

    Large areas keep their colors exactly, and small ones, such as arrows or edges of lines, approximately.

    Parameters
    ----------
    pixels : (height, width, 3) uint8 array

    Returns
    -------
    Image.Image
    """
    colors, indices, counts = np.unique(
        pixels.reshape(-1, 3), axis=0, return_inverse=True, return_counts=True
    )
    order = np.argsort(-counts)
    exact = colors[order[:EXACT_COLORS]]
    rare = Image.fromarray(colors[order[EXACT_COLORS:]][None])
    approximate_count = PALETTE_SIZE - EXACT_COLORS
    values = rare.quantize(approximate_count, method=Image.Quantize.MAXCOVERAGE).getpalette()
    assert values is not None
    approximate = np.reshape(values, (-1, 3))[:approximate_count]
    palette = np.concatenate([exact, approximate])
    offsets = colors[:, None].astype(int) - palette
    nearest = (offsets**2).sum(axis=2).argmin(axis=1).astype(np.uint8)
    image = Image.fromarray(nearest[indices].reshape(pixels.shape[:2]), "P")
    image.putpalette(palette.astype(np.uint8).tobytes())
    return image
