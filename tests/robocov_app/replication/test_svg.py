import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.figures.statistics import Interval
from robocov_app.replication.claims import Criterion, amount
from robocov_app.replication.pages import Strip, interval_bar, strips

gaps = st.dictionaries(
    st.text("abc<&", min_size=1, max_size=4), st.floats(-0.05, 3.0), min_size=1, max_size=9
)


def dots(svg: str) -> list[tuple[float, str]]:
    """Return where dots are, and what they say."""
    found = re.findall(r'<circle class="\w+" cx="([\d.]+)" cy="[\d.]+" r="3"><title>(.*?)</title>', svg)
    return [(float(x), words) for x, words in found]


@given(gaps)
def test_dots_stand_in_the_order_of_their_values(maps):
    svg = str(strips([Strip("one", True, maps)], 3.0))
    found = dots(svg)
    assert len(found) == len(maps)
    places = [x for x, _ in found]
    assert places == sorted(places)
    assert all(0.0 <= x <= 440.0 for x in places)
    for value, (_, words) in zip(sorted(maps.values()), found, strict=True):
        assert words.endswith(f": {amount(value, '%')}")


def test_the_same_value_stands_in_the_same_place_in_all_pictures():
    first = dots(str(strips([Strip("one", True, {"a": 0.1, "b": 0.2})], 2.0)))
    second = dots(str(strips([Strip("other", False, {"c": 0.1, "d": 2.0})], 2.0)))
    assert first[0][0] == second[0][0]
    # square roots: four times the gap is twice as far from 0
    zero = dots(str(strips([Strip("zero", False, {"c": 0.0, "d": 0.4})], 2.0)))
    assert abs((zero[1][0] - zero[0][0]) - 2.0 * (first[0][0] - zero[0][0])) <= 0.2


def test_it_says_in_words_what_it_shows_and_escapes_names():
    svg = str(strips([Strip("<b>", False, {"x&y": 0.5})], 1.0))
    assert 'role="img"' in svg and "&lt;b&gt;: 50 % to 50 %" in svg and "x&amp;y: 50 %" in svg
    assert "<b>" not in svg


def test_nothing_to_show_is_no_picture():
    assert str(strips([Strip("one", True, {})], 1.0)) == ""


numbers = st.floats(-5.0, 5.0)


def places(svg: str, kind: str) -> list[float]:
    """Return where marks of one kind stand, from left to right along the bar."""
    if kind == "estimate":
        return [float(x) for x in re.findall(r'class="estimate \w+" cx="([\d.]+)"', svg)]
    return [float(x) for x in re.findall(r'class="bound" d="M([\d.]+) ', svg)]


@given(numbers, numbers, numbers, numbers, numbers)
def test_a_bar_keeps_the_order_of_what_it_shows(a, b, c, d, e):
    low, estimate, high = sorted((a, b, c))
    least, most = sorted((d, e))
    svg = str(interval_bar(Criterion("x", Interval(estimate, low, high), least, most)))
    (mark,) = places(svg, "estimate")
    left, right = places(svg, "bound")
    assert 0.0 <= left <= right <= 320.0 and 0.0 <= mark <= 320.0
    if estimate < least:
        assert mark <= left
    if estimate > most:
        assert mark >= right


@pytest.mark.parametrize(
    ("interval", "state"),
    [((0.1, 0.2), "yes"), ((2.0, 3.0), "no"), ((0.5, 1.5), "open"), ((math.nan, math.nan), "open")],
)
def test_a_bar_says_in_words_what_it_shows(interval, state):
    estimate = 0.15 if math.isnan(interval[0]) else sum(interval) / 2
    svg = str(interval_bar(Criterion("x", Interval(estimate, *interval), high=1.0)))
    assert f'class="estimate {state}"' in svg
    assert "wanted: at most 1" in svg and 'role="img"' in svg
    assert ("interval " in svg) is not math.isnan(interval[0])


def test_nothing_to_show_is_no_bar():
    assert str(interval_bar(Criterion("x", Interval(math.nan, math.nan, math.nan), 0.0, 1.0))) == ""
