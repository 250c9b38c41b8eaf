"""Coverage of what is in view: the geometry of views, and the laws that climb it, Visibility and Boosting."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.controllers import Boosting, Visibility
from robocov.controllers.boosting import Climb, Mode, undetected
from robocov.controllers.visibility import find_cells_in_view
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment, PolygonObstacle
from robocov.observation import Observations, compute_headings
from robocov.observation.neighbours import Neighbours
from robocov.observation.region import Region
from robocov.observation.scanned_view import View, compute_step_fractions, find_windows
from robocov.simulation import Simulation
from robocov.team import Team

ROOM = shapely.Polygon(
    [(0, 0), (10, 0), (10, 8), (0, 8)],
    [[(4, 0.0), (4.6, 0.0), (4.6, 5), (4, 5)], [(7, 5), (8, 5.5), (7.2, 6.5)]],
)
REGION = Region(np.array(ROOM.exterior.coords[:-1]))
HOT = Gaussians((Gaussian((7.0, 3.0), weight=4.0, sigma=1.5),), floor=0.5)


def scanned(place: np.ndarray, rays: int, reach: float) -> View:
    """A scan: how far along each ray the first wall is."""
    begin, end = (
        np.concatenate([np.array(ring.coords)[part] for ring in (ROOM.exterior, *ROOM.interiors)])
        for part in (slice(None, -1), slice(1, None))
    )
    along, across, to = compute_headings(rays)[:, None], end - begin, begin - place
    turn = along[..., 0] * across[:, 1] - along[..., 1] * across[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (to[:, 0] * across[:, 1] - to[:, 1] * across[:, 0]) / turn
        part = (to[:, 0] * along[..., 1] - to[:, 1] * along[..., 0]) / turn
    met = np.where((far > 0.0) & (part >= 0.0) & (part <= 1.0), far, np.inf).min(axis=1)
    return View(np.minimum(met, reach)[None], (met < reach)[None])


def seen_from(positions: np.ndarray, **more: object) -> Observations:
    n = len(positions)
    nothing = np.full((n, 2), np.nan)
    return Observations(positions, np.zeros((n, 2)), Neighbours(n), nothing, REGION, **more)  # type: ignore[arg-type]


def worth(place: np.ndarray, reach: float, decay: float | None, density: Gaussians | None) -> float:
    """What is in view, weighted by φ and by how likely it is detected, by a fine polar sum."""
    rays, rings = 10000, 30
    distances = scanned(place, rays, reach).distances[0]
    along = distances[:, None] * (np.arange(rings) + 0.5) / rings
    values = np.ones_like(along) if decay is None else np.exp(-decay * along)
    if density is not None:
        points = place + along[..., None] * compute_headings(rays)[:, None]
        values = values * density.evaluate(points.reshape(-1, 2)).reshape(along.shape)
    return float((values * along * distances[:, None]).sum() / rings * 2.0 * np.pi / rays)


@pytest.mark.parametrize("place", [(2.1, 4.3), (3.2, 6.1), (6.2, 6.4)])
@pytest.mark.parametrize("density", [None, HOT], ids=["uniform", "hot"])
def test_gradients_are_those_of_what_is_in_view(
    place: tuple[float, float], density: Gaussians | None
) -> None:
    """Arcs and windows against finite differences of the area, and of the probability of detection."""
    at, h, reach = np.array(place), 0.05, 3.0
    seen, view = seen_from(at[None], density=density), scanned(at, 1440, reach)
    for decay in (None, 0.5):
        slope = [
            (worth(at + step, reach, decay, density) - worth(at - step, reach, decay, density)) / (2.0 * h)
            for step in (np.array([h, 0.0]), np.array([0.0, h]))
        ]
        if decay is None:
            found = Visibility(jump=0.1).compute_gradient(seen, view, np.array([reach]))[0]
        else:
            added, gradient, _ = Boosting(jump=0.1, decay=decay).slopes(seen, view, np.array([reach]))
            assert added[0] == pytest.approx(worth(at, reach, decay, density), rel=0.01)
            found = gradient[0]
        np.testing.assert_allclose(found, slope, atol=0.06 * np.hypot(*slope) + 0.05)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32), n=st.integers(2, 8))
def test_who_sees_a_place_with_the_least_power_is_find_cells_in_view(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    positions, reach = rng.uniform((1, 1), (9, 7), size=(n, 2)), rng.uniform(1.0, 4.0, n)
    directions, walls = compute_headings(16), np.full((n, 16), np.inf)
    along = reach[:, None, None] * np.broadcast_to(rng.uniform(0.0, 1.0, 5), (n, 16, 5))
    robot, other, offset, _ = seen_from(positions).find_near_neighbours(np.inf)
    mine = find_cells_in_view(along, walls, directions, robot, other, -offset, reach)
    for i in range(n):
        places = positions[i] + along[i][..., None] * directions[:, None]
        power = ((places[..., None, :] - positions) ** 2).sum(axis=-1) - reach**2
        np.testing.assert_array_equal(mine[i], power.argmin(axis=-1) == i)
    # behind a wall nobody is a rival
    walls = np.full((n, 16), 1e-9)
    assert find_cells_in_view(along, walls, directions, robot, other, -offset, reach).all()


def test_a_wall_at_a_low_angle_is_no_window() -> None:
    """Along a straight wall the distance leaps from ray to ray, and nothing is hidden."""
    directions = compute_headings(180)
    with np.errstate(divide="ignore"):
        wall = np.where(directions[:, 1] < 0.0, -0.3 / directions[:, 1], np.inf)
    view = View(np.minimum(wall, 20.0)[None], (wall < 20.0)[None])
    assert len(find_windows(view, directions, np.array([20.0]), 0.3).robot) == 0
    # it ends at x = 1
    shorter = np.where(directions[:, 0] * wall > 1.0, np.inf, wall)
    view = View(np.minimum(shorter, 20.0)[None], (shorter < 20.0)[None])
    found = find_windows(view, directions, np.array([20.0]), 0.3)
    assert len(found.robot) == 1
    assert found.corner[0] == pytest.approx(np.hypot(1.0, 0.3), rel=0.1)
    assert found.across[0] @ [0.3, 1.0] > 0.0  # up, off the wall


def test_who_sees_all_of_its_cell_rests() -> None:
    square = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))
    team = Team.homogeneous(2, sensing_range=20.0)
    simulation = Simulation(square, Visibility(), [[2.0, 2.0], [3.0, 3.0]], team)
    for _ in range(60):
        simulation.step()
    np.testing.assert_array_equal(simulation.positions, [[2.0, 2.0], [3.0, 3.0]])


@pytest.mark.slow
@pytest.mark.parametrize("law", [Visibility(), Boosting()])
def test_robots_spread_until_their_views_are_apart_and_touch_nothing(law: Visibility | Boosting) -> None:
    table = PolygonObstacle(((4, 4), (5, 4), (5, 5), (4, 5)))
    hall = Environment("hall", ((0, 0), (12, 0), (12, 12), (0, 12)), (table,))
    starts = np.array([[2.0, 2.0], [2.5, 2.0], [2.0, 2.6]])
    simulation = Simulation(hall, law, starts, Team.homogeneous(3, sensing_range=2.0))
    record = simulation.run(20.0)
    apart = shapely.union_all([shapely.Point(*place).buffer(2.0) for place in record.positions[-1]])
    before = shapely.union_all([shapely.Point(*place).buffer(2.0) for place in starts])
    room = hall.free
    assert apart.intersection(room).area > 1.8 * before.intersection(room).area
    assert shapely.distance(room.boundary, shapely.points(record.positions)).min() > 0.1


def test_steps_are_halved_where_gradients_turn_back() -> None:
    one, back = np.array([[1.0, 0.0]]), np.array([[-1.0, 0.1]])
    assert compute_step_fractions(one, None, None) == 1.0
    assert compute_step_fractions(back, one, np.array([0.8])) == 0.4
    assert compute_step_fractions(one, one, np.array([0.5])) == pytest.approx(0.6)


def test_a_neighbour_behind_a_wall_detects_nothing_here() -> None:
    """What Φ counts: the product over those whose line to the place is in front of walls."""
    directions = compute_headings(72)
    along = np.full((1, 72, 1), 1.0)
    walls = np.full((1, 72), np.inf)
    pair = np.array([0]), np.array([1]), np.array([[2.0, 0.0]])
    reach = np.full(2, 3.0)
    free = undetected(along, walls, directions, *pair, reach, 0.5)
    distance = np.hypot(*(directions - [2.0, 0.0]).T)
    expected = np.where(distance <= 3.0, 1.0 - np.exp(-0.5 * distance), 1.0)
    np.testing.assert_allclose(free[0, :, 0], expected)
    walls[0, :5] = walls[0, -4:] = 1.5  # a wall between the two
    assert (undetected(along, walls, directions, *pair, reach, 0.5) == 1.0).all()


def test_boosts_push_to_where_nobody_detects() -> None:
    """Two robots side by side: either is boosted away from the other."""
    seen = seen_from(np.array([[4.0, 4.0], [4.8, 4.0]]))
    view = View(np.full((2, 72), 3.0), np.zeros((2, 72), dtype=bool))
    for word in ("phi", "p", "neighbours"):
        _, plain, boosted = Boosting(boost=word).slopes(seen, view, np.full(2, 3.0))
        assert not np.allclose(plain, boosted)
        assert boosted[0, 0] < 0.0 < boosted[1, 0]


def test_a_climb_is_boosted_from_rest_and_goes_back_when_it_adds_less() -> None:
    climb, here, time = Climb(np.zeros(2), 0.0), np.zeros(2), 0.0
    modes = []
    for _ in range(200):
        time += 0.2
        added = 5.0 - np.hypot(*here)
        climb = climb.after(here, time, added, 1, 4.0)
        modes.append(climb.mode)
        if climb.mode is Mode.BOOSTED:
            here = here + [0.1, 0.0]
        elif climb.mode is Mode.BACK:
            here = here + 0.5 * (climb.trail[-1] - here)
    order = [mode for k, mode in enumerate(modes) if k == 0 or mode is not modes[k - 1]]
    assert order == [Mode.GRADIENT, Mode.BOOSTED, Mode.GRADIENT, Mode.BACK, Mode.GRADIENT]
    assert np.hypot(*here) < 0.2
