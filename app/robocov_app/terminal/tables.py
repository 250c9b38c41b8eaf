"""Tables for people, as wide as the terminal, or wide enough where there is none."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

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
