from __future__ import annotations

import numpy as np
import pytest
import shapely

from robocov.cost import CoverageCost
from robocov.cost.lattice import TILE_SIDE, TILES_PER_GROUP, build_lattice
from robocov.environment import CircleObstacle, Environment
from robocov.errors import ParameterError
from robocov.geodesic import Geodesics

SQUARE = ((2.0, 1.0), (6.0, 1.0), (6.0, 4.0), (2.0, 4.0))


def lattice(side, *obstacles):
    environment = Environment("test", SQUARE, obstacles)
    return environment, *build_lattice(Geodesics(environment), side)


def test_the_sites_are_the_free_cell_centres_row_by_row():
    environment, sites, _ = lattice(20, CircleObstacle((4.0, 2.0), 0.7))
    middles = (np.arange(20) + 0.5) / 20 * 4.0
    y, x = (part.ravel() for part in np.meshgrid(middles + 1.0, middles + 2.0, indexing="ij"))
    free = shapely.contains_xy(environment.free, x, y)
    np.testing.assert_allclose(sites.points, np.column_stack([x, y])[free], rtol=1e-15)
    np.testing.assert_array_equal(sites.cells, np.nonzero(free)[0])
    assert sites.spacing == 0.2


@pytest.mark.parametrize("side", [1, 3, 20, 37])
def test_tiles_are_squares_of_cells(side):
    _, sites, tiles = lattice(side)
    is_full = tiles.site >= 0
    number = tiles.site[is_full]
    places = np.column_stack([tiles.x[is_full], tiles.y[is_full]])
    row, column = np.divmod(sites.cells[number], side)
    np.testing.assert_array_equal(np.sort(number), np.arange(len(sites.cells)))
    # one tile, one square
    tile = np.nonzero(is_full)[0]
    square = row // TILE_SIDE * side + column // TILE_SIDE
    pairs = set(zip(tile.tolist(), square.tolist(), strict=True))
    assert len(pairs) == len(set(square.tolist())) == len(tiles.boxes)
    for boxes in (tiles.boxes[tile], tiles.group_boxes[tile // TILES_PER_GROUP]):
        assert (boxes[:, :2] <= places).all() and (places <= boxes[:, 2:]).all()


def test_a_lattice_without_a_free_cell_is_rejected():
    with pytest.raises(
        ParameterError, match="lattice: expected at least one site in the free space, got none with 1 cells"
    ):
        lattice(1, CircleObstacle((4.0, 3.0), 0.5))


def test_values_of_sites_are_arranged_as_an_image_of_the_lattice():
    cost = CoverageCost(lattice(4, CircleObstacle((4.5, 1.5), 0.4))[0], 4)
    picture = cost.to_grid(cost([[2.5, 1.5]]).owner)
    assert picture.tolist() == [[0, 0, -1, 0], [0] * 4, [0] * 4, [-1] * 4]
