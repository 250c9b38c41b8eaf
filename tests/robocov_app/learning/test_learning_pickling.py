"""Learning environments can be pickled and copied during an episode, for checkpoints and tree search."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest

from robocov_app.learning.gym import ID, CoverageEnv, CoverageVectorEnv
from robocov_app.learning.parallel import CoverageParallelEnv

REGISTERED = f"robocov_app.learning.gym:{ID}"
SMALL: dict[str, Any] = {"maps": "square", "robots": 3, "lattice": 16}


def copy_environment(env: Any, method: str) -> Any:
    return copy.deepcopy(env) if method == "deepcopy" else pickle.loads(pickle.dumps(env))


def convert_to_lists(outcome: Any) -> list[Any]:
    """Convert the arrays of an outcome to lists, with agents in alphabetical order."""
    if isinstance(outcome, dict):
        return [convert_to_lists(outcome[key]) for key in sorted(outcome)]
    if isinstance(outcome, tuple):
        return [convert_to_lists(each) for each in outcome]
    return np.asarray(outcome).tolist()


@pytest.mark.parametrize("method", ["pickle", "deepcopy"])
@pytest.mark.parametrize("kind", [CoverageEnv, CoverageVectorEnv, CoverageParallelEnv])
def test_a_copied_episode_continues_identically(kind: Any, method: str) -> None:
    env = kind(2, **SMALL) if kind is CoverageVectorEnv else kind(**SMALL)
    assert convert_to_lists(copy_environment(env, method).reset(seed=3)) == convert_to_lists(
        env.reset(seed=3)
    )
    rng = np.random.default_rng(0)

    def sample_action() -> Any:
        if kind is CoverageParallelEnv:
            return {agent: rng.uniform(-1, 1, 2).astype(np.float32) for agent in env.possible_agents}
        shape = env.action_space.shape
        return rng.uniform(-1, 1, shape).astype(np.float32)

    for _ in range(3):
        env.step(sample_action())
    copied = copy_environment(env, method)
    for _ in range(3):
        action = sample_action()
        assert convert_to_lists(copied.step(action)) == convert_to_lists(env.step(action))
    # The states of the random generators are copied as well.
    assert convert_to_lists(copied.reset()) == convert_to_lists(env.reset())


def test_a_copy_is_independent_after_rendering() -> None:
    env = CoverageEnv(render_mode="rgb_array", size=(128, 128), **SMALL)
    env.reset(seed=1)
    image = env.render()
    copied = copy.deepcopy(env)
    for _ in range(10):
        copied.step(np.ones((3, 2), dtype=np.float32))
    assert env.episode is not None and env.episode.cycle == 0
    np.testing.assert_array_equal(env.render(), image)
    assert not np.array_equal(pickle.loads(pickle.dumps(copied)).render(), image)


def test_make_vec_returns_the_vector_environment() -> None:
    outcomes = []
    for mode in ("vector_entry_point", "sync"):
        envs = gymnasium.make_vec(REGISTERED, num_envs=2, vectorization_mode=mode, **SMALL)
        assert isinstance(envs, CoverageVectorEnv) == (mode == "vector_entry_point")
        assert envs.num_envs == 2 and envs.spec is not None and envs.spec.id == ID
        rows, _ = envs.reset(seed=5)
        outcomes.append((rows, *envs.step(np.ones((2, 3, 2), dtype=np.float32))[:4]))
        envs.close()
    for one, other in zip(*outcomes, strict=True):
        np.testing.assert_array_equal(one, other)
    single = gymnasium.make(REGISTERED, **SMALL)
    np.testing.assert_array_equal(single.reset(seed=5)[0], outcomes[0][0][0])


@pytest.mark.slow
def test_make_vec_supports_environments_in_processes() -> None:
    envs = gymnasium.make_vec(REGISTERED, num_envs=2, vectorization_mode="async", **SMALL)
    try:
        assert envs.reset(seed=5)[0].shape == envs.observation_space.shape
    finally:
        envs.close()
