"""What a learner is rewarded for: the decrease of the coverage cost (22), and no contacts."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np

from robocov.arrays import Array
from robocov.cost import CoverageResult
from robocov.errors import ParameterError, unknown_name

Reward: TypeAlias = Literal["shared", "own", "level"]
"""Who is rewarded for what; see `shares`."""

REWARDS: tuple[Reward, ...] = ("shared", "own", "level")


def checked_reward(reward: str) -> Reward:
    """Return the kind of reward that is meant; raises ParameterError when there is none of that name."""
    for known in REWARDS:
        if reward == known:
            return known
    raise ParameterError(f"reward: {unknown_name('kind of reward', str(reward), REWARDS)}")


def reference_distance(area: float, robots: int) -> float:
    """Return a mean distance in metres that no placement of so many robots in so much area goes below.

    The mean distance to the middle of a disc, 2/3 of its radius, is the least among all shapes of its
    area; with n equal parts of the area A it is ``2/3 sqrt(A / (pi n))``. It makes costs of maps and teams of
    different sizes comparable.

    >>> round(reference_distance(100.0, 6), 3)
    1.536
    """
    return 2.0 / 3.0 * float(np.sqrt(area / (np.pi * robots)))


def shares(reward: Reward, before: CoverageResult, after: CoverageResult, part: float) -> Array:
    """Return what each robot gets for what became of the mean distance, (n,) m.

    ``shared``: its decrease, the same for all; summed over a run it is the whole decrease. ``own``: the part
    of the decrease that the robot's own move made, by the gradients of the cost before and after (the
    trapezoidal rule); what these leave over is divided equally, so that all parts sum up to the decrease.
    ``level``: less the mean distance itself, times the `part` of the run that has gone by in between.
    """
    n = len(after.positions)
    if reward == "level":
        return np.full(n, -after.mean_distance * part)
    decrease = before.mean_distance - after.mean_distance
    if reward == "shared":
        return np.full(n, decrease)
    moved = after.positions - before.positions
    slope = _slope(before) + _slope(after)
    own = -0.5 * (slope * moved).sum(axis=1)
    return np.asarray(own + (decrease - own.sum()) / n)


def _slope(result: CoverageResult) -> Array:
    """Return the derivative of the mean distance by every robot's position, (n, 2)."""
    if not result.value:
        return np.zeros_like(result.positions)
    return result.gradient * (result.mean_distance / result.value)
