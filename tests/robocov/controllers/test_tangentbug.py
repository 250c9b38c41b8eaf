"""Lloyd's algorithm with TangentBug: traps, unreachable goals and free directions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.controllers import Lloyd, TangentBug
from robocov.controllers.tangentbug import (
    CLOCKWISE,
    COUNTERCLOCKWISE,
    Mode,
    ObstacleView,
    compute_free_distances,
)
from robocov.cost import CoverageCost
from robocov.environment import Environment, PolygonObstacle, WallObstacle
from robocov.mapfile import load_map
from robocov.metrics import find_settling_time
from robocov.observation import compute_ray_directions
from robocov.simulation import Simulation
from robocov.team import Team

SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
DT = 0.05
"""Robots scan about ten times a second: more steps in between change little."""

# The trap is open to the left; the center of the square is behind its right wall.
U_TRAP = Environment("u", SQUARE, (WallObstacle(((1.5, 3.5), (4, 3.5), (4, 6.5), (1.5, 6.5)), 0.2),))


def simulate(
    environment: Environment, starts: list[list[float]], duration: float, controller: TangentBug | Lloyd
) -> np.ndarray:
    """Return the final positions, (n, 2) m."""
    simulation = Simulation(environment, controller, starts, dt=DT)
    for _ in range(round(duration / DT)):
        simulation.step()
    return simulation.positions


def test_a_robot_leaves_a_trap_in_which_lloyd_stays() -> None:
    """The claim of TangentBug: a reachable goal is reached."""
    tangentbug = simulate(U_TRAP, [[2.5, 5.2]], 25.0, TangentBug())
    lloyd = simulate(U_TRAP, [[2.5, 5.2]], 25.0, Lloyd())
    assert np.hypot(*(tangentbug[0] - [5.0, 5.0])) < 0.05
    assert np.hypot(*(lloyd[0] - [5.0, 5.0])) > 1.0


@pytest.mark.slow
@pytest.mark.parametrize(("reach", "detour"), [(1.0, 8.0), (2.0, 4.0), (8.0, 4.0)])
def test_a_robot_leaves_a_trap_with_any_sensing_range(reach: float, detour: float) -> None:
    """With a short range it follows the wall for longer."""
    team = Team.homogeneous(1, sensing_range=reach)
    simulation = Simulation(U_TRAP, TangentBug(detour=detour), [[2.5, 4.9]], team, DT)
    for _ in range(round(40 / DT)):
        simulation.step()
    np.testing.assert_allclose(simulation.positions[0], [5.0, 5.0], atol=0.05)


def test_a_goal_in_an_obstacle_is_projected_onto_its_boundary() -> None:
    """The robot comes to rest near the point of the block that is nearest to its centroid (5, 5)."""
    block = Environment("block", SQUARE, (PolygonObstacle(((4, 4.2), (6.4, 4.2), (6.4, 6.4), (4, 6.4))),))
    simulation = Simulation(block, TangentBug(), [[1.0, 8.0]], dt=DT)
    record = simulation.run(35.0)
    assert find_settling_time(record.time, record.positions) is not None
    np.testing.assert_allclose(record.positions[-1, 0], [5.0, 4.05], atol=0.3)


def test_a_goal_outside_the_region_is_given_up() -> None:
    """In an L-shaped region the centroid of the convex hull may be outside."""
    corner = Environment("corner", ((0, 0), (10, 0), (10, 2), (2, 2), (2, 10), (0, 10)))
    record = Simulation(corner, TangentBug(), [[1.0, 1.0]], dt=DT).run(40.0)
    assert find_settling_time(record.time, record.positions) is not None


def test_in_a_convex_room_it_is_lloyds_algorithm() -> None:
    room = Environment("room", SQUARE)
    starts = room.start().sample(5, seed=3).tolist()
    tangentbug = simulate(room, starts, 20.0, TangentBug())
    lloyd = simulate(room, starts, 20.0, Lloyd())
    np.testing.assert_allclose(tangentbug, lloyd, atol=0.1)


@pytest.mark.slow
def test_the_final_cost_is_lower_than_that_of_lloyd() -> None:
    """The claim of the paper, on a map that traps robots of Lloyd's algorithm."""
    trap = load_map("trap")
    cost = CoverageCost(trap, 48)
    starts = trap.start().sample(5, seed=0).tolist()
    tangentbug = simulate(trap, starts, 20.0, TangentBug())
    lloyd = simulate(trap, starts, 20.0, Lloyd())
    assert cost(tangentbug).mean_distance < 0.75 * cost(lloyd).mean_distance


@given(seed=st.integers(0, 2**32), clearance=st.floats(0.05, 0.4))
def test_a_disc_can_move_until_it_meets_a_point(seed: int, clearance: float) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-3, 3, size=(40, 2))
    points = points[np.hypot(*points.T) > clearance / 0.95]
    directions = compute_ray_directions(24)
    free_distances = compute_free_distances(points, directions, clearance, 2.5)
    for direction, free_distance in zip(directions, free_distances, strict=True):
        path = np.linspace(0.0, free_distance, 200)[:, None] * direction
        assert np.hypot(*(path[:, None] - points).T).min() > clearance - 1e-9
        if free_distance < 2.5:
            assert np.hypot(*(path[-1] - points).T).min() == pytest.approx(clearance, abs=1e-9)


def test_without_points_all_directions_are_free() -> None:
    free_distances = compute_free_distances(np.full((3, 2), np.nan), compute_ray_directions(4), 0.1, 2.0)
    np.testing.assert_array_equal(free_distances, 2.0)


def test_a_disc_that_is_too_near_may_move_away_and_along() -> None:
    free_distances = compute_free_distances(np.array([[0.05, 0.0]]), compute_ray_directions(4), 0.15, 2.0)
    assert free_distances[0] < 0.05
    np.testing.assert_array_equal(free_distances[1:], 2.0)


def view_obstacles(points: np.ndarray) -> ObstacleView:
    directions = compute_ray_directions(360)
    free_distances = compute_free_distances(points, directions, 0.1, 3.0)
    return ObstacleView(points, directions, free_distances, clearance=0.1, sensing_range=3.0)


def test_the_ends_of_a_wall_are_found() -> None:
    """A wall from (1, -1) to (1, 0.5), seen from the origin, ends at angles between two slopes."""
    view = view_obstacles(np.column_stack([np.ones(60), np.linspace(-1.0, 0.5, 60)]))
    ends = view.find_contour_ends(np.array([1.0, 0.0]), jump=0.5)
    slopes = {turn: view.directions[end.ray, 1] / view.directions[end.ray, 0] for turn, end in ends.items()}
    assert 0.5 < slopes[COUNTERCLOCKWISE] < 0.7
    assert -1.2 < slopes[CLOCKWISE] < -1.0


def test_a_closed_contour_has_no_end() -> None:
    view = view_obstacles(compute_ray_directions(360))
    assert view.find_contour_ends(np.array([1.0, 0.1]), jump=0.5) == {}


def test_the_goal_is_fixed_while_a_robot_follows_a_boundary() -> None:
    simulation = Simulation(U_TRAP, TangentBug(), [[2.5, 5.2]], dt=DT)
    modes = set()
    for _ in range(round(20 / DT)):
        simulation.step()
        state = simulation.memory.states[0]
        modes.add(state.mode)
        if state.mode is Mode.BOUNDARY:
            np.testing.assert_allclose(state.fixed_goal.position, [5.0, 5.0], atol=1e-9)
    assert modes >= {Mode.GOAL, Mode.BOUNDARY}


def test_without_scans_robots_navigate_by_the_closest_point() -> None:
    controller = TangentBug()
    simulation = Simulation(U_TRAP, controller, [[2.5, 5.2]])
    seen = replace(simulation.observe(), scans=None)
    decision = controller.decide(seen, controller.begin(U_TRAP.region, simulation.team))
    assert np.isfinite(decision.forces).all()


def test_runs_are_reproducible_and_copies_continue_identically() -> None:
    rooms = load_map("rooms")
    starts = rooms.start().sample(5, seed=1)
    first = Simulation(rooms, TangentBug(), starts)
    second = Simulation(rooms, TangentBug(), starts)
    for _ in range(300):
        first.step()
        second.step()
    copy = first.copy()
    for _ in range(100):
        first.step()
        copy.step()
        second.step()
    assert first.positions.tobytes() == copy.positions.tobytes() == second.positions.tobytes()
