"""Tables for people: as wide as the terminal, and wide enough where there is none."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

PIPED_WIDTH = 140
"""Columns of a table that goes to a file or a pipe."""


def console() -> Console:
    """Return the console of answers, on stdout; names may hold brackets, so none are taken for markup."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else PIPED_WIDTH, highlight=False, markup=False)
