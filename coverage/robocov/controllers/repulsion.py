"""The repulsive part that RPF and RAPF share: (25)."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array
from robocov.observation import Observations
from robocov.potential import repulsive_force, separation

_TOGETHER = 1e-12
"""Distance in metres at which two robots in one place are taken to be."""


def repulsion_from_robots(seen: Observations, k_rep: float, rho_0: float) -> Array:
    """Return the sum of (24) over the neighbours within `rho_0`, (n, 2) N."""
    n = len(seen.positions)
    robot, neighbour, offset, distance = seen.neighbours_within(rho_0)
    if len(robot) == 0:
        return np.zeros((n, 2))
    if distance.min() < _TOGETHER:
        together = distance < _TOGETHER
        offset[together] = _TOGETHER * separation(robot[together], neighbour[together])
        distance = np.maximum(distance, _TOGETHER)
    force = repulsive_force(offset, distance, k_rep, rho_0)
    total = np.empty((n, 2))
    total[:, 0] = np.bincount(robot, force[:, 0], minlength=n)
    total[:, 1] = np.bincount(robot, force[:, 1], minlength=n)
    return total


def repulsion_from_obstacle(seen: Observations, k_rep: float, rho_0: float) -> Array:
    """Return (24) from the single closest obstacle point, (n, 2) N; zero where none is sensed."""
    offset = seen.positions - seen.obstacle_points
    distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
    unseen = np.isnan(distance)
    if unseen.any():
        offset[unseen] = 0.0
        distance[unseen] = rho_0
    return repulsive_force(offset, distance, k_rep, rho_0)
