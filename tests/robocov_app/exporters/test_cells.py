"""Which cells a map covers, against a point-by-point test, and what a grid cannot be."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import MultiPolygon, Polygon

from robocov.environment import Environment, PolygonObstacle
from robocov.environment.starts import UniformStart
from robocov.errors import ParameterError
from robocov_app.exporters.cells import Grid, free_cells, grid_over, not_held

points = st.tuples(*[st.integers(-64, 448).map(lambda k: k / 64)] * 2)


@settings(deadline=None, max_examples=200)
@given(
    st.lists(points, min_size=3, max_size=9), st.integers(11, 130).map(lambda k: k / 100), st.integers(1, 3)
)
def test_a_cell_is_covered_where_its_centre_is(
    ring: list[tuple[float, float]], cell: float, finer: int
) -> None:
    shape = shapely.make_valid(Polygon(ring), method="structure", keep_collapsed=False)
    grid = Grid(7, 9, cell, (-0.3, -0.2))
    covered = grid.covered(MultiPolygon(shapely.get_parts(shape).tolist()), finer)
    step = cell / finer
    x, y = np.meshgrid(-0.3 + (np.arange(9 * finer) + 0.5) * step, -0.2 + (np.arange(7 * finer) + 0.5) * step)
    near = shapely.dwithin(shape.boundary, shapely.points(x, y), 1e-9)
    np.testing.assert_array_equal(covered[~near], shapely.contains_xy(shape, x, y)[~near])


def test_rooms_that_share_a_wall_share_no_cell() -> None:
    # centres lie on the common edge: each belongs to just one
    grid = Grid(4, 4, 1.0, (0.0, 0.0))
    left, right = shapely.box(0, 0, 1.5, 4), shapely.box(1.5, 0, 4, 4)
    assert (grid.covered(left).astype(int) + grid.covered(right)).tolist() == [[1] * 4] * 4
    slanted = Polygon([(0, 0), (4, 0), (4, 4)]), Polygon([(0, 0), (4, 4), (0, 4)])
    assert (grid.covered(slanted[0]).astype(int) + grid.covered(slanted[1])).tolist() == [[1] * 4] * 4


def room(**others: object) -> Environment:
    boundary = ((1.0, 2.0), (6.0, 2.0), (6.0, 5.0), (1.0, 5.0))
    return Environment("room", boundary, **others)  # type: ignore[arg-type]


def test_the_grid_has_a_cell_to_spare_on_each_side() -> None:
    grid = grid_over(room(), 0.25)
    assert (grid.rows, grid.columns, grid.cell, grid.origin) == (14, 22, 0.25, (0.75, 1.75))
    free, lost = free_cells(room(), grid)
    assert lost == ()
    assert free.sum() * 0.25**2 == 15
    assert not free[[0, -1]].any() and not free[:, [0, -1]].any()
    assert grid_over(room(), None).cell == 0.05
    # a side that is no whole number of cells has one more
    assert grid_over(room(), 0.7).columns == 8 + 2


def test_cells_that_are_too_small_or_too_large() -> None:
    with pytest.raises(
        ParameterError, match=r"cell: 0\.0001 m makes 50002 x 30002 cells, but at most 64 million"
    ):
        grid_over(room(), 1e-4)
    blocks = tuple(
        PolygonObstacle(((x, 2.0), (x + 0.4, 2.0), (x + 0.4, 5.0), (x, 5.0)))
        for x in (1.0, 1.5, 2.0, 2.5, 3.0)
    )
    with pytest.raises(ParameterError, match="cell: with 20 m no cell is free, but a smaller one was wanted"):
        free_cells(room(obstacles=blocks), grid_over(room(obstacles=blocks), 20.0))


def test_gaps_that_a_cell_closes_are_told() -> None:
    wall = PolygonObstacle(((3.0, 2.0), (3.5, 2.0), (3.5, 4.93), (3.0, 4.93)), name="wall")
    environment = room(obstacles=(wall,), starts={"all": UniformStart()})
    _, lost = free_cells(environment, grid_over(environment, 0.25))
    assert lost == ("the free space falls into 2 parts, not 1: a smaller cell keeps gaps open",)
    assert free_cells(environment, grid_over(environment, 0.02))[1] == ()
    assert not_held(environment) == ("starts: all", "names of obstacles")
    assert not_held(room()) == ()
