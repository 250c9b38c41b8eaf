"""Episodes of learning: rewards, contacts, and robots that fail or join."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from robocov.conditions import Conditions
from robocov.controllers import Rapf
from robocov.cost import CoverageCost
from robocov.environment import CircleObstacle, Environment, ObstaclePath
from robocov.errors import InputError, ParameterError, StartError
from robocov.metrics import compute_clearances, count_contacts
from robocov.scenario import Scenario
from robocov.simulation import Simulation
from robocov_app.learning import CoverageTask, ObservationLayout
from robocov_app.learning.environment import draw_episode
from robocov_app.learning.episode import Episode
from robocov_app.learning.maps import MapSampler
from robocov_app.learning.rewards import compute_reference_distance

STARTS = np.array([[1.0, 1.0], [2.0, 1.0], [1.0, 2.0]])


def start_episode(environment: Environment, positions: np.ndarray = STARTS, **changes: Any) -> Episode:
    task = CoverageTask(**{"maps": environment, "robots": len(positions), "lattice": 16, **changes})
    scenario = Scenario(
        environment,
        team=task.whole_team,
        starts=positions,
        seed=None,
        dt=task.dt,
        conditions=task.conditions,
    )
    return Episode(task, scenario, CoverageCost(environment, task.lattice))


def take_random_actions(episode: Episode, cycles: int, seed: int = 0) -> list[np.ndarray]:
    """Take random actions, and return the rewards of each."""
    rng = np.random.default_rng(seed)
    shape = (len(episode.team), 2)
    return [episode.advance(rng.normal(scale=2.0, size=shape)).rewards for _ in range(cycles)]


def test_shared_rewards_sum_up_to_the_decrease_of_the_cost(cluttered: Environment) -> None:
    episode = start_episode(cluttered, contact_penalty=0.0)
    rewards = np.array(take_random_actions(episode, 20))
    cost = CoverageCost(cluttered, 16)
    decrease = cost(STARTS).mean_distance - cost(episode.simulation.positions).mean_distance
    unit = compute_reference_distance(cluttered.free_area, 3)
    assert (rewards == rewards[:, :1]).all()
    assert rewards.sum(axis=0) == pytest.approx(decrease / unit, abs=1e-12)
    assert np.abs(rewards).max() > 0.001


@pytest.mark.parametrize("reward", ["shared", "own"])
def test_rewarding_less_often_gives_the_same_sum_of_rewards(cluttered: Environment, reward: str) -> None:
    every_action = start_episode(cluttered, reward=reward, reward_every=1, contact_penalty=0.0)
    every_fourth = start_episode(cluttered, reward=reward, reward_every=4, contact_penalty=0.0)
    dense = np.array(take_random_actions(every_action, 12))
    sparse = np.array(take_random_actions(every_fourth, 12))
    assert (sparse[[0, 1, 2, 4]] == 0.0).all()
    assert sparse[3].any()
    assert sparse.sum() == pytest.approx(dense.sum(), abs=1e-12)
    assert every_fourth.coverage.mean_distance == every_action.coverage.mean_distance


def test_the_last_action_is_always_rewarded(cluttered: Environment) -> None:
    episode = start_episode(cluttered, reward_every=100)
    assert not episode.advance(np.ones((3, 2))).rewards.any()
    assert episode.advance(np.ones((3, 2)), is_last=True).rewards.any()


def test_contacts_are_reported_and_penalized(empty: Environment) -> None:
    """Robot 1 is driven into the wall and stays there; the record shows when it arrives."""
    episode = start_episode(empty, STARTS, recording=True, contact_penalty=0.5)
    forces = np.zeros((3, 2))
    forces[0] = -4.0, 0.0
    contact_time = np.zeros(3)
    for _ in range(15):
        before = episode.coverage.mean_distance
        outcome = episode.advance(forces)
        contact_time += outcome.contact_time
        decrease = (before - episode.coverage.mean_distance) / episode.reference_distance
        np.testing.assert_allclose(outcome.rewards, decrease - 0.5 * outcome.contact_time, atol=1e-12)
    record = episode.record()
    clearances = compute_clearances(record)
    expected = ((clearances[1:] <= 1e-3) * record.dt).sum(axis=0)
    assert count_contacts(record, clearances) == 1
    np.testing.assert_allclose(contact_time, expected, atol=1e-12)
    assert contact_time[0] > 0.3
    assert not contact_time[1:].any()


def test_contact_between_two_robots_counts_for_both(empty: Environment) -> None:
    episode = start_episode(empty, np.array([[5.0, 5.0], [5.5, 5.0], [8.0, 8.0]]))
    toward = np.array([[3.0, 0.0], [-3.0, 0.0], [0.0, 0.0]])
    contact_time = sum(episode.advance(toward).contact_time for _ in range(12))
    assert contact_time[0] == contact_time[1] > 0.1
    assert contact_time[2] == 0.0


def test_a_robot_that_has_not_joined_has_no_contact(empty: Environment) -> None:
    """Robot 1 drives over the position at which robot 2 appears much later."""
    absent = Conditions(joins=((2, 100.0),))
    episode = start_episode(empty, np.array([[4.0, 5.0], [5.0, 5.0]]), conditions=absent, recording=True)
    forces = np.array([[3.0, 0.0], [3.0, 0.0]])
    assert not any(episode.advance(forces).contact_time.any() for _ in range(25))
    assert episode.simulation.positions[0, 0] > 5.5
    assert not episode.record().forces[:, 1].any()


def test_the_record_is_that_of_a_simulation_under_the_same_forces(cluttered: Environment) -> None:
    """A simulation with the same forces has the same states, bit for bit."""
    episode = start_episode(cluttered, recording=True, repeat=3)
    take_random_actions(episode, 10)
    record = episode.record()
    assert len(record.time) == 31
    assert not record.forces[-1].any()
    simulation = Simulation(cluttered, Rapf(), STARTS)
    for k in range(30):
        assert simulation.positions.tobytes() == record.positions[k].tobytes()
        assert simulation.velocities.tobytes() == record.velocities[k].tobytes()
        simulation.step(forces=record.forces[k])
    assert simulation.positions.tobytes() == record.positions[-1].tobytes()
    with pytest.raises(ParameterError, match="expected a task with recording=True"):
        start_episode(cluttered).record()


def test_a_failing_robot_does_not_change_the_rewards_of_the_others(cluttered: Environment) -> None:
    """After the failure their rewards are those of a team without the failed robot."""
    failing = Conditions(failures=((3, 0.45),))
    episode = start_episode(cluttered, conditions=failing, contact_penalty=0.0)
    rewards = []
    working = []
    forces = np.zeros((3, 2))
    forces[0] = 1.0, 0.5
    for _ in range(8):
        rewards.append(episode.advance(forces).rewards)
        working.append(episode.is_working.tolist())
    assert working[3] == [True] * 3
    assert working[5] == [True, True, False]
    first_failed = next(k for k, row in enumerate(working) if not row[2])
    cost = CoverageCost(cluttered, 16)
    for k in range(first_failed, 8):
        before = cost(episode.trail[k][:2]).mean_distance
        after = cost(episode.trail[k + 1][:2]).mean_distance
        decrease = (before - after) / episode.reference_distance
        np.testing.assert_allclose(rewards[k], [decrease, decrease, 0.0], atol=1e-12)
    assert len(episode.coverage.positions) == 2


def test_an_episode_continues_without_working_robots(empty: Environment) -> None:
    failures = Conditions(failures=tuple((k, 0.15) for k in (1, 2, 3)))
    episode = start_episode(empty, conditions=failures)
    rewards = take_random_actions(episode, 4)
    assert not episode.is_working.any()
    assert not np.array(rewards[2:]).any()
    assert np.isfinite(episode.build_rows()).all()


def test_moving_obstacles_count_at_their_present_position(empty: Environment) -> None:
    pillar = CircleObstacle((3.0, 5.0), 0.8, path=ObstaclePath(((3.0, 5.0), (7.0, 5.0)), speed=1.0))
    moving = replace(empty, obstacles=(pillar,))
    episode = start_episode(moving, STARTS, repeat=30, contact_penalty=0.0)
    rewards = np.array([episode.advance(np.zeros((3, 2))).rewards for _ in range(3)])
    final = CoverageCost(moving.at(1.5), 16)(episode.simulation.positions)
    assert episode.coverage.mean_distance == pytest.approx(final.mean_distance, abs=1e-9)
    decrease = episode.initial_coverage.mean_distance - final.mean_distance
    assert rewards[:, 0].sum() == pytest.approx(decrease / episode.reference_distance, abs=1e-12)
    assert decrease != 0.0


def test_scans_are_those_of_the_present_positions(cluttered: Environment) -> None:
    episode = start_episode(cluttered, observation=ObservationLayout(2, 12))
    columns = episode.task.observation.blocks["rays"]
    for _ in range(3):
        distances, hit = episode.simulation.sensor.scan(
            episode.simulation.positions, 12, episode.team.sensing_range
        )
        rows = episode.build_rows()[:, columns]
        np.testing.assert_allclose(rows, np.where(hit, distances / 3.0, 1.0), atol=1e-6)
        assert hit.any()
        episode.advance(np.ones((3, 2)))


def test_the_state_consists_of_positions_and_velocities(empty: Environment) -> None:
    episode = start_episode(empty, action="velocity")
    for _ in range(8):
        episode.advance(np.full((3, 2), 0.4))
    state = episode.build_state().reshape(3, 4)
    np.testing.assert_allclose(state[:, :2] * np.hypot(10, 10) + 5.0, episode.simulation.positions, atol=1e-5)
    np.testing.assert_allclose(state[:, 2:], 0.4, atol=0.01)


def test_options_replace_random_values(empty: Environment, cluttered: Environment) -> None:
    task = CoverageTask(maps=[empty, cluttered], robots=3, start="*", lattice=8)
    sampler = MapSampler(task.maps, 8)

    def list_starts(seed: int) -> list[tuple[str, bytes]]:
        rng = np.random.default_rng(seed)
        episodes = [draw_episode(task, sampler, rng) for _ in range(6)]
        return [(episode.environment.name, episode.simulation.positions.tobytes()) for episode in episodes]

    assert list_starts(1) == list_starts(1) != list_starts(2)
    assert {name for name, _ in list_starts(1)} == {"empty", "cluttered"}
    rng = np.random.default_rng(0)
    options = {"map": cluttered, "start": "uniform", "start_seed": 7, "nothing": 1}
    episode = draw_episode(task, sampler, rng, options)
    expected = cluttered.start("uniform").sample(3, seed=7)
    assert episode.environment is cluttered
    assert np.array_equal(episode.simulation.positions, expected)
    placed = draw_episode(task, sampler, rng, {"map": empty, "positions": STARTS.tolist()})
    assert np.array_equal(placed.simulation.positions, STARTS)


def test_each_episode_has_its_own_seed_of_conditions(empty: Environment) -> None:
    task = CoverageTask(maps=empty, robots=3, lattice=8, conditions=Conditions(position_noise=0.1))
    sampler = MapSampler(empty, 8)
    rng = np.random.default_rng(0)
    seeds = [draw_episode(task, sampler, rng).simulation.conditions.seed for _ in range(3)]
    assert len(set(seeds)) == 3
    seeded = draw_episode(task, sampler, rng, {"conditions_seed": 5})
    assert seeded.simulation.conditions.seed == 5


def test_invalid_actions_and_options_are_rejected(empty: Environment) -> None:
    episode = start_episode(empty)
    with pytest.raises(
        ParameterError, match=r"actions: expected an array of shape \(3, 2\), got one of shape \(2, 2\)"
    ):
        episode.advance(np.zeros((2, 2)))
    with pytest.raises(ParameterError, match=r"action of robot_2: expected finite numbers"):
        episode.advance(np.array([[0.0, 0.0], [np.nan, 0.0], [0.0, 0.0]]))
    with pytest.raises(StartError, match="starts: expected one for each of 3 robots, got 2"):
        start_episode(empty, STARTS[:2], robots=3)
    sampler = MapSampler(empty, 8)
    rng = np.random.default_rng(0)
    overlapping = {"positions": [[5.0, 5.0]] * 3}
    ragged = {"positions": [[1.0], [2.0, 1.0]]}
    for options in (overlapping, ragged, {"map": "nowhere"}, {"map": 3}, {"start": "nowhere"}):
        with pytest.raises(InputError):
            draw_episode(CoverageTask(maps=empty, robots=3), sampler, rng, options)
