"""How far two placements of a team are apart, whichever robot is where."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array

if TYPE_CHECKING:
    from collections.abc import Sequence


def matched_distance(first: Array, second: Array) -> float:
    """Return the mean distance between the robots of two placements, matched as well as can be.

    Robots are alike: who stands where does not matter. So each place of one is assigned to one of the
    other with the least sum of straight (Euclidean) distances (Kuhn's assignment problem).

    Parameters
    ----------
    first, second : (n, 2) m

    Returns
    -------
    float, m
    """
    from scipy.optimize import linear_sum_assignment

    apart = np.hypot(*(first[:, None] - second[None]).transpose(2, 0, 1))
    rows, columns = linear_sum_assignment(apart)
    return float(apart[rows, columns].mean())


def spread_of_placements(placements: Array, starts: Sequence[str]) -> float:
    """Return the median matched distance between the ends of runs on one map from different starts.

    Parameters
    ----------
    placements : (m, n, 2) m
        Runs with nan do not count.
    starts : m names

    Returns
    -------
    float, m
        nan where there is no pair.
    """
    fine = np.isfinite(placements).all(axis=(1, 2))
    pairs = [
        matched_distance(placements[i], placements[k])
        for i, k in combinations(np.flatnonzero(fine).tolist(), 2)
        if starts[i] != starts[k]
    ]
    return float(np.median(pairs)) if pairs else float("nan")
