"""Benchmark of learning environments, compared with a plain gymnasium environment of point masses."""

from collections.abc import Iterator
from functools import partial
from itertools import cycle
from time import process_time
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from robocov_app.learning import CoverageEnv, CoverageVectorEnv
from robocov_app.speed_benchmarks.measure import Case, Row, measure_interleaved

ROBOTS = 6
"""Number of robots in each environment."""
LATTICE = 32
"""Number of lattice sites along each side of the map."""
ENVIRONMENTS = 64
"""Number of environments that are stepped together in the vector environment."""
SIDE_M = 20.0
"""Side of the square in which the point masses move."""
BASELINE = f"{ROBOTS} point masses, gymnasium"
"""Name of the baseline."""
SINGLE_GOAL = 0.7
"""Minimum number of steps per second of a single environment, divided by that of the baseline."""
VECTOR_GOAL = 4.0
"""Minimum number of steps per second of a vector environment, divided by that of the baseline."""
EARLIER_RATIO = 10.0
"""Earlier ratio; see `Row.earlier_ratio`."""
_DT_S = 1.0 / 60.0
_MAX_FORCE_N = 4.0
_VISCOSITY = 2.0
_MAX_SPEED_M_S = 1.0
_ACTION_SETS = 100
"""Number of different actions, which are used in turn."""
_QUICK_ROUNDS = 20
"""Number of rounds of the quick benchmark."""
_FULL_ROUNDS = 200
"""Number of rounds of the full benchmark."""


class PointMasses(gymnasium.Env[Any, Any]):
    """Baseline: point masses in numpy, with a reward that is computed from straight-line distances."""

    def __init__(self) -> None:
        self.action_space = Box(-_MAX_FORCE_N, _MAX_FORCE_N, (ROBOTS, 2), np.float32)
        self.observation_space = Box(-SIDE_M, SIDE_M, (ROBOTS, 4), np.float32)
        axis = (np.arange(LATTICE) + 0.5) * (SIDE_M / LATTICE)
        self._sites = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 1, 2)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Any]:
        """Place the robots at random positions, at rest."""
        super().reset(seed=seed)
        self._positions = self.np_random.uniform(0.0, SIDE_M, (ROBOTS, 2))
        self._velocities = np.zeros((ROBOTS, 2))
        return self._observe(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, Any]:
        """Apply a force to each robot for one time step; the reward is the negative mean distance."""
        self._velocities += (action - _VISCOSITY * self._velocities) * _DT_S
        excess = np.hypot(*self._velocities.T)[:, None] / _MAX_SPEED_M_S
        self._velocities /= np.maximum(excess, 1.0)
        self._positions = np.clip(self._positions + self._velocities * _DT_S, 0.0, SIDE_M)
        distances = np.hypot(*np.moveaxis(self._sites - self._positions, -1, 0))
        return self._observe(), -float(distances.min(axis=1).mean()), False, False, {}

    def _observe(self) -> Any:
        return np.hstack([self._positions, self._velocities]).astype(np.float32)


def list_cases(*, quick: bool = False) -> list[Case]:
    """Return the benchmark case of learning environments."""
    return [partial(_measure_environments, quick=quick)]


def _measure_environments(*, quick: bool) -> Iterator[Row]:
    """Measure a step of one environment, and of many environments together, compared with point masses."""
    options: dict[str, Any] = {"robots": ROBOTS, "lattice": LATTICE, "repeat": 1, "duration": 1e6}
    plain = PointMasses()
    single = CoverageEnv(**options)
    vector = CoverageVectorEnv(ENVIRONMENTS, **options)
    for environment in (plain, single, vector):
        environment.reset(seed=0)
    rng = np.random.default_rng(0)
    samples = rng.normal(scale=2.0, size=(_ACTION_SETS, ENVIRONMENTS, ROBOTS, 2))
    actions = cycle(samples.clip(-_MAX_FORCE_N, _MAX_FORCE_N).astype(np.float32))
    calls = {
        "plain": lambda: plain.step(next(actions)[0]),
        "single": lambda: single.step(next(actions)[0]),
        "vector": lambda: vector.step(next(actions)),
    }
    # CPU time, because a step of many environments is long enough to be interrupted by other programs.
    rounds = _QUICK_ROUNDS if quick else _FULL_ROUNDS
    times = measure_interleaved(calls, rounds, clock=process_time)
    for name, count, min_speed_ratio in (("single", 1, SINGLE_GOAL), ("vector", ENVIRONMENTS, VECTOR_GOAL)):
        seconds = times[name] / count
        yield Row(
            "learning",
            "a step with reward",
            {"environments": count},
            seconds,
            baseline=BASELINE,
            baseline_seconds=times["plain"],
            max_ratio=1 / min_speed_ratio,
            note=f"{times['plain'] / seconds:.2f} times the steps per second of the baseline",
            earlier_ratio=EARLIER_RATIO,
        )
