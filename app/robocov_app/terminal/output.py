"""Output of commands: small files of results, names for them, and tables for people."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Iterable, Mapping
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocov.errors import InputError
from robocov.files.atomic import writable, written

if TYPE_CHECKING:
    from rich.console import Console


def tell(options: Any, answer: Any, *lines: str, indent: int | None = None) -> None:
    """Print an answer: with --json as one JSON object, with null for what is not finite; else as lines."""
    if options.json:
        print(json.dumps(finite(answer), indent=indent))  # noqa: T201 - it is the answer
    else:
        print(*lines, sep="\n", end="\n" if lines else "")  # noqa: T201


def free_name(folder: Path, stem: str, suffix: str) -> Path:
    """Return a path that is not there yet: ``stem-1.suffix``, ``stem-2.suffix``, ..."""
    stem = stem.rstrip("0123456789").rstrip("-") or stem
    paths = (folder / f"{stem}-{k}{suffix}" for k in count(1))
    return next(path for path in paths if not os.path.lexists(path))  # a link to nothing is there, too


def require_fresh(
    path: Path, other: str, *, overwrite: bool, source: Path | None = None, read: str = "file"
) -> None:
    """Raise InputError where `path` may not be written: it is the source, or there is a file already."""
    if not writable(path).exists():
        return
    if source is not None and source.exists() and path.samefile(source):
        raise InputError(f"{path}: the {read} that is read; {other} was wanted")
    if not overwrite:
        raise InputError(f"{path}: exists already; {other}, or --overwrite, was wanted")


def listed(folder: Path) -> str:
    return ", ".join(sorted(path.name for path in folder.iterdir() if not path.name.startswith(".")))


def write_json(path: Path, content: Any) -> None:
    with written(path) as part:
        part.write_text(json_text(content), encoding="utf-8")


def json_text(content: Any) -> str:
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def write_csv(path: Path, header: str, rows: Iterable[Iterable[object]]) -> None:
    with written(path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
        file.write(csv_text(header, rows))


def csv_text(header: str, rows: Iterable[Iterable[object]]) -> str:
    return "\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n"


def finite(content: Any) -> Any:
    """Return JSON content with None for every number that is not finite: JSON has no other word for it."""
    if isinstance(content, dict):
        return {key: finite(value) for key, value in content.items()}
    if isinstance(content, list):
        return [finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


PIPED_WIDTH = 140  # columns of a table that goes to a file or a pipe


def console() -> Console:
    """Return the console of answers, on stdout; names may hold brackets, so none are taken for markup."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else PIPED_WIDTH, highlight=False, markup=False)


BOLD: Mapping[str, Any] = {"style": "bold", "no_wrap": True}
RIGHT: Mapping[str, Any] = {"justify": "right", "no_wrap": True}


def print_table(
    columns: Iterable[tuple[str, Mapping[str, Any]]], rows: Iterable[Iterable[str]], title: str | None = None
) -> None:
    """Print rows under the titles of columns, each with what `rich.table.Table.add_column` takes."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold", title=title, title_justify="left")
    for name, look in columns:
        table.add_column(name, **look)
    for row in rows:
        table.add_row(*row)
    console().print(table)
