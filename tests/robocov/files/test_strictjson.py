"""Positions of values in a JSON text, compared with those that a writer records."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.files.json_positions import find_deep_nesting, find_line_and_column, find_offset

texts = st.text(st.characters(exclude_categories=("Cs",)), max_size=4) | st.sampled_from(
    ["[", '"', "{]", "\\"]
)
documents = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | texts,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner, max_size=4),
    max_leaves=12,
)
spaces = st.text(" \t\n\r", max_size=3)


class Writer:
    """Writes JSON with spaces by chance, and notes where every key and value begins."""

    def __init__(self, data: st.DataObject) -> None:
        self.text = ""
        self.values: dict[tuple[Any, ...], int] = {}
        self.keys: dict[tuple[Any, ...], int] = {}
        self._data = data

    def write(self, value: Any, path: tuple[Any, ...] = ()) -> None:
        self._space()
        self.values[path] = len(self.text)
        if isinstance(value, (dict, list)):
            brackets = "{}" if isinstance(value, dict) else "[]"
            self.text += brackets[0]
            steps = value if isinstance(value, dict) else range(len(value))
            for number, step in enumerate(steps):
                self.text += "," if number else ""
                if isinstance(value, dict):
                    self._space()
                    self.keys[*path, step] = len(self.text)
                    self.text += json.dumps(step, ensure_ascii=False)
                    self._space()
                    self.text += ":"
                self.write(value[step], (*path, step))
            self._space()
            self.text += brackets[1]
        else:
            self.text += json.dumps(value, ensure_ascii=False)
        self._space()

    def _space(self) -> None:
        self.text += self._data.draw(spaces)


@given(documents, st.data())
def test_values_and_keys_are_found_where_they_were_written(document: Any, data: st.DataObject) -> None:
    writer = Writer(data)
    writer.write(document)
    for path, offset in writer.values.items():
        assert find_offset(writer.text, path) == offset
    for path, offset in writer.keys.items():
        assert find_offset(writer.text, path, at_key=True) == offset
    for path, offset in writer.values.items():
        for missing in ("no such key", 99):
            assert find_offset(writer.text, (*path, missing)) == offset
            assert find_offset(writer.text, (*path, missing, 0), at_key=True) == offset


def test_the_last_of_two_equal_keys_counts() -> None:
    text = '{"a": {"b": 1}, "a": {"b": 2}}'
    assert text[find_offset(text, ("a", "b")) :] == "2}}"
    assert text[find_offset(text, ("a",), at_key=True) :] == '"a": {"b": 2}}'


@pytest.mark.parametrize("number", ["9" * 10_000, "1e999", "NaN", "-Infinity", "0.1"])
def test_numbers_of_any_form_are_skipped(number: str) -> None:
    assert find_offset(f"[{number}, 1]", (1,)) == len(number) + 3


@given(st.text("ab\r\n", max_size=30), st.data())
def test_lines_end_as_editors_end_them(text: str, data: st.DataObject) -> None:
    offset = data.draw(st.integers(0, len(text)))
    if text[offset - 1 : offset + 1] == "\r\n":
        return  # in the middle of an end of line
    # an x marks the place; it is in one line of those that Python sees
    lines = (text[:offset] + "x" + text[offset:]).splitlines()
    line, column = find_line_and_column(text, offset)
    assert lines[line - 1][column - 1] == "x"


@pytest.mark.parametrize(
    ("text", "offset"),
    [
        ("[[[", 2),
        ("[[]{}]", 6),
        ('["[[[", {"a": []}]', 14),
        ('["\\"[[[", [[]]]', 11),
        ("{}", 2),
        ("[" * 1000, 2),
    ],
)
def test_the_first_bracket_that_is_too_deep_is_found(text: str, offset: int) -> None:
    assert find_deep_nesting(text, 2) == offset
