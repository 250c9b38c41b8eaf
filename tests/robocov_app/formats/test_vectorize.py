"""Outlines of cells, compared with the union of their squares and with the labels of scipy."""

from unittest import mock

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from property_examples import count_examples
from scipy import ndimage
from shapely import MultiPolygon, Polygon

from robocov.errors import MapError
from robocov_app.formats.files import limits
from robocov_app.formats.geometry.cells.vectorize import NECK, trace_outline

grids = arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, max_side=9), elements=st.booleans())


def find_diagonal_corners(free: np.ndarray) -> list[tuple[int, int]]:
    """Return the corners (x, y) at which two cells meet that are as free as each other, and no more."""
    corners = []
    rows, columns = free.shape
    for y in range(1, rows):
        for x in range(1, columns):
            a = free[y - 1, x - 1]
            b = free[y - 1, x]
            c = free[y, x - 1]
            d = free[y, x]
            if a == d and b == c and a != b:
                corners.append((x, y))
    return corners


def unite_cells(free: np.ndarray) -> shapely.Geometry:
    """Return the union of the cells' squares, less the necks."""
    cells = [shapely.box(x, y, x + 1, y + 1) for y, x in zip(*free.nonzero(), strict=True)]
    necks = [
        Polygon([(x - NECK, y), (x, y - NECK), (x + NECK, y), (x, y + NECK)])
        for x, y in find_diagonal_corners(free)
    ]
    return shapely.union_all(cells) - shapely.union_all(necks)


@settings(deadline=None, max_examples=count_examples(200))
@given(grids, st.integers(1, 10))
def test_the_outline_is_the_union_of_the_cells(free: np.ndarray, strip: int) -> None:
    with mock.patch("robocov_app.formats.geometry.cells.vectorize._STRIP", strip):
        outline = trace_outline(free, "grid")
    assert outline.is_valid
    assert shapely.equals(outline, unite_cells(free)) if free.any() else outline.is_empty
    assert outline.area == free.sum() - len(find_diagonal_corners(free)) * NECK**2
    assert len(outline.geoms) == ndimage.label(free)[1]
    for part in outline.geoms:
        assert part.exterior.is_ccw
        assert not any(hole.is_ccw for hole in part.interiors)


@settings(deadline=None, max_examples=count_examples(100))
@given(grids)
def test_rings_are_apart_and_every_vertex_is_a_corner(free: np.ndarray) -> None:
    rings = shapely.get_rings(list(trace_outline(free, "grid").geoms))
    for k, ring in enumerate(rings):
        assert not shapely.intersects(ring, rings[:k]).any()
        points = shapely.get_coordinates(ring)[:-1]
        ahead = np.roll(points, -1, axis=0) - points
        behind = points - np.roll(points, 1, axis=0)
        assert (ahead[:, 0] * behind[:, 1] != ahead[:, 1] * behind[:, 0]).all()


def test_diagonal_free_cells_are_separate_and_obstacles_connected() -> None:
    assert len(trace_outline(np.array([[True, False], [False, True]]), "grid").geoms) == 2
    walls = np.ones((6, 6), dtype=bool)
    walls[[1, 2, 3, 4], [1, 2, 3, 4]] = False
    (part,) = trace_outline(walls, "grid").geoms
    assert len(part.interiors) == 1, "a diagonal wall of single cells is one obstacle"
    assert Polygon(part.interiors[0]).area == pytest.approx(4 + 3 * NECK**2)


def test_empty_and_full_grids_are_outlined() -> None:
    assert trace_outline(np.zeros((3, 4), dtype=bool), "grid") == MultiPolygon()
    assert shapely.equals(trace_outline(np.ones((3, 4), dtype=bool), "grid"), shapely.box(0, 0, 4, 3))


def test_a_grid_that_is_too_rough_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    chess = np.indices((20, 20)).sum(axis=0) % 2 == 0
    monkeypatch.setattr(limits, "MAX_VERTICES", 200)
    with pytest.raises(MapError, match=r"^grid: expected at most"):
        trace_outline(chess, "grid")
