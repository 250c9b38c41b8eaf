"""How large a foreign file may be: what is beyond is refused by its size and its header, unread."""

from __future__ import annotations

import math
import stat
from typing import TYPE_CHECKING

from robocov.errors import MapError, one_line, shown
from robocov.mapfile.models import FARTHEST, LARGEST

if TYPE_CHECKING:
    from pathlib import Path

MAX_BYTES = 256_000_000
"""Largest file of a raster, in bytes: `MAX_CELLS` in plain text."""

MAX_TEXT_BYTES = 50_000_000
"""Largest file of a vector format, in bytes; as of the project's own maps."""

MAX_CELLS = 64_000_000
"""Largest raster, in cells: 8000 x 8000."""

MAX_VERTICES = 500_000
"""Most vertices of a foreign map."""

MAX_SHAPES = 20_000
"""Most shapes of a drawing, of a file: each costs a quarter of a millisecond, whatever its size."""

MAX_DEPTH = 32
"""Deepest nesting of collections, groups, blocks, lists."""

HEAD = 1 << 20
"""So much of a file is looked at, in bytes, to know its format."""


def head(path: Path) -> bytes:
    """Return the first `HEAD` bytes of the file at `path`.

    Raises
    ------
    MapError
        When there is no such file, it is no ordinary one (a folder, a pipe, a device), or it
        cannot be read.
    """
    return _read(path, HEAD)


def content(path: Path, most: int = MAX_BYTES) -> bytes:
    """Return the content of the file at `path`, of at most `most` bytes.

    Raises
    ------
    MapError
        As `head`, and when the file is larger; its size is looked at first.
    """
    where = one_line(path)
    data = b""
    if _size(path) <= most:
        data = _read(path, most + 1)
    if (not data and _size(path) > most) or len(data) > most:
        raise MapError(f"{where}: larger than {most / 1e6:g} MB, but a smaller file was wanted")
    return data


def require_cells(width: int, height: int, where: str) -> None:
    """Check the size of a raster as its header gives it.

    Raises
    ------
    MapError
        When a side is not positive, or there are more than `MAX_CELLS`.
    """
    if width < 1 or height < 1:
        raise MapError(f"{where}: {width} x {height} cells, but at least 1 x 1 was wanted")
    if width * height > MAX_CELLS:
        most = MAX_CELLS // 1_000_000
        raise MapError(f"{where}: {width} x {height} cells, but at most {most} million were wanted")


def require_vertices(count: int, where: str) -> None:
    """Check the number of vertices of a map, or the least that it can be.

    Raises
    ------
    MapError
        When there are more than `MAX_VERTICES`.
    """
    if count > MAX_VERTICES:
        raise MapError(f"{where}: some {count} vertices, but at most {MAX_VERTICES} were wanted")


def require_shapes(count: int, where: str) -> None:
    """Check the number of shapes of a drawing.

    Raises
    ------
    MapError
        When there are more than `MAX_SHAPES`.
    """
    if count > MAX_SHAPES:
        raise MapError(f"{where}: {count:.6g} shapes, but at most {MAX_SHAPES} were wanted")


def require_length(value: float, where: str, smallest: float = 1e-6, largest: float = LARGEST) -> None:
    """Check a length in metres: a cell, a thickness, a unit.

    Raises
    ------
    MapError
        When it is not a finite number from `smallest` to `largest`.
    """
    if not (math.isfinite(value) and smallest <= value <= largest):
        raise MapError(
            f"{where}: {shown(value)}, but a number from {smallest:g} to {largest:g} (m) was wanted"
        )


def require_coordinate(value: float, where: str) -> None:
    """Check a coordinate in metres.

    Raises
    ------
    MapError
        When it is not a finite number within `robocov.mapfile.models.FARTHEST`.
    """
    if not abs(value) <= FARTHEST:
        raise MapError(
            f"{where}: {shown(value)}, but a number from {-FARTHEST:.0f} to {FARTHEST:.0f} (m) was wanted"
        )


def _size(path: Path) -> int:
    """Return the size of the file at `path`, in bytes."""
    where = one_line(path)
    try:
        found = path.stat()
    except FileNotFoundError:
        raise MapError(f"{where}: no such file") from None
    except (OSError, ValueError) as error:
        raise MapError(f"{where}: cannot be read: {_reason(error)}") from None
    if stat.S_ISDIR(found.st_mode):
        raise MapError(f"{where}: is a folder, but a file was wanted")
    if not stat.S_ISREG(found.st_mode):  # opening a pipe would wait for ever
        raise MapError(f"{where}: is a pipe or a device, but a file was wanted")
    return found.st_size


def _read(path: Path, most: int) -> bytes:
    _size(path)
    try:
        with path.open("rb") as file:
            return file.read(most)
    except (OSError, ValueError) as error:
        raise MapError(f"{one_line(path)}: cannot be read: {_reason(error)}") from None


def _reason(error: Exception) -> str:
    return one_line(error.strerror if isinstance(error, OSError) and error.strerror else error)
