"""Arguments of commands: values, help and messages."""

from dataclasses import dataclass, field, make_dataclass
from typing import Annotated, Literal

import pytest
from tyro.conf import Positional, arg

from robocov.errors import InputError
from robocov_app.terminal.arguments import (
    _format_default,
    name_option,
    parse_gains,
    parse_options,
    summarize_tyro_error,
)


@dataclass
class Options:
    """Some options."""

    count: int = 1
    """How many."""
    length: float = 0.5
    """How long."""
    kind: Literal["a", "b"] = "a"
    """Which."""
    study: Literal["late", "early"] | None = None
    """Or none."""


def test_words_become_values() -> None:
    assert parse_options(Options, "try", ["--count", "3", "--kind", "b"]) == Options(3, 0.5, "b")


@pytest.mark.parametrize("encoding", ["ascii", "utf-8"])
@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--count 1.5", "--count: expected a whole number, got '1.5'"),
        ("--length far", "--length: expected a number, got 'far'"),
        ("--kind c", "--kind: expected a or b, got 'c'"),
        ("--study mid", "--study: expected early or late, got 'mid'"),
        ("--kount 3", "unknown option --kount: did you mean --count?"),
        ("--count", "--count: expected a value"),
    ],
)
def test_a_wrong_word_gets_one_line_whatever_the_terminal(
    words: str, message: str, encoding: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONIOENCODING", encoding)
    monkeypatch.setenv("COLUMNS", "40")
    with pytest.raises(InputError) as caught:
        parse_options(Options, "try", words.split())
    assert str(caught.value) == f"{message} (see robocov try -h)"


def test_a_box_in_either_drawing() -> None:
    lines = "╭─ Oh ─╮\n│ no   │\n│ more │\n│ ──── │\n│ rest │\n╰──────╯"
    dashes = " Oh \n ---- \n  no  \n  more \n  ---- \n  rest \n"
    assert summarize_tyro_error(lines) == summarize_tyro_error(dashes) == "no more"


def test_defaults_that_say_something_are_in_the_help() -> None:
    assert _format_default("0.016666666666666666") == "(default: 0.01667)"
    assert _format_default("None") == ""


def test_a_message_names_the_option() -> None:
    kind = make_dataclass("Arguments", ["fail"])
    said = name_option(kind, "conditions.failures[0]: expected 1, got robot 9")
    assert said == "--fail: expected 1, got robot 9"


def test_gains_are_json_or_words() -> None:
    gains = parse_gains(("k_rep=0.3", "attraction_limit=null", "target=median"))
    assert gains == {"k_rep": 0.3, "attraction_limit": None, "target": "median"}


@dataclass
class Several:
    """Options of several values."""

    file: Positional[str]
    """A file."""
    skip: tuple[str, ...] | None = field(default=None, metadata={"aliases": ["--ignore-layer"]})
    """What is left out."""
    place: tuple[float, float] | None = None
    """Two numbers."""
    gains: Annotated[tuple[str, ...], arg(name="set")] = ()
    """Under another name."""


@pytest.mark.parametrize(
    "words",
    [
        ["f", "--skip", "a", "b"],
        ["f", "--skip", "a", "--skip", "b"],
        ["f", "--ignore-layer", "a", "--ignore-layer", "b"],
        ["--skip", "a", "--place", "-1", "2", "--ignore-layer", "b", "--set", "c=1", "--", "f"],
        ["f", "--skip=a", "--skip", "b"],
    ],
)
def test_an_option_of_several_values_may_be_repeated(words: list[str]) -> None:
    assert parse_options(Several, "try", words).skip == ("a", "b")


def test_repeated_options_keep_their_own_values() -> None:
    words = ["f", "--set", "k=-1", "--skip", "a", "--place", "-1", ".5", "--set", "l=2", "--skip"]
    assert parse_options(Several, "try", words) == Several("f", ("a",), (-1.0, 0.5), ("k=-1", "l=2"))
    # Options that may be given only once are not merged.
    with pytest.raises(InputError):
        parse_options(Several, "try", ["f", "--place", "1", "--place", "2"])
