"""Cells that a map covers, compared with a point-by-point test, and rejected grids."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from scipy import ndimage
from shapely import MultiPolygon, Polygon

from robocov.environment import CircleObstacle, Environment, PolygonObstacle, UniformStart, WallObstacle
from robocov.errors import ParameterError
from robocov_app.formats import ReadOptions, Shaping, WriteOptions, export_map, import_map
from robocov_app.formats.geometry.cells import rasterize
from robocov_app.formats.geometry.cells.rasterize import (
    CellGrid,
    build_grid,
    describe_lost_passages,
    describe_unsupported,
    find_free_cells,
)

points = st.tuples(*[st.integers(-64, 448).map(lambda k: k / 64)] * 2)


@settings(deadline=None, max_examples=count_examples(200))
@given(
    st.lists(points, min_size=3, max_size=9), st.integers(11, 130).map(lambda k: k / 100), st.integers(1, 3)
)
def test_a_cell_is_covered_where_its_center_is(
    ring: list[tuple[float, float]], cell: float, finer: int
) -> None:
    shape = shapely.make_valid(Polygon(ring), method="structure", keep_collapsed=False)
    grid = CellGrid(7, 9, cell, (-0.3, -0.2))
    covered = grid.find_covered_cells(MultiPolygon(shapely.get_parts(shape).tolist()), finer)
    step = cell / finer
    x, y = np.meshgrid(-0.3 + (np.arange(9 * finer) + 0.5) * step, -0.2 + (np.arange(7 * finer) + 0.5) * step)
    near = shapely.dwithin(shape.boundary, shapely.points(x, y), 1e-9)
    np.testing.assert_array_equal(covered[~near], shapely.contains_xy(shape, x, y)[~near])


def test_rooms_that_share_a_wall_share_no_cell() -> None:
    # Centers of cells are on the common edge; each belongs to exactly one room.
    grid = CellGrid(4, 4, 1.0, (0.0, 0.0))
    left = shapely.box(0, 0, 1.5, 4)
    right = shapely.box(1.5, 0, 4, 4)
    both = grid.find_covered_cells(left).astype(int) + grid.find_covered_cells(right)
    assert both.tolist() == [[1] * 4] * 4
    slanted = Polygon([(0, 0), (4, 0), (4, 4)]), Polygon([(0, 0), (4, 4), (0, 4)])
    both = grid.find_covered_cells(slanted[0]).astype(int) + grid.find_covered_cells(slanted[1])
    assert both.tolist() == [[1] * 4] * 4


def build_room(**others: object) -> Environment:
    boundary = ((1.0, 2.0), (6.0, 2.0), (6.0, 5.0), (1.0, 5.0))
    return Environment("room", boundary, **others)  # type: ignore[arg-type]


def test_the_grid_has_a_cell_to_spare_on_each_side() -> None:
    grid = build_grid(build_room(), 0.25)
    assert (grid.rows, grid.columns, grid.cell, grid.origin) == (14, 22, 0.25, (0.75, 1.75))
    free = find_free_cells(build_room(), grid)
    assert describe_lost_passages(build_room(), grid, free) == ()
    assert free.sum() * 0.25**2 == 15
    assert not free[[0, -1]].any() and not free[:, [0, -1]].any()
    assert build_grid(build_room(), None).cell == 0.05
    # A side that is not a whole number of cells has one cell more.
    assert build_grid(build_room(), 0.7).columns == 8 + 2


def test_cells_that_are_too_small_or_too_large_are_rejected() -> None:
    with pytest.raises(ParameterError, match=r"cell: expected at most 64 million"):
        build_grid(build_room(), 1e-4)
    blocks = tuple(
        PolygonObstacle(((x, 2.0), (x + 0.4, 2.0), (x + 0.4, 5.0), (x, 5.0)))
        for x in (1.0, 1.5, 2.0, 2.5, 3.0)
    )
    with pytest.raises(ParameterError, match="cell: no cell of 20 m is free, expected a smaller size"):
        find_free_cells(build_room(obstacles=blocks), build_grid(build_room(obstacles=blocks), 20.0))


_places = st.tuples(st.floats(0.8, 6.2), st.floats(1.8, 5.2))
_thin = st.one_of(
    st.builds(
        WallObstacle, st.lists(_places, min_size=2, max_size=4, unique=True).map(tuple), st.floats(0.001, 0.2)
    ),
    st.builds(CircleObstacle, _places, st.floats(0.001, 0.2)),
)


@settings(max_examples=count_examples(80))
@given(st.lists(_thin, min_size=1, max_size=6), st.floats(0.04, 0.25))
def test_no_obstacle_vanishes_or_splits_and_no_rooms_merge(things: list[Any], cell: float) -> None:
    environment = build_room(obstacles=tuple(things))
    grid = build_grid(environment, cell)
    free = find_free_cells(environment, grid)
    low = np.array(grid.origin)
    boxes = [shapely.box(*(low + [c * cell, r * cell]), *(low + [(c + 1) * cell, (r + 1) * cell]))
             for r, c in np.argwhere(~free)]  # fmt: skip
    blocked = shapely.STRtree(boxes)
    solid = shapely.get_parts(shapely.box(*low, *low + 100).difference(environment.free))
    for part in solid:
        assert len(blocked.query(part, predicate="intersects"))
    # Blocked cells are connected across corners.
    assert ndimage.label(~free, np.ones((3, 3)))[1] <= len(solid)
    # Free cells are connected across sides only: each component belongs to one part of the free space.
    islands, count = ndimage.label(free)
    for k in range(1, count + 1):
        row, column = np.nonzero(islands == k)
        x, y = (np.column_stack([column, row]) + 0.5).T * cell + low[:, None]
        homes = [
            part for part in environment.free.geoms if shapely.dwithin(part, shapely.points(x, y), 1e-9).any()
        ]
        assert len(homes) == 1


def test_a_wall_thinner_than_a_cell_keeps_rooms_apart(tmp_path: Path) -> None:
    upright = build_room(obstacles=(WallObstacle(((3.01, 2.0), (3.01, 5.0)), 0.03),))
    slanted = build_room(obstacles=(WallObstacle(((1.0, 2.2), (6.0, 4.7)), 0.03),))
    for environment in (upright, slanted):
        for name in ("map.yaml", "map.map", "map.png", "scale.yaml", "raw.yaml"):
            mode = name.removesuffix(".yaml") if name in ("scale.yaml", "raw.yaml") else None
            report = export_map(environment, tmp_path / name, options=WriteOptions(cell=0.1, mode=mode))  # type: ignore[arg-type]
            assert report.warnings == ()
            cell = ReadOptions(cell=0.1) if name == "map.map" else ReadOptions()
            imported, _, _ = import_map(tmp_path / name, options=cell, shaping=Shaping(keep="all"))
            assert len(imported.free.geoms) == 2
            assert imported.free_area == pytest.approx(environment.free_area, rel=0.04)


def test_closed_gaps_are_reported_with_a_cell_that_keeps_them() -> None:
    wall = PolygonObstacle(((3.0, 2.0), (3.5, 2.0), (3.5, 4.93), (3.0, 4.93)), name="wall")
    environment = build_room(obstacles=(wall,), starts={"all": UniformStart()})

    def list_warnings(cell: float) -> tuple[str, ...]:
        grid = build_grid(environment, cell)
        return describe_lost_passages(environment, grid, find_free_cells(environment, grid))

    (warning,) = list_warnings(0.25)
    assert warning == (
        "gaps close: the free space has 2 separate parts instead of 1; cells of 0.1 m keep it (--cell 0.1)"
    )
    assert list_warnings(0.1) == ()
    assert describe_unsupported(environment) == ("starts: all", "names of obstacles")
    assert describe_unsupported(build_room()) == ()


def test_lost_rooms_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    walls = (WallObstacle(((1.0, 2.2), (6.0, 2.2)), 0.01), WallObstacle(((1.0, 2.35), (6.0, 2.35)), 0.01))
    environment = build_room(obstacles=walls)
    grid = build_grid(environment, 0.4)
    (warning,) = describe_lost_passages(environment, grid, find_free_cells(environment, grid))
    assert warning.startswith("2 separate parts of the free space are lost; cells of 0.05 m keep it")
    monkeypatch.setattr(rasterize, "_MAX_TRIED_CELLS", 1_000_000)
    hair = build_room(obstacles=(PolygonObstacle(((3.0, 2.0), (3.5, 2.0), (3.5, 4.9995), (3.0, 4.9995))),))
    grid = build_grid(hair, 0.4)
    (warning,) = describe_lost_passages(hair, grid, find_free_cells(hair, grid))
    assert warning.endswith("instead of 1; no grid of at most 1 million cells keeps it")
