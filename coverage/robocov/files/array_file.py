"""Arrays in .npz files, whose sizes are looked at before anything of them is read into memory."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections import Counter
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from robocov.errors import InputError

MOST_BYTES = 2_000_000_000
"""Bytes that the arrays of one file may take: about the largest run that can be asked for."""

_MOST_SQUEEZED = 100
"""Bytes of arrays that one byte of a file may stand for, where they are more than `_MODEST`."""
_MODEST = 256_000_000

_LARGEST_READ = 1 << 20
"""Bytes that are read in one go: the directory of a file of arrays is short."""

_BROKEN = (
    *(ValueError, EOFError, OSError, MemoryError, NotImplementedError, RuntimeError),
    *(zipfile.BadZipFile, zlib.error, struct.error),
)
"""Errors that zipfile, zlib and numpy raise on a damaged file."""


def read_arrays(file: BinaryIO, where: str, most_bytes: int = MOST_BYTES) -> dict[str, NDArray[Any]]:
    """Return the arrays in an .npz file, which messages call `where`.

    Whatever is wrong with it is an `InputError` of one line: also where it holds objects, or more than is
    good for the machine.
    """
    try:
        size = file.seek(0, io.SEEK_END)
        with zipfile.ZipFile(_Sparing(file)) as archive:
            entries = archive.infolist()
            # a stream ends where its entry says, whatever there may be in it
            total = sum(entry.file_size for entry in entries)
            if total > min(most_bytes, max(_MODEST, _MOST_SQUEEZED * size)):
                found = f"{total / 1e6:,.0f} MB of arrays in a file of {size / 1e6:,.1f} MB"
                raise ValueError(f"{found} are too many")
            name, times = (
                Counter(entry.filename for entry in entries).most_common(1)[0] if entries else ("", 0)
            )
            if times > 1:
                raise ValueError(f"{name!r} is in it {times} times")
            arrays = {}
            for entry in entries:
                with archive.open(entry) as stream:
                    array = np.lib.format.read_array(stream, allow_pickle=False)
                arrays[entry.filename.removesuffix(".npy")] = array
            return arrays
    except _BROKEN as error:
        raise InputError(f"{where}: cannot be read: {error or type(error).__name__}") from error


class _Sparing:
    """A file of which nothing large is read in one go, as a directory of millions of entries would be."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def read(self, size: int = -1) -> bytes:
        if size > _LARGEST_READ:
            raise zipfile.BadZipFile("its directory is too large")
        return self._file.read(size)
