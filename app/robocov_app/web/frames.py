"""Frames of a window, and what is sent of them to pages that have an earlier one."""

from __future__ import annotations

import struct
import zlib
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pygame

HEADER = struct.Struct("<I7H")
"""Number, width, height; left, top, width and height of what changed; 1 if the frame starts from black."""
MAX_BASES_BYTES = 1 << 27  # of frames that are kept because some page has them
_COMPRESSION_LEVEL = 1  # the quickest; most of a change is zeros


@dataclass(frozen=True, eq=False)
class Frame:
    """Pixels of the window at one moment; `number` grows from frame to frame, from 1."""

    number: int
    pixels: NDArray[np.uint32]  # (height, width), 0xRRGGBB

    @classmethod
    def from_surface(cls, surface: pygame.Surface, number: int) -> Frame:
        """Copy the pixels of a surface."""
        height = surface.get_height()
        columns = surface.get_pitch() // 4
        buffer: Any = surface.get_buffer()
        view = np.frombuffer(buffer, np.uint32).reshape(height, columns)
        return cls(number, view[:, : surface.get_width()] & np.uint32(0xFFFFFF))


def encode_frame(frame: Frame, base: Frame | None) -> bytes:
    """Encode a frame for a browser that shows another one.

    The pixels are those of the smallest box around all that changed, xor those that were there: what stays
    is 0, which deflate compresses to almost nothing. Text stays as sharp as it is in the window, and all
    this is several times quicker than PNG.

    Parameters
    ----------
    frame : Frame
        The frame to show.
    base : Frame or None
        The frame that the browser shows now; None, or one of another size, to start from black.

    Returns
    -------
    bytes
        `HEADER`, and the deflated pixels.
    """
    pixels = frame.pixels
    height, width = pixels.shape
    starts_from_black = base is None or base.pixels.shape != pixels.shape
    change = pixels if base is None or starts_from_black else pixels ^ base.pixels
    rows = np.flatnonzero(change.any(axis=1))
    columns = np.flatnonzero(change.any(axis=0))
    left, top, right, bottom = 0, 0, 0, 0
    if len(rows):
        left, top, right, bottom = columns[0], rows[0], columns[-1] + 1, rows[-1] + 1
    box: Any = np.ascontiguousarray(change[top:bottom, left:right])
    header = HEADER.pack(
        frame.number % 2**32, width, height, left, top, right - left, bottom - top, starts_from_black
    )
    return header + zlib.compress(box, _COMPRESSION_LEVEL)


class BaseFrames:
    """The frames that pages have, within a bound on the memory of all of them.

    A page whose frame had to be given up gets the next one from black.
    """

    def __init__(self, max_bytes: int = MAX_BASES_BYTES) -> None:
        self._max_bytes = max_bytes
        self._frames: OrderedDict[int, Frame] = OrderedDict()

    def __len__(self) -> int:
        return len(self._frames)

    @property
    def n_bytes(self) -> int:
        """Memory of the frames that are kept, in bytes."""
        return sum(frame.pixels.nbytes for frame in self._frames.values())

    def add(self, frame: Frame) -> None:
        """Keep a frame that is sent to a page; give up the oldest ones if that is too much."""
        self._frames[frame.number] = frame
        while self.n_bytes > self._max_bytes and len(self._frames) > 1:
            self._frames.popitem(last=False)

    def get(self, number: int) -> Frame | None:
        """Return the frame of a number; None if it is not kept."""
        return self._frames.get(number)

    def keep_only(self, numbers: set[int]) -> None:
        """Give up all frames that no page has any more."""
        for number in [number for number in self._frames if number not in numbers]:
            del self._frames[number]
