"""Voronoi cells as sets of sample places, for what has no closed integrals: maps and estimates."""

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel


@kernel
def own_samples(places: Array, positions: Array, robot: IntArray, heard: Array) -> BoolArray:
    """Return which of (k, 2) places are in the cell of each robot, (n, k): nobody it hears is nearer.

    Row m of `heard`, (m, 2), is where the robot with the number ``robot[m]`` knows a neighbour to be.
    """
    mine = np.ones((len(positions), len(places)), dtype=np.bool_)
    for m in range(len(robot)):
        i = robot[m]
        for k in range(len(places)):
            if mine[i, k]:
                x, y = places[k, 0], places[k, 1]
                own = (x - positions[i, 0]) ** 2 + (y - positions[i, 1]) ** 2
                mine[i, k] = own <= (x - heard[m, 0]) ** 2 + (y - heard[m, 1]) ** 2
    return mine


def centroids(mine: BoolArray, places: Array, mass: Array, positions: Array) -> Array:
    """Return the centroids, (n, 2), of samples with a mass, (k,) or (n, k); of none, the positions."""
    weight = mine * mass
    total = weight.sum(axis=1)
    middle = np.column_stack([(weight * part).sum(axis=1) for part in places.T])
    full = total > 0.0
    return np.where(full[:, None], middle / np.where(full, total, 1.0)[:, None], positions)
