import re

from hypothesis import given
from hypothesis import strategies as st

from robocov_app.replication.strips import Strip, strips
from robocov_app.replication.verdicts import amount

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
