"""What robots head for: the centroids of their cells, or goals of another kind."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array

SAME = 0.05
"""Metres within which a goal is the centroid: a record's goals are those of a moment before its end."""

CENTROID, GOAL = "cell centroid", "goal"


def are_centroids(goals: Array, centroids: Array) -> bool:
    """Whether all goals that there are, (n, 2) m with nan for none, are the centroids, (n, 2) m."""
    known = np.isfinite(goals).all(axis=1)
    return bool((np.hypot(*(goals - centroids)[known].T) <= SAME).all())
