import numpy as np
import pytest
import shapely
from drawn_run import HALL, ROOMS

from robocov.cost import CoverageCost
from robocov.environment import CircleObstacle, Environment, ObstaclePath, WallObstacle
from robocov_app.render.field import Field, FieldLattice, Fields

SEALED = Environment("sealed", ((0, 0), (10, 0), (10, 6), (0, 6)), (WallObstacle(((6, 0), (6, 6)), 0.3),))


def field_of(environment, n, seed, lattice=128):
    cost = CoverageCost(environment, lattice)
    hall = max(environment.free.geoms, key=lambda part: part.area)
    points = cost.points[shapely.contains_xy(hall, *cost.points.T)]
    positions = points[np.random.default_rng(seed).choice(len(points), n, replace=False)]
    return cost, Field(FieldLattice(cost.sites), cost(positions))


def pixels(environment, width=331):
    """Return the middles of pixels, x to the right and y down."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    step = (high_x - low_x) / width
    x = low_x + (np.arange(width) + 0.5) * step
    return x, np.arange(high_y - 0.5 * step, low_y, -step), step


def some_free(environment, x, y, count, seed):
    """Return rows and columns of pixels that robots can reach."""
    columns, rows = np.meshgrid(np.arange(len(x)), np.arange(len(y)))
    hall = max(environment.free.geoms, key=lambda part: part.area)
    free = shapely.contains_xy(hall, x[columns], y[rows])
    chosen = np.random.default_rng(seed).choice(free.sum(), count, replace=False)
    return rows[free][chosen], columns[free][chosen]


@pytest.mark.parametrize("environment", [ROOMS, HALL], ids=lambda map_: map_.name)
@pytest.mark.parametrize("seed", range(4))
def test_distances_are_the_exact_ones(environment, seed):
    cost, field = field_of(environment, 5, seed)
    x, y, _ = pixels(environment)
    row, column = some_free(environment, x, y, 150, seed)
    places = np.column_stack([x[column], y[row]])
    exact = cost.geodesics.distances(places, field.result.positions).min(axis=1)
    error = np.abs(field.distances(x, y)[row, column] - exact)
    # nearly everywhere to rounding; beside shadows of corners by far less than the lattice's step
    assert np.quantile(error, 0.9) < 1e-9
    assert error.max() < 0.3 * cost.spacing


@pytest.mark.parametrize("seed", range(4))
def test_the_owner_is_the_nearest_robot(seed):
    cost, field = field_of(ROOMS, 6, seed)
    x, y, step = pixels(ROOMS)
    owner, _ = field.cells(x, y, step)
    row, column = some_free(ROOMS, x, y, 150, seed)
    exact = cost.geodesics.distances(np.column_stack([x[column], y[row]]), field.result.positions)
    chosen = exact[np.arange(150), owner[row, column]]
    assert (chosen - exact.min(axis=1)).max() < 0.2 * cost.spacing


@pytest.mark.parametrize("seed", range(4))
def test_borders_are_where_two_robots_are_equally_near(seed):
    cost, field = field_of(ROOMS, 6, seed)
    x, y, step = pixels(ROOMS)
    borders = field.borders(x, y, 0.5 * step)
    free = shapely.contains_xy(ROOMS.free, x[borders.column], y[borders.row])
    chosen = np.nonzero(free)[0][::7]
    places = np.column_stack([x[borders.column[chosen]], y[borders.row[chosen]]])
    exact = np.sort(cost.geodesics.distances(places, field.result.positions), axis=1)
    # two distances grow apart by at most twice the way to the border
    assert len(chosen) > 30
    assert (exact[:, 1] - exact[:, 0]).max() < 2.0 * borders.gap[chosen].max() + 0.1 * cost.spacing


@pytest.mark.parametrize("seed", range(3))
def test_every_change_of_owner_in_the_open_has_a_border(seed):
    _, field = field_of(HALL, 7, seed)
    x, y, step = pixels(HALL)
    owner, borders = field.cells(x, y, 1.5 * step)
    marked = np.zeros(owner.shape, dtype=bool)
    marked[borders.row, borders.column] = True
    columns, rows = np.meshgrid(x, y)
    open_ = shapely.contains_xy(HALL.free.buffer(-0.2), columns, rows)
    changes = (owner[:, 1:] != owner[:, :-1]) & open_[:, 1:] & open_[:, :-1]
    assert changes.sum() > 50
    assert (marked[:, 1:] | marked[:, :-1])[changes].mean() > 0.99


def test_where_obstacles_move_a_field_is_of_its_time():
    path = ObstaclePath(((2.0, 1.0), (2.0, 5.0)), 1.0)
    crossed = Environment("crossed", SEALED.boundary, (CircleObstacle((2.0, 1.0), 0.8, path=path),))
    fields = Fields(CoverageCost(crossed, 64), 5.0)
    robots = np.array([[1.0, 3.0], [2.0, 5.0]])
    x, y = np.array([1.95, 2.05]), np.array([1.05, 0.95])
    assert fields.at(robots).result.owner.max() == 1
    # at four seconds it stands on the second robot, where the other cannot be either
    later = fields.at(robots, 4.0)
    assert set(later.result.owner.tolist()) == {0}
    exact = np.hypot(*(np.array([1.95, 1.05]) - robots[0]))
    assert later.distances(x, y)[0, 0] == pytest.approx(exact, abs=1e-9)
    assert fields.at(robots[1:], 4.0) is None


def test_no_distance_leaks_through_a_wall():
    cost = CoverageCost(SEALED, 64)
    field = Fields(cost, 5.0).at(np.array([[1.0, 1.0], [3.0, 5.0]]))
    x, y, _ = pixels(SEALED)
    distance, (owner, borders) = field.distances(x, y), field.cells(x, y, 0.1)
    closed = x > 6.15 + cost.spacing
    assert np.isinf(distance[:, closed]).all()
    assert (owner[:, closed] == -1).all()
    opened = x < 5.85 - cost.spacing
    assert np.isfinite(distance[:, opened]).all()
    assert not closed[borders.column].any()
    reached = field.result.distances[field.result.owner >= 0]
    assert field.largest == reached.max() < 6.0


def test_one_robot_has_no_borders():
    _, field = field_of(ROOMS, 1, 0)
    x, y, _ = pixels(ROOMS)
    owner, borders = field.cells(x, y, 10.0)
    assert len(borders.gap) == 0
    row, column = some_free(ROOMS, x, y, 100, 0)
    assert set(owner[row, column].tolist()) == {0}


@pytest.mark.parametrize("lattice", [2, 3, 5])
def test_coarse_lattices_and_single_pixels(lattice):
    _, field = field_of(HALL, 1, 0, lattice)
    for x, y in (([3.0], [3.0]), ([0.0, 14.0], [11.0, 0.0]), (np.linspace(-5, 20, 9), [2.0])):
        distance = field.distances(np.array(x, dtype=float), np.array(y, dtype=float))
        assert distance.shape == (len(y), len(x))
        assert np.isfinite(distance).all()
        assert field.cells(np.array(x, dtype=float), np.array(y, dtype=float), 1.0)[0].shape == distance.shape
