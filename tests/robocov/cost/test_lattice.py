"""The lattice of sites, and its tiles."""

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


def build_environment(*obstacles):
    return Environment("test", SQUARE, obstacles)


def test_the_sites_are_the_free_cell_centers_row_by_row():
    environment = build_environment(CircleObstacle((4.0, 2.0), 0.7))
    sites, _ = build_lattice(Geodesics(environment), 20)
    centers = (np.arange(20) + 0.5) / 20 * 4.0
    points = np.array([(x + 2.0, y + 1.0) for y in centers for x in centers])
    is_free = shapely.contains_xy(environment.free, points[:, 0], points[:, 1])
    np.testing.assert_allclose(sites.points, points[is_free], rtol=1e-15)
    np.testing.assert_array_equal(sites.cells, np.flatnonzero(is_free))
    assert sites.spacing == 0.2


@pytest.mark.parametrize("side", [1, 3, 20, 37])
def test_tiles_are_squares_of_cells(side):
    sites, tiles = build_lattice(Geodesics(build_environment()), side)
    tile, slot = np.nonzero(tiles.sites >= 0)
    number = tiles.sites[tile, slot]
    points = np.column_stack([tiles.x[tile, slot], tiles.y[tile, slot]])
    np.testing.assert_array_equal(np.sort(number), np.arange(len(sites.cells)))
    # Each tile contains the sites of one square, and each square belongs to one tile.
    row, column = np.divmod(sites.cells[number], side)
    square = row // TILE_SIDE * side + column // TILE_SIDE
    pairs = set(zip(tile.tolist(), square.tolist(), strict=True))
    assert len(pairs) == len(set(square.tolist())) == len(tiles.boxes)
    for boxes in (tiles.boxes[tile], tiles.group_boxes[tile // TILES_PER_GROUP]):
        assert (boxes[:, :2] <= points).all()
        assert (points <= boxes[:, 2:]).all()


def test_a_lattice_without_a_free_cell_is_rejected():
    with pytest.raises(
        ParameterError, match="lattice: expected at least one site in the free space, got none with 1 cells"
    ):
        build_lattice(Geodesics(build_environment(CircleObstacle((4.0, 3.0), 0.5))), 1)


def test_a_map_without_free_space_is_rejected():
    with pytest.raises(ParameterError, match="lattice: expected at least one site in the free space"):
        CoverageCost(build_environment(CircleObstacle((4.0, 2.5), 5.0)), 8)


def test_values_of_sites_are_arranged_as_an_image_of_the_lattice():
    cost = CoverageCost(build_environment(CircleObstacle((4.5, 1.5), 0.4)), 4)
    image = cost.to_grid(cost([[2.5, 1.5]]).owners)
    assert image.tolist() == [[0, 0, -1, 0], [0] * 4, [0] * 4, [-1] * 4]
