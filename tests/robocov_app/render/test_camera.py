import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.look.lengths import format_scale_length, round_down
from robocov_app.render.camera import MAX_ZOOM_PX_PER_M, MIN_ZOOM_PX_PER_M, Camera

lengths = st.floats(1e-2, 1e4)
places = st.floats(-1e4, 1e4)
cameras = st.builds(
    Camera,
    center=st.tuples(places, places),
    zoom=st.floats(1e-2, 1e3),
    view=st.tuples(st.floats(0, 500), st.floats(0, 500), st.floats(10, 4000), st.floats(10, 4000)),
)


@given(cameras, places, places)
def test_conversion_to_pixels_is_inverted(camera, x, y):
    point = np.array([x, y])
    assert camera.to_world(camera.to_pixels(point)) == pytest.approx(point, abs=1e-6)


@given(cameras)
def test_y_points_up_in_the_world_and_down_in_pixels(camera):
    low, high = camera.to_pixels(np.array([[0.0, 0.0], [1.0, 1.0]]))
    assert high[0] > low[0] and high[1] < low[1]
    assert high[0] - low[0] == pytest.approx(camera.zoom, rel=1e-6, abs=1e-6)


@given(cameras, st.floats(0.2, 5), st.floats(0, 4000), st.floats(0, 4000))
def test_zoom_keeps_the_position_under_the_pointer(camera, factor, x, y):
    under = camera.to_world(np.array([x, y]))
    zoomed = camera.zoom_at(factor, (x, y))
    assert zoomed.zoom == pytest.approx(camera.zoom * factor)
    assert zoomed.to_pixels(under) == pytest.approx([x, y], abs=1e-3)


@given(cameras, st.floats(-500, 500), st.floats(-500, 500))
def test_pan_moves_the_world_by_the_dragged_pixels(camera, dx, dy):
    point = np.array([1.0, 2.0])
    moved = camera.pan(dx, dy).to_pixels(point) - camera.to_pixels(point)
    assert moved == pytest.approx([dx, dy], abs=1e-3)


def test_zoom_has_limits():
    camera = Camera((0.0, 0.0), 1.0, (0, 0, 100, 100))
    assert camera.zoom_at(1e-30, (0, 0)).zoom == MIN_ZOOM_PX_PER_M
    assert camera.zoom_at(1e30, (0, 0)).zoom == MAX_ZOOM_PX_PER_M


@given(places, places, lengths, lengths, st.floats(100, 3000), st.floats(100, 3000), st.floats(0, 40))
def test_fit_shows_all_and_touches_two_sides(x, y, width, height, view_width, view_height, margin):
    view = (13.0, 7.0, view_width, view_height)
    camera = Camera.fit((x, y, x + width, y + height), view, margin)
    (left, bottom), (right, top) = camera.to_pixels(np.array([[x, y], [x + width, y + height]]))
    gaps = np.array([left - 13.0, 13.0 + view_width - right, top - 7.0, 7.0 + view_height - bottom])
    assert (gaps >= margin - 1e-3).all()
    assert min(gaps[0] + gaps[1], gaps[2] + gaps[3]) == pytest.approx(2 * margin, abs=1e-2)
    assert gaps[0] == pytest.approx(gaps[1], abs=1e-2)
    assert gaps[2] == pytest.approx(gaps[3], abs=1e-2)


@given(cameras)
def test_visible_is_the_view(camera):
    left, top, width, height = camera.view
    corners = camera.to_world(np.array([[left, top + height], [left + width, top]])).ravel()
    assert camera.compute_visible_bounds() == pytest.approx(tuple(corners), rel=1e-6, abs=1e-6)


@given(st.floats(1e-6, 1e6))
def test_round_length_is_the_largest_round_one(limit):
    length = round_down(limit)
    mantissa = float(f"{length:e}".split("e")[0])
    assert mantissa == pytest.approx(round(mantissa)) and round(mantissa) in (1, 2, 5)
    assert length <= limit * (1 + 1e-6) < 2.5001 * length * (1 + 1e-6)


@pytest.mark.parametrize(
    ("meters", "text"), [(0.01, "1 cm"), (0.1, "0.1 m"), (20.0, "20 m"), (1000.0, "1 km"), (0.002, "0.2 cm")]
)
def test_lengths_of_scale_bars(meters, text):
    assert format_scale_length(meters) == text
