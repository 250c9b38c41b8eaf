"""Voronoi cells as sets of sample points, for functions without closed-form integrals, such as estimates."""

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel


@kernel
def find_own_samples(
    samples: Array, positions: Array, robot: IntArray, neighbor_positions: Array
) -> BoolArray:
    """Find the samples in the cell of each robot: no neighbor is nearer to them than the robot is.

    Parameters
    ----------
    samples : (k, 2) array, m
    positions : (n, 2) array, m
        Positions of the robots.
    robot : (m,) int array
        The robot in each pair of a robot and one of its neighbors.
    neighbor_positions : (m, 2) array, m
        Position of the neighbor in each pair, as known to the robot.

    Returns
    -------
    (n, k) bool array
    """
    is_own = np.ones((len(positions), len(samples)), dtype=np.bool_)
    for m in range(len(robot)):
        i = robot[m]
        for k in range(len(samples)):
            if is_own[i, k]:
                x = samples[k, 0]
                y = samples[k, 1]
                dx = x - positions[i, 0]
                dy = y - positions[i, 1]
                neighbor_dx = x - neighbor_positions[m, 0]
                neighbor_dy = y - neighbor_positions[m, 1]
                is_own[i, k] = dx**2 + dy**2 <= neighbor_dx**2 + neighbor_dy**2
    return is_own


def compute_sample_centroids(is_own: BoolArray, samples: Array, mass: Array, positions: Array) -> Array:
    """Compute the centroids of cells that consist of samples.

    Parameters
    ----------
    is_own : (n, k) bool array
        Whether each sample belongs to each cell.
    samples : (k, 2) array, m
    mass : (k,) or (n, k) array
        Mass of each sample, the same for all robots or as known to each robot.
    positions : (n, 2) array, m
        Positions of the robots, which replace the centroids of cells without mass.

    Returns
    -------
    (n, 2) array, m
    """
    weight = is_own * mass
    total = weight.sum(axis=1)
    moment_x = (weight * samples[:, 0]).sum(axis=1)
    moment_y = (weight * samples[:, 1]).sum(axis=1)
    is_filled = total > 0.0
    centroid = np.column_stack([moment_x, moment_y]) / np.where(is_filled, total, 1.0)[:, None]
    return np.where(is_filled[:, None], centroid, positions)
