"""Arrays in .npz files: read after a look at their sizes, and kept in a cache between runs."""

from __future__ import annotations

import hashlib
import io
import os
import struct
import time
import zipfile
import zlib
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from robocov.errors import InputError, OutputError
from robocov.files.cache_folders import find_cache_root, is_private
from robocov.files.writing import replace_file

MOST_BYTES = 2_000_000_000
"""Bytes that the arrays of one file may take: about the largest run that can be asked for."""
_MOST_SQUEEZED, _MODEST = 100, 256_000_000
"""Bytes of arrays that one byte of a file may stand for, where they are more than so many."""
_LARGEST_READ = 1 << 20
"""Bytes that are read in one go: the directory of a file of arrays is short."""
_BROKEN = (
    *(ValueError, EOFError, OSError, MemoryError, NotImplementedError, RuntimeError),
    *(zipfile.BadZipFile, zlib.error, struct.error),
)
"""Errors that zipfile, zlib and numpy raise on a damaged file."""
_SUFFIX, _FORMAT = ".robocov", b"robocov arrays 1\n"
_DIGEST = 16
"""Bytes of the check sum that stands before the data of a cached file."""
_STALE = 24 * 3600.0
"""Seconds after which a half-written file has no writer any more."""


def read_arrays(file: BinaryIO, where: str, most_bytes: int = MOST_BYTES) -> dict[str, NDArray[Any]]:
    """Return the arrays in an .npz file, which messages call `where`.

    Raises `InputError` on whatever is wrong with it: also objects, or more than is good for the machine.
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
            for name, times in Counter(entry.filename for entry in entries).most_common(1):
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


class ArrayCache:
    """A folder of arrays, each entry a file named by what the arrays were computed from.

    A cache is never in the way: an entry that is damaged, foreign or unreadable counts as missing, and one
    that cannot be written is not written. Any number of processes may use one folder at the same time. When
    its files grow beyond `limit` bytes, those that were not used for the longest time are removed.
    """

    def __init__(self, folder: Path, limit: int = 1 << 30) -> None:
        self.folder, self.limit = folder, limit

    @classmethod
    def of_user(cls) -> ArrayCache | None:
        """Return the cache in the user's folder, or that of ``ROBOCOV_CACHE``; None if that is empty."""
        folder = find_cache_root()
        return None if folder is None else cls(folder)

    @staticmethod
    def key(*parts: bytes | str | float) -> str:
        """Return a name for what is computed from these parts, a digest of their exact values."""
        digest = hashlib.blake2b(digest_size=20)
        for part in parts:
            if isinstance(part, float):
                data = struct.pack("<d", part)
            else:
                data = part if isinstance(part, bytes) else str(part).encode()
            digest.update(b"%s %d\n" % (type(part).__name__.encode(), len(data)) + data)
        return digest.hexdigest()

    def load(self, key: str) -> dict[str, NDArray[Any]] | None:
        """Return the arrays that were saved under a key, read-only, None if there are none that are whole."""
        path = self.folder / f"{key}{_SUFFIX}"
        # what was written whole can be read, except by a numpy that knows less than the writer's
        with suppress(OSError, InputError):
            if path.stat().st_size > self.limit or not is_private(path):
                return None
            data = path.read_bytes()
            start = len(_FORMAT) + _DIGEST
            payload = memoryview(data)[start:]
            if data[:start] != _FORMAT + _digest(payload):
                path.unlink()
                return None
            arrays = read_arrays(io.BytesIO(payload), path.name, self.limit)
            for array in arrays.values():
                array.setflags(write=False)
            with suppress(OSError):
                os.utime(path)
            return arrays
        return None

    def save(self, key: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep arrays under a key, if that is possible."""
        buffer = io.BytesIO()
        np.savez(buffer, **arrays)  # type: ignore[arg-type]
        payload = buffer.getvalue()
        if len(payload) > self.limit:
            return
        with suppress(OSError, OutputError):
            self.folder.mkdir(parents=True, exist_ok=True)
            with replace_file(self.folder / f"{key}{_SUFFIX}", durable=False) as path:
                path.write_bytes(b"".join([_FORMAT, _digest(payload), payload]))
                path.chmod(0o600)  # `load` ignores what others may have written
            self._tidy()

    def _tidy(self) -> None:
        """Remove what was not used for the longest time beyond the limit, and what was left half-written."""
        found: list[tuple[float, int, Path]] = []
        for path in self.folder.glob(f"*{_SUFFIX}"):
            with suppress(OSError):  # another process may have been quicker
                status = path.stat()
                if not path.name.startswith("."):
                    found.append((status.st_mtime, status.st_size, path))
                elif status.st_mtime < time.time() - _STALE:
                    path.unlink()
        total = sum(size for _, size, _ in found)
        for _, size, path in sorted(found):
            if total <= self.limit:
                break
            with suppress(OSError):
                path.unlink()
            total -= size


def _digest(payload: bytes | memoryview) -> bytes:
    return hashlib.blake2b(payload, digest_size=_DIGEST).digest()
