"""The background image: its position, scale and level."""

import math
from dataclasses import replace

import pytest
from drawn_sketches import backgrounds
from hypothesis import given
from hypothesis import strategies as st

from robocov.errors import MapError
from robocov_app.editor.model.background import (
    Background,
    create_background,
    level_background,
    scale_to_length,
)
from robocov_app.toolkit.tools.geometry import compute_cos_sin

PLAN = Background("plan.png", (400, 300), 0.05, (1.0, 2.0))


def find_pixel(background: Background, position):
    dx = position[0] - background.corner[0]
    dy = position[1] - background.corner[1]
    cos, sin = compute_cos_sin(background.rotation_deg)
    x = cos * dx + sin * dy
    y = cos * dy - sin * dx
    return x / background.scale, background.pixels[1] - y / background.scale


@given(backgrounds, st.floats(-100, 5000), st.floats(-100, 5000))
def test_pixels_and_positions_correspond(background, x, y):
    position = background.to_world((x, y))
    size = max(1.0, *map(abs, background.corner), *map(abs, position)) / background.scale
    assert find_pixel(background, position) == pytest.approx((x, y), abs=1e-9 * max(size, 1.0))


def test_pixels_count_downwards_from_the_upper_left_corner():
    assert PLAN.to_world((0, 300)) == (1.0, 2.0)
    assert PLAN.to_world((400, 0)) == (21.0, 17.0)
    assert PLAN.corners == ((1.0, 2.0), (21.0, 2.0), (21.0, 17.0), (1.0, 17.0))
    upright = replace(PLAN, rotation_deg=90.0)
    assert upright.to_world((400, 300)) == pytest.approx((1.0, 22.0))


@given(backgrounds)
def test_a_background_survives_a_document(background):
    assert Background.from_document(background.to_document()) == background


@pytest.mark.parametrize(
    "change",
    [
        {"path": ""},
        {"path": 3},
        {"pixels": [0, 10]},
        {"pixels": [1e3, 10.5]},
        {"pixels": [10]},
        {"pixels": [100_000, 100_000]},
        {"scale": 0},
        {"scale": "1"},
        {"corner": [1, None]},
        {"opacity": 1.5},
        {"shown": 1},
        {"turn": math.nan},
        {"more": 1},
    ],
)
def test_invalid_documents_give_no_background(change):
    assert Background.from_document({**PLAN.to_document(), **change}) is None
    assert Background.from_document([]) is None


def test_a_new_background_has_the_given_width():
    background = create_background("plan.png", (400, 300), 10.0)
    assert background.scale == 0.025
    assert background.corners[2] == pytest.approx((10.0, 7.5))
    with pytest.raises(MapError, match="million pixels"):
        create_background("plan.png", (100_000, 1_000))
    with pytest.raises(MapError, match="0 x 5 pixels"):
        create_background("plan.png", (0, 5))


places = st.tuples(st.floats(-20, 20), st.floats(-20, 20))


@given(backgrounds, st.tuples(st.integers(0, 99), st.integers(0, 99)), st.sampled_from([0.1, 2.5, 40.0]))
def test_scaling_gives_two_points_the_given_distance(background, offset, meters):
    background = replace(background, corner=(3.0, -2.0), scale=0.02)
    a = background.to_world((0, 0))
    b = background.to_world((offset[0] + 5, offset[1]))
    pixel_a = find_pixel(background, a)
    pixel_b = find_pixel(background, b)
    scaled = scale_to_length(background, a, b, meters)
    assert math.dist(scaled.to_world(pixel_a), scaled.to_world(pixel_b)) == pytest.approx(meters)
    assert scaled.to_world(pixel_a) == pytest.approx(a, abs=1e-6)
    assert scaled.rotation_deg == background.rotation_deg


def test_impossible_scales_raise_a_map_error():
    for a, b, meters, words in [
        ((1.0, 1.0), (1.01, 1.0), 3.0, "farther apart"),
        ((1.0, 1.0), (5.0, 1.0), 0.0, "above 0 m"),
        ((1.0, 1.0), (5.0, 1.0), math.inf, "above 0 m"),
        ((1.0, 1.0), (5.0, 1.0), 1e9, "is 1e\\+09 m right"),
    ]:
        with pytest.raises(MapError, match=words):
            scale_to_length(PLAN, a, b, meters)


@given(backgrounds, st.tuples(st.integers(10, 99), st.integers(-99, 99)))
def test_leveling_makes_two_points_horizontal_or_vertical(background, offset):
    background = replace(background, corner=(3.0, -2.0), scale=0.02)
    a = background.to_world((0, 0))
    b = background.to_world(offset)
    level = level_background(background, a, b)
    start = level.to_world((0, 0))
    end = level.to_world(offset)
    assert start == pytest.approx(a, abs=1e-6)
    assert min(abs(end[0] - a[0]), abs(end[1] - a[1])) < 1e-6
    assert math.dist(start, end) == pytest.approx(math.dist(a, b))
    assert abs(math.remainder(level.rotation_deg - background.rotation_deg, 360.0)) <= 45.0 + 1e-6
    assert -180.0 <= level.rotation_deg <= 180.0
    with pytest.raises(MapError, match="farther apart"):
        level_background(background, a, a)
