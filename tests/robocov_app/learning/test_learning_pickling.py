"""Learning environments are pickled and copied in the midst of an episode: checkpoints, search in trees."""

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


def copy_environment(env: Any, way: str) -> Any:
    return copy.deepcopy(env) if way == "deepcopy" else pickle.loads(pickle.dumps(env))


def digest(outcome: Any) -> list[Any]:
    """Return numbers of an outcome in their order, also those in dicts of agents."""
    if isinstance(outcome, dict):
        return [digest(outcome[key]) for key in sorted(outcome)]
    if isinstance(outcome, tuple):
        return [digest(each) for each in outcome]
    return np.asarray(outcome).tolist()


@pytest.mark.parametrize("way", ["pickle", "deepcopy"])
@pytest.mark.parametrize("kind", [CoverageEnv, CoverageVectorEnv, CoverageParallelEnv])
def test_an_episode_goes_on_bit_for_bit(kind: Any, way: str) -> None:
    env = kind(2, **SMALL) if kind is CoverageVectorEnv else kind(**SMALL)
    assert digest(copy_environment(env, way).reset(seed=3)) == digest(env.reset(seed=3))
    rng = np.random.default_rng(0)

    def sample_action() -> Any:
        if kind is CoverageParallelEnv:
            return {agent: rng.uniform(-1, 1, 2).astype(np.float32) for agent in env.possible_agents}
        shape = env.action_space.shape
        return rng.uniform(-1, 1, shape).astype(np.float32)

    for _ in range(3):
        env.step(sample_action())
    twin = copy_environment(env, way)
    for _ in range(3):
        act = sample_action()
        assert digest(twin.step(act)) == digest(env.step(act))
    # what comes by chance goes on as well
    assert digest(twin.reset()) == digest(env.reset())


def test_a_copy_is_independent_also_after_a_picture() -> None:
    env = CoverageEnv(render_mode="rgb_array", size=(128, 128), **SMALL)
    env.reset(seed=1)
    picture = env.render()
    twin = copy.deepcopy(env)
    for _ in range(10):
        twin.step(np.ones((3, 2), dtype=np.float32))
    assert env.episode is not None and env.episode.cycle == 0
    np.testing.assert_array_equal(env.render(), picture)
    assert not np.array_equal(pickle.loads(pickle.dumps(twin)).render(), picture)


def test_make_vec_finds_the_vector_environment() -> None:
    alike = []
    for mode in ("vector_entry_point", "sync"):
        envs = gymnasium.make_vec(REGISTERED, num_envs=2, vectorization_mode=mode, **SMALL)
        assert isinstance(envs, CoverageVectorEnv) == (mode == "vector_entry_point")
        assert envs.num_envs == 2 and envs.spec is not None and envs.spec.id == ID
        rows, _ = envs.reset(seed=5)
        alike.append((rows, *envs.step(np.ones((2, 3, 2), dtype=np.float32))[:4]))
        envs.close()
    for one, other in zip(*alike, strict=True):
        np.testing.assert_array_equal(one, other)
    single = gymnasium.make(REGISTERED, **SMALL)
    np.testing.assert_array_equal(single.reset(seed=5)[0], alike[0][0][0])


@pytest.mark.slow
def test_make_vec_in_other_processes() -> None:
    envs = gymnasium.make_vec(REGISTERED, num_envs=2, vectorization_mode="async", **SMALL)
    try:
        assert envs.reset(seed=5)[0].shape == envs.observation_space.shape
    finally:
        envs.close()
