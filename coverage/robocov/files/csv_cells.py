"""Cells of CSV files that spreadsheets would otherwise evaluate as formulas."""

from __future__ import annotations

import re
from typing import Any

_FORMULA = re.compile(r"'*[=+\-@\t\r\n＝＋－＠]")
"""Start of a text that a spreadsheet may evaluate, or that has already been quoted."""
_QUOTED_FORMULA = re.compile(r"'+[=+\-@\t\r\n＝＋－＠]")
"""Start of a text that has been quoted."""


def quote_cell(value: Any) -> Any:
    """Quote the content of a CSV cell, so that no spreadsheet evaluates it.

    A text that starts with ``=``, ``+``, ``-``, ``@``, a tab or a line break gets a leading apostrophe. In
    spreadsheets, an apostrophe marks a cell as text.

    Parameters
    ----------
    value : object
        Content of a cell. Only a `str` is ever changed.

    Returns
    -------
    object
        Content to write, from which `unquote_cell` restores the text.

    Examples
    --------
    >>> quote_cell("=1+1"), quote_cell(-0.5), quote_cell("office")
    ("'=1+1", -0.5, 'office')
    """
    if isinstance(value, str) and _FORMULA.match(value):
        return f"'{value}"
    return value


def unquote_cell(text: str) -> str:
    """Restore the text of a cell that `quote_cell` returned.

    Parameters
    ----------
    text : str
        Text of a cell, quoted or not.

    Returns
    -------
    str
        Text without the apostrophe of the quotation.

    Examples
    --------
    >>> unquote_cell("'=1+1"), unquote_cell("'quoted'")
    ('=1+1', "'quoted'")
    """
    return text[1:] if _QUOTED_FORMULA.match(text) else text
