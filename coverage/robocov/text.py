"""Escaping and removal of control characters in text from files, keyboards and users' controllers."""

from __future__ import annotations

import re

_CONTROLS = (
    r"\x00-\x08\x0b-\x1f\x7f-\x9f"  # C0 without tab and line feed, DEL and C1: they control terminals
    r"\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"  # marks, embeddings and isolates, which reorder text
    r"\xad\u180e\u200b\u2060-\u2065\u206a-\u206f\ufeff\ufff9-\ufffb\U000e0000-\U000e007f"  # invisible ones
    r"\u2028\u2029"  # line and paragraph separators
    r"\ud800-\udfff"  # bytes of file names that are not UTF-8
)
_UNSAFE = re.compile(f"[{_CONTROLS}]")
_UNSAFE_IN_LINE = re.compile(f"[{_CONTROLS}\t\n]")


def escape_controls(text: str, *, single_line: bool = False) -> str:
    r"""Replace control characters in a string with visible escapes.

    Names and messages from files and from users' controllers may contain characters that color or overwrite
    the terminal, or change the order in which text is displayed. Joiners, which some scripts need, are kept.

    Parameters
    ----------
    text : str
        Text of any origin.
    single_line : bool
        Whether to escape tabs and line feeds as well.

    Returns
    -------
    str
        Equal to `text` if it contains no such characters.

    Examples
    --------
    >>> print(escape_controls("boom\x1b[31m"))
    boom\x1b[31m
    >>> print(escape_controls("map \u202ename"))
    map \u202ename
    """
    pattern = _UNSAFE_IN_LINE if single_line else _UNSAFE
    return pattern.sub(_escape_match, text)


def remove_controls(text: str, *, single_line: bool = False) -> str:
    r"""Remove control characters from a string.

    All text that enters a window passes through this function: from the clipboard, the keyboard, input
    methods and the messages of a web page. SDL rejects NUL and unpaired surrogates; other control characters
    do not belong in names and files.

    Parameters
    ----------
    text : str
        Text of any origin.
    single_line : bool
        Whether to remove tabs and line feeds as well.

    Returns
    -------
    str
        All line ends are line feeds.

    Examples
    --------
    >>> remove_controls("a\x00b\u202ec")
    'abc'
    >>> remove_controls("one\ttwo\r\n", single_line=True)
    'onetwo'
    """
    pattern = _UNSAFE_IN_LINE if single_line else _UNSAFE
    return pattern.sub("", text.replace("\r\n", "\n").replace("\r", "\n"))


def _escape_match(match: re.Match[str]) -> str:
    r"""Return the escape of a character, such as ``\x1b``."""
    return ascii(match[0])[1:-1]
