"""Wrapping the descriptions of commands."""

from dataclasses import dataclass

import pytest

from robocov_app.terminal.arguments import parse_options
from robocov_app.terminal.help_text import insert_description, wrap_description


def test_paragraphs_are_wrapped_regardless_of_their_lines_in_the_source() -> None:
    docstring = """Summary of the command.

    The first line of a paragraph
    (and its second line).
    """
    assert wrap_description(docstring, 80) == (
        "Summary of the command.\n\nThe first line of a paragraph (and its second line)."
    )
    narrow = wrap_description(docstring, 40)
    assert narrow == ("Summary of the command.\n\nThe first line of a paragraph (and its\nsecond line).")


def test_texts_of_items_stay_in_their_column() -> None:
    docstring = """Summary.

      png   an image whose
            cells are obstacles
      many, names
            one text for both

    Example: try
    """
    assert wrap_description(docstring, 80).splitlines()[2:5] == [
        "  png   an image whose cells are obstacles",
        "  many, names",
        "        one text for both",
    ]
    assert wrap_description(docstring, 40).splitlines()[2:4] == [
        "  png   an image whose cells are",
        "        obstacles",
    ]


def test_an_option_of_the_usage_stays_on_one_line() -> None:
    help_text = "usage: robocov try [--first VALUE] [--second VALUE]\n\noptions\n"
    assert insert_description(help_text, "Try it.", 40) == (
        "usage: robocov try [--first VALUE]\n       [--second VALUE]\n\nTry it.\n\noptions\n"
    )


def test_only_empty_lines_between_groups_remain() -> None:
    options = " options\n ---\n  --first  Fills its line.\n    \n  --second\n   \n others\n"
    text = insert_description(f"usage: robocov try\n\n{options}", "Try it.", 80)
    assert text.partition("Try it.\n\n")[2].splitlines() == [
        " options",
        " ---",
        "  --first  Fills its line.",
        "  --second",
        "   ",
        " others",
    ]


def test_the_help_has_the_description_before_the_options(capsys: pytest.CaptureFixture[str]) -> None:
    @dataclass
    class Options:
        """Try something."""

        count: int = 1
        """Number of attempts."""

    with pytest.raises(SystemExit):
        parse_options(Options, "try", ["--help"])
    text = capsys.readouterr().out
    assert text.startswith("usage: robocov try [-h] [--count INT]\n\nTry something.\n\n")
    assert "Number of attempts." in text
