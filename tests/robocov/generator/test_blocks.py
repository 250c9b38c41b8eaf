"""Generated blocks of a city, and the streets between them."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from robocov.generator import blocks
from robocov.generator.blocks import Edge, cut_cell, divide_into_cells, remove_streets
from robocov.generator.request import MapRequest


def build_polygon(cell):
    return shapely.Polygon([edge[:2] for edge in cell])


# GEOS computes wrong offsets for lengths below a micrometer.
LENGTHS = st.floats(0.0, 1.5).map(lambda length: round(length, 6))


@given(st.integers(0, 2**32), LENGTHS, LENGTHS)
def test_a_block_is_the_outline_of_its_cell_moved_inwards(seed, setback, widening):
    rng = np.random.default_rng(seed)
    outline = shapely.MultiPoint(rng.uniform(0, 10, (8, 2))).convex_hull
    points = np.asarray(shapely.orient_polygons(outline).exterior.coords)[:-1]
    cell = [Edge(x, y, setback, 0.5) for x, y in points.tolist()]
    expected = outline.buffer(-setback - 0.5 * widening, join_style="mitre", mitre_limit=1e6)
    block = remove_streets(cell, widening)
    area = build_polygon(block).area if len(block) > 2 else 0.0
    assert area == pytest.approx(expected.area, abs=1e-6)


@given(st.integers(0, 2**32), st.floats(0.0, 2.0 * np.pi))
def test_a_cut_divides_a_cell(seed, angle):
    rng = np.random.default_rng(seed)
    outline = (0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)
    cell = [Edge(*point, setback, 1.0) for setback, point in enumerate(outline)]
    normal = np.array([np.cos(angle), np.sin(angle)])
    origin = rng.uniform(0.5, 2.5, 2)
    halves = [cut_cell(cell, origin, sign * normal, 9.0, 2.0) for sign in (1, -1)]
    assert sum(build_polygon(half).area for half in halves) == pytest.approx(12.0)
    assert build_polygon(halves[0]).intersection(build_polygon(halves[1])).area < 1e-9
    for half in halves:
        edges = np.array(half)
        points = edges[:, :2]
        setbacks = edges[:, 2]
        along = np.roll(points, -1, axis=0) - points
        is_on_cut = np.abs((points - origin) @ normal) < 1e-9
        is_on_cut &= np.abs(along @ normal) < 1e-9
        assert is_on_cut.sum() == 1
        assert (setbacks[is_on_cut] == 9.0).all()
        # Every other edge keeps the setback of the edge on which it lies.
        for point, step, setback in zip(
            points[~is_on_cut], along[~is_on_cut], setbacks[~is_on_cut], strict=True
        ):
            x, y = point + step / 2.0
            assert [y, 4.0 - x, 3.0 - y, x][int(setback)] == pytest.approx(0.0, abs=1e-9)


@given(st.integers(0, 2**32), st.integers(2, 25))
def test_the_narrowest_streets_are_as_wide_as_the_gap(seed, count):
    request = MapRequest(count, 0.3, 0.5, 14.0, 11.0)
    cells = divide_into_cells(request, np.random.default_rng(seed))
    assume(cells is not None)
    assert len(cells) == count
    outlines = [remove_streets(cell, 0.0) for cell in cells]
    shapes = [build_polygon(outline) for outline in outlines if len(outline) > 2]
    assert all(first.distance(second) > 0.5 for first, second in combinations(shapes, 2))
    assert all(shape.distance(shapely.box(0, 0, 14, 11).exterior) > 0.5 for shape in shapes)


def test_streets_that_separate_more_blocks_are_wider():
    request = MapRequest(16, 0.3, 0.4, 20.0, 20.0)
    cells = divide_into_cells(request, np.random.default_rng(1))
    assert cells is not None
    shares = np.array([edge.widening_share for cell in cells for edge in cell])
    # Each cell has half of a street. The last streets and those at the boundary are the narrowest.
    assert shares.min() == pytest.approx(blocks._MIN_WIDENING_SHARE / 2)
    assert shares.max() == pytest.approx(0.5)
    assert len(np.unique(shares.round(6))) >= 4
