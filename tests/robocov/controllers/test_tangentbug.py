from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.controllers import Lloyd, TangentBug
from robocov.controllers.tangentbug import Mode, compute_free_distances, find_contour_end
from robocov.cost import CoverageCost
from robocov.environment import Environment, PolygonObstacle, WallObstacle
from robocov.mapfile import load_map
from robocov.metrics import find_settling_time
from robocov.observation import compute_headings
from robocov.simulation import Simulation
from robocov.team import Team

SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
DT = 0.05
"""The law looks about ten times a second: more steps in between change little."""

# open to the left, the middle of the square behind its bottom
U_TRAP = Environment("u", SQUARE, (WallObstacle(((1.5, 3.5), (4, 3.5), (4, 6.5), (1.5, 6.5)), 0.2),))


def run(
    environment: Environment, start: list[list[float]], seconds: float, law: TangentBug | Lloyd
) -> Simulation:
    simulation = Simulation(environment, law, start, dt=DT)
    for _ in range(round(seconds / DT)):
        simulation.step()
    return simulation


def test_it_gets_out_of_a_u_trap() -> None:
    """The claim of TangentBug: a reachable goal is reached; Lloyd's robot stays in the trap."""
    middle = np.array([5.0, 5.0])
    bug, lloyd = (run(U_TRAP, [[2.5, 5.2]], 25.0, law).positions[0] for law in (TangentBug(), Lloyd()))
    assert np.hypot(*(bug - middle)) < 0.05
    assert np.hypot(*(lloyd - middle)) > 1.0


@pytest.mark.slow
@pytest.mark.parametrize(("reach", "detour"), [(1.0, 8.0), (2.0, 4.0), (8.0, 4.0)])
def test_it_goes_round_with_any_sensor_that_sees_the_wall(reach: float, detour: float) -> None:
    """One that sees little follows the wall for longer."""
    team = Team.homogeneous(1, sensing_range=reach)
    simulation = Simulation(U_TRAP, TangentBug(detour=detour), [[2.5, 4.9]], team, DT)
    for _ in range(round(40 / DT)):
        simulation.step()
    np.testing.assert_allclose(simulation.positions[0], [5.0, 5.0], atol=0.05)


def test_a_goal_in_an_obstacle_is_projected_onto_its_boundary() -> None:
    """The robot rests at the point of the block that is nearest to its centroid, to within what it keeps."""
    block = Environment("block", SQUARE, (PolygonObstacle(((4, 4.2), (6.4, 4.2), (6.4, 6.4), (4, 6.4))),))
    simulation = Simulation(block, TangentBug(), [[1.0, 8.0]], dt=DT)
    record = simulation.run(35.0)
    assert find_settling_time(record.time, record.positions) is not None
    # the middle (5, 5) is 0.8 from the lower side, 1 from the left one
    np.testing.assert_allclose(record.positions[-1, 0], [5.0, 4.05], atol=0.3)


def test_a_goal_behind_the_end_of_the_world_is_given_up() -> None:
    """In an L the centroid of the hull may be outside: nobody follows the walls for ever."""
    corner = Environment("corner", ((0, 0), (10, 0), (10, 2), (2, 2), (2, 10), (0, 10)))
    record = Simulation(corner, TangentBug(), [[1.0, 1.0]], dt=DT).run(40.0)
    assert find_settling_time(record.time, record.positions) is not None


def test_in_a_convex_room_it_is_lloyd() -> None:
    room = Environment("room", SQUARE)
    starts = room.start().sample(5, seed=3)
    bug, lloyd = (run(room, starts.tolist(), 20.0, law).positions for law in (TangentBug(), Lloyd()))
    np.testing.assert_allclose(bug, lloyd, atol=0.1)


@pytest.mark.slow
def test_the_team_covers_more_than_lloyds_does() -> None:
    """The claim of the paper, on the map that traps Lloyd's robots."""
    trap = load_map("trap")
    cost = CoverageCost(trap, 48)
    starts = trap.start().sample(5, seed=0).tolist()
    bug, lloyd = (run(trap, starts, 20.0, law).positions for law in (TangentBug(), Lloyd()))
    assert cost(bug).mean_distance < 0.75 * cost(lloyd).mean_distance


@given(seed=st.integers(0, 2**32), keep=st.floats(0.05, 0.4))
def test_a_disc_that_goes_as_far_as_it_may_touches_and_no_more(seed: int, keep: float) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-3, 3, size=(40, 2))
    points = points[np.hypot(*points.T) > keep / 0.95]
    directions = compute_headings(24)
    free = compute_free_distances(points, directions, keep, 2.5)
    for direction, far in zip(directions, free, strict=True):
        way = np.linspace(0.0, far, 200)[:, None] * direction
        nearest = np.hypot(*(way[:, None] - points).T).min()
        assert nearest > keep - 1e-9
        if far < 2.5:
            assert np.hypot(*(far * direction - points).T).min() == pytest.approx(keep, abs=1e-9)


def test_nothing_around_is_free_as_far_as_one_sees() -> None:
    np.testing.assert_array_equal(
        compute_free_distances(np.full((3, 2), np.nan), compute_headings(4), 0.1, 2.0), 2.0
    )


def test_who_is_too_near_may_go_away_and_along() -> None:
    free = compute_free_distances(np.array([[0.05, 0.0]]), compute_headings(4), 0.15, 2.0)
    assert free[0] < 0.05
    np.testing.assert_array_equal(free[1:], 2.0)


def test_ends_of_a_wall() -> None:
    """A wall across from (1, -1) to (1, 0.5): its ends are about there, seen from the origin."""
    wall = np.column_stack([np.ones(60), np.linspace(-1.0, 0.5, 60)])
    directions = compute_headings(360)
    free = compute_free_distances(wall, directions, 0.1, 3.0)
    ends = {turn: find_contour_end(free, directions, 0, turn, 0.9, 0.5, 3.0) for turn in (1, -1)}
    assert ends[1] is not None and ends[-1] is not None
    assert np.degrees(np.arctan2(0.5, 1)) < ends[1].ray < np.degrees(np.arctan2(0.7, 1))
    assert 360 - np.degrees(np.arctan2(1.2, 1)) < ends[-1].ray < 360 - np.degrees(np.arctan2(1.0, 1))
    closed = np.full(360, 1.0)
    assert find_contour_end(closed, directions, 7, 1, 1.0, 0.5, 3.0) is None


def test_it_remembers_the_goal_that_it_goes_round_for() -> None:
    simulation = Simulation(U_TRAP, TangentBug(), [[2.5, 5.2]], dt=DT)
    modes = set()
    for _ in range(round(20 / DT)):
        simulation.step()
        bug = simulation.memory.bugs[0]
        modes.add(bug.mode)
        if bug.mode is Mode.BOUNDARY:
            np.testing.assert_allclose(bug.fixed_goal, [5.0, 5.0], atol=1e-9)
    assert modes >= {Mode.GOAL, Mode.BOUNDARY}


def test_without_scans_it_goes_by_the_closest_point() -> None:
    law = TangentBug()
    simulation = Simulation(U_TRAP, law, [[2.5, 5.2]])
    seen = replace(simulation.observe(), scans=None)
    decision = law.decide(seen, law.begin(U_TRAP.region, simulation.team))
    assert np.isfinite(decision.forces).all()


def test_the_same_run_twice_and_a_copy_goes_on_the_same() -> None:
    rooms = load_map("rooms")
    starts = rooms.start().sample(5, seed=1)
    one, other = (Simulation(rooms, TangentBug(), starts) for _ in range(2))
    for _ in range(300):
        one.step()
        other.step()
    twin = one.copy()
    for _ in range(100):
        one.step()
        twin.step()
    assert one.positions.tobytes() == twin.positions.tobytes()
    for _ in range(100):
        other.step()
    assert one.positions.tobytes() == other.positions.tobytes()
