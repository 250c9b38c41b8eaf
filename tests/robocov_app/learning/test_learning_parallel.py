from __future__ import annotations

import warnings
from functools import partial
from typing import Any

import numpy as np
import pytest

with warnings.catch_warnings():
    # its tests load games by ways that it has deprecated itself
    warnings.simplefilter("ignore", DeprecationWarning)
    from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, parallel_seed_test, seed_test

from robocov.conditions import Conditions
from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError
from robocov_app.learning import CoverageParallelEnv, CoverageTask, ObservationLayout, coverage_v0

SMALL = {"robots": 3, "lattice": 8, "duration": 2.0, "dt": 0.05, "repeat": 2}


def made(environment: Environment, **changes: Any) -> CoverageParallelEnv:
    return CoverageParallelEnv(**{"maps": environment, **SMALL, **changes})


VARIANTS: list[dict[str, Any]] = [
    {},
    {"action": "velocity", "reward": "own", "start": "*", "observation": ObservationLayout(2, 8, True)},
    {"conditions": Conditions(failure_rate=0.5, loss=0.2), "reward": "own"},
    {"conditions": Conditions(joins=((2, 0.55),), failures=((1, 1.0),))},
]


@pytest.mark.parametrize("changes", VARIANTS)
def test_pettingzoos_checks_pass(cluttered: Environment, changes: dict[str, Any]) -> None:
    if not changes.get("conditions") or not changes["conditions"].joins:  # it knows of nobody who joins
        parallel_api_test(made(cluttered, **changes), 25)
    parallel_seed_test(partial(made, cluttered, **changes), 25)


@pytest.mark.parametrize("changes", VARIANTS[:2])
def test_its_checks_of_robots_that_act_in_turn_pass(cluttered: Environment, changes: dict[str, Any]) -> None:
    options = {"maps": cluttered, **SMALL, **changes}
    api_test(coverage_v0.env(**options), 15)
    seed_test(partial(coverage_v0.env, **options), 15)


def test_its_check_of_truncation_passes(monkeypatch: pytest.MonkeyPatch, empty: Environment) -> None:
    class Module:
        parallel_env = staticmethod(partial(coverage_v0.parallel_env, maps=empty, **SMALL))
        env = staticmethod(partial(coverage_v0.env, maps=empty, **SMALL))

    max_cycles_test(Module)


def played(env: CoverageParallelEnv, seed: int, cycles: int = 6) -> list[bytes]:
    observations, infos = env.reset(seed=seed)
    rng = np.random.default_rng(0)
    told = [row.tobytes() for row in observations.values()]
    for _ in range(cycles):
        observations, rewards, _, _, infos = env.step({a: rng.normal(size=2) for a in env.agents})
        told += [row.tobytes() for row in observations.values()]
        told.append(repr((rewards, infos)).encode())
    return told


@pytest.mark.parametrize("changes", VARIANTS)
def test_the_same_seed_gives_the_same_bits(cluttered: Environment, changes: dict[str, Any]) -> None:
    one, other = made(cluttered, **changes), made(cluttered, **changes)
    first = played(one, 3)
    assert first == played(other, 3)
    assert first == played(one, 3)  # whatever was played before
    assert first != played(one, 4)


def test_the_random_numbers_go_on_without_a_seed(cluttered: Environment) -> None:
    one, other = made(cluttered), made(cluttered)
    one.reset(seed=1), other.reset(seed=1)
    first, second = one.reset()[0]["robot_1"], one.reset()[0]["robot_1"]
    assert not np.array_equal(first, second)
    assert np.array_equal(other.reset()[0]["robot_1"], first)


def test_an_episode_is_truncated_after_its_time(empty: Environment) -> None:
    env = made(empty, duration=0.5)
    env.reset(seed=0)
    for cycle in range(5):
        assert env.agents == ["robot_1", "robot_2", "robot_3"]
        _, _, terminated, truncated, infos = env.step(dict.fromkeys(env.agents, (0.0, 0.0)))
        assert not any(terminated.values()) and set(truncated.values()) == {cycle == 4}
    assert env.agents == [] and infos["robot_2"]["time_s"] == pytest.approx(0.5)


def test_the_last_action_is_rewarded_in_any_case(cluttered: Environment) -> None:
    returns = []
    for every in (1, 1000):
        env = made(cluttered, reward_every=every, contact_penalty=0.0)
        env.reset(seed=0)
        rewards = []
        while env.agents:
            rewards.append(env.step(dict.fromkeys(env.agents, (2.0, 1.0)))[1]["robot_1"])
        returns.append(rewards)
    assert not any(returns[1][:-1]) and abs(returns[1][-1]) > 0.1
    assert sum(returns[0]) == pytest.approx(returns[1][-1], abs=1e-12)


def test_who_fails_is_terminated_and_who_joins_appears(empty: Environment) -> None:
    env = made(empty, conditions=Conditions(failures=((1, 0.35),), joins=((3, 0.65),)))
    env.reset(seed=0)
    agents, ended = [], []
    for _ in range(8):
        agents.append(env.agents)
        observations, rewards, terminated, _, _ = env.step(dict.fromkeys(env.agents, (0.5, 0.0)))
        assert set(observations) == set(rewards) == set(terminated)
        ended.append([agent for agent in terminated if terminated[agent]])
    assert agents[3] == ["robot_1", "robot_2"] and ended[3] == ["robot_1"]
    assert agents[4] == ["robot_2"] and agents[7] == ["robot_2", "robot_3"]
    assert [agent for each in ended for agent in each] == ["robot_1"]


def test_spaces_of_unequal_robots(empty: Environment) -> None:
    from robocov.team import Team

    fast = Team(*(np.array(pair) for pair in ([0.1, 0.2], [1, 2], [1, 0.5], [2, 1], [2, 4], [3, 1], [9, 9])))
    env = made(empty, team=fast)
    assert env.action_space("robot_1").high.tolist() == [4.0, 4.0]  # 1 x 2 + 2 x 1
    assert env.action_space("robot_2").high.tolist() == [4.0, 4.0]  # 2 x 1 + 4 x 0.5
    assert made(empty, team=fast, action="velocity").action_space("robot_2").high.tolist() == [0.5, 0.5]
    assert env.state_space.contains(env.reset(seed=0) and env.state())


def test_a_task_and_changes_of_it(empty: Environment) -> None:
    task = CoverageTask(maps=empty, **SMALL)
    assert CoverageParallelEnv(task).task.robots == 3
    assert CoverageParallelEnv(task, robots=2).possible_agents == ["robot_1", "robot_2"]


def test_what_is_wrong_is_said(empty: Environment) -> None:
    env = made(empty)
    with pytest.raises(RobocovError, match=r"call reset\(\) first"):
        env.step({})
    env.reset(seed=0)
    with pytest.raises(ParameterError, match="actions: expected one for each agent, got none for robot_2"):
        env.step({"robot_1": (0, 0)})
    for bad in ((0.0, np.inf), (1.0,), "go", None):
        with pytest.raises(ParameterError, match=r"action of robot_1: expected two finite numbers, got"):
            env.step({"robot_1": bad})
    with pytest.raises(ParameterError, match="max_cycles: expected a whole number of at least 1, got 0"):
        made(empty, max_cycles=0)
    with pytest.raises(ParameterError, match="unknown part of a task 'map': did you mean 'maps'"):
        CoverageParallelEnv(map="rooms")
