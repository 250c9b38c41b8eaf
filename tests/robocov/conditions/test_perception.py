"""Observations under conditions; copies and repetitions of runs under them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.conditions import Conditions
from robocov.conditions.perception import MIN_MEASURED_DISTANCE_M, restrict_decision_to_working
from robocov.controllers import Lloyd, Rapf
from robocov.controllers.tangentbug import TangentBug
from robocov.environment import CircleObstacle, Environment
from robocov.observation import Decision
from robocov.simulation import Simulation, TeamState
from robocov.team import Team

HALL = Environment("hall", ((0, 0), (10, 0), (10, 8), (0, 8)), (CircleObstacle((5.0, 4.0), 1.0),))
STARTS = np.array([[1.0, 1.0], [2.0, 1.5], [1.0, 3.0], [3.0, 2.5], [8.0, 6.0]])
DT = 0.05
ALL_CONDITIONS = Conditions(
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


def build_simulation(conditions: Conditions | None, communication_range: float = np.inf) -> Simulation:
    team = Team.homogeneous(len(STARTS), communication_range=communication_range)
    return Simulation(HALL, Rapf(), STARTS, team, DT, conditions=conditions)


def simulate(simulation: Simulation, steps: int) -> list[bytes]:
    """Simulate some steps, and return the bytes of states and observations."""
    states = []
    for _ in range(steps):
        seen = simulation.observe_and_decide().seen
        arrays = [simulation.positions, simulation.velocities, seen.positions, seen.obstacle_points]
        if seen.reported_positions is not None:
            arrays.append(seen.reported_positions)
        states.append(b"".join(array.tobytes() for array in arrays))
        simulation.step()
    return states


def compute_lengths(vectors: np.ndarray) -> np.ndarray:
    return np.hypot(vectors[:, 0], vectors[:, 1])


def test_ideal_conditions_equal_no_conditions() -> None:
    ideal = build_simulation(Conditions(seed=3))
    assert ideal.conditions is None
    assert simulate(ideal, 30) == simulate(build_simulation(None), 30)


@pytest.mark.parametrize("communication_range", [np.inf, 4.0])
def test_perfect_messages_equal_ideal_communication(communication_range: float) -> None:
    """With a limited range, a robot that gets out of range is remembered for a step."""
    ideal = build_simulation(None, communication_range).run(2.0)
    conditions = Conditions(message_rate=20.0, forget_after=0.05)
    with_messages = build_simulation(conditions, communication_range).run(2.0)
    if communication_range == np.inf:
        assert with_messages.positions.tobytes() == ideal.positions.tobytes()
    np.testing.assert_allclose(with_messages.positions, ideal.positions, atol=2e-3)


@settings(max_examples=count_examples(8))
@given(st.integers(0, 40), st.integers(0, 2**40))
def test_copies_continue_identically(steps: int, seed: int) -> None:
    simulation = build_simulation(replace(ALL_CONDITIONS, seed=seed))
    for _ in range(steps):
        simulation.step()
    # The copy is made in the middle of a step.
    simulation.observe_and_decide()
    copy = simulation.copy()
    assert simulate(copy, 15) == simulate(simulation, 15)


def test_a_simulation_rebuilt_at_an_earlier_state_repeats_the_run() -> None:
    """The window rewinds like this: by state, memory and messages of an earlier step."""
    original = build_simulation(ALL_CONDITIONS)
    for _ in range(17):
        original.step()
    state = TeamState(original.positions, original.velocities, steps=17, is_computed=True)
    memory = original.memory
    inbox = original.inbox
    expected = simulate(original, 12)
    rebuilt = Simulation(HALL, Rapf(), state, original.team, DT, conditions=ALL_CONDITIONS)
    assert simulate(rebuilt.with_memory(memory, inbox), 12) == expected


def test_observing_twice_gives_the_same_observations() -> None:
    simulation = build_simulation(ALL_CONDITIONS)
    for _ in range(6):
        first = simulation.copy().observe()
        second = simulation.observe()
        assert first.positions.tobytes() == second.positions.tobytes()
        assert first.reported_positions is not None
        assert second.reported_positions is not None
        assert first.reported_positions.tobytes() == second.reported_positions.tobytes()
        simulation.step()


def test_the_seed_determines_all_random_effects() -> None:
    first = build_simulation(ALL_CONDITIONS).run(1.0)
    second = build_simulation(ALL_CONDITIONS).run(1.0)
    other = build_simulation(replace(ALL_CONDITIONS, seed=12)).run(1.0)
    assert first.positions.tobytes() == second.positions.tobytes()
    assert first.positions.tobytes() != other.positions.tobytes()


def test_noisy_distances_are_positive_and_keep_their_direction() -> None:
    true_offsets = build_simulation(None).observe().obstacle_points - STARTS
    measured = build_simulation(Conditions(sensing_noise=50.0)).observe()
    measured_offsets = measured.obstacle_points - STARTS
    distances = compute_lengths(measured_offsets)
    assert distances.min() == pytest.approx(MIN_MEASURED_DISTANCE_M)
    assert distances.max() > 10.0
    true_directions = true_offsets / compute_lengths(true_offsets)[:, None]
    np.testing.assert_allclose(measured_offsets / distances[:, None], true_directions, atol=1e-9)


def test_true_positions_decide_which_robots_are_in_range() -> None:
    lost = build_simulation(Conditions(position_noise=100.0), communication_range=2.5).observe()
    ideal = build_simulation(None, communication_range=2.5).observe()
    robots, _ = ideal.neighbors.list_pairs()
    assert len(robots) > 0
    assert lost.neighbors.list_pairs()[0].tolist() == robots.tolist()


def test_kinds_of_noise_are_independent() -> None:
    with_position_noise = build_simulation(Conditions(position_noise=0.1, seed=2)).observe()
    with_sensing_noise = build_simulation(Conditions(sensing_noise=0.1, seed=2)).observe()
    distances = compute_lengths(build_simulation(None).observe().obstacle_points - STARTS)
    distance_errors = compute_lengths(with_sensing_noise.obstacle_points - STARTS) - distances
    position_errors = with_position_noise.positions - STARTS
    assert not np.isclose(distance_errors, position_errors[:, 0]).any()


def test_lost_messages_do_not_change_the_noise_of_sensors() -> None:
    conditions = Conditions(position_noise=0.1, sensing_noise=0.1, seed=2)
    without_loss = build_simulation(conditions).observe()
    with_loss = build_simulation(replace(conditions, loss=0.5)).observe()
    assert without_loss.positions.tobytes() == with_loss.positions.tobytes()
    assert without_loss.obstacle_points.tobytes() == with_loss.obstacle_points.tobytes()


def test_noise_has_the_given_standard_deviation() -> None:
    """Bounds are five standard errors wide."""
    simulation = build_simulation(Conditions(position_noise=0.2, sensing_noise=0.05, seed=1))
    ranges = simulation.team.sensing_range
    all_position_errors = []
    all_distance_errors = []
    for _ in range(200):
        seen = simulation.observe()
        obstacle_points = simulation.sensor.find_nearest_points(simulation.positions, ranges)
        all_position_errors.append(seen.positions - simulation.positions)
        measured_distances = compute_lengths(seen.obstacle_points - seen.positions)
        distances = compute_lengths(obstacle_points - simulation.positions)
        all_distance_errors.append(measured_distances - distances)
        simulation.step(forces=np.zeros_like(STARTS))
    position_errors = np.array(all_position_errors)
    count = position_errors.size / 2
    assert np.abs(position_errors.mean(axis=(0, 1))).max() < 5 * 0.2 / np.sqrt(count)
    assert abs(position_errors.std() / 0.2 - 1.0) < 5 / np.sqrt(2 * position_errors.size)
    distance_errors = np.array(all_distance_errors)
    assert abs(distance_errors.mean()) < 5 * 0.05 / np.sqrt(distance_errors.size)
    assert abs(distance_errors.std() / 0.05 - 1.0) < 5 / np.sqrt(2 * distance_errors.size)


def test_sensed_points_are_relative_to_the_believed_position() -> None:
    simulation = build_simulation(Conditions(position_noise=0.3, sensing_noise=0.5, seed=4))
    seen = simulation.observe()
    ranges = simulation.team.sensing_range
    obstacle_points = simulation.sensor.find_nearest_points(simulation.positions, ranges)
    offsets = obstacle_points - simulation.positions
    measured_offsets = seen.obstacle_points - seen.positions
    # The bearing is exact.
    cross_products = measured_offsets[:, 0] * offsets[:, 1] - measured_offsets[:, 1] * offsets[:, 0]
    np.testing.assert_allclose(cross_products, 0.0, atol=1e-12)
    assert ((measured_offsets * offsets).sum(axis=1) > 0).all()
    assert (compute_lengths(measured_offsets) >= MIN_MEASURED_DISTANCE_M - 1e-12).all()


def test_scans_are_noisy_where_they_hit_an_obstacle() -> None:
    team = Team.homogeneous(len(STARTS), sensing_range=2.5)
    conditions = Conditions(sensing_noise=0.04, position_noise=0.5, seed=6)
    exact = Simulation(HALL, TangentBug(), STARTS, team, DT).observe().scans
    noisy = Simulation(HALL, TangentBug(), STARTS, team, DT, conditions=conditions).observe().scans
    assert exact is not None
    assert noisy is not None
    np.testing.assert_array_equal(noisy.is_hit, exact.is_hit)
    np.testing.assert_array_equal(noisy.distances[~exact.is_hit], exact.distances[~exact.is_hit])
    errors = (noisy.distances - exact.distances)[exact.is_hit]
    assert len(errors) > 100
    assert abs(errors.mean()) < 5 * 0.04 / np.sqrt(len(errors))
    assert abs(errors.std() / 0.04 - 1.0) < 5 / np.sqrt(2 * len(errors))


def test_noisy_scans_measure_positive_distances() -> None:
    team = Team.homogeneous(len(STARTS), sensing_range=2.5)
    conditions = Conditions(sensing_noise=50.0, seed=6)
    scans = Simulation(HALL, TangentBug(), STARTS, team, DT, conditions=conditions).observe().scans
    assert scans is not None
    assert scans.distances[scans.is_hit].min() == MIN_MEASURED_DISTANCE_M


def test_records_contain_true_positions() -> None:
    simulation = build_simulation(Conditions(position_noise=0.5, seed=4))
    record = simulation.run(0.5)
    # Robots move at 1 m/s at most.
    assert (np.abs(np.diff(record.positions, axis=0)) < 0.06).all()
    np.testing.assert_array_equal(record.positions[0], STARTS)
    snapshot = simulation.observe_and_decide()
    assert snapshot.true_positions is not None
    np.testing.assert_array_equal(snapshot.positions, simulation.positions)
    assert not np.array_equal(snapshot.seen.positions, simulation.positions)


def test_robots_report_the_positions_that_they_believe() -> None:
    seen = build_simulation(Conditions(position_noise=0.3, seed=9)).observe()
    _, neighbors = seen.neighbors.list_pairs()
    assert seen.reported_positions is not None
    np.testing.assert_array_equal(seen.reported_positions, seen.positions[neighbors])
    assert seen.report_ages is not None
    assert not seen.report_ages.any()


def test_reports_are_as_old_as_the_latency() -> None:
    simulation = build_simulation(Conditions(delay=0.2))
    for step in range(12):
        seen = simulation.observe()
        assert seen.report_ages is not None
        if step < 4:
            assert len(seen.report_ages) == 0
        else:
            np.testing.assert_allclose(seen.report_ages, 0.2)
        simulation.step()


def test_failed_robots_are_forgotten_after_a_while_without_messages() -> None:
    """The last message, of 0.25 s, is forgotten after 0.75 s."""
    conditions = Conditions(message_rate=20.0, forget_after=0.5, failures=((2, 0.3),))
    assert list_steps_with_neighbor(build_simulation(conditions), steps=24) == list(range(16))


def test_failed_robots_are_forgotten_at_once_with_ideal_communication() -> None:
    ideal = build_simulation(Conditions(failures=((2, 0.3),)))
    assert list_steps_with_neighbor(ideal, steps=10) == list(range(6))


def list_steps_with_neighbor(simulation: Simulation, steps: int) -> list[int]:
    """Return the steps in which robot 2 is a neighbor of robot 1."""
    steps_with_neighbor = []
    for step in range(steps):
        if 1 in simulation.observe().neighbors.list_neighbors(0):
            steps_with_neighbor.append(step)
        simulation.step()
    return steps_with_neighbor


def test_idle_robots_have_neither_forces_nor_goals() -> None:
    decision = Decision(np.ones((3, 2)), np.ones((3, 2)), {"attraction": np.ones((3, 2))})
    remaining = restrict_decision_to_working(decision, np.array([True, False, True]))
    assert remaining.forces[:, 0].tolist() == [1, 0, 1]
    assert remaining.terms["attraction"][:, 0].tolist() == [1, 0, 1]
    assert remaining.goals is not None
    assert np.isnan(remaining.goals).all(axis=1).tolist() == [False, True, False]
    assert restrict_decision_to_working(decision, np.ones(3, dtype=bool)) is decision


def test_changes_keep_messages_unless_the_conditions_change() -> None:
    simulation = build_simulation(ALL_CONDITIONS)
    for _ in range(8):
        simulation.step()
    assert simulation.with_changes(controller=Lloyd()).inbox is simulation.inbox
    assert simulation.with_changes(conditions=Conditions(loss=0.1)).inbox is not simulation.inbox
