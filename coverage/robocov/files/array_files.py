"""Arrays in .npz files: read only if their sizes are reasonable, and cached between runs."""

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

MAX_BYTES = 2_000_000_000
"""Default limit for the arrays of one file: about the largest run that the application accepts."""
_MAX_COMPRESSION_RATIO = 100
"""Maximum size of the arrays relative to that of the file: more is a decompression bomb."""
_RATIO_EXEMPT_BYTES = 256_000_000
"""Arrays up to this total size may have any compression ratio."""
_MAX_READ_BYTES = 1 << 20
"""Largest single read: the central directory of a zip file with arrays is short."""
_DAMAGE_ERRORS = (
    ValueError,
    EOFError,
    OSError,
    MemoryError,
    NotImplementedError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
)
"""Errors that zipfile, zlib and numpy raise for damaged files."""
_SUFFIX = ".robocov"
_FORMAT = b"robocov arrays 1\n"
_DIGEST_BYTES = 16
"""Length of the checksum between the format and the data of a cached file."""
_STALE_S = 24 * 3600.0
"""Age at which a partly written file counts as abandoned."""


def read_arrays(file: BinaryIO, where: str, max_bytes: int = MAX_BYTES) -> dict[str, NDArray[Any]]:
    """Read the arrays of an .npz file.

    Parameters
    ----------
    file : binary file
        Open for reading, and seekable.
    where : str
        Name of the file in messages.
    max_bytes : int
        Largest total size of the arrays.

    Returns
    -------
    dict of str to array

    Raises
    ------
    InputError
        If the file is damaged or too large, or contains duplicate entries or Python objects.
    """
    try:
        file_size = file.seek(0, io.SEEK_END)
        with zipfile.ZipFile(_LimitedReader(file)) as archive:
            entries = archive.infolist()
            _require_reasonable_entries(entries, file_size, max_bytes)
            arrays = {}
            for entry in entries:
                with archive.open(entry) as stream:
                    array = np.lib.format.read_array(stream, allow_pickle=False)
                arrays[entry.filename.removesuffix(".npy")] = array
            return arrays
    except _DAMAGE_ERRORS as error:
        raise InputError(f"{where}: cannot be read: {error or type(error).__name__}") from error


def _require_reasonable_entries(entries: list[zipfile.ZipInfo], file_size: int, max_bytes: int) -> None:
    """Raise ValueError if entries are too large, or have the same name."""
    # No stream yields more than the size in its entry, regardless of its content.
    total = sum(entry.file_size for entry in entries)
    if total > min(max_bytes, max(_RATIO_EXEMPT_BYTES, _MAX_COMPRESSION_RATIO * file_size)):
        raise ValueError(f"arrays too large: {total / 1e6:,.0f} MB, from a file of {file_size / 1e6:,.1f} MB")
    for name, count in Counter(entry.filename for entry in entries).items():
        if count > 1:
            raise ValueError(f"duplicate entry {name!r}")


class _LimitedReader:
    """A file that refuses large reads, such as that of a directory with millions of entries."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def read(self, size: int = -1) -> bytes:
        if size > _MAX_READ_BYTES:
            raise zipfile.BadZipFile("its directory is too large")
        return self._file.read(size)


class ArrayCache:
    """A folder of cached arrays, whose keys identify the inputs of the computation.

    An entry that is damaged, not private or unreadable counts as missing, and errors on writing are ignored.
    Any number of processes may use a folder at the same time.

    Parameters
    ----------
    folder : Path
        Created by the first `save`.
    max_bytes : int
        Largest total size of the files. Beyond it, the least recently used ones are removed.

    Attributes
    ----------
    folder : Path
    max_bytes : int

    See Also
    --------
    find_optimum : Its results are worth caching.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> import robocov as rc
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     cache = rc.ArrayCache(Path(folder))
    ...     key = rc.ArrayCache.compute_key("squares", 3)
    ...     cache.save(key, {"squares": np.arange(3) ** 2})
    ...     cache.load(key)
    {'squares': array([0, 1, 4])}
    """

    def __init__(self, folder: Path, max_bytes: int = 1 << 30) -> None:
        self.folder = folder
        self.max_bytes = max_bytes

    @classmethod
    def open_default(cls) -> ArrayCache | None:
        """Open the cache in the folder that ``ROBOCOV_CACHE`` names, or else in the user's cache folder.

        Returns
        -------
        ArrayCache or None
            None if the environment variable is empty.
        """
        folder = find_cache_root()
        return None if folder is None else cls(folder)

    @staticmethod
    def compute_key(*parts: bytes | str | float) -> str:
        """Compute a key for arrays from the inputs that determine them.

        Parameters
        ----------
        *parts : bytes, str, int or float

        Returns
        -------
        str
            A digest of the types and exact values.
        """
        digest = hashlib.blake2b(digest_size=20)
        for part in parts:
            if isinstance(part, float):
                data = struct.pack("<d", part)
            elif isinstance(part, bytes):
                data = part
            else:
                data = str(part).encode()
            digest.update(b"%s %d\n" % (type(part).__name__.encode(), len(data)) + data)
        return digest.hexdigest()

    def load(self, key: str) -> dict[str, NDArray[Any]] | None:
        """Load the arrays of a key.

        Parameters
        ----------
        key : str
            See `compute_key`.

        Returns
        -------
        dict of str to array, or None
            Read-only arrays; None if there is no intact entry.
        """
        path = self.folder / f"{key}{_SUFFIX}"
        # Even intact arrays may be unreadable if a newer version of numpy wrote them.
        with suppress(OSError, InputError):
            if path.stat().st_size > self.max_bytes or not is_private(path):
                return None
            data = path.read_bytes()
            payload_start = len(_FORMAT) + _DIGEST_BYTES
            payload = memoryview(data)[payload_start:]
            if data[:payload_start] != _FORMAT + _compute_digest(payload):
                path.unlink()
                return None
            arrays = read_arrays(io.BytesIO(payload), path.name, self.max_bytes)
            for array in arrays.values():
                array.setflags(write=False)
            with suppress(OSError):
                os.utime(path)  # It is the most recently used file now.
            return arrays
        return None

    def save(self, key: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Save arrays under a key, if possible.

        Parameters
        ----------
        key : str
            See `compute_key`.
        arrays : mapping of str to array
            Arrays by name.
        """
        buffer = io.BytesIO()
        np.savez(buffer, **arrays)  # type: ignore[arg-type]
        payload = buffer.getvalue()
        if len(payload) > self.max_bytes:
            return
        with suppress(OSError, OutputError):
            self.folder.mkdir(parents=True, exist_ok=True)
            with replace_file(self.folder / f"{key}{_SUFFIX}", durable=False) as path:
                path.write_bytes(b"".join([_FORMAT, _compute_digest(payload), payload]))
                path.chmod(0o600)  # `load` ignores files that others may have written.
            self._remove_old_files()

    def _remove_old_files(self) -> None:
        """Remove the least recently used files beyond the limit, and abandoned temporary files."""
        entries: list[tuple[float, int, Path]] = []
        for path in self.folder.glob(f"*{_SUFFIX}"):
            with suppress(OSError):  # Another process may have removed it.
                status = path.stat()
                if not path.name.startswith("."):
                    entries.append((status.st_mtime, status.st_size, path))
                elif status.st_mtime < time.time() - _STALE_S:
                    path.unlink()
        total = sum(size for _, size, _ in entries)
        for _, size, path in sorted(entries):
            if total <= self.max_bytes:
                break
            with suppress(OSError):
                path.unlink()
            total -= size


def _compute_digest(payload: bytes | memoryview) -> bytes:
    return hashlib.blake2b(payload, digest_size=_DIGEST_BYTES).digest()
