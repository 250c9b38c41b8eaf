from __future__ import annotations

import numpy as np
import pytest
import shapely

from robocov.cost.lattice import TILE, Lattice
from robocov.cost.site_paths import GROUP
from robocov.environment import CircleObstacle, Environment
from robocov.errors import ParameterError
from robocov.geodesic.corners import Walls
from robocov.geodesic.orientation import Grid

SQUARE = ((2.0, 1.0), (6.0, 1.0), (6.0, 4.0), (2.0, 4.0))


def lattice_of(side, *obstacles):
    environment = Environment("test", SQUARE, obstacles)
    walls = Walls.of(environment.free, Grid.over(np.array([2.0, 1.0]), 4.0))
    return environment, Lattice(walls, 4.0, side)


def test_the_sites_are_the_free_cell_centres_row_by_row():
    environment, sites = lattice_of(20, CircleObstacle((4.0, 2.0), 0.7))
    middles = (np.arange(20) + 0.5) / 20 * 4.0
    y, x = (part.ravel() for part in np.meshgrid(middles + 1.0, middles + 2.0, indexing="ij"))
    free = shapely.contains_xy(environment.free, x, y)
    np.testing.assert_allclose(sites.sites.points, np.column_stack([x, y])[free], rtol=1e-15)
    np.testing.assert_array_equal(sites.sites.cells, np.nonzero(free)[0])
    assert sites.sites.spacing == 0.2


@pytest.mark.parametrize("side", [1, 3, 20, 37])
def test_tiles_are_squares_of_cells(side):
    _, sites = lattice_of(side)
    tiles = sites.tiles
    row, column = np.divmod(sites.sites.cells[tiles.site], side)
    np.testing.assert_array_equal(np.sort(tiles.site), np.arange(len(sites.sites.cells)))
    np.testing.assert_array_equal(tiles.slot, row % TILE * TILE + column % TILE)
    # one tile, one square
    count = len(tiles.first) - 1
    tile = np.repeat(np.arange(count), np.diff(tiles.first))
    square = row // TILE * side + column // TILE
    pairs = set(zip(tile.tolist(), square.tolist(), strict=True))
    assert len(pairs) == len(set(square.tolist())) == count
    for numbers, boxes in ((tile, tiles.boxes), (tile // GROUP, tiles.groups)):
        assert (boxes.low_x[numbers] <= tiles.x).all() and (tiles.x <= boxes.high_x[numbers]).all()
        assert (boxes.low_y[numbers] <= tiles.y).all() and (tiles.y <= boxes.high_y[numbers]).all()


def test_a_lattice_without_a_free_cell_is_refused():
    with pytest.raises(ParameterError, match="none of its sites is free"):
        lattice_of(1, CircleObstacle((4.0, 3.0), 0.5))
