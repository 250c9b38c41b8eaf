"""The help of a command: tyro's usage and options, with the description between them wrapped."""

import inspect
import io
import re
import textwrap
from typing import TextIO

MIN_WIDTH = 40
"""Minimum width of wrapped text, characters. tyro's boxes have the same minimum."""
_EMPTY_BOX_LINE = re.compile(r"│ *│")
_NO_BREAK_SPACE = "\u00a0"
_ITEM_TEXT = re.compile(r"^ *\S+(?: \S+)* {2,}(?=\S)")
"""The name of an item of a list, with the two or more spaces between the name and the text of the item."""


class HelpBuffer(io.StringIO):
    """A buffer for the help that tyro prints.

    Parameters
    ----------
    stream : text stream
        The stream to which the help will be written. tyro colors help for terminals, and draws boxes if the
        encoding has characters for them.
    """

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        self._stream = stream

    def isatty(self) -> bool:
        """Return whether the help will be shown on a terminal."""
        return self._stream.isatty()

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """Encoding of the stream."""
        return self._stream.encoding


def insert_description(help_text: str, docstring: str, width: int) -> str:
    """Insert a description between the usage and the options of a help text.

    tyro wraps the options itself, but neither the usage nor a description.

    Parameters
    ----------
    help_text : str
        Help by tyro without a description. It may contain the escape sequences of colors.
    docstring : str
        Docstring of the command's options.
    width : int
        Width of the terminal, characters.

    Returns
    -------
    str
    """
    from rich.text import Text

    usage, _, options = help_text.partition("\n\n")
    usage = _wrap_usage(Text.from_ansi(usage).plain, max(width, MIN_WIDTH))
    lines = options.splitlines()
    plain_lines = [Text.from_ansi(line).plain for line in lines]
    kept_lines = [line for row, line in enumerate(lines) if not _is_superfluous(plain_lines, row)]
    return f"{usage}\n\n{wrap_description(docstring, width)}\n\n" + "\n".join(kept_lines) + "\n"


def wrap_description(docstring: str, width: int) -> str:
    """Wrap the paragraphs of a docstring.

    Parameters
    ----------
    docstring : str
        Paragraphs are separated by empty lines. The lines of an indented paragraph are the items of a list.
    width : int
        Maximum length of a line, characters.

    Returns
    -------
    str

    Examples
    --------
    >>> print(wrap_description("Write a map in a format that other programs read.", 40))
    Write a map in a format that other
    programs read.
    """
    width = max(width, MIN_WIDTH)
    wrapped = []
    for paragraph in inspect.cleandoc(docstring).split("\n\n"):
        lines = paragraph.splitlines()
        if paragraph.startswith(" "):
            items = [_wrap(item, width, " " * _find_text_column(item)) for item in _join_items(lines)]
            wrapped.append("\n".join(items))
        else:
            wrapped.append(_wrap(" ".join(lines), width, ""))
    return "\n\n".join(wrapped)


def _is_superfluous(lines: list[str], row: int) -> bool:
    """Return whether a line is empty, but does not separate two groups of options.

    tyro adds such a line to a text that fills its last line. Groups of options are drawn as boxes. If the
    terminal has no characters for boxes, options are indented by two spaces, and titles of groups by one.
    """
    if lines[row].strip():
        return _EMPTY_BOX_LINE.fullmatch(lines[row]) is not None
    return row + 1 < len(lines) and lines[row + 1].startswith("  ") and bool(lines[row + 1].strip())


def _wrap_usage(usage: str, width: int) -> str:
    """Wrap the usage of a command; an option stays on one line with its value."""
    unbreakable = re.sub(r"\[[^]]*\]", lambda match: match[0].replace(" ", _NO_BREAK_SPACE), usage)
    return _wrap(unbreakable, width, " " * len("usage: ")).replace(_NO_BREAK_SPACE, " ")


def _join_items(lines: list[str]) -> list[str]:
    """Return each item of a list as one line, given lines that are wrapped in the source."""
    first_indent = _count_leading_spaces(lines[0])
    items: list[str] = []
    for line in lines:
        indent = _count_leading_spaces(line)
        if indent > first_indent and indent == _find_text_column(items[-1]):
            items[-1] += f" {line.strip()}"
        else:
            items.append(line)
    return items


def _find_text_column(item: str) -> int:
    """Return the column at which the text of an item starts; its indentation if it has no name."""
    match = _ITEM_TEXT.match(item)
    return _count_leading_spaces(item) if match is None else match.end()


def _count_leading_spaces(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def _wrap(text: str, width: int, indent: str) -> str:
    """Wrap a text between words, with an indentation of all lines but the first."""
    return textwrap.fill(
        text, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
