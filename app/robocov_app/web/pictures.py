"""Pictures as a browser gets them: what is different from the picture before, without loss."""

import struct
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pygame import Surface

HEADER = struct.Struct("<I6H")
"""Number of the picture; its width and height; left, top, width and height of what is different."""


@dataclass(frozen=True, eq=False)
class Picture:
    """Pixels of the window at one moment; `number` grows from picture to picture."""

    number: int
    pixels: NDArray[np.uint32]  # (height, width), 0xRRGGBB

    @classmethod
    def of(cls, surface: Surface, number: int) -> "Picture":
        high, wide = surface.get_height(), surface.get_pitch() // 4
        buffer: Any = surface.get_buffer()
        view = np.frombuffer(buffer, np.uint32).reshape(high, wide)
        return cls(number, view[:, : surface.get_width()] & np.uint32(0xFFFFFF))


def encoded(picture: Picture, before: Picture | None) -> bytes:
    """Return what a browser that shows `before` needs to show a picture: a header and deflated pixels.

    The pixels are those of the smallest box around all that is different, xor those that were there: what
    stays is 0, which deflate makes nothing of. Text stays as sharp as it is in the window, and all this is
    several times quicker than PNG. A picture of another size begins from black.
    """
    pixels = picture.pixels
    high, wide = pixels.shape
    change = pixels if before is None or before.pixels.shape != pixels.shape else pixels ^ before.pixels
    rows, columns = np.flatnonzero(change.any(axis=1)), np.flatnonzero(change.any(axis=0))
    left, top, right, bottom = 0, 0, 0, 0
    if len(rows):
        left, top, right, bottom = columns[0], rows[0], columns[-1] + 1, rows[-1] + 1
    box: Any = np.ascontiguousarray(change[top:bottom, left:right])
    head = HEADER.pack(picture.number % 2**32, wide, high, left, top, right - left, bottom - top)
    return head + zlib.compress(box, 1)
