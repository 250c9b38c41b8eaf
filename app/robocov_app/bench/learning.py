"""Steps of learning environments against a plain one of gymnasium: point masses in an empty square."""

from collections.abc import Iterator
from functools import partial
from itertools import cycle
from time import process_time
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from robocov_app.bench.measure import Case, Row, in_turn
from robocov_app.learning import CoverageEnv, CoverageVectorEnv

ROBOTS, LATTICE, TOGETHER = 6, 32, 64
SIDE = 20.0  # of the square that the point masses are in, m
YARDSTICK = f"{ROBOTS} point masses, gymnasium"


class PointMasses(gymnasium.Env[Any, Any]):
    """Robots without bodies, rewarded each step by distances as the crow flies, in numpy."""

    def __init__(self) -> None:
        self.action_space = Box(-4.0, 4.0, (ROBOTS, 2), np.float32)
        self.observation_space = Box(-SIDE, SIDE, (ROBOTS, 4), np.float32)
        axis = (np.arange(LATTICE) + 0.5) * (SIDE / LATTICE)
        self._sites = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 1, 2)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Any]:
        super().reset(seed=seed)
        self._positions = self.np_random.uniform(0.0, SIDE, (ROBOTS, 2))
        self._velocities = np.zeros((ROBOTS, 2))
        return self._seen(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, Any]:
        self._velocities += (action - 2.0 * self._velocities) / 60.0
        self._velocities /= np.maximum(np.hypot(*self._velocities.T)[:, None], 1.0)
        self._positions = np.clip(self._positions + self._velocities / 60.0, 0.0, SIDE)
        distances = np.hypot(*np.moveaxis(self._sites - self._positions, -1, 0))
        return self._seen(), -float(distances.min(axis=1).mean()), False, False, {}

    def _seen(self) -> Any:
        return np.hstack([self._positions, self._velocities]).astype(np.float32)


def cases(*, quick: bool = False) -> list[Case]:
    return [partial(_rows, quick)]


def _rows(quick: bool) -> Iterator[Row]:
    options: dict[str, Any] = {"robots": ROBOTS, "lattice": LATTICE, "repeat": 1, "duration": 1e6}
    plain, single = PointMasses(), CoverageEnv(**options)
    many = CoverageVectorEnv(TOGETHER, **options)
    for env in (plain, single, many):
        env.reset(seed=0)
    rng = np.random.default_rng(0)
    actions = cycle(rng.normal(scale=2.0, size=(100, TOGETHER, ROBOTS, 2)).clip(-4.0, 4.0).astype(np.float32))
    calls = {
        "plain": lambda: plain.step(next(actions)[0]),
        "single": lambda: single.step(next(actions)[0]),
        "many": lambda: many.step(next(actions)),
    }
    # processor time: a step of many is long enough to be interrupted by other programs
    taken = in_turn(calls, 20 if quick else 200, clock=process_time)
    for name, count, goal in (("single", 1, 0.7), ("many", TOGETHER, 4.0)):
        each, plain_step = taken[name] / count, taken["plain"]
        rate = f"{plain_step / each:.2f} times its steps a second"
        yardstick = YARDSTICK, plain_step, 1 / goal
        size = {"environments": count}
        yield Row("learning", "a step with reward", size, each, *yardstick, note=rate, before=10.0)
