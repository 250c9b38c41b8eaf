"""Rewards: how a change in the coverage cost is shared among the robots."""

from typing import Literal, TypeAlias, get_args

import numpy as np

from robocov.cost import CoverageResult
from robocov.typing import FloatArray

Reward: TypeAlias = Literal["shared", "own", "level"]
"""Scheme by which a reward is shared among the robots; see `share_reward`."""
REWARDS: tuple[Reward, ...] = get_args(Reward)


def compute_reference_distance(area: float, robots: int) -> float:
    """Compute a lower bound of the mean distance for a given area and number of robots.

    Divided by this bound, the costs of maps and teams of different sizes are comparable.

    Parameters
    ----------
    area : float
        Area of the free space, m².
    robots : int

    Returns
    -------
    float
        Lower bound, m.

    Notes
    -----
    Among all shapes of equal area, a disc has the smallest mean distance to its center: 2/3 of its radius.
    For n discs that together have the area A, that is ``2/3 sqrt(A / (π n))``.

    Examples
    --------
    >>> round(compute_reference_distance(area=100.0, robots=6), 3)
    1.536
    """
    return 2.0 / 3.0 * float(np.sqrt(area / (np.pi * robots)))


def share_reward(
    reward: Reward, before: CoverageResult, after: CoverageResult, elapsed_fraction: float
) -> FloatArray:
    """Compute the reward of each robot for a change in the mean distance.

    Parameters
    ----------
    reward : str
        "shared": each robot gets the whole decrease of the mean distance. "own": each robot gets the decrease
        that its own motion caused, and an equal share of the rest. "level": each robot gets the negative mean
        distance times `elapsed_fraction`.
    before : CoverageResult
        Cost of the n robots at the last reward.
    after : CoverageResult
        Cost of the same robots now.
    elapsed_fraction : float
        Time between the two costs, relative to the duration of the episode.

    Returns
    -------
    (n,) array, m

    See Also
    --------
    CoverageTask : Task of an environment, with its reward.

    Notes
    -----
    The decrease that a robot's own motion caused is the negative scalar product of its displacement and the
    gradient of the mean distance, which is averaged over both costs (trapezoidal rule).
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
            gradient_sum += _compute_mean_distance_gradient(result)
    own_decreases = -0.5 * (gradient_sum * (after.positions - before.positions)).sum(axis=1)
    return np.asarray(own_decreases + (decrease - own_decreases.sum()) / n)


def _compute_mean_distance_gradient(result: CoverageResult) -> FloatArray:
    """Convert the gradient of the cost value, which must not be 0, to that of the mean distance, (n, 2)."""
    return np.asarray(result.gradient * (result.mean_distance / result.value))
