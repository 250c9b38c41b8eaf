"""Rewards: how a change of the coverage cost is shared among robots."""

from typing import Literal, TypeAlias, get_args

import numpy as np

from robocov.arrays import Array
from robocov.cost import CoverageResult

Reward: TypeAlias = Literal["shared", "own", "level"]
"""Scheme by which a reward is shared among robots; see `share_reward`."""
REWARDS: tuple[Reward, ...] = get_args(Reward)


def compute_reference_distance(area: float, robots: int) -> float:
    """Compute a lower bound of the mean distance of any placement.

    It makes the costs of maps and teams of different sizes comparable.

    Parameters
    ----------
    area : float
        Area of the free space, m².
    robots : int

    Returns
    -------
    float
        m

    Notes
    -----
    The mean distance to the center of a disc, 2/3 of its radius, is the lowest among all shapes of its area.
    With n equal parts of the area A it is ``2/3 sqrt(A / (π n))``.

    Examples
    --------
    >>> round(compute_reference_distance(area=100.0, robots=6), 3)
    1.536
    """
    return 2.0 / 3.0 * float(np.sqrt(area / (np.pi * robots)))


def share_reward(
    reward: Reward, before: CoverageResult, after: CoverageResult, elapsed_fraction: float
) -> Array:
    """Share the change of the mean distance among robots.

    Parameters
    ----------
    reward : str
        "shared": each robot gets the decrease, whose sum over a run is the whole decrease. "own": each robot
        gets the part that its own motion caused, and an equal share of the rest. "level": each robot gets
        the negative mean distance times `elapsed_fraction`.
    before, after : CoverageResult
        Costs of n robots.
    elapsed_fraction : float
        Time between both, relative to the duration of the episode.

    Returns
    -------
    (n,) array, m

    Notes
    -----
    The part of a robot's own motion follows from the gradients before and after it by the trapezoidal rule.
    """
    n = len(after.positions)
    if reward == "level":
        return np.full(n, -after.mean_distance * elapsed_fraction)
    decrease = before.mean_distance - after.mean_distance
    if reward == "shared":
        return np.full(n, decrease)
    gradient_sum = np.zeros_like(after.positions)
    for result in (before, after):
        if result.value:
            gradient_sum += result.gradient * (result.mean_distance / result.value)
    own = -0.5 * (gradient_sum * (after.positions - before.positions)).sum(axis=1)
    return np.asarray(own + (decrease - own.sum()) / n)
