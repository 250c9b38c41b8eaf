"""Parsing of command lines into options, with one-line messages for invalid ones."""

import contextlib
import io
import json
import re
import shutil
import sys
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import tyro

from robocov.errors import InputError, ParameterError, find_similar_names, quote, require_number
from robocov_app.terminal.help_text import HelpBuffer, insert_description

T = TypeVar("T")

_MIN_WINDOW_SIZE_PX = (900, 600)
_MAX_WINDOW_SIZE_PX = (7680, 4320)
_FIRST_OPTIONS = (
    "map",
    "controller",
    "controllers",
    "out",
    "robots",
    "gains",
    "duration",
    "seed",
    "start",
    "video",
)
"""The most frequently used options, which come first in the help."""
_LAST_OPTIONS = ("json", "overwrite")
"""Options that come last in the help."""
_NEGATIVE_NUMBER = re.compile(r"-\.?\d.*")
"""A word that begins like an option, but is a negative number."""
_WORD = r"[A-Za-z][A-Za-z0-9_-]*"
"""A value of a gain that is a word."""
_JSON_CONSTANTS = frozenset(("null", "true", "false", "NaN", "Infinity"))
"""Words that are values in JSON."""
_MIN_SIMILARITY = 0.8
"""Minimum similarity, as measured by `difflib`, of an option that is suggested."""


def _describe_choices(text: str) -> str:
    """Return choices as "a, b or c", given tyro's list "'a', 'b', 'c'"."""
    choices = [choice.strip("'") for choice in text.split(", ")]
    if "None" in choices:
        choices = sorted(set(choices) - {"None"})
    if len(choices) < 2:
        return "".join(choices)
    return f"{', '.join(choices[:-1])} or {choices[-1]}"


def _explain_invalid_choice(match: re.Match[str]) -> str:
    """Return the message for a value that is not one of the choices of an option."""
    value, option, choices = match.groups()
    return f"{option}: expected {_describe_choices(choices)}, got {value}"


def _explain_missing_choice(match: re.Match[str]) -> str:
    """Return the message for a missing positional argument with choices."""
    command, choices = match.groups()
    return f"{command}: expected {_describe_choices(choices.replace(',', ', '))}, got nothing"


def _explain_invalid_number(match: re.Match[str]) -> str:
    """Return the message for a value that is not a number of the expected kind."""
    option, kind, value = match.groups()
    number = "whole number" if kind == "INT" else "number"
    return f"{option}: expected a {number}, got {value}"


_EXPLANATIONS: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    (r"^Error parsing (\S+): invalid literal for int.* 10: (.*)$", r"\1: expected a whole number, got \2"),
    (r"^Error parsing (\S+): could not convert string to float: (.*)$", r"\1: expected a number, got \2"),
    (
        r"^Error parsing (\S+): no type matching (INT|FLOAT) could be .* from \[(.*?)\]\. .*$",
        _explain_invalid_number,
    ),
    (
        r"^Error parsing (\S+): no type matching \{?FLOAT FLOAT\}? could be .* from \[(.*?)\]\. .*$",
        r"\1: expected two numbers, got \2",
    ),
    (
        r"^invalid choice (.*) for argument '(\S+)'\. Expected one of \((.*?),? ?\) ?\.$",
        _explain_invalid_choice,
    ),
    (r"^Missing value for argument '(\S+)'\..*$", r"\1: expected a value"),
    (r"^Missing from robocov \w+: (-\S+).*$", r"\1: this option is required"),
    (r"^Missing from robocov (\w+): \{(\S+)\}.*$", _explain_missing_choice),
    (r"^Missing from robocov \w+: (\S+).*$", r"missing argument: expected \1"),
    (r"^Unrecognized options: (-[^\s,]+).*$", r"unknown option \1"),
    (r"^Unrecognized options: ([^\s,]*).*$", r"unexpected argument \1"),
)
"""Patterns of tyro's messages, and the messages that are printed instead."""


def parse_options(kind: type[T], command: str, words: list[str]) -> T:
    """Parse the words of a command.

    Parameters
    ----------
    kind : type
        Dataclass of the command's options.
    command : str
        Name of the command.
    words : list of str
        The words after the name of the command.

    Returns
    -------
    object
        An instance of the dataclass.

    Raises
    ------
    InputError
        If the words are invalid.
    SystemExit
        After the help has been printed.
    """
    words = merge_repeated_options(kind, words)
    error_text = io.StringIO()
    help_text = HelpBuffer(sys.stdout)
    try:
        with contextlib.redirect_stderr(error_text), contextlib.redirect_stdout(help_text):
            return tyro.cli(
                _arrange_help(kind),
                prog=f"robocov {command}",
                description="",
                args=words,
                config=(tyro.conf.FlagCreatePairsOff, tyro.conf.DisallowNone),
            )
    except SystemExit as error:
        if not error.code:
            width = shutil.get_terminal_size().columns
            sys.stdout.write(insert_description(help_text.getvalue(), kind.__doc__ or "", width))
            raise
        problem = _add_suggestion(summarize_tyro_error(error_text.getvalue()), kind, command)
        raise InputError(f"{problem} (see robocov {command} -h)") from None


def _add_suggestion(problem: str, kind: Any, command: str) -> str:
    """Return the message about a problem, with a suggestion if the user may have meant another option."""
    names = _list_option_names(kind)
    options = [f"--{name}" for name in names]
    match = re.match(r"unexpected argument (\S+)", problem)
    if match:
        return _explain_unexpected_argument(match[1], options)
    match = re.fullmatch(r"unknown option (-[^-]\S+)", problem)
    if match and f"-{match[1]}" in options:
        return f"{problem}: did you mean -{match[1]}?"
    match = re.match(r"([a-z]\w*): expected ", problem)
    if match and match[1] in names:
        # A positional argument has no name that users see.
        return f"{command}: {problem.removeprefix(f'{match[1]}: ')}"
    return problem


def _explain_unexpected_argument(word: str, options: list[str]) -> str:
    """Return the message about an unexpected word, with the option that may be missing before it."""
    text = f"unexpected argument {quote(word)}"
    if _is_controller(word):
        for option in options:
            if option in ("--controller", "--controllers"):
                return f"{text}: did you mean {option} {word}?"
    similar_options = find_similar_names(f"--{word}", options, _MIN_SIMILARITY)
    if not similar_options:
        return text
    return f"{text}: did you mean {' or '.join(similar_options)}?"


def _list_option_names(kind: Any) -> list[str]:
    """Return the names of the options in a dataclass and its groups, with hyphens."""
    return [
        option.name.replace("_", "-")
        for group in (kind, *list_option_groups(kind))
        for option in fields(group)
    ]


def _is_controller(word: str) -> bool:
    """Return whether a word is the name of a controller or ``file.py:Class``."""
    from robocov.controllers import CONTROLLERS

    return word in CONTROLLERS or bool(re.search(r"\.py:\w+$", word))


def merge_repeated_options(kind: Any, words: list[str]) -> list[str]:
    """Merge the occurrences of options that take any number of values.

    Parameters
    ----------
    kind : type
        Dataclass of the options.
    words : list of str
        The words after the name of the command.

    Returns
    -------
    list of str
        Words in which each such option occurs once: ``--skip a --skip b`` becomes ``--skip a b``. Without
        this, the last occurrence would silently replace the others.
    """
    names = _map_multiple_options(kind)
    merged: list[str] = []
    values_by_option: dict[str, list[str]] = {}
    # The list to which values are appended: that of the current option if its values are merged, or `merged`.
    current = merged
    for position, word in enumerate(words):
        if word == "--":
            merged += words[position:]
            break
        option, has_value, value = word.partition("=")
        option = option.replace("_", "-")
        if not option.startswith("-") or _NEGATIVE_NUMBER.fullmatch(word):
            current.append(word)
            continue
        current = merged
        if option not in names:
            merged.append(word)
            continue
        name = names[option]
        if name not in values_by_option:
            values_by_option[name] = []
            merged.append(name)
        current = values_by_option[name]
        if has_value:
            current.append(value)
            current = merged
    complete = []
    for word in merged:
        complete.append(word)
        complete += values_by_option.get(word, ())
    return complete


def _map_multiple_options(kind: Any) -> dict[str, str]:
    """Return the full names of the options that take any number of values, by full name and by alias."""
    names: dict[str, str] = {}
    for group in (kind, *list_option_groups(kind)):
        plain_hints = get_type_hints(group)
        hints = get_type_hints(group, include_extras=True)
        for option in fields(group):
            if not _takes_many_values(plain_hints[option.name]):
                continue
            # An option may have another name than its field.
            given_names = [getattr(mark, "name", None) for mark in get_args(hints[option.name])[1:]]
            chosen = next(filter(None, given_names), option.name)
            name = f"--{chosen.replace('_', '-')}"
            names |= dict.fromkeys((name, *option.metadata.get("aliases", ())), name)
    return names


def _takes_many_values(hint: Any) -> bool:
    """Return whether a type is a tuple of any length, or a union with one."""
    return any(get_origin(part) is tuple and ... in get_args(part) for part in (hint, *get_args(hint)))


def _arrange_help(kind: type[T]) -> type[T]:
    """Put the most frequently used options first in the help, and omit uninformative default values.

    This changes the annotations and the field order of the dataclass, from which tyro builds the help.
    """
    for group in (kind, *list_option_groups(kind)):
        owner: Any = group
        hints = get_type_hints(owner, include_extras=True)
        known_fields = owner.__dataclass_fields__
        owner.__annotations__ = {
            name: Annotated[hint, _make_help_settings(known_fields.get(name))] for name, hint in hints.items()
        }
        order = [*_FIRST_OPTIONS, *(name for name in known_fields if name not in _LAST_OPTIONS)]
        order += _LAST_OPTIONS
        owner.__dataclass_fields__ = {name: known_fields[name] for name in order if name in known_fields}
    return kind


def _make_help_settings(option: Any) -> Any:
    """Return tyro's settings for an option, including those in the metadata of its field, such as aliases."""
    settings = {} if option is None else dict(option.metadata)
    return tyro.conf.arg(help_behavior_hint=_format_default, **settings)


def _format_default(label: str) -> str:
    """Return the hint about a default value in the help; empty for values such as None."""
    if label in ("", "''", "None", "False"):
        return ""
    if "." in label:
        with contextlib.suppress(ValueError):
            label = f"{float(label):.4g}"
    return f"(default: {label})"


def list_option_groups(kind: Any) -> list[Any]:
    """Return the dataclasses of option groups that a dataclass of options contains."""
    return [option.default_factory for option in fields(kind) if is_dataclass(option.default_factory)]


def name_option(kind: Any, message: str) -> str:
    """Replace the name of a parameter at the start of a message by the option that sets it.

    Parameters
    ----------
    kind : type
        Dataclass of the command's options.
    message : str
        Such as ``team.max_speed: expected ...``.

    Returns
    -------
    str
        Such as ``--max-speed: expected ...``; the message itself if there is no such option.
    """
    match = re.match(r"(?:conditions\.|team\.)?(\w+)(?:\[\d+\])?(?=: )", message)
    if match is None:
        return message
    name = {"failures": "fail", "joins": "join"}.get(match[1], match[1])
    option = name.replace("_", "-")
    if option not in _list_option_names(kind):
        return message
    return f"--{option}{message[match.end() :]}"


def summarize_tyro_error(text: str) -> str:
    """Summarize an error message of tyro, which is printed in a box, in one line with its suggestion.

    Parameters
    ----------
    text : str
        The output of tyro.

    Returns
    -------
    str
    """
    paragraphs = _split_box(text)
    summary = " ".join(paragraphs[0])
    for pattern, explanation in _EXPLANATIONS:
        summary, count = re.subn(pattern, explanation, summary)
        if count:
            break
    for paragraph in paragraphs[1:]:
        if paragraph and paragraph[0].startswith("Perhaps you meant"):
            option = next((line.split()[0] for line in paragraph[1:] if line.startswith("--")), None)
            if option is not None:
                summary += f": did you mean {option}?"
    return summary


def _split_box(text: str) -> list[list[str]]:
    """Return the lines of each paragraph of a text in a box drawn with line characters."""
    paragraphs: list[list[str]] = []
    for line in text.splitlines():
        content = line.strip("│| \t")
        if content.startswith("╭") or re.fullmatch(r"[-─]{3,}", content):
            paragraphs.append([])
        elif paragraphs and content and not content.startswith("╰"):
            paragraphs[-1].append(content)
    return paragraphs


def parse_size(option: str, text: str, minimum: tuple[int, int], maximum: tuple[int, int]) -> tuple[int, int]:
    """Parse a size such as ``1280x720``.

    Parameters
    ----------
    option : str
        Name of the option in messages.
    text : str
        Value of the option.
    minimum, maximum : (width, height), px
        Range of valid sizes.

    Returns
    -------
    (width, height), px

    Raises
    ------
    ParameterError
        If the text is not a size, or the size is out of range.
    """
    match = re.fullmatch(r"(\d{1,6})[xX×](\d{1,6})", text)
    if not match:
        expected = "expected WIDTHxHEIGHT in pixels, as in 1280x720"
        raise ParameterError(f"{option}: {expected}, got {quote(text)}")
    width = int(match[1])
    height = int(match[2])
    require_number(option, width, minimum[0], maximum[0], "pixels wide")
    require_number(option, height, minimum[1], maximum[1], "pixels high")
    return width, height


def parse_window_size(text: str | None) -> tuple[int, int] | None:
    """Parse the value of ``--size`` for a window; see `parse_size`; None if the option is not given."""
    if text is None:
        return None
    return parse_size("--size", text, _MIN_WINDOW_SIZE_PX, _MAX_WINDOW_SIZE_PX)


def parse_gains(texts: tuple[str, ...]) -> dict[str, Any]:
    """Parse the values of the option ``--set``.

    Parameters
    ----------
    texts : tuple of str
        Texts such as ``k_rep=0.3``. Each value is JSON (``null`` means no limit) or a word.

    Returns
    -------
    dict
        Values by the name of the gain.

    Raises
    ------
    ParameterError
        If a text cannot be parsed, or a gain is given twice.

    Examples
    --------
    >>> parse_gains(("k_rep=0.3", "target=median", "attraction_limit=null"))
    {'k_rep': 0.3, 'target': 'median', 'attraction_limit': None}
    """
    gains: dict[str, Any] = {}
    for text in texts:
        name, has_value, value = text.partition("=")
        if not has_value or not re.fullmatch(r"[^\W\d][\w.:/-]*", name):
            raise ParameterError(f"--set: expected GAIN=VALUE, as in k_rep=0.3, got {quote(text)}")
        if name in gains:
            raise ParameterError(f"--set: {name} is given twice")
        gains[name] = _parse_gain_value(name, value)
    return gains


def _parse_gain_value(name: str, text: str) -> Any:
    """Parse the value of a gain: a word, or JSON; raise a ParameterError for anything else."""
    if re.fullmatch(_WORD, text) and text not in _JSON_CONSTANTS:
        return text
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        # ValueError also means thousands of digits, RecursionError deeply nested brackets.
        expected = "expected a number (or null), or a word"
        raise ParameterError(f"--set {name}: {expected}, got {quote(text)}") from error
