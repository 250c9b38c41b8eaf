"""What robots know under conditions, and that a run under them can be copied, rewound and repeated."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.conditions import Conditions
from robocov.conditions.perception import MIN_MEASURED_DISTANCE_M, ignore_idle_robots
from robocov.controllers import Lloyd, Rapf
from robocov.controllers.tangentbug import TangentBug
from robocov.environment import CircleObstacle, Environment
from robocov.observation import Decision
from robocov.simulation import Simulation, TeamState
from robocov.team import Team

HALL = Environment("hall", ((0, 0), (10, 0), (10, 8), (0, 8)), (CircleObstacle((5.0, 4.0), 1.0),))
STARTS = np.array([[1.0, 1.0], [2.0, 1.5], [1.0, 3.0], [3.0, 2.5], [8.0, 6.0]])
NOISE = ("position_noise", "sensing_noise")
BAD = Conditions(
    loss=0.3,
    delay=0.11,
    message_rate=20.0,
    forget_after=0.8,
    position_noise=0.03,
    sensing_noise=0.02,
    failures=((2, 0.5),),
    joins=((4, 0.3),),
    seed=11,
)


def simulation(conditions: Conditions | None, reach: float = np.inf, steps: int = 0) -> Simulation:
    team = Team.homogeneous(len(STARTS), communication_range=reach)
    return Simulation(HALL, Rapf(), TeamState(STARTS, steps=steps), team, 0.05, conditions=conditions)


def bits(one: Simulation, steps: int) -> list[bytes]:
    found = []
    for _ in range(steps):
        seen = one.observe_and_decide().seen
        heard = b"" if seen.reported_positions is None else seen.reported_positions.tobytes()
        found.append(
            one.positions.tobytes()
            + one.velocities.tobytes()
            + seen.positions.tobytes()
            + seen.obstacle_points.tobytes()
            + heard
        )
        one.step()
    return found


def test_ideal_conditions_equal_no_conditions() -> None:
    assert bits(simulation(Conditions(seed=3)), 30) == bits(simulation(None), 30)
    assert simulation(Conditions(seed=3)).conditions is None


@pytest.mark.parametrize("reach", [np.inf, 4.0])
def test_perfect_messages_equal_ideal_communication(reach: float) -> None:
    """Bit for bit where everybody is in range; who comes out of range is remembered for a step."""
    plain = simulation(None, reach).run(2.0)
    told = simulation(Conditions(message_rate=20.0, forget_after=0.05), reach).run(2.0)
    if reach == np.inf:
        assert told.positions.tobytes() == plain.positions.tobytes()
    np.testing.assert_allclose(told.positions, plain.positions, atol=2e-3)


@settings(max_examples=8)
@given(st.integers(0, 40), st.integers(0, 2**40))
def test_copies_continue_identically(steps: int, seed: int) -> None:
    one = simulation(Conditions(**{**BAD.__dict__, "seed": seed}))
    for _ in range(steps):
        one.step()
    _ = one.observe_and_decide()  # a copy in the midst of a step
    twin = one.copy()
    expected = bits(one, 15)
    assert bits(twin, 15) == expected


def test_a_simulation_rebuilt_at_an_earlier_state_repeats_the_run() -> None:
    """As the window does it: a simulation made anew at an earlier state, with memory and messages of then."""
    one = simulation(BAD)
    for _ in range(17):
        one.step()
    state = TeamState(one.positions, one.velocities, steps=17, is_computed=True)
    memory = one.memory
    inbox = one.inbox
    expected = bits(one, 12)
    again = Simulation(HALL, Rapf(), state, one.team, 0.05, conditions=BAD).with_memory(memory, inbox)
    assert bits(again, 12) == expected


def test_observing_twice_gives_the_same_observations() -> None:
    one = simulation(BAD)
    for _ in range(6):
        first, second = one.observe(), one.observe()
        assert first.positions.tobytes() == second.positions.tobytes()
        assert first.reported_positions is not None
        assert second.reported_positions is not None
        assert first.reported_positions.tobytes() == second.reported_positions.tobytes()
        one.step()


def test_the_seed_determines_all_random_effects() -> None:
    one, same = simulation(BAD).run(1.0), simulation(BAD).run(1.0)
    other = simulation(Conditions(**{**BAD.__dict__, "seed": 12})).run(1.0)
    assert one.positions.tobytes() == same.positions.tobytes()
    assert one.positions.tobytes() != other.positions.tobytes()


def test_noisy_distances_are_positive_and_keep_their_direction() -> None:
    ideal, noisy = simulation(None).observe(), simulation(Conditions(sensing_noise=50.0)).observe()
    true, found = (each.obstacle_points - STARTS for each in (ideal, noisy))
    lengths = np.hypot(*found.T)
    assert lengths.min() == pytest.approx(MIN_MEASURED_DISTANCE_M) and lengths.max() > 10.0
    np.testing.assert_allclose(found / lengths[:, None], true / np.hypot(*true.T)[:, None], atol=1e-9)


def test_true_positions_decide_which_robots_are_in_range() -> None:
    lost = simulation(Conditions(position_noise=100.0), reach=2.5).observe()
    ideal = simulation(None, reach=2.5).observe()
    assert lost.neighbours.list_pairs()[0].tolist() == ideal.neighbours.list_pairs()[0].tolist() != []


def test_kinds_of_noise_are_independent() -> None:
    """That messages are lost does not change what a sensor measures at the first step."""
    where, what = (simulation(Conditions(**{name: 0.1}, seed=2)).observe() for name in NOISE)
    away = np.hypot(*(what.obstacle_points - STARTS).T)
    away -= np.hypot(*(simulation(None).observe().obstacle_points - STARTS).T)
    assert not np.isclose(away, (where.positions - STARTS)[:, 0]).any()
    noise = {"position_noise": 0.1, "sensing_noise": 0.1, "seed": 2}
    one = simulation(Conditions(**noise)).observe()  # type: ignore[arg-type]
    other = simulation(Conditions(loss=0.5, **noise)).observe()  # type: ignore[arg-type]
    assert one.positions.tobytes() == other.positions.tobytes()
    assert one.obstacle_points.tobytes() == other.obstacle_points.tobytes()


def test_noise_has_the_given_standard_deviation() -> None:
    one = simulation(Conditions(position_noise=0.2, sensing_noise=0.05, seed=1))
    errors, ranges = [], []
    still = np.zeros_like(STARTS)
    for _ in range(200):
        seen = one.observe()
        true = one.sensor.find_nearest_points(one.positions, one.team.sensing_range)
        errors.append(seen.positions - one.positions)
        measured = np.hypot(*(seen.obstacle_points - seen.positions).T)
        ranges.append(measured - np.hypot(*(true - one.positions).T))
        one.step(forces=still)
    error, off = np.array(errors), np.array(ranges)
    count = error.size / 2
    assert np.abs(error.mean(axis=(0, 1))).max() < 5 * 0.2 / np.sqrt(count)
    assert abs(error.std() / 0.2 - 1.0) < 5 / np.sqrt(2 * error.size)
    assert abs(off.mean()) < 5 * 0.05 / np.sqrt(off.size)
    assert abs(off.std() / 0.05 - 1.0) < 5 / np.sqrt(2 * off.size)


def test_sensed_points_are_relative_to_the_believed_position() -> None:
    one = simulation(Conditions(position_noise=0.3, sensing_noise=0.5, seed=4))
    seen, true = one.observe(), one.sensor.find_nearest_points(one.positions, one.team.sensing_range)
    felt, there = seen.obstacle_points - seen.positions, true - one.positions
    np.testing.assert_allclose(felt[:, 0] * there[:, 1], felt[:, 1] * there[:, 0], atol=1e-12)
    assert ((felt * there).sum(axis=1) > 0).all()
    assert (np.hypot(*felt.T) >= MIN_MEASURED_DISTANCE_M - 1e-12).all()


def test_scans_are_noisy_where_they_hit_an_obstacle() -> None:
    team = Team.homogeneous(len(STARTS), sensing_range=2.5)
    plain, noisy = (
        Simulation(HALL, TangentBug(), STARTS, team, 0.05, conditions=each).observe().scans
        for each in (None, Conditions(sensing_noise=0.04, position_noise=0.5, seed=6))
    )
    assert plain is not None
    assert noisy is not None
    assert (noisy.hit == plain.hit).all()
    assert (noisy.distances[~plain.hit] == plain.distances[~plain.hit]).all()
    off = (noisy.distances - plain.distances)[plain.hit]
    assert len(off) > 100
    assert abs(off.mean()) < 5 * 0.04 / np.sqrt(len(off))
    assert abs(off.std() / 0.04 - 1.0) < 5 / np.sqrt(2 * len(off))


def test_noisy_scans_measure_positive_distances() -> None:
    team = Team.homogeneous(len(STARTS), sensing_range=2.5)
    conditions = Conditions(sensing_noise=50.0, seed=6)
    scans = Simulation(HALL, TangentBug(), STARTS, team, 0.05, conditions=conditions).observe().scans
    assert scans is not None
    assert scans.distances[scans.hit].min() == MIN_MEASURED_DISTANCE_M


def test_records_contain_true_positions() -> None:
    one = simulation(Conditions(position_noise=0.5, seed=4))
    record = one.run(0.5)
    assert (np.abs(np.diff(record.positions, axis=0)) < 0.06).all()  # 1 m/s, and no jumps
    assert (record.positions[0] == STARTS).all()
    assert one.observe_and_decide().truth is not None
    assert (one.observe_and_decide().positions == one.positions).all()
    assert not np.array_equal(one.observe_and_decide().seen.positions, one.positions)


def test_robots_report_the_positions_that_they_believe() -> None:
    one = simulation(Conditions(position_noise=0.3, seed=9))
    seen = one.observe()
    assert seen.reported_positions is not None
    assert (seen.reported_positions == seen.positions[seen.neighbours.list_pairs()[1]]).all()
    assert seen.report_ages is not None
    assert not seen.report_ages.any()


def test_reports_are_as_old_as_the_latency() -> None:
    one = simulation(Conditions(delay=0.2))
    for step in range(12):
        seen = one.observe()
        assert seen.report_ages is not None
        if step < 4:
            assert len(seen.report_ages) == 0
        else:
            np.testing.assert_allclose(seen.report_ages, 0.2)
        one.step()


def test_failed_robots_are_forgotten_after_a_while_without_messages() -> None:
    one = simulation(Conditions(message_rate=20.0, forget_after=0.5, failures=((2, 0.3),)))
    heard = []
    for _ in range(24):
        heard.append(1 in one.observe().neighbours.list_neighbours(0).tolist())
        one.step()
    # the last message of 0.25 s is forgotten after 0.75 s
    assert heard == [True] * 16 + [False] * 8
    ideal = simulation(Conditions(failures=((2, 0.3),)))
    ideal_heard = []
    for _ in range(10):
        ideal_heard.append(1 in ideal.observe().neighbours.list_neighbours(0).tolist())
        ideal.step()
    assert ideal_heard == [True] * 6 + [False] * 4


def test_idle_robots_have_neither_forces_nor_goals() -> None:
    decision = Decision(np.ones((3, 2)), np.ones((3, 2)), {"attraction": np.ones((3, 2))})
    found = ignore_idle_robots(decision, np.array([True, False, True]))
    assert found.goals is not None
    assert (found.forces[:, 0] == [1, 0, 1]).all()
    assert (found.terms["attraction"][:, 0] == [1, 0, 1]).all()
    assert np.isnan(found.goals[1]).all()
    assert ignore_idle_robots(decision, np.ones(3, dtype=bool)) is decision


def test_changes_keep_messages_unless_the_conditions_change() -> None:
    one = simulation(BAD)
    for _ in range(8):
        one.step()
    assert one.with_changes(controller=Lloyd()).inbox is one.inbox
    assert one.with_changes(conditions=Conditions(loss=0.1)).inbox is not one.inbox
