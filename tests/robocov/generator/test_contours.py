"""Fields and their contours, against areas and shapes that are known."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.generator.contours import Field
from robocov.generator.request import Request

REQUEST = Request(9, 0.4, 0.6, 12.0, 9.0)


def mesh(function, side: float = 10.0, count: int = 101) -> Field:
    along = np.linspace(0.0, side, count)
    points = np.stack(np.meshgrid(along, along), axis=-1)
    return Field(points, function(points[..., 0], points[..., 1]))


def test_a_disc() -> None:
    field = mesh(lambda x, y: np.hypot(x - 5.0, y - 4.0))
    (disc,) = shapely.get_parts(field.below(2.0))
    assert disc.area == pytest.approx(4.0 * np.pi, rel=2e-3)
    assert disc.hausdorff_distance(shapely.Point(5, 4).buffer(2.0, quad_segs=64)) < 0.01


def test_rings_have_holes_and_what_is_in_a_hole_is_apart() -> None:
    field = mesh(lambda x, y: np.cos(np.hypot(x - 5.0, y - 5.0) * 3.0))
    # below zero from pi/6 to 3 pi/6, from 5 pi/6 to 7 pi/6, and from 9 pi/6 on
    parts = sorted(shapely.get_parts(field.below(0.0)), key=lambda part: part.area)
    rings = [part for part in parts if part.interiors]
    for ring, (low, high) in zip(rings, ((1, 3), (5, 7)), strict=False):
        assert len(ring.interiors) == 1
        assert ring.area == pytest.approx(np.pi * (high**2 - low**2) * (np.pi / 6.0) ** 2, rel=0.01)


def test_the_edge_of_the_mesh_is_above_every_level() -> None:
    field = mesh(lambda x, y: x * 0.0 - 5.0)
    (whole,) = shapely.get_parts(field.below(0.0))
    low_x, low_y, high_x, high_y = whole.bounds
    assert 0.0 < low_x < 0.1 and 9.9 < high_y < 10.0
    assert 0.0 < low_y < 0.1 and 9.9 < high_x < 10.0
    assert field.below(-6.0).is_empty


@settings(max_examples=30)
@given(st.integers(0, 2**32), st.floats(-1.0, 1.0))
def test_points_of_the_mesh_are_on_their_side(seed: int, level: float) -> None:
    field = Field.drawn(REQUEST, np.random.default_rng(seed))
    below = field.below(level)
    assert below.is_valid
    inner = field.points[1:-1, 1:-1].reshape(-1, 2)
    inside = shapely.contains_xy(below, inner[:, 0], inner[:, 1])
    np.testing.assert_array_equal(inside, field.values[1:-1, 1:-1].ravel() < level)


def test_a_field_has_mean_zero_and_variance_one_and_is_smooth() -> None:
    fields = [Field.drawn(REQUEST, np.random.default_rng(seed)) for seed in range(40)]
    values = np.stack([field.values for field in fields])
    assert abs(values.mean()) < 0.1
    assert values.var() == pytest.approx(1.0, abs=0.15)
    assert fields[0].points[-1, -1].tolist() == [12.0, 9.0]
    # the shortest waves are eight steps of the mesh long
    assert np.abs(np.diff(values, axis=2)).std() < 0.5
    low, high = fields[0].range
    assert low < -1.0 and high > 1.0


def test_raising_and_lowering() -> None:
    flat = mesh(lambda x, y: x * 0.0)
    raised = flat.raised(1.0, 3.0).values
    assert raised[0].tolist() == [3.0] * 101
    assert raised[50, 50] == pytest.approx(0.0, abs=1e-9)
    assert raised[50, 10] == pytest.approx(3.0 / np.e)
    lowered = flat.lowered((5.0, 2.0), 0.5, 2.0).values
    assert lowered[20, 50] == -2.0
    assert lowered[20, 55] == pytest.approx(-2.0 / np.e)
    assert lowered[90, 50] == pytest.approx(0.0, abs=1e-9)
