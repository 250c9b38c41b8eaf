from __future__ import annotations

import numpy as np
import pytest

from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov_app.learning import CoverageEnv, CoverageParallelEnv

SMALL = {"robots": 3, "lattice": 8, "dt": 0.05, "repeat": 2, "size": (200, 150)}


def test_a_picture_shows_the_present(cluttered: Environment) -> None:
    env = CoverageEnv(maps=cluttered, render_mode="rgb_array", **SMALL)
    env.reset(seed=0)
    first = env.render()
    assert (
        first.flags.writeable
        and first.shape == (150, 200, 3)
        and first.dtype == np.uint8
        and len(np.unique(first)) > 20
    )
    kept = first.copy()
    for _ in range(10):
        env.step(np.full((3, 2), 2.0))
    assert not np.array_equal(env.render(), kept)
    assert np.array_equal(first, kept)  # what was given is not drawn on again
    env.reset(seed=0)
    assert np.array_equal(env.render(), kept)


def test_another_map_is_drawn_anew(empty: Environment, cluttered: Environment) -> None:
    env = CoverageEnv(maps=[empty, cluttered], render_mode="rgb_array", **SMALL)
    long = Environment("long", ((0.0, 0.0), (30.0, 0.0), (30.0, 10.0), (0.0, 10.0)))
    at = {"positions": [[1.0, 1.0], [2.0, 1.0], [1.0, 2.0]]}
    for each in (empty, cluttered, long):
        env.reset(options={"map": each, **at})
        alone = CoverageEnv(maps=each, render_mode="rgb_array", **SMALL)
        alone.reset(options=at)
        assert np.array_equal(env.render(), alone.render())


def test_in_the_dark(empty: Environment) -> None:
    means = []
    for theme in ("light", "dark"):
        env = CoverageEnv(maps=empty, render_mode="rgb_array", theme=theme, **SMALL)
        env.reset(seed=0)
        means.append(env.render().mean())
    assert means[0] > 180 and means[1] < 80


def test_nothing_is_drawn_unasked(empty: Environment) -> None:
    env = CoverageParallelEnv(maps=empty, **SMALL)
    env.reset(seed=0)
    assert env.render() is None
    env.close()


def test_a_window(empty: Environment, monkeypatch: pytest.MonkeyPatch) -> None:
    import pygame

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = CoverageParallelEnv(maps=empty, render_mode="human", **SMALL)
    env.reset(seed=0)
    before = pygame.surfarray.array3d(pygame.display.get_surface())
    for _ in range(3):
        env.step(dict.fromkeys(env.agents, (3.0, 0.0)))
    assert env.render() is None
    assert (pygame.surfarray.array3d(pygame.display.get_surface()) != before).any()
    env.close()
    assert not pygame.display.get_init()
    env.close()


def test_what_cannot_be_shown(empty: Environment) -> None:
    with pytest.raises(ParameterError, match="render_mode: unknown mode 'rgb': did you mean 'rgb_array'"):
        CoverageEnv(maps=empty, render_mode="rgb")
    with pytest.raises(ParameterError, match="theme: unknown theme 'drak': did you mean 'dark'"):
        CoverageEnv(maps=empty, theme="drak")
    with pytest.raises(ParameterError, match=r"size: .* from 64 to 8192 pixels"):
        CoverageEnv(maps=empty, size=(10, 10))
