"""One legend for several figures."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.look.legend import merge_legends

legends_of_numbers = st.lists(st.lists(st.integers(0, 8), unique=True), max_size=4)


@pytest.mark.parametrize(
    ("legends", "merged"),
    [
        (["abe", "abcde"], "abcde"),
        (["abcde", "ace"], "abcde"),
        (["ac", "abcd"], "abcd"),
        (["bc", "abd"], "abdc"),
        (["", "ab", "ab"], "ab"),
        (["", "x", "yx"], "yx"),
    ],
)
def test_entries_of_later_legends_keep_their_position(legends: list[str], merged: str) -> None:
    assert merge_legends([list(legend) for legend in legends], str) == list(merged)


@given(legends_of_numbers)
def test_each_entry_appears_once(legends: list[list[int]]) -> None:
    merged = merge_legends(legends, int)
    assert len(merged) == len(set(merged))
    assert set(merged) == {entry for legend in legends for entry in legend}


@given(legends_of_numbers.filter(bool))
def test_entries_of_the_first_legend_keep_their_order(legends: list[list[int]]) -> None:
    merged = merge_legends(legends, int)
    first_legend = legends[0]
    assert [entry for entry in merged if entry in first_legend] == first_legend
