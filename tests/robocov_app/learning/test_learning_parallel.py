"""The environment for PettingZoo."""

from __future__ import annotations

import warnings
from functools import partial
from typing import Any

import numpy as np
import pytest

with warnings.catch_warnings():
    # The tests of pettingzoo load games by deprecated functions.
    warnings.simplefilter("ignore", DeprecationWarning)
    from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, parallel_seed_test, seed_test

from robocov.conditions import Conditions
from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError
from robocov.team import Team
from robocov_app.learning import CoverageParallelEnv, CoverageTask, ObservationLayout, coverage_v0

SMALL = {"robots": 3, "lattice": 8, "duration": 2.0, "dt": 0.05, "repeat": 2}


def build_environment(environment: Environment, **changes: Any) -> CoverageParallelEnv:
    return CoverageParallelEnv(**{"maps": environment, **SMALL, **changes})


VARIANTS: list[dict[str, Any]] = [
    {},
    {"action": "velocity", "reward": "own", "start": "*", "observation": ObservationLayout(2, 8, True)},
    {"conditions": Conditions(failure_rate=0.5, loss=0.2), "reward": "own"},
    {"conditions": Conditions(joins=((2, 0.55),), failures=((1, 1.0),))},
]


@pytest.mark.parametrize("changes", VARIANTS)
def test_the_checks_of_pettingzoo_pass(cluttered: Environment, changes: dict[str, Any]) -> None:
    if not changes.get("conditions") or not changes["conditions"].joins:
        # This check does not support agents that join.
        parallel_api_test(build_environment(cluttered, **changes), 25)
    parallel_seed_test(partial(build_environment, cluttered, **changes), 25)


@pytest.mark.parametrize("changes", VARIANTS[:2])
def test_the_checks_of_pettingzoo_for_agents_in_turn_pass(
    cluttered: Environment, changes: dict[str, Any]
) -> None:
    options = {"maps": cluttered, **SMALL, **changes}
    api_test(coverage_v0.env(**options), 15)
    seed_test(partial(coverage_v0.env, **options), 15)


def test_the_check_of_pettingzoo_for_truncation_passes(
    monkeypatch: pytest.MonkeyPatch, empty: Environment
) -> None:
    class Module:
        parallel_env = staticmethod(partial(coverage_v0.parallel_env, maps=empty, **SMALL))
        env = staticmethod(partial(coverage_v0.env, maps=empty, **SMALL))

    max_cycles_test(Module)


def test_an_episode_is_never_longer_than_the_duration(empty: Environment) -> None:
    env = build_environment(empty, max_cycles=1000)
    env.reset(seed=0)
    cycles = 0
    while env.agents:
        env.step(dict.fromkeys(env.agents, (0.0, 0.0)))
        cycles += 1
    assert cycles == env.task.cycles == 20


def run_random_episode(env: CoverageParallelEnv, seed: int, cycles: int = 6) -> list[bytes]:
    """Take random actions, and return all observations, rewards and infos."""
    observations, infos = env.reset(seed=seed)
    rng = np.random.default_rng(0)
    results = [row.tobytes() for row in observations.values()]
    for _ in range(cycles):
        observations, rewards, _, _, infos = env.step({agent: rng.normal(size=2) for agent in env.agents})
        results += [row.tobytes() for row in observations.values()]
        results.append(repr((rewards, infos)).encode())
    return results


@pytest.mark.parametrize("changes", VARIANTS)
def test_results_of_the_same_seed_are_identical(cluttered: Environment, changes: dict[str, Any]) -> None:
    env = build_environment(cluttered, **changes)
    other = build_environment(cluttered, **changes)
    first = run_random_episode(env, 3)
    assert first == run_random_episode(other, 3)
    assert first == run_random_episode(env, 3)
    assert first != run_random_episode(env, 4)


def test_without_a_seed_the_random_numbers_continue(cluttered: Environment) -> None:
    env = build_environment(cluttered)
    other = build_environment(cluttered)
    env.reset(seed=1)
    other.reset(seed=1)
    first = env.reset()[0]["robot_1"]
    second = env.reset()[0]["robot_1"]
    assert not np.array_equal(first, second)
    assert np.array_equal(other.reset()[0]["robot_1"], first)


def test_an_episode_is_truncated_after_its_duration(empty: Environment) -> None:
    env = build_environment(empty, duration=0.5)
    env.reset(seed=0)
    for cycle in range(5):
        assert env.agents == ["robot_1", "robot_2", "robot_3"]
        _, _, terminated, truncated, infos = env.step(dict.fromkeys(env.agents, (0.0, 0.0)))
        assert not any(terminated.values()) and set(truncated.values()) == {cycle == 4}
    assert env.agents == [] and infos["robot_2"]["time_s"] == pytest.approx(0.5)


def test_the_last_action_is_always_rewarded(cluttered: Environment) -> None:
    returns = []
    for every in (1, 1000):
        env = build_environment(cluttered, reward_every=every, contact_penalty=0.0)
        env.reset(seed=0)
        rewards = []
        while env.agents:
            rewards.append(env.step(dict.fromkeys(env.agents, (2.0, 1.0)))[1]["robot_1"])
        returns.append(rewards)
    assert not any(returns[1][:-1])
    assert abs(returns[1][-1]) > 0.1
    assert sum(returns[0]) == pytest.approx(returns[1][-1], abs=1e-12)


def test_robots_that_fail_are_terminated_and_robots_that_join_appear(empty: Environment) -> None:
    env = build_environment(empty, conditions=Conditions(failures=((1, 0.35),), joins=((3, 0.65),)))
    env.reset(seed=0)
    agents = []
    ended = []
    for _ in range(8):
        agents.append(env.agents)
        observations, rewards, terminated, _, _ = env.step(dict.fromkeys(env.agents, (0.5, 0.0)))
        assert set(observations) == set(rewards) == set(terminated)
        ended.append([agent for agent in terminated if terminated[agent]])
    assert agents[3] == ["robot_1", "robot_2"] and ended[3] == ["robot_1"]
    assert agents[4] == ["robot_2"] and agents[7] == ["robot_2", "robot_3"]
    assert [agents for agents in ended if agents] == [["robot_1"]]


@pytest.mark.parametrize(
    ("action", "limits"),
    [
        # The force m a + ν v: 1 kg · 2 m/s² + 2 N s/m · 1 m/s, and 2 kg · 3 m/s² + 4 N s/m · 0.5 m/s.
        ("force", {"robot_1": 4.0, "robot_2": 8.0}),
        # The maximum speeds.
        ("velocity", {"robot_1": 1.0, "robot_2": 0.5}),
    ],
)
def test_action_spaces_have_the_limits_of_each_robot(
    empty: Environment, action: str, limits: dict[str, float]
) -> None:
    team = Team(
        radius=np.array([0.1, 0.2]),
        mass=np.array([1.0, 2.0]),
        max_speed=np.array([1.0, 0.5]),
        max_acceleration=np.array([2.0, 3.0]),
        viscosity=np.array([2.0, 4.0]),
        sensing_range=np.array([3.0, 1.0]),
        communication_range=np.array([9.0, 9.0]),
    )
    env = build_environment(empty, team=team, action=action)
    assert env.possible_agents == list(limits)
    for agent, limit in limits.items():
        space = env.action_space(agent)
        assert space.high.tolist() == [limit, limit]
        assert space.low.tolist() == [-limit, -limit]


def test_the_state_is_in_the_state_space(empty: Environment) -> None:
    env = build_environment(empty)
    env.reset(seed=0)
    assert env.state_space.contains(env.state())


def test_attributes_of_a_task_can_be_changed(empty: Environment) -> None:
    task = CoverageTask(maps=empty, **SMALL)
    assert CoverageParallelEnv(task).task.robots == 3
    assert CoverageParallelEnv(task, robots=2).possible_agents == ["robot_1", "robot_2"]


def test_invalid_actions_and_options_are_rejected(empty: Environment) -> None:
    env = build_environment(empty)
    with pytest.raises(RobocovError, match=r"call reset\(\) first"):
        env.step({})
    env.reset(seed=0)
    with pytest.raises(ParameterError, match="actions: expected one for each agent, got none for robot_2"):
        env.step({"robot_1": (0, 0)})
    for invalid in ((0.0, np.inf), (1.0,), "go", None):
        with pytest.raises(ParameterError, match=r"action of robot_1: expected two finite numbers, got"):
            env.step({"robot_1": invalid})
    for invalid in (0, 2.5, "3"):
        with pytest.raises(ParameterError, match="max_cycles: expected a whole number of at least 1, got"):
            build_environment(empty, max_cycles=invalid)
    with pytest.raises(ParameterError, match="unknown attribute of a task 'map': did you mean 'maps'"):
        CoverageParallelEnv(map="rooms")
