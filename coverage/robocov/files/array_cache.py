"""Arrays that are costly to compute, kept in files between runs.

A cache must never be in the way: an entry that is damaged, foreign or unreadable counts as missing, and
one that cannot be written is not written.
"""

from __future__ import annotations

import hashlib
import io
import os
import struct
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

from robocov.errors import InputError, OutputError
from robocov.files.array_file import read_arrays
from robocov.files.atomic import written

_SUFFIX = ".robocov"

_FORMAT = b"robocov arrays 1\n"

_DIGEST = 16
"""Bytes of the check sum that stands before the data."""

_STALE = 24 * 3600.0
"""Seconds after which a half-written file has no writer any more."""


class ArrayCache:
    """A folder of arrays, each entry a file named by what the arrays were computed from.

    Any number of processes may use one folder at the same time. When the files grow beyond the
    limit, those that were not used for the longest time are removed.

    Parameters
    ----------
    folder : Path
        Made when something is saved.
    limit : int, bytes
        Of all files together.
    """

    def __init__(self, folder: Path, limit: int = 1 << 30) -> None:
        self.folder = folder
        self.limit = limit

    @classmethod
    def of_user(cls) -> ArrayCache | None:
        """Return the cache in the user's cache folder, None where the user wants none.

        The environment variable ``ROBOCOV_CACHE`` names another folder; if it is empty, there is no cache.
        """
        wanted = os.environ.get("ROBOCOV_CACHE")
        if wanted == "":
            return None
        return cls(Path(wanted) if wanted else platformdirs.user_cache_path("robocov", appauthor=False))

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
        path = self._path(key)
        try:
            if path.stat().st_size > self.limit:
                return None
            data = path.read_bytes()
        except OSError:
            return None
        start = len(_FORMAT) + _DIGEST
        payload = memoryview(data)[start:]
        if data[:start] != _FORMAT + _digest(payload):
            with suppress(OSError):
                path.unlink()
            return None
        # what was written whole can be read, except by a numpy that knows less than the writer's
        try:
            arrays = read_arrays(io.BytesIO(payload), path.name, self.limit)
        except InputError:
            return None
        for array in arrays.values():
            array.setflags(write=False)
        with suppress(OSError):
            os.utime(path)
        return arrays

    def save(self, key: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep arrays under a key, if that is possible."""
        buffer = io.BytesIO()
        np.savez(buffer, **arrays)  # type: ignore[arg-type]
        payload = buffer.getbuffer()
        if len(payload) > self.limit:
            return
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with written(self._path(key), durable=False) as path, path.open("wb") as file:
                file.write(_FORMAT + _digest(payload))
                file.write(payload)
        except (OSError, OutputError):
            return
        self._tidy()

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}{_SUFFIX}"

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


def _digest(payload: memoryview) -> bytes:
    return hashlib.blake2b(payload, digest_size=_DIGEST).digest()
