"""The forces (24) and (27) of the paper's artificial potentials (23) and (26), in one walk over the robots.

What the paper leaves open is decided here:

- *Contact*. (24) is singular at distance zero. Below `CONTACT_DISTANCE` its magnitude stays what it is
  there, and the potential goes on linearly, so that F = -grad U holds everywhere.
- *Two robots in one place* have no direction apart. They are pushed apart along a fixed direction
  that depends on their two numbers alone, opposite for the two.
- *Saturation*. (27) grows with the third power of the distance, without bound, and pushes robots
  through the repulsion of walls. A limit caps its magnitude; the potential goes on linearly there.
"""

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.observation.neighbours import find_bin, sort_into_bins

CONTACT_DISTANCE = 0.01
"""Distance in metres below which the repulsion no longer grows: a tenth of a robot's radius."""

_TOGETHER = 1e-12
"""Distance in metres at which two robots in one place are taken to be."""

_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


@kernel
def _repulsion(distance: float, k_rep: float, rho_0: float) -> float:
    """Return the magnitude of (24) for each metre of offset, N/m; zero where that has no direction."""
    inverse = 1.0 / max(distance, CONTACT_DISTANCE)
    magnitude = k_rep * max(inverse - 1.0 / rho_0, 0.0) * inverse * inverse
    return magnitude / distance if distance > 0.0 else 0.0


@kernel
def _attraction(square: float, k_att: float, limit: float) -> float:
    """Return the magnitude of (27) for each metre of offset, N/m."""
    return float(min(k_att * square, limit / max(np.sqrt(square), 1e-300)))


@kernel
def compute_potential_forces(
    positions: Array, reported: Array, indptr: IntArray, indices: IntArray, team: int, obstacle_points: Array,
    goals: Array, k_rep: float, rho_0: float, k_att: float, limit: float,
) -> Array:  # fmt: skip
    """Return the forces (25) + (27) on each robot, and their three parts, (4, n, 2) N.

    The parts are the attraction to the goal (27), the sum of (24) over the robots within `rho_0` that it
    hears, and (24) from the closest obstacle point, zero where that is nan.

    Places are in metres; `reported`, `indptr` and `indices`, the neighbours of each robot and their known
    positions, are as in `robocov.voronoi.clipped_cells.KnownNeighbours`. If there are none, all robots of a
    team, of `team` successive rows, are neighbours. k_rep, rho_0, k_att and the limit, which may be infinite,
    are in N m³, m, N/m³ and N.
    """
    n = len(positions)
    forces = np.zeros((4, n, 2))
    starts, order = np.empty(2 * team + 8, np.intp), np.empty(team, np.intp)
    left = low = scale = 0.0
    columns = rows = 1
    for i in range(n):
        x, y = positions[i, 0], positions[i, 1]
        if len(indptr):
            for k in range(indptr[i], indptr[i + 1]):
                j = indices[k]
                if len(reported):
                    _push(forces, i, j, x - reported[k, 0], y - reported[k, 1], k_rep, rho_0)
                else:
                    _push(forces, i, j, x - positions[j, 0], y - positions[j, 1], k_rep, rho_0)
        else:
            if i % team == 0:
                left, low, scale, columns, rows = sort_into_bins(positions, i, i + team, rho_0, starts, order)
            column, row = find_bin(x - left, scale), find_bin(y - low, scale)
            for r in range(max(row - 1, 0), min(row + 2, rows)):
                b = r * columns
                for k in range(starts[b + max(column - 1, 0)], starts[b + min(column + 2, columns)]):
                    j = order[k]
                    if j != i:
                        _push(forces, i, j, x - positions[j, 0], y - positions[j, 1], k_rep, rho_0)
        dx, dy = x - obstacle_points[i, 0], y - obstacle_points[i, 1]
        part = _repulsion(np.sqrt(dx * dx + dy * dy), k_rep, rho_0)
        if part > 0.0:
            forces[3, i, 0], forces[3, i, 1] = part * dx, part * dy
        dx, dy = goals[i, 0] - x, goals[i, 1] - y
        part = _attraction(dx * dx + dy * dy, k_att, limit)
        forces[1, i, 0], forces[1, i, 1] = part * dx, part * dy
        for c in range(2):
            forces[0, i, c] = forces[1, i, c] + forces[2, i, c] + forces[3, i, c]
    return forces


@kernel
def _push(forces: Array, i: int, j: int, dx: float, dy: float, k_rep: float, rho_0: float) -> None:
    """Add (24) on robot i from robot j to its sum."""
    square = dx * dx + dy * dy
    if square > rho_0 * rho_0:
        return
    distance = np.sqrt(square)
    if distance < _TOGETHER:
        dx, dy = _apart(i, j)
        dx, dy, distance = _TOGETHER * dx, _TOGETHER * dy, _TOGETHER
    part = _repulsion(distance, k_rep, rho_0)
    forces[2, i, 0] += part * dx
    forces[2, i, 1] += part * dy


@kernel
def _apart(i: int, j: int) -> tuple[float, float]:
    angle = _GOLDEN_ANGLE * (min(i, j) + 1.0) * (max(i, j) + 1.0)
    sign = 1.0 if i < j else -1.0
    return sign * np.cos(angle), sign * np.sin(angle)


@kernel
def compute_separations(robot: IntArray, neighbour: IntArray) -> Array:
    """Return unit vectors, (m, 2), along which robots in one place are told apart."""
    directions = np.empty((len(robot), 2))
    for k in range(len(robot)):
        directions[k, 0], directions[k, 1] = _apart(robot[k], neighbour[k])
    return directions
