"""Images and the window of a learning environment."""

from __future__ import annotations

import numpy as np
import pytest

from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov_app.learning import CoverageEnv, CoverageParallelEnv

SMALL = {"robots": 3, "lattice": 8, "dt": 0.05, "repeat": 2, "size": (200, 150)}


def test_images_show_the_current_state(cluttered: Environment) -> None:
    env = CoverageEnv(maps=cluttered, render_mode="rgb_array", **SMALL)
    env.reset(seed=0)
    first = env.render()
    assert first.flags.writeable
    assert first.shape == (150, 200, 3)
    assert first.dtype == np.uint8
    assert len(np.unique(first)) > 20
    initial = first.copy()
    for _ in range(10):
        env.step(np.full((3, 2), 2.0))
    assert not np.array_equal(env.render(), initial)
    assert np.array_equal(first, initial)  # A returned image does not change later.
    env.reset(seed=0)
    assert np.array_equal(env.render(), initial)


def test_each_map_is_drawn_with_its_own_background(empty: Environment, cluttered: Environment) -> None:
    env = CoverageEnv(maps=[empty, cluttered], render_mode="rgb_array", **SMALL)
    long = Environment("long", ((0.0, 0.0), (30.0, 0.0), (30.0, 10.0), (0.0, 10.0)))
    starts = {"positions": [[1.0, 1.0], [2.0, 1.0], [1.0, 2.0]]}
    for each in (empty, cluttered, long):
        env.reset(options={"map": each, **starts})
        alone = CoverageEnv(maps=each, render_mode="rgb_array", **SMALL)
        alone.reset(options=starts)
        assert np.array_equal(env.render(), alone.render())


def test_images_have_the_colors_of_the_theme(empty: Environment) -> None:
    means = []
    for theme in ("light", "dark"):
        env = CoverageEnv(maps=empty, render_mode="rgb_array", theme=theme, **SMALL)
        env.reset(seed=0)
        means.append(env.render().mean())
    assert means[0] > 180 and means[1] < 80


def test_without_a_render_mode_nothing_is_drawn(empty: Environment) -> None:
    env = CoverageParallelEnv(maps=empty, **SMALL)
    env.reset(seed=0)
    assert env.render() is None
    env.close()


def test_the_window_is_updated_and_closed(empty: Environment, monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_invalid_options_of_rendering_are_rejected(empty: Environment) -> None:
    with pytest.raises(ParameterError, match="render_mode: unknown mode 'rgb': did you mean 'rgb_array'"):
        CoverageEnv(maps=empty, render_mode="rgb")
    with pytest.raises(ParameterError, match="theme: unknown theme 'drak': did you mean 'dark'"):
        CoverageEnv(maps=empty, theme="drak")
    with pytest.raises(ParameterError, match=r"size: .* from 64 to 8192 pixels"):
        CoverageEnv(maps=empty, size=(10, 10))
