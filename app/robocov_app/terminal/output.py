"""Output of commands: answers, tables, and small files of results."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import re
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

PIPED_TABLE_COLUMNS = 140
"""Width in characters of a table that is written to a file or a pipe."""
MAX_FILE_STEM_CHARS = 64
"""Maximum length of a file name that is derived from another name, without a number and the extension."""
BOLD: Mapping[str, Any] = {"style": "bold", "no_wrap": True}
"""Look of a bold column of `print_table`."""
RIGHT: Mapping[str, Any] = {"justify": "right", "no_wrap": True}
"""Look of a right-aligned column of `print_table`."""


def echo(
    *texts: object, sep: str = " ", end: str = "\n", to_stderr: bool = False, flush: bool = False
) -> None:
    """Print texts; control characters, which names and messages may contain, are escaped.

    All output of the application goes through this function or through `create_console`.

    Parameters
    ----------
    *texts : object
        Objects to print, which are converted by `str`.
    sep, end, flush
        As for `print`.
    to_stderr : bool
        Whether to print to standard error instead of standard output.
    """
    file = sys.stderr if to_stderr else sys.stdout
    safe = [escape_controls(str(text)) for text in texts]
    print(*safe, sep=sep, end=end, file=file, flush=flush)


def print_answer(options: Any, answer: Any, *lines: str, indent: int | None = None) -> None:
    """Print the answer of a command.

    Parameters
    ----------
    options : JsonOption
        Options of the command. If ``options.json`` is set, the answer is printed as JSON.
    answer : object
        The answer as JSON; numbers that are not finite become null.
    *lines : str
        The answer as lines of text.
    indent : int or None
        Indentation of the JSON content.
    """
    if options.json:
        echo(json.dumps(replace_non_finite(answer), indent=indent))
    else:
        echo(*lines, sep="\n", end="\n" if lines else "")


def clean_file_stem(name: str, default: str) -> str:
    """Convert a name to the stem of a file name, without separators and special characters.

    Parameters
    ----------
    name : str
        Any name, such as that of a map.
    default : str
        The stem if nothing of the name remains.

    Returns
    -------
    str

    Examples
    --------
    >>> clean_file_stem("Floor 1/2", "map"), clean_file_stem("../escaped", "map"), clean_file_stem(" ", "map")
    ('Floor-1-2', 'escaped', 'map')
    """
    stem = re.sub(r"[^\w.-]+", "-", name).strip(".-")[:MAX_FILE_STEM_CHARS]
    return stem.rstrip(".-") or default


def find_free_path(folder: Path, stem: str, suffix: str) -> Path:
    """Find a path that does not exist yet.

    Parameters
    ----------
    folder : Path
        Folder of the file.
    stem, suffix : str
        Beginning of the file name, and its extension.

    Returns
    -------
    Path
        The first free one of ``stem-1.suffix``, ``stem-2.suffix`` and so on. A number at the end of the given
        stem is replaced.
    """
    stem = stem.rstrip("0123456789").rstrip("-") or stem
    paths = (folder / f"{stem}-{number}{suffix}" for number in count(1))
    # A broken symbolic link also counts as an existing file.
    return next(path for path in paths if not os.path.lexists(path))


def check_output_file(
    path: Path, alternative: str, *, overwrite: bool, source: Path | None = None, source_kind: str = "file"
) -> None:
    """Check that a file may be written.

    Parameters
    ----------
    path : Path
        The file.
    alternative : str
        Alternative that the message suggests, such as ``another --out``.
    overwrite : bool
        Whether an existing file may be replaced.
    source : Path or None
        File that the command reads, which must never be replaced.
    source_kind : str
        Kind of the source, for the message.

    Raises
    ------
    InputError
        If the file may not be written.
    """
    if not resolve_target(path).exists():
        return
    if source is not None and source.exists() and path.samefile(source):
        raise InputError(f"{path}: is the {source_kind} being read; choose {alternative}")
    if not overwrite:
        raise InputError(f"{path}: already exists; choose {alternative} or pass --overwrite")


def list_files(folder: Path) -> str:
    """Return the names of the visible files and folders in a folder, separated by commas."""
    return ", ".join(sorted(path.name for path in folder.iterdir() if not path.name.startswith(".")))


def write_json(path: Path, content: Any) -> None:
    """Write a JSON file atomically.

    Parameters
    ----------
    path : Path
        The file.
    content : object
        Content of the file; all numbers must be finite.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    with replace_file(path) as temporary:
        temporary.write_text(format_json(content), encoding="utf-8")


def format_json(content: Any) -> str:
    """Format the text of a JSON file; numbers must be finite."""
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def write_csv(path: Path, header: str, rows: Iterable[Iterable[object]]) -> None:
    """Write a CSV file atomically.

    Parameters
    ----------
    path : Path
        The file.
    header : str
        First line.
    rows : iterable of iterable of object
        Cells of the other lines; see `format_csv`.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    with replace_file(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write(format_csv(header, rows))


def format_csv(header: str, rows: Iterable[Iterable[object]]) -> str:
    """Format a table as CSV.

    Parameters
    ----------
    header : str
        First line.
    rows : iterable of iterable of object
        Cells of the other lines. Numbers keep all digits, None becomes an empty cell, and texts are quoted
        such that spreadsheets do not interpret them as formulas.

    Returns
    -------
    str
    """
    return header + "\n" + "".join(format_csv_line(row) for row in rows)


def format_csv_line(cells: Iterable[object]) -> str:
    """Format one row of a CSV file; see `format_csv`."""
    text = io.StringIO()
    # The writer only quotes the characters of its own line ending, so it must contain both line breaks.
    csv.writer(text, lineterminator="\r\n").writerow(map(quote_cell, cells))
    return text.getvalue().removesuffix("\r\n") + "\n"


def replace_non_finite(content: Any) -> Any:
    """Replace numbers that are not finite, which JSON cannot express, by None.

    Examples
    --------
    >>> replace_non_finite({"cost": float("inf"), "values": [1.0]})
    {'cost': None, 'values': [1.0]}
    """
    if isinstance(content, dict):
        return {key: replace_non_finite(value) for key, value in content.items()}
    if isinstance(content, list):
        return [replace_non_finite(value) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content


def create_console() -> Console:
    """Create a console for tables on standard output.

    Returns
    -------
    rich.console.Console
        A console that does not interpret brackets in names as markup, and escapes control characters in
        printed texts. Table cells have to be passed through `escape_controls`, as `print_table` does.
    """
    from rich.console import Console

    class SafeConsole(Console):
        """A console that escapes control characters in texts."""

        def print(self, *objects: Any, **options: Any) -> None:
            """Print objects; control characters in texts are escaped."""
            safe = [escape_controls(item) if isinstance(item, str) else item for item in objects]
            super().print(*safe, **options)

    width = None if sys.stdout.isatty() else PIPED_TABLE_COLUMNS
    return SafeConsole(width=width, highlight=False, markup=False)


def print_table(
    columns: Iterable[tuple[str, Mapping[str, Any]]], rows: Iterable[Iterable[str]], title: str | None = None
) -> None:
    """Print a table.

    Parameters
    ----------
    columns : iterable of (str, mapping)
        Title of each column, and its look as arguments of `rich.table.Table.add_column`.
    rows : iterable of iterable of str
        Cells of each row.
    title : str or None
        Title above the table.
    """
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold", title=title, title_justify="left")
    for name, look in columns:
        table.add_column(name, **look)
    for row in rows:
        table.add_row(*map(escape_controls, row))
    create_console().print(table)
