"""Reading and writing map files in the editor, and detecting changes by other programs."""

from __future__ import annotations

import stat
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Literal, TypeAlias

from robocov.errors import MapError, OutputError, to_one_line
from robocov.files.strictjson import read_bytes
from robocov.files.writing import replace_file
from robocov.mapfile import list_bundled_maps
from robocov_app.editor.model.parser import parse_sketch
from robocov_app.editor.model.sketch import Sketch, dump_sketch

SUFFIX = ".json"
FileState: TypeAlias = Literal["same", "changed", "gone"]
"""State of a file compared with an earlier version."""
_Stamp: TypeAlias = tuple[int, int]
"""Size (bytes) and modification time (ns) of a file, which are quick to read."""
_UNKNOWN_STAMP = (-1, 0)


class FileChangedError(OutputError):
    """A file has changed since it was read or written, or a file exists that was expected to be new."""


@dataclass(frozen=True)
class FileVersion:
    """A version of a file, as it was read or written.

    Attributes
    ----------
    path : Path
        Absolute path.
    digest : str
        SHA-256 of its content.
    stamp : tuple of int
        Size (bytes) and modification time (ns).
    """

    path: Path
    digest: str
    stamp: _Stamp


def read_sketch(path: Path) -> tuple[Sketch, FileVersion]:
    """Read a map file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    sketch : Sketch
        The map.
    version : FileVersion
        The version of the file that was read.

    Raises
    ------
    MapError
        If the file cannot be read.
    """
    path = path.absolute()
    # The stamp is read first, so that a change while reading is detected later.
    stamp = _read_stamp(path)
    content = read_bytes(path)
    version = FileVersion(path, sha256(content).hexdigest(), stamp or _UNKNOWN_STAMP)
    return parse_sketch(content, str(path), path.parent), version


def write_sketch(
    sketch: Sketch, path: Path, expected: FileVersion | None = None, *, overwrites: bool = False
) -> FileVersion:
    """Write a map file atomically.

    Parameters
    ----------
    sketch : Sketch
    path : Path
    expected : FileVersion, optional
        Version of the file that may be replaced. By default, no file may exist.
    overwrites : bool
        Whether to replace the file regardless of its version.

    Returns
    -------
    FileVersion
        The version that was written.

    Raises
    ------
    FileChangedError
        If the file is not the expected version, unless `overwrites` is set.
    OutputError
        If the file cannot be written.
    """
    path = path.absolute()
    content = dump_sketch(sketch).encode()
    if not overwrites:
        _require_unchanged(path, expected)
    with replace_file(path) as temporary:
        temporary.write_bytes(content)
    return FileVersion(path, sha256(content).hexdigest(), _read_stamp(path) or _UNKNOWN_STAMP)


def _require_unchanged(path: Path, expected: FileVersion | None) -> None:
    if expected is None or expected.path != path:
        if _read_stamp(path) is not None:
            raise FileChangedError(f"{to_one_line(path)}: this file already exists")
    elif check_file(expected) == "changed":
        raise FileChangedError(
            f"{to_one_line(path)}: was changed by another program since it was opened or saved"
        )


def check_file(version: FileVersion) -> FileState:
    """Compare a file with an earlier version. It counts as the same if its content is the same.

    Parameters
    ----------
    version : FileVersion

    Returns
    -------
    {"same", "changed", "gone"}
    """
    stamp = _read_stamp(version.path)
    if stamp is None:
        return "gone"
    if stamp == version.stamp:
        return "same"
    try:
        content = read_bytes(version.path)
    except MapError:
        if _read_stamp(version.path) is None:
            return "gone"
        return "changed"
    if sha256(content).hexdigest() == version.digest:
        return "same"
    return "changed"


def is_bundled(path: Path) -> bool:
    """Return whether a file is one of the maps that come with robocov."""
    # Invalid paths raise errors; they are not those of bundled maps.
    with suppress(OSError, ValueError, RuntimeError):
        return path.resolve() in {bundled.resolve() for bundled in list_bundled_maps().values()}
    return False


def add_suffix(path: Path) -> Path:
    """Return a path with the suffix of map files, which is added if it is missing."""
    if path.suffix.lower() == SUFFIX:
        return path
    return path.with_name(path.name + SUFFIX)


def _read_stamp(path: Path) -> _Stamp | None:
    """Return the stamp of a file; None if it does not exist or is not a regular file."""
    with suppress(OSError, ValueError):
        status = path.stat()
        if stat.S_ISREG(status.st_mode):
            return status.st_size, status.st_mtime_ns
    return None
