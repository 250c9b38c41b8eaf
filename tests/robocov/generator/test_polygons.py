"""Generated polygons: convex, L-shaped and U-shaped ones."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from robocov.generator.polygons import sample_convex_polygon, sample_l_shape, sample_u_shape

SEEDS = st.integers(0, 2**32)
AREAS = st.floats(0.05, 20.0)


def build_shape(outline, area):
    """Return the polygon of a centered outline after checking its area."""
    shape = shapely.Polygon(outline)
    assert shape.is_valid
    assert shape.area == pytest.approx(area)
    np.testing.assert_allclose(outline.min(axis=0), -outline.max(axis=0), atol=1e-9)
    return shape


@given(SEEDS, AREAS)
def test_convex_polygons_are_convex_and_compact(seed, area):
    outline = sample_convex_polygon(np.random.default_rng(seed), area)
    shape = build_shape(outline, area)
    assert 3 <= len(outline) <= 7
    assert shape.convex_hull.area == pytest.approx(area)
    assert 4.0 * np.pi * area / shape.length**2 > 0.4


@given(SEEDS, AREAS)
def test_an_l_shape_has_right_angles_and_one_reflex_corner(seed, area):
    outline = sample_l_shape(np.random.default_rng(seed), area)
    build_shape(outline, area)
    before = outline - np.roll(outline, 1, axis=0)
    after = np.roll(outline, -1, axis=0) - outline
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    sine = cross / np.hypot(*before.T) / np.hypot(*after.T)
    np.testing.assert_allclose(np.sort(sine), [-1, 1, 1, 1, 1, 1], atol=1e-9)


@given(SEEDS, AREAS, st.floats(0.1, 2.0))
def test_a_u_shape_has_the_requested_opening(seed, area, opening):
    outline = sample_u_shape(np.random.default_rng(seed), area, opening)
    if outline is None:
        # Only a wide opening does not fit in a shape of this area.
        assert opening > 0.5 * np.sqrt(area)
        return
    shape = build_shape(outline, area)
    # A morphological closing by a little less than the opening does not change the shape.
    dilated = shape.buffer(opening / 2 - 1e-6, join_style="mitre")
    closed = dilated.buffer(-opening / 2 + 1e-6, join_style="mitre")
    assert closed.area == pytest.approx(area, rel=1e-6)
    assert shape.convex_hull.area > 1.2 * area
