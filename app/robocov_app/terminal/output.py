"""Output of commands: small files of results, names for them, and tables for people."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import sys
from collections.abc import Iterable, Mapping
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocov.errors import InputError
from robocov.files.csv_cells import quote_cell
from robocov.files.writing import replace_file, resolve_target
from robocov.text import escape_controls

if TYPE_CHECKING:
    from rich.console import Console


def echo(
    *texts: object, sep: str = " ", end: str = "\n", to_stderr: bool = False, flush: bool = False
) -> None:
    """Print texts. Whatever names and messages they contain, the terminal does not obey it.

    All output of the application goes through here or through `console`; see `escape_controls`.
    """
    file = sys.stderr if to_stderr else sys.stdout
    safe = [escape_controls(str(text)) for text in texts]
    print(*safe, sep=sep, end=end, file=file, flush=flush)


def tell(options: Any, answer: Any, *lines: str, indent: int | None = None) -> None:
    """Print an answer: with --json as one JSON object, with null for what is not finite; else as lines."""
    if options.json:
        echo(json.dumps(finite(answer), indent=indent))
    else:
        echo(*lines, sep="\n", end="\n" if lines else "")


def free_name(folder: Path, stem: str, suffix: str) -> Path:
    """Return a path that is not there yet: ``stem-1.suffix``, ``stem-2.suffix``, ..."""
    stem = stem.rstrip("0123456789").rstrip("-") or stem
    paths = (folder / f"{stem}-{k}{suffix}" for k in count(1))
    return next(path for path in paths if not os.path.lexists(path))  # a link to nothing is there, too


def require_fresh(
    path: Path, other: str, *, overwrite: bool, source: Path | None = None, read: str = "file"
) -> None:
    """Raise InputError where `path` may not be written: it is the source, or there is a file already."""
    if not resolve_target(path).exists():
        return
    if source is not None and source.exists() and path.samefile(source):
        raise InputError(f"{path}: the {read} that is read; choose {other}")
    if not overwrite:
        raise InputError(f"{path}: exists already; choose {other} or pass --overwrite")


def listed(folder: Path) -> str:
    return ", ".join(sorted(path.name for path in folder.iterdir() if not path.name.startswith(".")))


def write_json(path: Path, content: Any) -> None:
    with replace_file(path) as part:
        part.write_text(json_text(content), encoding="utf-8")


def json_text(content: Any) -> str:
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def write_csv(path: Path, header: str, rows: Iterable[Iterable[object]]) -> None:
    with replace_file(path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
        file.write(csv_text(header, rows))


def csv_text(header: str, rows: Iterable[Iterable[object]]) -> str:
    """Return a table as CSV: None is an empty cell, and no text is taken for a formula by a spreadsheet."""
    return header + "\n" + "".join(csv_line(row) for row in rows)


def csv_line(cells: Iterable[object]) -> str:
    """Return one line of CSV, with all digits of its numbers."""
    text = io.StringIO()
    # the writer puts only those line breaks into quotation marks that end its own lines
    csv.writer(text, lineterminator="\r\n").writerow(map(quote_cell, cells))
    return text.getvalue().removesuffix("\r\n") + "\n"


def finite(content: Any) -> Any:
    """Return JSON content with None for every number that is not finite: JSON has no other word for it."""
    if isinstance(content, dict):
        return {key: finite(value) for key, value in content.items()}
    if isinstance(content, list):
        return [finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


PIPED_WIDTH = 140  # columns of a table that goes to a file or a pipe


def console() -> Console:
    """Return the console of answers, on stdout.

    Names may contain brackets, so none are taken for markup. Texts that are printed are safe to display;
    cells of tables have to be passed through `escape_controls`, as `print_table` does.
    """
    from rich.console import Console

    class SafeConsole(Console):
        def print(self, *objects: Any, **options: Any) -> None:
            safe = [escape_controls(each) if isinstance(each, str) else each for each in objects]
            super().print(*safe, **options)

    return SafeConsole(width=None if sys.stdout.isatty() else PIPED_WIDTH, highlight=False, markup=False)


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
        table.add_row(*map(escape_controls, row))
    console().print(table)
