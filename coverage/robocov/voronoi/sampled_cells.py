"""Voronoi cells as sets of sample points, for functions without closed-form integrals, such as estimates."""

import numpy as np

from robocov.compiled import kernel
from robocov.typing import BoolArray, FloatArray, IntArray


@kernel
def find_own_samples(
    samples: FloatArray, positions: FloatArray, robots: IntArray, neighbor_positions: FloatArray
) -> BoolArray:
    """Find the samples in the cell of each robot: those at least as close to it as to any neighbor.

    Parameters
    ----------
    samples : (k, 2) array, m
        Positions of the samples.
    positions : (n, 2) array, m
        Positions of the robots.
    robots : (m,) int array
        Index of the robot in each pair of a robot and one of its neighbors.
    neighbor_positions : (m, 2) array, m
        Position of the neighbor in each pair, as known to the robot.

    Returns
    -------
    (n, k) bool array
        Whether each sample is in the cell of each robot.
    """
    is_own = np.ones((len(positions), len(samples)), dtype=np.bool_)
    for m in range(len(robots)):
        i = robots[m]
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


def compute_sample_centroids(
    is_own: BoolArray, samples: FloatArray, masses: FloatArray, positions: FloatArray
) -> FloatArray:
    """Compute the centroids of cells that consist of samples.

    Parameters
    ----------
    is_own : (n, k) bool array
        Whether each sample is in each cell.
    samples : (k, 2) array, m
        Positions of the samples.
    masses : (k,) or (n, k) array
        Mass of each sample, the same for all robots or as known to each robot.
    positions : (n, 2) array, m
        Positions of the robots.

    Returns
    -------
    (n, 2) array, m
        Centroid of each cell. If a cell has no mass, it is the position of the robot.
    """
    cell_masses = is_own * masses
    total_masses = cell_masses.sum(axis=1)
    moments_x = (cell_masses * samples[:, 0]).sum(axis=1)
    moments_y = (cell_masses * samples[:, 1]).sum(axis=1)
    has_mass = total_masses > 0.0
    centroids = np.column_stack([moments_x, moments_y]) / np.where(has_mass, total_masses, 1.0)[:, None]
    return np.where(has_mass[:, None], centroids, positions)
