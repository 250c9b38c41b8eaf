"""Small text files of results, and names for them."""

import json
import math
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from robocov.errors import InputError
from robocov.files.atomic import writable, written


def free_name(folder: Path, stem: str, suffix: str) -> Path:
    """Return a path that is not there yet: ``stem-1.suffix``, ``stem-2.suffix``, ..."""
    stem = stem.rstrip("0123456789").rstrip("-") or stem
    k = 1
    while os.path.lexists(folder / f"{stem}-{k}{suffix}"):  # a link to nothing is there, too
        k += 1
    return folder / f"{stem}-{k}{suffix}"


def require_fresh(path: Path, other: str, *, overwrite: bool, source: Path | None = None) -> None:
    """Raise InputError where `path` may not be written: it is the source, or there is a file already."""
    if not writable(path).exists():
        return
    if source is not None and source.exists() and path.samefile(source):
        raise InputError(f"{path}: the file that is read; {other} was wanted")
    if not overwrite:
        raise InputError(f"{path}: exists already; {other}, or --overwrite, was wanted")


def listed(folder: Path) -> str:
    """Return the names of what a result consists of, for people."""
    return ", ".join(sorted(path.name for path in folder.iterdir() if not path.name.startswith(".")))


def write_json(path: Path, content: Any) -> None:
    """Write `content` as JSON; whole or not at all."""
    with written(path) as part:
        part.write_text(json_text(content), encoding="utf-8")


def json_text(content: Any) -> str:
    """Return what `write_json` writes."""
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def write_csv(path: Path, header: str, rows: Iterable[Iterable[object]]) -> None:
    """Write rows under a header; numbers keep all their digits."""
    with written(path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
        file.write(csv_text(header, rows))


def csv_text(header: str, rows: Iterable[Iterable[object]]) -> str:
    """Return what `write_csv` writes."""
    lines = [header, *(",".join(str(cell) for cell in row) for row in rows)]
    return "\n".join(lines) + "\n"


def finite(content: Any) -> Any:
    """Return JSON content with None for every number that is not finite: JSON has no other word for it."""
    if isinstance(content, dict):
        return {key: finite(value) for key, value in content.items()}
    if isinstance(content, list):
        return [finite(value) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content
