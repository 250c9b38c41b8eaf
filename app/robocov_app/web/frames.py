"""Frames of a window, and their encoding as differences from earlier frames."""

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
"""Frame number, width, height; left, top, width, height of the changed box; 1 if based on a black frame."""
MAX_BASES_BYTES = 1 << 27
"""Maximum memory of the frames that are kept because a page shows them."""
_COMPRESSION_LEVEL = 1
"""The fastest level, which suffices because most of a difference is zeros."""


@dataclass(frozen=True, eq=False)
class Frame:
    """The pixels of the window at one time.

    Attributes
    ----------
    number : int
        Number of the frame, counted from 1.
    pixels : (height, width) array of uint32
        Colors as 0xRRGGBB.
    """

    number: int
    pixels: NDArray[np.uint32]

    @classmethod
    def from_surface(cls, surface: pygame.Surface, number: int) -> Frame:
        """Copy the pixels of a surface."""
        height = surface.get_height()
        columns = surface.get_pitch() // 4
        buffer: Any = surface.get_buffer()
        # Rows of a surface may be padded, and the highest byte of a pixel is unused.
        view = np.frombuffer(buffer, np.uint32).reshape(height, columns)
        return cls(number, view[:, : surface.get_width()] & np.uint32(0xFFFFFF))


def encode_frame(frame: Frame, base: Frame | None) -> bytes:
    """Encode a frame as the difference from the one that a browser shows now.

    The pixels in the smallest box around all changes are XORed with the previous ones: unchanged pixels
    become 0, which deflate compresses to almost nothing. This is lossless and several times faster than PNG.

    Parameters
    ----------
    frame : Frame
        The frame to show.
    base : Frame or None
        The frame that the browser shows now. If it is None or of another size, the difference is from black.

    Returns
    -------
    bytes
        The header (see `HEADER`) and the compressed pixels of the changed box.
    """
    pixels = frame.pixels
    height, width = pixels.shape
    starts_from_black = base is None or base.pixels.shape != pixels.shape
    change = pixels if base is None or starts_from_black else pixels ^ base.pixels
    rows = np.flatnonzero(change.any(axis=1))
    columns = np.flatnonzero(change.any(axis=0))
    left = top = box_width = box_height = 0
    if len(rows):
        left = columns[0]
        top = rows[0]
        box_width = columns[-1] + 1 - left
        box_height = rows[-1] + 1 - top
    box: Any = np.ascontiguousarray(change[top : top + box_height, left : left + box_width])
    number = frame.number % 2**32
    header = HEADER.pack(number, width, height, left, top, box_width, box_height, starts_from_black)
    return header + zlib.compress(box, _COMPRESSION_LEVEL)


class BaseFrames:
    """The frames that pages show, within a limit on their memory.

    For a page whose frame was dropped, the next frame is encoded from black.
    """

    def __init__(self, max_bytes: int = MAX_BASES_BYTES) -> None:
        self._max_bytes = max_bytes
        self._frames: OrderedDict[int, Frame] = OrderedDict()

    def __len__(self) -> int:
        return len(self._frames)

    @property
    def n_bytes(self) -> int:
        """Memory of the frames, bytes."""
        return sum(frame.pixels.nbytes for frame in self._frames.values())

    def add(self, frame: Frame) -> None:
        """Store a frame that is sent to a page; drop the oldest ones if they exceed the memory limit."""
        self._frames[frame.number] = frame
        while self.n_bytes > self._max_bytes and len(self._frames) > 1:
            self._frames.popitem(last=False)

    def get(self, number: int) -> Frame | None:
        """Return the frame with a number; None if it was dropped."""
        return self._frames.get(number)

    def keep_only(self, numbers: set[int]) -> None:
        """Drop all frames except those with these numbers."""
        for number in [number for number in self._frames if number not in numbers]:
            del self._frames[number]
