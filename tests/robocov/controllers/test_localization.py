"""Estimates under noise and late messages: exact where nothing is wrong, near the truth where it is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.arrays import Array
from robocov.conditions import Conditions
from robocov.conditions.perception import Perception
from robocov.controllers import Atlas
from robocov.controllers.localization import Estimates, assume_closer_neighbors, estimate_positions
from robocov.environment import Environment
from robocov.metrics import compute_clearances, count_contacts
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.simulation import Simulation
from robocov.team import Team

SQUARE = np.array([[-99.0, -99.0], [99.0, -99.0], [99.0, 99.0], [-99.0, 99.0]])
DT = 0.05


def driven(paths: Array, conditions: Conditions) -> tuple[Observations, Estimates, list[Array]]:
    """Drive robots along (t, n, 2) m; return the last estimates, and the errors of the own ones, (n,) m."""
    n = paths.shape[1]
    team = Team.homogeneous(n)
    perception = Perception(conditions, team, DT)
    inbox, estimates, errors = perception.create_inbox(), Estimates.build_initial(n), []
    speeds = np.gradient(paths, DT, axis=0)
    for k, (places, velocities) in enumerate(zip(paths, speeds, strict=True)):
        walls = places + [1.0, 0.0]
        truth = Observations(places, velocities, Neighbors(n), walls, Region(SQUARE), k * DT)
        seen, inbox = perception.perceive(truth, inbox, np.ones(n, dtype=bool))
        known, estimates = estimate_positions(seen, estimates, team)
        assert np.allclose(known.obstacle_points - known.positions, [1.0, 0.0])
        errors.append(np.hypot(*(known.positions - places).T))
    return known, estimates, errors


def lines(n: int, steps: int, seed: int = 0) -> Array:
    chance = np.random.default_rng(seed)
    begin, velocities = chance.uniform(-20, 20, (n, 2)), chance.uniform(-0.7, 0.7, (n, 2))
    return np.asarray(begin + np.arange(steps)[:, None, None] * DT * velocities)


@given(st.integers(0, 99), st.sampled_from([0.0, 0.3, 0.5]))
def test_latency_is_compensated_for_robots_that_move_straight(seed: int, delay: float) -> None:
    paths = lines(3, 60, seed)
    known, _, errors = driven(paths, Conditions(delay=delay, message_rate=4.0))
    assert max(map(np.max, errors)) < 1e-9
    assert known.reported_positions is not None
    _, other = known.neighbors.list_pairs()
    assert np.allclose(known.reported_positions, paths[-1][other], atol=1e-9)


def test_others_are_extrapolated_for_a_limited_time() -> None:
    conditions = Conditions(delay=2.0, message_rate=2.0, forget_after=9.0)
    known, estimates, _ = driven(lines(2, 90), conditions)
    robot, other = known.neighbors.list_pairs()
    assert known.reported_positions is not None
    distances = np.hypot(*(known.reported_positions - estimates.tracks.positions[robot, other]).T)
    speeds = np.hypot(*estimates.tracks.velocities[robot, other].T)
    assert speeds.min() > 0.1
    np.testing.assert_allclose(distances, 1.5 * speeds)


def test_others_are_no_faster_than_a_robot_itself() -> None:
    """The robots of this team move at 1 m/s at most, but their messages say 3 m/s."""
    paths = np.zeros((40, 2, 2))
    paths[:, 1, 0] = 3.0 * DT * np.arange(40)
    _, estimates, _ = driven(paths, Conditions(message_rate=4.0))
    assert np.hypot(*estimates.tracks.velocities[0, 1]) == pytest.approx(1.0)


@given(st.integers(0, 30))
def test_noise_is_averaged_out(seed: int) -> None:
    paths = lines(4, 120, seed)
    known, estimates, errors = driven(paths, Conditions(position_noise=0.1, seed=seed))
    assert np.sqrt(np.mean(np.square(errors[80:]))) < 0.035
    assert np.all((estimates.variance > 0.06**2) & (estimates.variance < 0.14**2))
    assert known.reported_positions is not None
    _, other = known.neighbors.list_pairs()
    off = np.hypot(*(known.reported_positions - paths[-1][other]).T)
    assert np.sqrt(np.mean(off**2)) < 0.09  # 0.141 m without a filter; of these seeds 20 is the worst, 0.0841


def test_a_robot_that_is_moved_notices_it_at_once() -> None:
    paths = lines(2, 100)
    paths[60:] += [3.0, 0.0]
    conditions = Conditions(position_noise=0.02)
    team = Team.homogeneous(2)
    perception, estimates = Perception(conditions, team, DT), Estimates.build_initial(2)
    inbox = perception.create_inbox()
    for k in range(62):
        velocities = (paths[1] - paths[0]) / DT
        truth = Observations(paths[k], velocities, Neighbors(2), paths[k], Region(SQUARE), k * DT)
        seen, inbox = perception.perceive(truth, inbox, np.ones(2, dtype=bool))
        known, estimates = estimate_positions(seen, estimates, team)
    assert np.hypot(*(known.positions - paths[61]).T).max() < 0.1


@given(st.integers(0, 20))
def test_robots_out_of_range_do_not_affect_the_estimates(seed: int) -> None:
    """The first two and the last two are out of range of each other."""
    team = Team.homogeneous(4, communication_range=5.0)
    perception = Perception(Conditions(position_noise=0.1, loss=0.2), team, DT)
    found = []
    for far in (50.0, 70.0):
        estimates, inbox = Estimates.build_initial(4), perception.create_inbox()
        for k, places in enumerate(lines(4, 20, seed) * 0.05 + [[0, 0], [1, 0], [far, 0], [far, 1]]):
            near = Neighbors.from_ranges(places, team.communication_range)
            truth = Observations(places, places * 0.0, near, places, Region(SQUARE), k * DT)
            seen, inbox = perception.perceive(truth, inbox, np.ones(4, dtype=bool))
            known, estimates = estimate_positions(seen, estimates, team)
        close = assume_closer_neighbors(known, estimates)
        assert close.reported_positions is not None
        rows = close.neighbors.list_pairs()[0] < 2
        found.append([known.positions[:2].tobytes(), close.reported_positions[rows].tobytes()])
    assert found[0] == found[1]


def test_others_may_be_nearer_by_the_noise_and_with_time() -> None:
    known, estimates, _ = driven(lines(3, 60), Conditions(position_noise=0.1, delay=0.5))
    robot, other = known.neighbors.list_pairs()
    close = assume_closer_neighbors(known, estimates)
    assert known.reported_positions is not None and close.reported_positions is not None
    before, after = (
        np.hypot(*(each.reported_positions - each.positions[robot]).T) for each in (known, close)
    )
    ages = known.time - estimates.tracks.sent_times[robot, other]
    doubt = np.sqrt(estimates.variance)[robot] + 1.0 * ages
    assert np.allclose(before - after, np.minimum(doubt, 0.75 * before))


@pytest.mark.slow
def test_atlas_has_no_contacts_with_noisy_positions() -> None:
    room = Environment("room", ((0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (0.0, 6.0)), ())
    starts = [[0.5 + 0.35 * (k % 3), 0.5 + 0.35 * (k // 3)] for k in range(6)]
    for seed in range(4):
        conditions = Conditions(position_noise=0.1, seed=seed)
        record = Simulation(room, Atlas(), starts, conditions=conditions).run(12.0)
        assert count_contacts(record, compute_clearances(record)) == 0
