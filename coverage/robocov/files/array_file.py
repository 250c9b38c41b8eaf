"""Arrays in .npz files, which are looked at before anything of them is read into memory."""

from __future__ import annotations

import io
import math
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from robocov.errors import InputError, shown

MOST_BYTES = 2_000_000_000
"""Bytes that the arrays of one file may take: about the largest run that can be asked for."""

_MOST_SQUEEZED = 100
"""Bytes of arrays that one byte of a file may stand for, where they are more than `_MODEST`."""
_MODEST = 256_000_000

_LARGEST_READ = 1 << 20
"""Bytes that are read in one go: the directory of a file of arrays is short."""

_LOCAL_HEADER = 30
"""Bytes before the name of an entry of a zip file."""

_HEADER = 1 << 16
"""Bytes of an entry within which the header of its array ends."""

_BROKEN = (
    *(ValueError, EOFError, OSError, MemoryError, NotImplementedError, RuntimeError),
    *(zipfile.BadZipFile, zlib.error, struct.error),
)
"""Errors that zipfile, zlib and numpy raise on a damaged file."""


class Header(NamedTuple):
    """Shape and type of an array, read before its data."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]


class ArrayFile:
    """The arrays in an .npz file: their `headers` by name, and how to read them."""

    def __init__(self, archive: zipfile.ZipFile, size: int, most_bytes: int) -> None:
        self._archive = archive
        self._entries: dict[str, zipfile.ZipInfo] = {}
        self.headers: dict[str, Header] = {}
        entries = sorted(archive.infolist(), key=lambda entry: entry.header_offset)
        total = sum(entry.file_size for entry in entries)
        if total > min(most_bytes, max(_MODEST, _MOST_SQUEEZED * size)):
            raise ValueError(
                f"{total / 1e6:,.0f} MB of arrays in a file of {size / 1e6:,.1f} MB are too many"
            )
        ends = [*(entry.header_offset for entry in entries[1:]), archive.start_dir]
        for entry, end in zip(entries, ends, strict=False):
            name = entry.filename.removesuffix(".npy")
            if entry.header_offset + _LOCAL_HEADER + entry.compress_size > end:
                raise ValueError(f"{shown(name)} overlaps what comes after it")
            if name in self.headers:
                raise ValueError(f"{shown(name)} is there twice")
            self._entries[name] = entry
            self.headers[name] = _header_of(archive, entry, name)

    def read(self, name: str) -> NDArray[Any]:
        """Return an array."""
        with self._archive.open(self._entries[name]) as stream:
            array: NDArray[Any] = npy.read_array(stream, allow_pickle=False)
        return array


@contextmanager
def opened_arrays(file: BinaryIO, where: str, most_bytes: int = MOST_BYTES) -> Iterator[ArrayFile]:
    """Give the arrays in an .npz file, which messages call `where`.

    Whatever is wrong with it while it is read is an InputError of one line: also where it holds objects, or
    more than is good for the machine.
    """
    try:
        size = file.seek(0, io.SEEK_END)
        with zipfile.ZipFile(_Sparing(file)) as archive:
            yield ArrayFile(archive, size, most_bytes)
    except InputError:
        raise
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


def _header_of(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, name: str) -> Header:
    with archive.open(entry) as stream:
        head = io.BytesIO(stream.read(_HEADER))
    version = npy.read_magic(head)
    read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, _, dtype = read(head)
    if dtype.hasobject:
        raise ValueError(f"{shown(name)} holds objects")
    if min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize != entry.file_size - head.tell():
        raise ValueError(f"{shown(name)} of shape {shape} does not take {entry.file_size} bytes")
    return Header(shape, dtype)
