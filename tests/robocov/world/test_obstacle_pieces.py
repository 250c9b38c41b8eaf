"""Convex pieces of obstacles for pymunk."""

from __future__ import annotations

import numpy as np
import pymunk
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import Environment
from robocov.mapfile import list_bundled_maps, load_map
from robocov.world.obstacle_pieces import build_solid_pieces, split_into_convex_pieces


def is_convex(ring: np.ndarray) -> bool:
    edges = np.roll(ring, -1, axis=0) - ring
    next_edges = np.roll(edges, -1, axis=0)
    return bool((edges[:, 0] * next_edges[:, 1] - edges[:, 1] * next_edges[:, 0] > 0).all())


def compute_pymunk_area(ring: np.ndarray) -> float:
    """Return the area of the polygon that pymunk makes of a ring: that of its convex hull, m²."""
    return float(pymunk.Poly(None, ring.tolist()).area)


@pytest.mark.parametrize("name", sorted(list_bundled_maps()))
def test_pymunk_gets_exactly_the_space_that_is_not_free(name: str) -> None:
    environment = load_map(name).static
    pieces = build_solid_pieces(environment)
    frame = shapely.box(*shapely.union_all([shapely.Polygon(ring) for ring in pieces]).bounds)
    solid = shapely.union_all([shapely.Polygon(ring) for ring in pieces])
    expected = shapely.difference(frame, environment.free)
    assert sum(shapely.Polygon(piece).area for piece in pieces) == pytest.approx(expected.area, rel=1e-9)
    assert shapely.symmetric_difference(solid, expected).area < 1e-6
    # pymunk takes the convex hull of a polygon: the areas agree only if every piece is convex.
    assert sum(map(compute_pymunk_area, pieces)) == pytest.approx(expected.area, rel=1e-9)
    assert all(is_convex(ring) for ring in pieces)


def test_a_concave_polygon_is_not_filled() -> None:
    u_shape = shapely.Polygon([(0, 0), (6, 0), (6, 6), (4, 6), (4, 2), (2, 2), (2, 6), (0, 6)])
    pieces = split_into_convex_pieces(u_shape)
    assert compute_pymunk_area(np.array(u_shape.exterior.coords)[:-1]) == pytest.approx(36.0)
    assert sum(map(compute_pymunk_area, pieces)) == pytest.approx(u_shape.area) == pytest.approx(28.0)
    assert len(pieces) == 3


@settings(max_examples=count_examples(60))
@given(st.lists(st.tuples(st.floats(0, 10), st.floats(0, 10), st.floats(0.1, 3)), min_size=1, max_size=6))
def test_pieces_tile_unions_of_discs(discs: list[tuple[float, float, float]]) -> None:
    union = shapely.union_all(
        [shapely.Point(x, y).buffer(r, quad_segs=3) for x, y, r in discs], grid_size=1e-6
    )
    pieces = split_into_convex_pieces(union)
    assert sum(shapely.Polygon(piece).area for piece in pieces) == pytest.approx(union.area, rel=1e-9)
    assert sum(map(compute_pymunk_area, pieces)) == pytest.approx(union.area, rel=1e-6)


def test_everything_outside_a_non_convex_boundary_is_solid(cluttered: Environment) -> None:
    pieces = [shapely.Polygon(ring) for ring in build_solid_pieces(cluttered)]
    outside = shapely.Point(2.0, 8.0)  # inside the convex hull of the L-shaped hall
    assert any(piece.contains(outside) for piece in pieces)
    assert not any(piece.contains(shapely.Point(7.0, 7.0)) for piece in pieces)
