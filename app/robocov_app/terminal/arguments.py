"""Words of the command line to values, with one line for what is wrong with them."""

import contextlib
import io
import json
import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import tyro

from robocov.errors import InputError, ParameterError, quote, require_number

T = TypeVar("T")

_WORDING: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    (r"^Error parsing (\S+): invalid literal for int.* 10: (.*)$", r"\1: expected a whole number, got \2"),
    (r"^Error parsing (\S+): could not convert string to float: (.*)$", r"\1: expected a number, got \2"),
    (
        r"^Error parsing (\S+): no type matching (INT|FLOAT) could be .* from \[(.*?)\]\. .*$",
        lambda match: f"{match[1]}: expected a {'whole ' * (match[2] == 'INT')}number, got {match[3]}",
    ),
    (
        r"^Error parsing (\S+): no type matching \{?FLOAT FLOAT\}? could be .* from \[(.*?)\]\. .*$",
        r"\1: expected two numbers, got \2",
    ),
    (
        r"^invalid choice (.*) for argument '(\S+)'\. Expected one of \((.*?),? ?\) ?\.$",
        lambda match: f"{match[2]}: expected {_choices(match[3])}, got {match[1]}",
    ),
    (r"^Missing value for argument '(\S+)'\..*$", r"\1: expected a value"),
    (r"^Missing from robocov \w+: (-\S+).*$", r"\1: this option is required"),
    (r"^Missing from robocov \w+: (\S+).*$", r"missing argument: expected \1"),
    (r"^Unrecognized options: (-[^\s,]+).*$", r"unknown option \1"),
    (r"^Unrecognized options: ([^\s,]*).*$", r"unexpected argument \1"),
)
_FIRST = ("map", "controller", "controllers", "out", "robots", "gains", "duration", "seed", "start", "video")
_LAST = ("json", "overwrite")  # the help ends with these, as it begins with those
_NEGATIVE = re.compile(r"-\.?\d.*")  # a value, not an option
_WORD = r"[A-Za-z][A-Za-z0-9_-]*"
_JSON_WORDS = frozenset(("null", "true", "false", "NaN", "Infinity"))  # no words of an option


def _choices(text: str) -> str:
    choices = [choice.strip("'") for choice in text.split(", ")]
    if "None" in choices:
        choices = sorted(set(choices) - {"None"})
    if len(choices) < 2:
        return "".join(choices)
    return f"{', '.join(choices[:-1])} or {choices[-1]}"


def parsed(kind: type[T], command: str, words: list[str]) -> T:
    """Return the options that `words` give; raises InputError, or SystemExit after help."""
    complaint = io.StringIO()
    words = merge_repeated(kind, words)
    try:
        with contextlib.redirect_stderr(complaint):
            config = tyro.conf.FlagCreatePairsOff, tyro.conf.DisallowNone
            return tyro.cli(_for_readers(kind), prog=f"robocov {command}", args=words, config=config)
    except SystemExit as ending:
        if not ending.code:
            raise
        problem = _with_hint(one_line(complaint.getvalue()), kind, command)
        raise InputError(f"{problem} (robocov {command} -h explains)") from None


def _with_hint(problem: str, kind: Any, command: str) -> str:
    """Return what is wrong with the words of a command, with what may have been meant."""
    options = [f"--{name}" for name in _option_names(kind)]
    if found := re.match(r"unexpected argument (\S+)", problem):
        word = found[1]
        text = f"unexpected argument {quote(word)}"
        meant = [f"{option} {word}" for option in options if option in ("--controller", "--controllers")]
        near = get_close_matches(f"--{word}", options, n=1, cutoff=0.8)
        if meant and _is_controller(word):
            return f"{text}: did you mean {meant[0]}?"
        return f"{text}: did you mean {near[0]}?" if near else text
    if (found := re.fullmatch(r"unknown option (-[^-]\S+)", problem)) and f"-{found[1]}" in options:
        return f"{problem}: did you mean -{found[1]}?"
    # values of arguments without an option are known by the command alone
    if (found := re.match(r"([a-z]\w*): expected ", problem)) and found[1] in _option_names(kind):
        return f"{command}: {problem.removeprefix(f'{found[1]}: ')}"
    return problem


def _option_names(kind: Any) -> list[str]:
    return [each.name.replace("_", "-") for one in (kind, *groups_of(kind)) for each in fields(one)]


def _is_controller(word: str) -> bool:
    from robocov.controllers import CONTROLLERS

    return word in CONTROLLERS or bool(re.search(r"\.py:\w+$", word))


def merge_repeated(kind: Any, words: list[str]) -> list[str]:
    """Return words in which options that take any number of values stand once, with all their values.

    ``--skip a --skip b`` means ``--skip a b``: without this the last would silently replace the others.
    """
    several = _options_of_several_values(kind)
    given: dict[str, list[str]] = {}
    kept: list[str] = []
    values = kept
    for k, word in enumerate(words):
        if word == "--":
            kept += words[k:]
            break
        name, equals, value = word.partition("=")
        name = name.replace("_", "-")
        if not name.startswith("-") or _NEGATIVE.fullmatch(word):
            values.append(word)
            continue
        values = kept
        if name not in several:
            kept.append(word)
            continue
        name = several[name]
        if name in given:
            values = given[name]
        else:
            values = given[name] = []
            kept.append(name)
        if equals:
            values.append(value)
            values = kept
    merged = []
    for word in kept:
        merged.append(word)
        merged += given.get(word, ())
    return merged


def _options_of_several_values(kind: Any) -> dict[str, str]:
    """Return the options of a tuple of any length: each name or alias, and the name that it stands for."""
    several: dict[str, str] = {}
    for owner in (kind, *groups_of(kind)):
        plain = get_type_hints(owner)
        marked = get_type_hints(owner, include_extras=True)
        for each in fields(owner):
            kinds = (plain[each.name], *get_args(plain[each.name]))
            if any(get_origin(hint) is tuple and ... in get_args(hint) for hint in kinds):
                # an option may have another name than its field
                names = [getattr(mark, "name", None) for mark in get_args(marked[each.name])[1:]]
                chosen = next(filter(None, names), each.name)
                name = f"--{chosen.replace('_', '-')}"
                several |= dict.fromkeys((name, *each.metadata.get("aliases", ())), name)
    return several


def _for_readers(kind: type[T]) -> type[T]:
    """Return options with the most used ones first in the help, and without defaults that say nothing."""
    hint = tyro.conf.arg(help_behavior_hint=_default_hint)
    for each in (kind, *groups_of(kind)):
        own: Any = each
        hints, known = get_type_hints(own, include_extras=True), own.__dataclass_fields__
        own.__annotations__ = {name: Annotated[hints[name], hint] for name in hints}
        for name, each in known.items():
            if aliases := each.metadata.get("aliases"):
                marked = tyro.conf.arg(help_behavior_hint=_default_hint, aliases=aliases)
                own.__annotations__[name] = Annotated[hints[name], marked]
        order = [*_FIRST, *(name for name in known if name not in _LAST), *_LAST]
        own.__dataclass_fields__ = {name: known[name] for name in order if name in known}
    return kind


def _default_hint(label: str) -> str:
    with contextlib.suppress(ValueError):
        label = f"{float(label):.4g}" if "." in label else label
    return "" if label in ("", "None", "False") else f"(default: {label})"


def groups_of(kind: Any) -> list[Any]:
    return [each.default_factory for each in fields(kind) if is_dataclass(each.default_factory)]


def by_option(kind: Any, message: str) -> str:
    """Return a message on a value with the option that gives it in the place of the value's path."""
    groups = [kind, *groups_of(kind)]
    found = re.match(r"(?:conditions\.|team\.)?(\w+)(?:\[\d+\])?(?=: )", message)
    name = {"failures": "fail", "joins": "join"}.get(found[1], found[1]) if found else ""
    if found is None or not any(name == each.name for group in groups for each in fields(group)):
        return message
    return f"--{name.replace('_', '-')}{message[found.end() :]}"


def one_line(boxed: str) -> str:
    """Return the first paragraph of a boxed complaint as one line, with the suggestion where there is one."""
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


def parse_size(option: str, text: str, minimum: tuple[int, int], maximum: tuple[int, int]) -> tuple[int, int]:
    """Return width and height from a text like ``1280x720``; raises ParameterError."""
    match = re.fullmatch(r"(\d{1,6})[xX×](\d{1,6})", text)
    if not match:
        wanted = "expected WIDTHxHEIGHT in pixels, as in 1280x720"
        raise ParameterError(f"{option}: {wanted}, got {quote(text)}")
    width, height = int(match[1]), int(match[2])
    require_number(option, width, minimum[0], maximum[0], "pixels wide")
    require_number(option, height, minimum[1], maximum[1], "pixels high")
    return width, height


def parse_window_size(text: str | None) -> tuple[int, int] | None:
    return None if text is None else parse_size("--size", text, (900, 600), (7680, 4320))


def parse_gains(texts: tuple[str, ...]) -> dict[str, Any]:
    """Return gains from texts like ``k_rep=0.3``; the value is JSON, ``null`` for no limit, or a word."""
    gains: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not re.fullmatch(r"[^\W\d][\w.:/-]*", name):
            raise ParameterError(f"--set: expected GAIN=VALUE, as in k_rep=0.3, got {quote(text)}")
        if name in gains:
            raise ParameterError(f"--set: {name} is given twice")
        if re.fullmatch(_WORD, value) and value not in _JSON_WORDS:
            gains[name] = value
            continue
        try:
            gains[name] = json.loads(value)
        except (ValueError, RecursionError) as error:  # also of thousands of digits, or brackets
            wanted = "expected a number (or null), or a word"
            raise ParameterError(f"--set {name}: {wanted}, got {quote(value)}") from error
    return gains
