"""The environment for Gymnasium."""

from __future__ import annotations

import pickle
import subprocess
import sys
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.vector import AutoresetMode

from robocov.conditions import Conditions
from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError
from robocov_app import learning
from robocov_app.learning import CoverageEnv, CoverageParallelEnv, CoverageVectorEnv, ObservationLayout

SMALL = {"maps": "square", "robots": 3, "lattice": 8, "duration": 2.0, "dt": 0.05, "repeat": 2}
ID = "robocov_app.learning.gym:robocov/Coverage-v0"


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"action": "velocity", "reward": "level", "observation": ObservationLayout(1, 6, True)},
        {"conditions": Conditions(position_noise=0.1, failure_rate=0.3)},
    ],
)
def test_the_check_of_gymnasium_passes(changes: dict[str, Any]) -> None:
    check_env(gymnasium.make(ID, render_mode="rgb_array", size=(160, 120), **SMALL, **changes).unwrapped)


@pytest.mark.slow
def test_importing_the_module_registers_the_environment() -> None:
    assert gymnasium.spec("robocov/Coverage-v0").entry_point == "robocov_app.learning.gym:CoverageEnv"
    assert gymnasium.make("robocov/Coverage-v0", **SMALL).unwrapped.task.robots == 3
    script = f"import gymnasium; print(gymnasium.make({ID!r}, robots=2).reset(seed=0)[0].shape)"
    finished = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert finished.stdout == "(2, 19)\n"


def test_a_single_agent_environment_behaves_as_the_parallel_one(cluttered: Environment) -> None:
    options = {**SMALL, "maps": cluttered, "reward": "own", "contact_penalty": 0.3, "reward_every": 3}
    single = CoverageEnv(**options)
    parallel = CoverageParallelEnv(**options)
    rows, info = single.reset(seed=5)
    rows_by_agent, infos = parallel.reset(seed=5)
    rng = np.random.default_rng(0)
    truncated = False
    while not truncated:
        assert rows.tobytes() == b"".join(rows_by_agent[agent].tobytes() for agent in parallel.agents)
        action = rng.normal(scale=2.0, size=(3, 2))
        rows, reward, terminated, truncated, info = single.step(action)
        rows_by_agent, rewards, _, truncations, infos = parallel.step(
            dict(zip(parallel.agents, action, strict=True))
        )
        assert reward == pytest.approx(np.mean([*rewards.values()]), abs=1e-15)
        assert not terminated
        assert set(truncations.values()) == {truncated}
        assert info["mean_distance_m"] == infos["robot_1"]["mean_distance_m"]
    assert parallel.agents == []


def test_environments_in_processes_behave_as_single_environments() -> None:
    """Each has its own seed, and the results are the same, bit for bit."""
    vector_env = gymnasium.vector.AsyncVectorEnv([partial(CoverageEnv, **SMALL)] * 2)
    actions = np.random.default_rng(0).normal(size=(4, 2, 3, 2)).astype(np.float32)
    try:
        rows, _ = vector_env.reset(seed=[3, 4])
        together = [rows.copy()]
        rewards = []
        for action in actions:
            rows, reward, *_ = vector_env.step(action)
            together.append(rows.copy())
            rewards.append(reward)
    finally:
        vector_env.close()
    for k, seed in enumerate((3, 4)):
        alone = CoverageEnv(**SMALL)
        assert np.array_equal(alone.reset(seed=seed)[0], together[0][k])
        for cycle, action in enumerate(actions):
            rows, reward, *_ = alone.step(action[k])
            assert np.array_equal(rows, together[cycle + 1][k]) and reward == rewards[cycle][k]


def test_an_environment_without_an_episode_can_be_pickled() -> None:
    env = pickle.loads(pickle.dumps(CoverageEnv(**SMALL)))
    assert np.array_equal(env.reset(seed=3)[0], CoverageEnv(**SMALL).reset(seed=3)[0])


def test_an_episode_ends_when_no_robot_works() -> None:
    env = CoverageEnv(**SMALL, conditions=Conditions(failures=((1, 0.15), (2, 0.15), (3, 0.35))))
    env.reset(seed=0)
    ended = []
    for _ in range(4):
        rows, _, terminated, _, info = env.step(np.zeros((3, 2)))
        ended.append(terminated)
        assert [bool(row.any()) for row in rows] == info["working"].tolist()
    assert ended == [False, False, False, True]


def test_wrappers_rescale_actions_and_flatten_observations() -> None:
    wrapped = gymnasium.wrappers.RescaleAction(CoverageEnv(**SMALL), np.float32(-1.0), np.float32(1.0))
    wrapped = gymnasium.wrappers.FlattenObservation(wrapped)
    plain = CoverageEnv(**SMALL)
    assert wrapped.reset(seed=0)[0].shape == (3 * 19,)
    plain.reset(seed=0)
    rows = plain.step(np.full((3, 2), 2.0))[0]
    np.testing.assert_allclose(
        wrapped.step(np.full((3, 2), 0.5, dtype=np.float32))[0], rows.ravel(), atol=1e-6
    )


def test_steps_before_a_reset_and_invalid_actions_are_rejected() -> None:
    env = CoverageEnv(**SMALL)
    with pytest.raises(RobocovError, match=r"call reset\(\) first"):
        env.step(env.action_space.sample())
    env.reset(seed=0)
    with pytest.raises(
        ParameterError, match=r"actions: expected an array of shape \(3, 2\), got one of shape \(6,\)"
    ):
        env.step(np.zeros(6))
    with pytest.raises(
        ParameterError, match=r"actions: expected an array of shape \(3, 2\), got \[\[1, 2\], \[3\]\]"
    ):
        env.step([[1, 2], [3]])
    with pytest.raises(ParameterError, match=r"actions: expected an array of shape \(3, 2\), got 'ab'"):
        env.step("ab")
    vector_env = CoverageVectorEnv(num_envs=2, **SMALL)
    vector_env.reset(seed=0)
    with pytest.raises(ParameterError, match="expected one array for each of 2 environments, got 1"):
        vector_env.step(np.zeros((1, 3, 2)))
    with pytest.raises(ParameterError, match="actions: expected one array for each of 2 environments, got 3"):
        vector_env.step(3)
    with pytest.raises(
        ParameterError, match=r"actions: expected an array of shape \(3, 2\), got \[\[1, 2\], \[3\]\]"
    ):
        vector_env.step([np.zeros((3, 2)), [[1, 2], [3]]])


@pytest.mark.parametrize(
    ("name", "package"), [("CoverageEnv", "gymnasium"), ("CoverageParallelEnv", "pettingzoo")]
)
def test_a_missing_package_is_reported_with_its_extra(
    name: str, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.delitem(vars(learning), name)
    with pytest.raises(RobocovError) as caught:
        getattr(learning, name)
    assert str(caught.value) == f'{package} is not installed: pip install "robocov[rl]"'


def test_public_names_are_loaded_on_access() -> None:
    assert all(getattr(learning, name) is not None for name in learning.__all__)
    assert sorted(learning._MODULES) == sorted(learning.__all__) and set(learning.__all__) <= {*dir(learning)}
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        learning.nothing


@pytest.mark.slow
def test_policies_do_not_import_gymnasium_or_pettingzoo() -> None:
    script = "import sys, robocov_app.learning as learning\n"
    script += "learning.PolicyController, learning.ControllerPolicy, learning.CoverageTask\n"
    script += "print({'gymnasium', 'pettingzoo', 'pygame', 'matplotlib'} & set(sys.modules))"
    finished = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert finished.stdout == "set()\n"


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize(
    "changes",
    [
        {"reward": "own", "repeat": 1},
        {"observation": ObservationLayout(1, 6)},
        {"conditions": Conditions(loss=0.5)},
    ],
)
def test_environments_that_share_a_simulation_behave_as_single_environments(
    mode: AutoresetMode, changes: dict[str, Any]
) -> None:
    """Observations, rewards, ends and infos are equal bit for bit, also after the end of an episode."""
    options = {**SMALL, "maps": "rooms", "duration": 0.4, **changes}
    together = CoverageVectorEnv(3, autoreset_mode=mode, **options)
    separate = gymnasium.vector.SyncVectorEnv([partial(CoverageEnv, **options)] * 3, autoreset_mode=mode)
    assert together.action_space == separate.action_space
    assert together.observation_space == separate.observation_space
    assert together.metadata == separate.metadata
    rng = np.random.default_rng(0)
    environments = (together, separate)
    answers = [environment.reset(seed=5) for environment in environments]
    for step in range(12):
        assert data_equivalence(*answers, exact=True)
        action = rng.normal(scale=20.0, size=(3, 3, 2))
        answers = [environment.step(action) for environment in environments]
        if mode == AutoresetMode.DISABLED and answers[0][3].any():
            mask = answers[0][3]
            answers = [environment.reset(options={"reset_mask": mask.copy()}) for environment in environments]
        if step == 5:
            other = {"map": "square", "reset_mask": np.array([False, True, False])}
            answers = [environment.reset(seed=9, options=dict(other)) for environment in environments]


def test_vector_environments_reject_invalid_actions() -> None:
    vector_env = CoverageVectorEnv(2, **SMALL)
    with pytest.raises(RobocovError, match="reset"):
        vector_env.step(np.zeros((2, 3, 2)))
    vector_env.reset(seed=0)
    with pytest.raises(ParameterError, match="action of robot_3"):
        vector_env.step(np.pad(np.zeros((2, 2, 2)), ((0, 0), (0, 1), (0, 0)), constant_values=np.nan))


@pytest.mark.parametrize("num_envs", [0, -1, 2.5, True])
def test_an_invalid_number_of_environments_is_rejected(num_envs: Any) -> None:
    with pytest.raises(ParameterError, match="num_envs: expected a whole number of at least 1, got "):
        CoverageVectorEnv(num_envs, **SMALL)


def test_environments_that_share_a_simulation_render_their_own_robots() -> None:
    together = CoverageVectorEnv(2, render_mode="rgb_array", **SMALL)
    alone = CoverageEnv(render_mode="rgb_array", **SMALL)
    together.reset(seed=4)
    alone.reset(seed=5)
    second = together.envs[1]
    assert second.episode.shared is not None
    assert second.episode.observe().positions.tobytes() == alone.episode.observe().positions.tobytes()
    assert second.render().tobytes() == alone.render().tobytes()
