"""Read .npz files with size limits, and cache arrays."""

from __future__ import annotations

import hashlib
import io
import os
import struct
import time
import tokenize
import zipfile
import zlib
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from robocov.errors import InputError, OutputError, describe_error
from robocov.files.cache_folders import find_cache_root, is_private
from robocov.files.writing import replace_file
from robocov.typing import AnyArray

MAX_BYTES = 2_000_000_000
"""Default limit for the total size of the arrays of one file: about the largest run that the application
accepts."""
_MAX_COMPRESSION_RATIO = 100
"""Maximum size of the arrays relative to the size of the file. A larger ratio suggests a decompression
bomb."""
_RATIO_EXEMPT_BYTES = 256_000_000
"""Arrays up to this total size may have any compression ratio."""
_MAX_READ_BYTES = 1 << 20
"""Maximum size of a single read. A longer one would be the central directory of a zip file with too many
entries."""
_DAMAGE_ERRORS = (
    ValueError,
    TypeError,
    OverflowError,
    EOFError,
    OSError,
    MemoryError,
    NotImplementedError,
    RuntimeError,
    struct.error,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)
"""Errors that zipfile, its decompressors and numpy raise for damaged files."""
_SUFFIX = ".robocov"
"""Suffix of the files of the cache."""
_FORMAT = b"robocov arrays 1\n"
"""Start of each file of the cache."""
_DIGEST_BYTES = 16
"""Length of the checksum, which follows the format. The arrays, as an .npz file, follow the checksum."""
_ABANDONED_AGE_S = 24 * 3600.0
"""Age from which a partly written file counts as abandoned."""


def read_arrays(file: BinaryIO, source_name: str, max_bytes: int = MAX_BYTES) -> dict[str, AnyArray]:
    """Read the arrays of an .npz file.

    Parameters
    ----------
    file : binary file
        Open for reading, and seekable.
    source_name : str
        Name of the source in messages, such as the path of the file.
    max_bytes : int
        Maximum total size of the arrays.

    Returns
    -------
    dict of str to array
        Arrays by name.

    Raises
    ------
    InputError
        If the file is damaged or too large, uses an unsupported compression method, or contains duplicate
        entries or Python objects.
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
        reason = describe_error(error) or type(error).__name__
        raise InputError(f"{source_name}: cannot be read: {reason}") from error


def _require_reasonable_entries(entries: list[zipfile.ZipInfo], file_size: int, max_bytes: int) -> None:
    """Raise ValueError if entries are too large, have the same name, or use an unsupported compression."""
    # The sizes in the entries can be trusted: `zipfile` never decompresses more than the size in an entry.
    total_size = sum(entry.file_size for entry in entries)
    max_size = min(max_bytes, max(_RATIO_EXEMPT_BYTES, _MAX_COMPRESSION_RATIO * file_size))
    if total_size > max_size:
        raise ValueError(
            f"arrays too large: {total_size / 1e6:,.0f} MB, from a file of {file_size / 1e6:,.1f} MB"
        )
    for entry in entries:
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise ValueError(f"entry {entry.filename!r} uses an unsupported compression method")
    for name, count in Counter(entry.filename.removesuffix(".npy") for entry in entries).items():
        if count > 1:
            raise ValueError(f"duplicate entry {name!r}")


class _LimitedReader:
    """A file that rejects reads above `_MAX_READ_BYTES`, such as that of an oversized zip directory."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def read(self, size: int = -1) -> bytes:
        """Read up to `size` bytes, or the rest of the file."""
        # `zipfile` omits the size only near the end of the file, where at most 64 KiB follow.
        if size > _MAX_READ_BYTES:
            raise zipfile.BadZipFile("its central directory is too large")
        return self._file.read(size)


class ArrayCache:
    """A folder with cached results of computations, which are arrays. Keys identify the inputs.

    An entry that is damaged, unreadable or writable by other users counts as missing. Errors on writing are
    ignored. Any number of processes may use a folder at the same time.

    Parameters
    ----------
    folder : Path
        Folder of the cache, which the first `save` creates.
    max_bytes : int
        Maximum total size of the files. If they become larger, the least recently used files are removed.

    Attributes
    ----------
    folder : Path
        Folder of the cache.
    max_bytes : int
        Maximum total size of the files.

    See Also
    --------
    find_optimum : A slow computation, whose results can be cached.

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
            The cache. None if the environment variable is set but empty.
        """
        folder = find_cache_root()
        return None if folder is None else cls(folder)

    @staticmethod
    def compute_key(*parts: bytes | str | float) -> str:
        """Compute a key from the inputs of a computation.

        Parameters
        ----------
        *parts : bytes, str, int or float
            Inputs that determine the arrays, in a fixed order.

        Returns
        -------
        str
            A digest of the types and exact values of the inputs.
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

    def load(self, key: str) -> dict[str, AnyArray] | None:
        """Load the arrays of a key.

        Parameters
        ----------
        key : str
            Key of the arrays; see `compute_key`.

        Returns
        -------
        dict of str to array, or None
            Read-only arrays by name. None if there is no intact entry.
        """
        path = self.folder / f"{key}{_SUFFIX}"
        # Reading an intact file may also fail, for example if a newer version of numpy wrote it.
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
            # The time of modification tells when a file was last used. The arrays are valid without it.
            with suppress(OSError):
                os.utime(path)
            return arrays
        return None

    def save(self, key: str, arrays: Mapping[str, AnyArray]) -> None:
        """Save arrays under a key, if possible.

        Parameters
        ----------
        key : str
            Key of the arrays; see `compute_key`.
        arrays : mapping of str to array
            Arrays by name.
        """
        buffer = io.BytesIO()
        np.savez(buffer, **arrays)  # type: ignore[arg-type]
        payload = buffer.getvalue()
        if len(payload) > self.max_bytes:
            return
        # Without a cache, the arrays are computed again the next time.
        with suppress(OSError, OutputError):
            self.folder.mkdir(parents=True, exist_ok=True)
            with replace_file(self.folder / f"{key}{_SUFFIX}", durable=False) as temporary:
                temporary.write_bytes(b"".join([_FORMAT, _compute_digest(payload), payload]))
                temporary.chmod(0o600)  # `load` ignores files to which other users may have written.
            self._remove_old_files()

    def _remove_old_files(self) -> None:
        """Remove the least recently used files beyond the limit, and abandoned temporary files."""
        entries: list[tuple[float, int, Path]] = []
        for path in self.folder.glob(f"*{_SUFFIX}"):
            with suppress(OSError):  # Another process may have removed the file.
                status = path.stat()
                # The temporary files of `replace_file` are hidden.
                is_temporary = path.name.startswith(".")
                if not is_temporary:
                    entries.append((status.st_mtime, status.st_size, path))
                elif status.st_mtime < time.time() - _ABANDONED_AGE_S:
                    path.unlink()
        total_size = sum(size for _, size, _ in entries)
        for _, size, path in sorted(entries):
            if total_size <= self.max_bytes:
                break
            with suppress(OSError):  # Another process may have removed the file, or may have it open.
                path.unlink()
            total_size -= size


def _compute_digest(payload: bytes | memoryview) -> bytes:
    """Return the checksum of the arrays in a file of the cache."""
    return hashlib.blake2b(payload, digest_size=_DIGEST_BYTES).digest()
