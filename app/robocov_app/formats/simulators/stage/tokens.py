"""Words, numbers, strings and brackets of world files and of the files that they include."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, NoReturn

from robocov.errors import MapError, quote, to_one_line
from robocov_app.formats import files

MAX_BYTES = 5_000_000
"""Maximum size of a world file, and maximum total size of all included files."""
MAX_TOKENS = 200_000
"""Maximum number of tokens."""
BRACKETS = ("(", ")", "[", "]")
_TOKEN = re.compile(
    r"(?P<blank>(?>[ \t\r\n]+|#[^\n]*)++)|(?P<word>[A-Za-z_][\w.-]*(?:\[\d+\][\w.-]*)*)"
    r'|(?P<number>[-+.\d][-+.\w]*)|"(?P<string>[^"\n]*)"|(?P<mark>[()\[\]])|(?P<strange>[\s\S])'
)
_MAX_QUOTED_CHARACTERS = 20


class Token(NamedTuple):
    """A word, number, string or bracket.

    Attributes
    ----------
    kind : str
        "word", "number", "string", or the bracket itself.
    text : str
        The text of the token, without quotation marks.
    location : str
        File and line, for messages.
    """

    kind: str
    text: str
    location: str

    def raise_error(self, expected: str) -> NoReturn:
        """Raise a MapError with the location of this token and a description of the expected one."""
        raise MapError(f"{self.location}: expected {expected}, got {quote(self.text)}")


def read_tokens(path: Path, find_file: Callable[..., Path]) -> deque[Token]:
    """Return the tokens of a world file, with each include replaced by the tokens of the included file.

    Parameters
    ----------
    path : Path
    find_file : callable
        ``find_file(name, kind, location=location)`` returns the path of a file that another file names.

    Raises
    ------
    MapError
        If a file cannot be read, is too large, or includes itself.
    """
    reader = _TokenReader(find_file)
    reader.read(path, (path,))
    return reader.tokens


class _TokenReader:
    """Collects the tokens of files."""

    def __init__(self, find_file: Callable[..., Path]) -> None:
        self.tokens: deque[Token] = deque()
        self._find_file = find_file
        self._budget = files.IncludeBudget(max_bytes=MAX_BYTES)

    def read(self, path: Path, open_files: tuple[Path, ...]) -> None:
        """Append the tokens of a file; `open_files` are the file itself and those that include it."""
        content = files.read_content(path, MAX_BYTES).decode("utf-8", "replace")
        name = to_one_line(path)
        line = 1
        is_after_include = False
        for match in _TOKEN.finditer(content):
            kind = str(match.lastgroup)
            text = match[kind]
            token = Token(text if kind == "mark" else kind, text, f"{name}:{line}")
            line += match[0].count("\n")
            if kind == "blank":
                continue
            if kind == "strange":
                strange = content[match.start() : match.start() + _MAX_QUOTED_CHARACTERS]
                token._replace(text=strange).raise_error("a word, a number or a bracket")
            is_include = kind == "word" and text == "include"
            if is_after_include:
                self._include(token, open_files)
            elif not is_include:
                self._append(token)
            is_after_include = is_include and not is_after_include
        if is_after_include:
            raise MapError(f"{name}:{line}: expected a file to include, got the end of the file")

    def _append(self, token: Token) -> None:
        if len(self.tokens) >= MAX_TOKENS:
            raise MapError(f"{token.location}: expected at most {MAX_TOKENS} words and numbers, got more")
        self.tokens.append(token)

    def _include(self, token: Token, open_files: tuple[Path, ...]) -> None:
        """Append the tokens of the file that a token names; raise MapError if it includes itself."""
        if token.kind != "string":
            token.raise_error("a file to include")
        path = self._find_file(token.text, "file", location=token.location)
        includes_itself = any(path.resolve() == file.resolve() for file in open_files)
        if includes_itself or len(open_files) > files.MAX_DEPTH:
            token.raise_error("a file that does not include itself")
        self._budget.count_file(path, token.location)
        self.read(path, (*open_files, path))
