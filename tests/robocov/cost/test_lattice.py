from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.cost import lattice
from robocov.cost.lattice import TILE, Lattice
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
    row, column = np.divmod(sites.sites.cells[sites.by_tile], side)
    np.testing.assert_array_equal(np.sort(sites.by_tile), np.arange(len(sites.sites.cells)))
    np.testing.assert_array_equal(sites.slot, row % TILE * TILE + column % TILE)
    assert np.diff(sites.tile, prepend=0).tolist() == np.clip(np.diff(sites.tile, prepend=0), 0, 1).tolist()
    assert sites.tile[-1] == sites.tiles - 1
    # one tile, one square
    square = row // TILE * side + column // TILE
    pairs = set(zip(sites.tile.tolist(), square.tolist(), strict=True))
    assert len(pairs) == len(set(square.tolist())) == sites.tiles


@pytest.mark.parametrize("pairs", [1, 1 << 18])
@settings(max_examples=60)
@given(st.integers(1, 40), st.integers(1, 30), st.integers(0, 2**32))
def test_within_finds_all_pairs_closer_than_the_bound(pairs, side, robots, seed):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lattice, "_PAIRS", pairs)
        _, sites = lattice_of(side)
        rng = np.random.default_rng(seed)
        place = np.nonzero(rng.random(len(sites.sites.cells)) < rng.choice([0.05, 0.5, 1.0]))[0]
        if not len(place):
            place = np.zeros(1, dtype=np.intp)
        x, y = rng.choice(sites.x, robots), rng.choice(sites.y, robots)
        bound2 = (rng.choice([0.0, 0.01, 0.1, 0.5, np.inf], len(place)) * 2.0**48) ** 2
        index, robot, dx, dy, distance2 = sites.within(place, bound2, x, y)
        site = sites.by_tile[place]
        table = (sites.x[site, None] - x) ** 2 + (sites.y[site, None] - y) ** 2
        expected = {(int(i), int(j)) for i, j in np.argwhere(table < bound2[:, None])}
        found = list(zip(index.tolist(), robot.tolist(), strict=True))
        assert len(found) == len(set(found))
        assert set(found) == expected
        np.testing.assert_array_equal(distance2, table[index, robot])
        np.testing.assert_array_equal(dx, sites.x[site[index]] - x[robot])
        np.testing.assert_array_equal(dy, sites.y[site[index]] - y[robot])


def test_a_lattice_without_a_free_cell_is_refused():
    with pytest.raises(ParameterError, match="none of its sites is free"):
        lattice_of(1, CircleObstacle((4.0, 3.0), 0.5))
