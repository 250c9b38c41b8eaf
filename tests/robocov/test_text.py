"""Text that is safe to print: control characters become visible."""

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.errors import to_one_line
from robocov.text import escape_controls

HOSTILE = [
    *("\x00", "\x07", "\x08", "\r", "\x1b[2J", "\x1b]0;title\x07", "\x7f", "\x85", "\x9b31m"),
    *("\u061c", "\u200e", "\u200f", *map(chr, range(0x202A, 0x202F)), *map(chr, range(0x2066, 0x206A))),
    *("\u2028", "\u2029", "\u200b", "\ufeff", "\U000e0041", "\udcff"),
]


@pytest.mark.parametrize("text", HOSTILE)
def test_characters_that_control_a_terminal_or_reorder_text_are_escaped(text: str) -> None:
    escaped = escape_controls(f"a{text}b")
    assert escaped.isprintable()
    assert escaped.startswith("a\\")


@given(st.text(st.characters()))
def test_only_control_characters_are_escaped(text: str) -> None:
    escaped = escape_controls(text)
    assert not any(unicodedata.category(char) in ("Cc", "Cs") and char not in "\t\n" for char in escaped)
    assert not any(
        unicodedata.bidirectional(char) in ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")
        for char in escaped
    )
    assert escape_controls(escaped) == escaped
    if text.isprintable():
        assert escaped == text


def test_names_in_any_script_stay_as_they_are() -> None:
    for name in ("naïve café", "дом", "部屋", "می‌خواهم", "غرفة", "👩‍🚀", "a\tb\nc"):
        assert escape_controls(name) == name
    assert to_one_line("a\tb\nc") == "a\\tb\\nc"
