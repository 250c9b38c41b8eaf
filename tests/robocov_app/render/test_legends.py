"""One legend for several pictures."""

from hypothesis import given
from hypothesis import strategies as st

from robocov_app.render.legends import united

ENTRIES = st.lists(st.integers(0, 8), unique=True)


def both(*legends: str) -> str:
    return "".join(united([list(legend) for legend in legends], str))


def test_what_only_a_later_one_has_stands_where_it_stands_there() -> None:
    assert both("abe", "abcde") == "abcde"
    assert both("abcde", "ace") == "abcde"
    assert both("bc", "abd") == "abdc"
    assert both("", "ab", "ab") == "ab"


@given(st.lists(ENTRIES, max_size=4))
def test_each_entry_stands_once_and_the_first_legend_keeps_its_order(legends: list[list[int]]) -> None:
    found = united(legends, lambda entry: entry)
    assert len(found) == len(set(found))
    assert set(found) == {entry for legend in legends for entry in legend}
    if legends:
        assert [entry for entry in found if entry in legends[0]] == legends[0]
