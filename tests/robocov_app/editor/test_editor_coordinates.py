"""Typed positions, lengths, sizes and angles."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.errors import MapError
from robocov_app.editor.model.coordinates import (
    parse_angle,
    parse_length,
    parse_next_point,
    parse_point,
    parse_size,
)

LAST = (1.0, 2.0)


@pytest.mark.parametrize(
    ("text", "point"),
    [
        ("3.2 1.5", (3.2, 1.5)),
        ("3,2 1,5", (3.2, 1.5)),
        ("3,2; 1,5", (3.2, 1.5)),
        ("3.2,1.5", (3.2, 1.5)),
        ("3.2, 1.5", (3.2, 1.5)),
        ("3, 2", (3.0, 2.0)),
        ("3 ,2", (3.0, 2.0)),
        ("3;2", (3.0, 2.0)),
        ("  3   2 ", (3.0, 2.0)),
        ("3 -2", (3.0, -2.0)),
        ("-3 −2", (-3.0, -2.0)),
        ("120cm 80cm", (1.2, 0.8)),
        ("120 cm 80 cm", (1.2, 0.8)),
        ("120 cm; 0.8 m", (1.2, 0.8)),
        ("1e3 .5", (1000.0, 0.5)),
        ("3. 2.", (3.0, 2.0)),
        ("10' 6\"", (3.048, 0.1524)),
        ("2<90", (0.0, 2.0)),
        ("2∠180°", (-2.0, 0.0)),
        ("1,5 < 0", (1.5, 0.0)),
        ("+0.5 0", (1.5, 2.0)),
        ("+0,5 -1", (1.5, 1.0)),
        ("@0.5 0", (1.5, 2.0)),
        ("@-0.5 -0.5", (0.5, 1.5)),
        ("@2<45", (1.0 + math.sqrt(2.0), 2.0 + math.sqrt(2.0))),
        ("@ 50 cm < -90", (1.0, 1.5)),
        ("@1<0.5rad", (1.0 + math.cos(0.5), 2.0 + math.sin(0.5))),
    ],
)
def test_typed_positions_are_parsed(text, point):
    assert parse_point(text, last=LAST) == pytest.approx(point, abs=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "3",
        "3,2",
        "3 2 1",
        "a b",
        "3 x 2",
        "2<",
        "<45",
        "2<a",
        "@",
        "+",
        "1 2 <3",
        "nan 1",
        "inf 1",
        "3 m 2 k",
        "1;2;3",
        "1e999 0",
        "1e9 0",
        "٣ ٢ x",
    ],
)
def test_invalid_positions_raise_a_map_error(text):
    with pytest.raises(MapError) as caught:
        parse_point(text, last=LAST)
    assert "\n" not in str(caught.value)
    assert repr(text) in str(caught.value)


def test_relative_positions_require_a_previous_point():
    with pytest.raises(MapError, match="a relative position needs a previous point"):
        parse_point("@1 0")
    assert parse_point("1 0") == (1.0, 0.0)


@pytest.mark.parametrize(
    ("text", "now", "length"),
    [
        ("3.2", None, 3.2),
        ("3,2", None, 3.2),
        ("120cm", None, 1.2),
        ("1200 mm", None, 1.2),
        ("3m", None, 3.0),
        ("0.5 km", None, 500.0),
        ("4'", None, 1.2192),
        ("4 ft", None, 1.2192),
        ('6"', None, 0.1524),
        ("12'6\"", None, 3.81),
        ("12′6″", None, 3.81),
        ("-1", None, -1.0),
        ("+0.5", 2.0, 2.5),
        ("-50cm", 2.0, 1.5),
        ("*2", 2.0, 4.0),
        ("×2", 2.0, 4.0),
        ("/ 4", 2.0, 0.5),
        ("50%", 2.0, 1.0),
        ("1.1in", None, 0.02794),
    ],
)
def test_typed_lengths_are_parsed(text, now, length):
    assert parse_length(text, now=now) == length


@pytest.mark.parametrize(
    ("text", "now"),
    [
        ("", None),
        ("x", None),
        ("3 2", None),
        ("*2", None),
        ("50%", None),
        ("/0", 1.0),
        ("*", 1.0),
        ("%", 1.0),
        ("1e6", None),
        ("3 furlongs", None),
    ],
)
def test_invalid_lengths_raise_a_map_error(text, now):
    with pytest.raises(MapError, match=r"^'"):
        parse_length(text, now=now)


@pytest.mark.parametrize(
    ("text", "size"),
    [
        ("3 x 2", (3.0, 2.0)),
        ("3x2", (3.0, 2.0)),
        ("3×2", (3.0, 2.0)),
        ("3 * 2", (3.0, 2.0)),
        ("3 2", (3.0, 2.0)),
        ("120cm × 80cm", (1.2, 0.8)),
        ("3,5 x 2,5", (3.5, 2.5)),
        ("1.5", (1.5, 1.5)),
    ],
)
def test_typed_sizes_are_parsed(text, size):
    assert parse_size(text) == size


@pytest.mark.parametrize("text", ["", "0", "3 x 0", "-1 x 2", "3 x", "x", "3 x 2 x 1", "50%"])
def test_invalid_sizes_raise_a_map_error(text):
    with pytest.raises(MapError, match=r"^'"):
        parse_size(text)


def test_typed_angles_are_parsed():
    assert [parse_angle(text) for text in ("45", "45°", "-90 deg", "22,5", "3.141592653589793rad")] == [
        45.0,
        45.0,
        -90.0,
        22.5,
        180.0,
    ]
    with pytest.raises(MapError, match="degrees"):
        parse_angle("north")


def test_a_single_length_leads_toward_the_cursor():
    assert parse_next_point("2", LAST, (1.0, 9.0)) == (1.0, 4.0)
    assert parse_next_point("2", LAST, (4.0, 6.0)) == pytest.approx((2.2, 3.6))
    assert parse_next_point("50 cm", LAST, (0.0, 2.0)) == (0.5, 2.0)
    assert parse_next_point("<90", LAST, (4.0, 6.0)) == pytest.approx((1.0, 7.0))
    assert parse_next_point("3 4", LAST, (4.0, 6.0)) == (3.0, 4.0)
    assert parse_next_point("@1 0", LAST, None) == (2.0, 2.0)
    with pytest.raises(MapError, match="point the cursor"):
        parse_next_point("2", LAST, LAST)
    with pytest.raises(MapError, match="type x and y"):
        parse_next_point("2", None, (4.0, 6.0))


meters = st.integers(-(10**7), 10**7).map(lambda k: k / 1000)


@given(meters, meters, st.sampled_from([" ", "; ", " ;", ", "]), st.booleans())
def test_plainly_formatted_numbers_are_parsed(x, y, between, comma):
    text = f"{x:.3f}{between}{y:.3f}"
    if comma and between != ", ":
        text = text.replace(".", ",")
    assert parse_point(text) == (x, y)
    assert parse_point(f"@{text}", last=LAST) == pytest.approx((x + 1.0, y + 2.0), abs=1e-8)


@given(st.text(alphabet=st.sampled_from("0123456789 .,;<@+-*/%x'\"mcke°ÿ∠"), max_size=12))
def test_any_text_gives_a_number_or_a_map_error(text):
    for read in (
        lambda: parse_point(text, last=LAST),
        lambda: parse_next_point(text, LAST, (3.0, 3.0)),
        lambda: (parse_length(text, now=2.0),),
        lambda: parse_size(text),
        lambda: (parse_angle(text),),
    ):
        try:
            assert all(math.isfinite(value) for value in read())
        except MapError as error:
            assert str(error).strip() and "\n" not in str(error)
