"""Conversion between meters and pixels, zoom and pan, and lengths of scale bars."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.look.lengths import format_scale_length, round_down
from robocov_app.render.camera import MAX_ZOOM_PX_PER_M, MIN_ZOOM_PX_PER_M, Camera

lengths = st.floats(1e-2, 1e4)
coordinates = st.floats(-1e4, 1e4)
cameras = st.builds(
    Camera,
    center=st.tuples(coordinates, coordinates),
    zoom=st.floats(1e-2, 1e3),
    view=st.tuples(st.floats(0, 500), st.floats(0, 500), st.floats(10, 4000), st.floats(10, 4000)),
)


@given(cameras, coordinates, coordinates)
def test_conversion_to_pixels_is_inverted(camera, x, y):
    point = np.array([x, y])
    assert camera.to_world(camera.to_pixels(point)) == pytest.approx(point, abs=1e-6)


@given(cameras)
def test_y_points_up_in_the_world_and_down_in_pixels(camera):
    (x_at_0, y_at_0), (x_at_1, y_at_1) = camera.to_pixels(np.array([[0.0, 0.0], [1.0, 1.0]]))
    assert x_at_1 > x_at_0
    assert y_at_1 < y_at_0
    assert x_at_1 - x_at_0 == pytest.approx(camera.zoom, rel=1e-6, abs=1e-6)


@given(cameras, st.floats(0.2, 5), st.floats(0, 4000), st.floats(0, 4000))
def test_zoom_keeps_the_position_under_the_pointer(camera, factor, x, y):
    point = camera.to_world(np.array([x, y]))
    zoomed = camera.zoom_at(factor, (x, y))
    assert zoomed.zoom == pytest.approx(camera.zoom * factor)
    assert zoomed.to_pixels(point) == pytest.approx([x, y], abs=1e-3)


@given(cameras, st.floats(-500, 500), st.floats(-500, 500))
def test_pan_moves_the_world_by_the_dragged_pixels(camera, dx, dy):
    point = np.array([1.0, 2.0])
    shift = camera.pan(dx, dy).to_pixels(point) - camera.to_pixels(point)
    assert shift == pytest.approx([dx, dy], abs=1e-3)


def test_zoom_has_limits():
    camera = Camera((0.0, 0.0), 1.0, (0, 0, 100, 100))
    assert camera.zoom_at(1e-30, (0, 0)).zoom == MIN_ZOOM_PX_PER_M
    assert camera.zoom_at(1e30, (0, 0)).zoom == MAX_ZOOM_PX_PER_M


@given(
    coordinates, coordinates, lengths, lengths, st.floats(100, 3000), st.floats(100, 3000), st.floats(0, 40)
)
def test_fit_centers_the_bounds_and_fills_one_dimension(x, y, width, height, view_width, view_height, margin):
    view_left = 13.0
    view_top = 7.0
    camera = Camera.fit((x, y, x + width, y + height), (view_left, view_top, view_width, view_height), margin)
    (left, bottom), (right, top) = camera.to_pixels(np.array([[x, y], [x + width, y + height]]))
    left_gap = left - view_left
    right_gap = view_left + view_width - right
    top_gap = top - view_top
    bottom_gap = view_top + view_height - bottom
    assert min(left_gap, right_gap, top_gap, bottom_gap) >= margin - 1e-3
    assert min(left_gap + right_gap, top_gap + bottom_gap) == pytest.approx(2 * margin, abs=1e-2)
    assert left_gap == pytest.approx(right_gap, abs=1e-2)
    assert top_gap == pytest.approx(bottom_gap, abs=1e-2)


@given(cameras)
def test_visible_bounds_are_those_of_the_view(camera):
    left, top, width, height = camera.view
    corners = camera.to_world(np.array([[left, top + height], [left + width, top]])).ravel()
    assert camera.compute_visible_bounds() == pytest.approx(tuple(corners), rel=1e-6, abs=1e-6)


@given(st.floats(1e-6, 1e6))
def test_round_lengths_are_1_2_or_5_times_a_power_of_ten(number):
    mantissa = float(f"{round_down(number):e}".split("e")[0])
    assert mantissa == pytest.approx(round(mantissa))
    assert round(mantissa) in (1, 2, 5)


@given(st.floats(1e-6, 1e6))
def test_rounding_down_gives_the_nearest_round_length(number):
    length = round_down(number)
    assert length <= number * (1 + 1e-6)
    assert number < 2.5001 * length


@pytest.mark.parametrize(
    ("meters", "text"), [(0.01, "1 cm"), (0.1, "0.1 m"), (20.0, "20 m"), (1000.0, "1 km"), (0.002, "0.2 cm")]
)
def test_lengths_of_scale_bars_are_formatted_with_their_unit(meters, text):
    assert format_scale_length(meters) == text
