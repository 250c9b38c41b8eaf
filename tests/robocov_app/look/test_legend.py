"""One legend for several pictures."""

from robocov_app.look.legend import merge_legends


def test_entries_appear_once_in_the_order_of_the_first_legend() -> None:
    assert merge_legends([["a", "c"], ["a", "b", "c", "d"]], str) == ["a", "b", "c", "d"]
    assert merge_legends([[], ["x"], ["y", "x"]], str) == ["y", "x"]
