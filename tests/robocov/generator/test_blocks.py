from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from robocov.generator import blocks
from robocov.generator.blocks import Edge, cut_cell, divide_into_cells, remove_streets
from robocov.generator.request import Request


def polygon(cell):
    return shapely.Polygon([edge[:2] for edge in cell])


# GEOS computes wrong offsets for lengths below a micrometer.
LENGTHS = st.floats(0.0, 1.5).map(lambda length: round(length, 6))


@given(st.integers(0, 2**32), LENGTHS, LENGTHS)
def test_a_cell_without_its_streets_is_its_outline_moved_inwards(seed, setback, wider):
    rng = np.random.default_rng(seed)
    outline = shapely.MultiPoint(rng.uniform(0, 10, (8, 2))).convex_hull
    points = np.asarray(shapely.orient_polygons(outline).exterior.coords)[:-1]
    cell = [Edge(x, y, setback, 0.5) for x, y in points.tolist()]
    expected = outline.buffer(-setback - 0.5 * wider, join_style="mitre", mitre_limit=1e6)
    block = remove_streets(cell, wider)
    area = polygon(block).area if len(block) > 2 else 0.0
    assert area == pytest.approx(expected.area, abs=1e-6)


@given(st.integers(0, 2**32), st.floats(0.0, 2.0 * np.pi))
def test_a_cut_divides_a_cell(seed, angle):
    rng = np.random.default_rng(seed)
    outline = (0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)
    cell = [Edge(*point, setback, 1.0) for setback, point in enumerate(outline)]
    normal, origin = np.array([np.cos(angle), np.sin(angle)]), rng.uniform(0.5, 2.5, 2)
    halves = [cut_cell(cell, origin, sign * normal, 9.0, 2.0) for sign in (1, -1)]
    assert sum(polygon(half).area for half in halves) == pytest.approx(12.0)
    assert polygon(halves[0]).intersection(polygon(halves[1])).area < 1e-9
    for half in halves:
        points, setbacks = np.array(half)[:, :2], np.array(half)[:, 2]
        along = np.roll(points, -1, axis=0) - points
        on_cut = np.abs((points - origin) @ normal) < 1e-9
        on_cut &= np.abs(along @ normal) < 1e-9
        assert (setbacks[on_cut] == 9.0).all() and on_cut.sum() == 1
        # Every other edge keeps the setback of the edge on which it lies.
        for point, step, setback in zip(points[~on_cut], along[~on_cut], setbacks[~on_cut], strict=True):
            x, y = point + step / 2.0
            assert [y, 4.0 - x, 3.0 - y, x][int(setback)] == pytest.approx(0.0, abs=1e-9)


@given(st.integers(0, 2**32), st.integers(2, 25))
def test_the_narrowest_streets_are_as_wide_as_the_gap(seed, count):
    request = Request(count, 0.3, 0.5, 14.0, 11.0)
    cells = divide_into_cells(request, np.random.default_rng(seed))
    assume(cells is not None)
    assert len(cells) == count
    parts = [remove_streets(cell, 0.0) for cell in cells]
    shapes = [polygon(part) for part in parts if len(part) > 2]
    assert all(one.distance(other) > 0.5 for one, other in combinations(shapes, 2))
    assert all(shape.distance(shapely.box(0, 0, 14, 11).exterior) > 0.5 for shape in shapes)


def test_streets_that_separate_more_blocks_are_wider():
    request = Request(16, 0.3, 0.4, 20.0, 20.0)
    cells = divide_into_cells(request, np.random.default_rng(1))
    assert cells is not None
    shares = np.array([edge.widening_share for cell in cells for edge in cell])
    # Each cell has half of a street: the last ones and the boundary's are the narrowest.
    assert shares.min() == pytest.approx(blocks._MIN_WIDENING_SHARE / 2)
    assert shares.max() == pytest.approx(0.5)
    assert len(np.unique(shares.round(6))) >= 4
