"""Text cells of CSV files that spreadsheets would otherwise take for formulas."""

from __future__ import annotations

import re
from typing import Any

_FORMULA = re.compile(r"'*[=+\-@\t\r\n＝＋－＠]")
"""A text that a spreadsheet may evaluate, also one that is already behind apostrophes."""
_QUOTED_FORMULA = re.compile(r"'+[=+\-@\t\r\n＝＋－＠]")


def quote_cell(value: Any) -> Any:
    """Return the content of a CSV cell in a form that no spreadsheet evaluates.

    A text that begins with ``=``, ``+``, ``-``, ``@``, a tab or a line break gets a leading apostrophe, as
    spreadsheets mark text themselves. Numbers stay as they are, and None is an empty cell.

    Parameters
    ----------
    value : object
        The content of a cell. Only a `str` is ever changed.

    Returns
    -------
    object
        The content to write, from which `unquote_cell` restores the text.

    Examples
    --------
    >>> quote_cell("=1+1"), quote_cell(-0.5), quote_cell("office")
    ("'=1+1", -0.5, 'office')
    """
    if isinstance(value, str) and _FORMULA.match(value):
        return f"'{value}"
    return value


def unquote_cell(text: str) -> str:
    """Return the text that `quote_cell` was given.

    Examples
    --------
    >>> unquote_cell("'=1+1"), unquote_cell("'quoted'")
    ('=1+1', "'quoted'")
    """
    return text[1:] if _QUOTED_FORMULA.match(text) else text
