"""Views, and the controllers Visibility and Boosting that maximize the visible area."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.conditions import Conditions, Join
from robocov.controllers import Boosting, Visibility
from robocov.controllers.boosting import Ascent, BoostLimits, Mode, compute_miss_probabilities
from robocov.controllers.visibility import find_points_in_own_cell
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment, PolygonObstacle
from robocov.observation import NeighborPairs, Observations, compute_ray_directions
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.observation.scanned_view import (
    OcclusionEdges,
    View,
    compute_speed_fractions,
    find_occlusion_edges,
    integrate_over_edges,
)
from robocov.simulation import Simulation
from robocov.team import Team

ROOM = shapely.Polygon(
    [(0, 0), (10, 0), (10, 8), (0, 8)],
    [[(4, 0.0), (4.6, 0.0), (4.6, 5), (4, 5)], [(7, 5), (8, 5.5), (7.2, 6.5)]],
)
REGION = Region(np.array(ROOM.exterior.coords[:-1]))
HOT = Gaussians((Gaussian((7.0, 3.0), weight=4.0, sigma=1.5),), floor=0.5)


def scan_room(position: np.ndarray, rays: int, reach: float) -> View:
    """Return the view from a position, by the intersections of all rays with all walls."""
    rings = [np.array(ring.coords) for ring in (ROOM.exterior, *ROOM.interiors)]
    starts = np.concatenate([ring[:-1] for ring in rings])
    walls = np.concatenate([np.diff(ring, axis=0) for ring in rings])
    directions = compute_ray_directions(rays)[:, None]
    offsets = starts - position
    cross = directions[..., 0] * walls[:, 1] - directions[..., 1] * walls[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (offsets[:, 0] * walls[:, 1] - offsets[:, 1] * walls[:, 0]) / cross
        fraction = (offsets[:, 0] * directions[..., 1] - offsets[:, 1] * directions[..., 0]) / cross
    is_hit = (distance > 0.0) & (fraction >= 0.0) & (fraction <= 1.0)
    nearest = np.where(is_hit, distance, np.inf).min(axis=1)
    return View(distances=np.minimum(nearest, reach)[None], is_hit=(nearest < reach)[None])


def observe(positions: np.ndarray, density: Gaussians | None = None) -> Observations:
    """Return the observations of robots at rest within communication range of each other.

    There are no obstacle points.
    """
    n = len(positions)
    return Observations(
        positions, np.zeros((n, 2)), Neighbors(n), np.full((n, 2), np.nan), REGION, density=density
    )


def integrate_view(
    position: np.ndarray, reach: float, decay: float | None, density: Gaussians | None
) -> float:
    """Integrate φ times the probability of detection over the view, by a fine polar grid.

    Without decay, each point in view is detected.
    """
    rays = 10000
    rings = 30
    distances = scan_room(position, rays, reach).distances[0]
    depths = distances[:, None] * (np.arange(rings) + 0.5) / rings
    values = np.ones_like(depths) if decay is None else np.exp(-decay * depths)
    if density is not None:
        points = position + depths[..., None] * compute_ray_directions(rays)[:, None]
        values = values * density.evaluate(points.reshape(-1, 2)).reshape(depths.shape)
    return float((values * depths * distances[:, None]).sum() / rings * 2.0 * np.pi / rays)


def differentiate_view(
    position: np.ndarray, reach: float, decay: float | None, density: Gaussians | None
) -> np.ndarray:
    """Return the gradient of `integrate_view` by central differences, (2,)."""
    h = 0.05
    gradient = []
    for step in (np.array([h, 0.0]), np.array([0.0, h])):
        after = integrate_view(position + step, reach, decay, density)
        before = integrate_view(position - step, reach, decay, density)
        gradient.append((after - before) / (2.0 * h))
    return np.array(gradient)


@pytest.mark.parametrize("position", [(2.1, 4.3), (3.2, 6.1), (6.2, 6.4)])
@pytest.mark.parametrize("density", [None, HOT], ids=["uniform", "hot"])
def test_the_gradient_is_that_of_the_area_in_view(
    position: tuple[float, float], density: Gaussians | None
) -> None:
    seen = observe(np.array([position]), density)
    view = scan_room(seen.positions[0], 1440, 3.0)
    gradient = Visibility(jump=0.1).compute_gradient(seen, view, np.array([3.0]))[0]
    expected = differentiate_view(seen.positions[0], 3.0, None, density)
    np.testing.assert_allclose(gradient, expected, atol=0.06 * np.hypot(*expected) + 0.05)


@pytest.mark.parametrize("position", [(2.1, 4.3), (3.2, 6.1), (6.2, 6.4)])
@pytest.mark.parametrize("density", [None, HOT], ids=["uniform", "hot"])
def test_the_gradient_is_that_of_the_probability_of_detection(
    position: tuple[float, float], density: Gaussians | None
) -> None:
    seen = observe(np.array([position]), density)
    view = scan_room(seen.positions[0], 1440, 3.0)
    contributions = Boosting(jump=0.1, decay=0.5).compute_contributions(seen, view, np.array([3.0]))
    assert contributions.value[0] == pytest.approx(
        integrate_view(seen.positions[0], 3.0, 0.5, density), rel=0.01
    )
    expected = differentiate_view(seen.positions[0], 3.0, 0.5, density)
    np.testing.assert_allclose(contributions.gradient[0], expected, atol=0.06 * np.hypot(*expected) + 0.05)


@settings(max_examples=count_examples(25))
@given(seed=st.integers(0, 2**32), n=st.integers(2, 8))
def test_a_point_belongs_to_the_robot_with_the_lowest_power(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    positions = rng.uniform((1, 1), (9, 7), size=(n, 2))
    reach = rng.uniform(1.0, 4.0, n)
    directions = compute_ray_directions(16)
    depths = reach[:, None, None] * np.broadcast_to(rng.uniform(0.0, 1.0, 5), (n, 16, 5))
    pairs = observe(positions).find_neighbors()
    is_own = find_points_in_own_cell(depths, np.full((n, 16), np.inf), directions, pairs, reach)
    for i in range(n):
        points = positions[i] + depths[i][..., None] * directions[:, None]
        power = ((points[..., None, :] - positions) ** 2).sum(axis=-1) - reach**2
        np.testing.assert_array_equal(is_own[i], power.argmin(axis=-1) == i)


def test_neighbors_behind_walls_do_not_share_the_view() -> None:
    positions = np.random.default_rng(0).uniform((1, 1), (9, 7), size=(4, 2))
    pairs = observe(positions).find_neighbors()
    walls = np.full((4, 16), 1e-9)
    is_own = find_points_in_own_cell(
        np.ones((4, 16, 5)), walls, compute_ray_directions(16), pairs, np.full(4, 3.0)
    )
    assert is_own.all()


def test_a_wall_at_a_low_angle_is_not_an_occlusion_edge() -> None:
    """Along a straight wall the distance jumps from ray to ray, but nothing is hidden."""
    directions = compute_ray_directions(180)
    with np.errstate(divide="ignore"):
        wall = np.where(directions[:, 1] < 0.0, -0.3 / directions[:, 1], np.inf)
    view = View(distances=np.minimum(wall, 20.0)[None], is_hit=(wall < 20.0)[None])
    assert len(find_occlusion_edges(view, directions, np.array([20.0]), 0.3).robots) == 0


def test_the_end_of_a_wall_is_an_occlusion_edge() -> None:
    """A wall at y = -0.3 ends at x = 1: a robot that moves up sees more behind it."""
    directions = compute_ray_directions(180)
    with np.errstate(divide="ignore"):
        wall = np.where(directions[:, 1] < 0.0, -0.3 / directions[:, 1], np.inf)
    wall = np.where(directions[:, 0] * wall > 1.0, np.inf, wall)
    view = View(distances=np.minimum(wall, 20.0)[None], is_hit=(wall < 20.0)[None])
    edges = find_occlusion_edges(view, directions, np.array([20.0]), 0.3)
    assert len(edges.robots) == 1
    assert edges.corner_distances[0] == pytest.approx(np.hypot(1.0, 0.3), rel=0.1)
    assert edges.motion_directions[0] @ [0.3, 1.0] > 0.0


def test_the_view_grows_along_the_edge_beyond_a_corner() -> None:
    """For a constant weight, the integral of (s - ρ)/ρ from ρ to D is (D - ρ)²/(2 ρ)."""
    view = View(distances=np.full((1, 4), 5.0), is_hit=np.zeros((1, 4), dtype=bool))
    edges = OcclusionEdges(
        robots=np.array([0]),
        rays=np.array([2]),
        motion_directions=np.array([[0.0, 1.0]]),
        corner_distances=np.array([2.0]),
    )
    depths = view.distances[..., None] * (np.arange(100) + 0.5) / 100
    growth = integrate_over_edges(edges, view, depths, np.full(depths.shape, 3.0))
    np.testing.assert_allclose(growth, [[0.0, 3.0 * 2.25]], rtol=1e-3)


def test_robots_that_see_their_whole_cells_are_at_rest() -> None:
    square = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))
    team = Team.homogeneous(2, sensing_range=20.0)
    simulation = Simulation(square, Visibility(), [[2.0, 2.0], [3.0, 3.0]], team)
    for _ in range(60):
        simulation.step()
    np.testing.assert_array_equal(simulation.positions, [[2.0, 2.0], [3.0, 3.0]])


@pytest.mark.slow
@pytest.mark.parametrize("controller", [Visibility(), Boosting()])
def test_robots_spread_their_views_without_collisions(controller: Visibility | Boosting) -> None:
    table = PolygonObstacle(((4, 4), (5, 4), (5, 5), (4, 5)))
    hall = Environment("hall", ((0, 0), (12, 0), (12, 12), (0, 12)), (table,))
    starts = np.array([[2.0, 2.0], [2.5, 2.0], [2.0, 2.6]])
    simulation = Simulation(hall, controller, starts, Team.homogeneous(3, sensing_range=2.0))
    record = simulation.run(20.0)
    areas = []
    for positions in (starts, record.positions[-1]):
        views = shapely.union_all([shapely.Point(*position).buffer(2.0) for position in positions])
        areas.append(views.intersection(hall.free).area)
    assert areas[1] > 1.8 * areas[0]
    assert shapely.distance(hall.free.boundary, shapely.points(record.positions)).min() > 0.1


def test_steps_are_halved_when_the_gradient_turns_back() -> None:
    forward = np.array([[1.0, 0.0]])
    backward = np.array([[-1.0, 0.1]])
    assert compute_speed_fractions(forward, None, None) == 1.0
    assert compute_speed_fractions(backward, forward, np.array([0.8])) == 0.4
    assert compute_speed_fractions(forward, forward, np.array([0.5])) == pytest.approx(0.6)


def test_a_neighbor_behind_a_wall_detects_nothing_here() -> None:
    """Φ is the product over the neighbors whose line to the point is in front of walls."""
    directions = compute_ray_directions(72)
    depths = np.full((1, 72, 1), 1.0)
    walls = np.full((1, 72), np.inf)
    pairs = NeighborPairs(np.array([0]), np.array([1]), np.array([[-2.0, 0.0]]), np.array([2.0]))
    reach = np.full(2, 3.0)
    undetected = compute_miss_probabilities(depths, walls, directions, pairs, reach, 0.5)
    distance = np.hypot(*(directions - [2.0, 0.0]).T)
    expected = np.where(distance <= 3.0, 1.0 - np.exp(-0.5 * distance), 1.0)
    np.testing.assert_allclose(undetected[0, :, 0], expected)
    # A wall between the two robots.
    walls[0, :5] = 1.5
    walls[0, -4:] = 1.5
    assert (compute_miss_probabilities(depths, walls, directions, pairs, reach, 0.5) == 1.0).all()


def test_boosts_lead_to_where_no_robot_detects() -> None:
    """Two robots next to each other are boosted away from each other."""
    seen = observe(np.array([[4.0, 4.0], [4.8, 4.0]]))
    view = View(np.full((2, 72), 3.0), np.zeros((2, 72), dtype=bool))
    for boost in ("phi", "p", "neighbors"):
        contributions = Boosting(boost=boost).compute_contributions(seen, view, np.full(2, 3.0))
        assert not np.allclose(contributions.gradient, contributions.boosted_gradient)
        assert contributions.boosted_gradient[0, 0] < 0.0 < contributions.boosted_gradient[1, 0]


@pytest.mark.parametrize("track_width", [0.0, 0.16])
def test_a_robot_that_joins_late_has_all_its_boosts(track_width: float) -> None:
    room = Environment("room", ((0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0)))
    team = Team.homogeneous(2, track_width=track_width)
    conditions = Conditions(joins=(Join(2, 20.0, (1.0, 1.0)),))
    simulation = Simulation(room, Boosting(), [[4.0, 1.0], [2.0, 2.0]], team, conditions=conditions)
    simulation.run(20.0)
    late = simulation.memory.ascents[1]
    assert (late.mode, late.boost_count, late.trail) == (Mode.GRADIENT, 0, ())
    assert simulation.memory.ascents[0].boost_count > 0
    simulation.run(15.0)
    late = simulation.memory.ascents[1]
    assert late.boost_count > 0
    assert np.linalg.norm(simulation.positions[1] - [1.0, 1.0]) > 0.5


def test_an_ascent_is_boosted_at_rest_and_returns_to_a_better_optimum() -> None:
    ascent = Ascent(np.zeros(2), 0.0)
    position = np.zeros(2)
    time = 0.0
    modes = []
    for _ in range(200):
        time += 0.2
        value = 5.0 - np.hypot(*position)
        ascent = ascent.update(position, time, value, BoostLimits(max_boosts=1, max_duration=4.0))
        modes.append(ascent.mode)
        if ascent.mode is Mode.BOOSTED:
            position = position + [0.1, 0.0]
        elif ascent.mode is Mode.RETURN:
            position = position + 0.5 * (ascent.trail[-1] - position)
    order = [mode for k, mode in enumerate(modes) if k == 0 or mode is not modes[k - 1]]
    assert order == [Mode.GRADIENT, Mode.BOOSTED, Mode.GRADIENT, Mode.RETURN, Mode.GRADIENT]
    assert np.hypot(*position) < 0.2
