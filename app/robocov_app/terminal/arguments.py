"""Words of the command line to values, with one line for what is wrong with them."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Callable
from typing import TypeVar

import tyro

from robocov.errors import InputError

T = TypeVar("T")

_WORDING: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    (
        r"^Error parsing (\S+): invalid literal for int\(\) with base 10: (.*)$",
        r"\1: \2, but a whole number was wanted",
    ),
    (r"^Error parsing (\S+): could not convert string to float: (.*)$", r"\1: \2, but a number was wanted"),
    (
        r"^Error parsing (\S+): no type matching \{None\}\|(INT|FLOAT) could be .* from \[(.*?)\]\. .*$",
        lambda match: f"{match[1]}: {match[3]}, but a {'whole ' * (match[2] == 'INT')}number was wanted",
    ),
    (
        r"^invalid choice (.*) for argument '(\S+)'\. Expected one of \((.*?),? ?\) ?\.$",
        lambda match: f"{match[2]}: {match[1]}, but one of {_choices(match[3])} was wanted",
    ),
    (r"^Missing value for argument '(\S+)'\..*$", r"\1: a value was wanted"),
    (r"^Missing from robocov \w+: (\S+).*$", r"\1: this option is required"),
    (r"^Unrecognized options: (.*)$", r"unknown option \1"),
)


def _choices(text: str) -> str:
    """Return choices without None; with it they come in any order, and are sorted then."""
    choices = text.split(", ")
    return ", ".join(sorted(set(choices) - {"'None'"}) if "'None'" in choices else choices)


def parsed(kind: type[T], command: str, words: list[str]) -> T:
    """Return the dataclass of options that `words` give.

    Raises
    ------
    InputError
        When the words do not fit the options: one line.
    SystemExit
        After help was printed.
    """
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            return tyro.cli(
                kind, prog=f"robocov {command}", args=words, config=(tyro.conf.FlagCreatePairsOff,)
            )
    except SystemExit as ending:
        if not ending.code:
            raise
        raise InputError(f"{one_line(complaint.getvalue())} (robocov {command} -h explains)") from None


def one_line(boxed: str) -> str:
    """Return the first paragraph of a boxed complaint as one line, with the suggestion where there is one.

    The box is drawn with lines or, where the terminal has none, with dashes.
    """
    paragraphs: list[list[str]] = []
    for line in boxed.splitlines():
        words = line.strip("│| \t")
        if words.startswith("╭") or re.fullmatch(r"[-─]{3,}", words):
            paragraphs.append([])
        elif paragraphs and words and not words.startswith("╰"):
            paragraphs[-1].append(words)
    text = " ".join(paragraphs[0])
    for pattern, wording in _WORDING:
        text, changed = re.subn(pattern, wording, text)
        if changed:
            break
    for paragraph in paragraphs[1:]:
        if paragraph and paragraph[0].startswith("Perhaps you meant"):
            option = next((line.split()[0] for line in paragraph[1:] if line.startswith("--")), None)
            text += f": did you mean {option}?" if option else ""
    return text
