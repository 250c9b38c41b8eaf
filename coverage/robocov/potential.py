"""The forces (24) and (27) of the paper's artificial potentials (23) and (26).

Three cases that the paper leaves open are decided as follows:

- *Contact*: the force (24) is infinite at distance zero. Below `CONTACT_DISTANCE`, its magnitude is constant
  and the potential is linear in the distance, so that F = -grad U holds everywhere.
- *Robots at the same position*: there is no direction from one to the other. They are pushed apart in
  opposite directions that depend only on the indices of the two robots.
- *Saturation*: the force (27) grows with the third power of the distance, without bound, and would push
  robots against the repulsion of walls and through them. Its magnitude is therefore limited. Where the limit
  applies, the potential is linear in the distance.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.observation.bins import count_starts, find_bin, sort_into_bins
from robocov.observation.neighbors import NeighborPositions
from robocov.typing import FloatArray, IntArray

CONTACT_DISTANCE = 0.01
"""Distance below which the repulsion no longer grows, m: a tenth of the default radius of a robot."""
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
"""The golden angle, rad, whose multiples are spread evenly over all directions."""

_MIN_DISTANCE = 1e-12
"""Distance that is assumed between robots that are closer together, such as at the same position, m."""
_MIN_GOAL_DISTANCE = 1e-300
"""Minimum divisor, m; prevents division by zero."""


class PotentialGains(NamedTuple):
    """Parameters of the potentials.

    Attributes
    ----------
    k_rep : float, N m³
        Strength of the repulsion (24).
    rho_0 : float, m
        Range of the repulsion.
    k_att : float, N/m³
        Strength of the attraction (27).
    max_attraction : float, N
        Limit of the magnitude of the attraction; may be infinite.
    """

    k_rep: float
    rho_0: float
    k_att: float
    max_attraction: float


class PotentialForces(NamedTuple):
    """The forces on n robots.

    Attributes
    ----------
    total : (n, 2) array, N
        Sum of the other three forces on each robot.
    attraction : (n, 2) array, N
        The force (27) toward the goal.
    robots : (n, 2) array, N
        Sum of the forces (24) from the other robots within `rho_0`.
    obstacle : (n, 2) array, N
        The force (24) from the closest obstacle point.
    """

    total: FloatArray
    attraction: FloatArray
    robots: FloatArray
    obstacle: FloatArray


@kernel
def compute_potential_forces(
    positions: FloatArray,
    neighbors: NeighborPositions,
    obstacle_points: FloatArray,
    goals: FloatArray,
    gains: PotentialGains,
) -> PotentialForces:
    """Compute the repulsion (25) from neighbors and obstacles, and the attraction (27), of each robot.

    Parameters
    ----------
    positions : (n, 2) array, m
        Positions of the robots.
    neighbors : NeighborPositions
        The other robots that repel each robot.
    obstacle_points : (n, 2) array, m
        Closest obstacle point of each robot; nan if none is in range.
    goals : (n, 2) array, m
        Point toward which each robot is attracted.
    gains : PotentialGains

    Returns
    -------
    PotentialForces
    """
    n = len(positions)
    attraction = np.zeros((n, 2))
    obstacle = np.zeros((n, 2))
    for i in range(n):
        x = positions[i, 0]
        y = positions[i, 1]
        dx = x - obstacle_points[i, 0]
        dy = y - obstacle_points[i, 1]
        factor = _compute_repulsion_factor(np.sqrt(dx * dx + dy * dy), gains.k_rep, gains.rho_0)
        # Without an obstacle point, the distance is nan and the factor is 0. The product of the factor and dx
        # would be nan.
        if factor > 0.0:
            obstacle[i, 0] = factor * dx
            obstacle[i, 1] = factor * dy
        dx = goals[i, 0] - x
        dy = goals[i, 1] - y
        factor = _compute_attraction_factor(dx * dx + dy * dy, gains.k_att, gains.max_attraction)
        attraction[i, 0] = factor * dx
        attraction[i, 1] = factor * dy
    if neighbors.is_complete:
        robots = _sum_team_repulsion(positions, gains)
    else:
        robots = _sum_neighbor_repulsion(positions, neighbors, gains)
    total = attraction + robots + obstacle
    return PotentialForces(total, attraction, robots, obstacle)


@kernel
def compute_separations(robots: IntArray, neighbors: IntArray) -> FloatArray:
    """Compute the directions in which pairs of robots at the same position are pushed apart.

    Parameters
    ----------
    robots, neighbors : (m,) int array
        Indices of the first and the second robot of each pair.

    Returns
    -------
    (m, 2) array
        Unit vectors in which the first robot of each pair is pushed. The second one is pushed the other way.
    """
    directions = np.empty((len(robots), 2))
    for k in range(len(robots)):
        x, y = _compute_separation(robots[k], neighbors[k])
        directions[k, 0] = x
        directions[k, 1] = y
    return directions


def compute_spread_directions(numbers: IntArray) -> FloatArray:
    """Compute directions that are spread evenly, one for each of several whole numbers.

    Parameters
    ----------
    numbers : (k,) int array
        Multiples of the golden angle.

    Returns
    -------
    (k, 2) array
        Unit vectors at these multiples, which are spread evenly over all directions.
    """
    angles = GOLDEN_ANGLE * numbers
    return np.column_stack([np.cos(angles), np.sin(angles)])


@kernel
def _compute_repulsion_factor(distance: float, k_rep: float, rho_0: float) -> float:
    """Return the magnitude of the repulsion (24) divided by the distance, N/m; 0 if that is 0 or nan."""
    inverse = 1.0 / max(distance, CONTACT_DISTANCE)
    magnitude = k_rep * max(inverse - 1.0 / rho_0, 0.0) * inverse * inverse
    return magnitude / distance if distance > 0.0 else 0.0


@kernel
def _compute_attraction_factor(squared_distance: float, k_att: float, max_attraction: float) -> float:
    """Return the magnitude of the attraction (27) divided by the distance, N/m."""
    distance = max(np.sqrt(squared_distance), _MIN_GOAL_DISTANCE)
    return float(min(k_att * squared_distance, max_attraction / distance))


@kernel
def _sum_neighbor_repulsion(
    positions: FloatArray, neighbors: NeighborPositions, gains: PotentialGains
) -> FloatArray:
    """Return the sum of the forces (24) on each robot from its neighbors, (n, 2) N."""
    sums = np.zeros((len(positions), 2))
    for i in range(len(positions)):
        for k in range(neighbors.indptr[i], neighbors.indptr[i + 1]):
            j = neighbors.indices[k]
            if neighbors.has_reports:
                dx = positions[i, 0] - neighbors.positions[k, 0]
                dy = positions[i, 1] - neighbors.positions[k, 1]
            else:
                dx = positions[i, 0] - positions[j, 0]
                dy = positions[i, 1] - positions[j, 1]
            _add_repulsion(sums, i, j, dx, dy, gains)
    return sums


@kernel
def _sum_team_repulsion(positions: FloatArray, gains: PotentialGains) -> FloatArray:
    """Return the sum of the forces (24) on each robot from all other robots in range, (n, 2) N.

    Robots are sorted into square bins whose sides are at least the range, so that only nearby ones are
    examined.
    """
    n = len(positions)
    sums = np.zeros((n, 2))
    if n == 0:
        return sums
    starts = np.empty(count_starts(n), np.intp)
    order = np.empty(n, np.intp)
    bins = sort_into_bins(positions, 0, n, gains.rho_0, starts, order)
    for i in range(n):
        # The robots in range are in the bin of robot i or in one of the eight around it. In `order`, the
        # robots are sorted by bin, row by row, so that those in the three bins of a row are consecutive.
        column = find_bin(positions[i, 0] - bins.left, bins.scale)
        row = find_bin(positions[i, 1] - bins.bottom, bins.scale)
        first_column = max(column - 1, 0)
        stop_column = min(column + 2, bins.columns)
        for bin_row in range(max(row - 1, 0), min(row + 2, bins.rows)):
            first_bin = bin_row * bins.columns + first_column
            stop_bin = bin_row * bins.columns + stop_column
            for k in range(starts[first_bin], starts[stop_bin]):
                j = order[k]
                if j != i:
                    dx = positions[i, 0] - positions[j, 0]
                    dy = positions[i, 1] - positions[j, 1]
                    _add_repulsion(sums, i, j, dx, dy, gains)
    return sums


@kernel
def _add_repulsion(sums: FloatArray, i: int, j: int, dx: float, dy: float, gains: PotentialGains) -> None:
    """Add the repulsion (24) that robot j exerts on robot i to the sum of i; (dx, dy) leads from j to i."""
    squared_distance = dx * dx + dy * dy
    if squared_distance > gains.rho_0 * gains.rho_0:
        return
    distance = np.sqrt(squared_distance)
    if distance < _MIN_DISTANCE:
        x, y = _compute_separation(i, j)
        dx = _MIN_DISTANCE * x
        dy = _MIN_DISTANCE * y
        distance = _MIN_DISTANCE
    factor = _compute_repulsion_factor(distance, gains.k_rep, gains.rho_0)
    sums[i, 0] += factor * dx
    sums[i, 1] += factor * dy


@kernel
def _compute_separation(i: int, j: int) -> tuple[float, float]:
    """Return the unit vector in which robot i is pushed away from robot j at the same position.

    The direction depends on the pair, and is opposite for j and i.
    """
    angle = GOLDEN_ANGLE * (min(i, j) + 1.0) * (max(i, j) + 1.0)
    sign = 1.0 if i < j else -1.0
    return sign * np.cos(angle), sign * np.sin(angle)
