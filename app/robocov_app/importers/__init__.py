"""Foreign map formats, turned into environments.

Each format is one module with ``is_<format>(path)`` and ``import_<format>(path, ...)``,
which returns the environment and an `ImportReport`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robocov.errors import MapError
from robocov.strictjson import one_line, read_bytes
from robocov_app.importers.houseexpo import import_houseexpo, is_houseexpo
from robocov_app.importers.report import ImportReport

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["FORMATS", "ImportReport", "detect", "import_houseexpo"]

FORMATS: dict[str, Callable[[Path, bytes], bool]] = {"houseexpo": is_houseexpo}
"""The known formats: name, and whether a file at a path with this content is of it."""


def detect(path: str | Path) -> str:
    """Return the name of the format of the file at `path`.

    Raises
    ------
    MapError
        When the file cannot be read, or is of no known format.
    """
    path = Path(path)
    content = read_bytes(path)
    for name, recognises in FORMATS.items():
        if recognises(path, content):
            return name
    raise MapError(f"{one_line(path)}: unknown format, but one of {', '.join(FORMATS)} was wanted")
