"""Strips and bars in SVG for the report of the replication."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.figures.statistics import Interval
from robocov_app.replication.claims import Criterion
from robocov_app.replication.formatting import format_amount
from robocov_app.replication.pages.svg_marks import DotStrip, draw_interval_bar, draw_strips

gaps = st.dictionaries(
    st.text("abc<&", min_size=1, max_size=4), st.floats(-0.05, 3.0), min_size=1, max_size=9
)


def find_dots(svg: str) -> list[tuple[float, str]]:
    """Return the x of all dots, and their titles."""
    matches = re.findall(r'<circle class="\w+" cx="([\d.]+)" cy="[\d.]+" r="3"><title>(.*?)</title>', svg)
    return [(float(x), title) for x, title in matches]


@given(gaps)
def test_dots_are_in_the_order_of_their_values(maps):
    svg = str(draw_strips([DotStrip("one", True, maps)], 3.0))
    dots = find_dots(svg)
    assert len(dots) == len(maps)
    positions = [x for x, _ in dots]
    assert positions == sorted(positions)
    assert all(0.0 <= x <= 440.0 for x in positions)
    for value, (_, title) in zip(sorted(maps.values()), dots, strict=True):
        assert title.endswith(f": {format_amount(value, '%')}")


def test_equal_values_have_equal_positions_in_all_strips():
    first = find_dots(str(draw_strips([DotStrip("one", True, {"a": 0.1, "b": 0.2})], 2.0)))
    second = find_dots(str(draw_strips([DotStrip("other", False, {"c": 0.1, "d": 2.0})], 2.0)))
    assert first[0][0] == second[0][0]
    # The scale is that of square roots: four times the gap is twice as far from 0.
    zero = find_dots(str(draw_strips([DotStrip("zero", False, {"c": 0.0, "d": 0.4})], 2.0)))
    assert abs((zero[1][0] - zero[0][0]) - 2.0 * (first[0][0] - zero[0][0])) <= 0.2


def test_strips_have_a_description_and_escape_names():
    svg = str(draw_strips([DotStrip("<b>", False, {"x&y": 0.5})], 1.0))
    assert 'role="img"' in svg and "&lt;b&gt;: 50% to 50%" in svg and "x&amp;y: 50%" in svg
    assert "<b>" not in svg


def test_without_values_there_are_no_strips():
    assert str(draw_strips([DotStrip("one", True, {})], 1.0)) == ""


numbers = st.floats(-5.0, 5.0)


def find_marks(svg: str, kind: str) -> list[float]:
    """Return the x of all marks of one kind."""
    if kind == "estimate":
        return [float(x) for x in re.findall(r'class="estimate \w+" cx="([\d.]+)"', svg)]
    return [float(x) for x in re.findall(r'class="bound" d="M([\d.]+) ', svg)]


@given(st.tuples(numbers, numbers, numbers), st.tuples(numbers, numbers))
def test_marks_on_a_bar_are_in_the_order_of_their_values(interval, bounds):
    low, estimate, high = sorted(interval)
    minimum, maximum = sorted(bounds)
    svg = str(draw_interval_bar(Criterion("x", Interval(estimate, low, high), minimum, maximum)))
    (mark,) = find_marks(svg, "estimate")
    left, right = find_marks(svg, "bound")
    assert 0.0 <= left <= right <= 320.0 and 0.0 <= mark <= 320.0
    if estimate < minimum:
        assert mark <= left
    if estimate > maximum:
        assert mark >= right


@pytest.mark.parametrize(
    ("interval", "state"),
    [((0.1, 0.2), "yes"), ((2.0, 3.0), "no"), ((0.5, 1.5), "open"), ((math.nan, math.nan), "open")],
)
def test_a_bar_has_a_description(interval, state):
    estimate = 0.15 if math.isnan(interval[0]) else sum(interval) / 2
    svg = str(draw_interval_bar(Criterion("x", Interval(estimate, *interval), high=1.0)))
    assert f'class="estimate {state}"' in svg
    assert "expected: at most 1" in svg and 'role="img"' in svg
    assert ("interval " in svg) is not math.isnan(interval[0])


def test_without_values_there_is_no_bar():
    assert str(draw_interval_bar(Criterion("x", Interval(math.nan, math.nan, math.nan), 0.0, 1.0))) == ""
