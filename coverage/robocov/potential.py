"""The artificial potentials (23)-(27) of the paper, as pure functions of offsets and distances.

All are vectorised: m pairs, or n robots, at once. What the paper leaves open is decided here:

- *Contact*. (24) is singular at distance zero. Below `CONTACT_DISTANCE` its magnitude stays what it is
  there, and the potential goes on linearly, so that F = -grad U holds everywhere.
- *Two robots in one place* have no direction apart. They are pushed apart along a fixed direction
  that depends on their two numbers alone, opposite for the two.
- *Saturation*. (27) grows with the third power of the distance, without bound, and pushes robots
  through the repulsion of walls. A limit caps its magnitude; the potential goes on linearly there.
"""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array, IntArray

CONTACT_DISTANCE = 0.01
"""Distance in metres below which the repulsion no longer grows: a tenth of a robot's radius."""

_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def repulsive_potential(distance: Array, k_rep: float, rho_0: float) -> Array:
    """Return the repulsive potential (23), J.

    Parameters
    ----------
    distance : (m,) m
        rho, from the robot to the other robot or to the obstacle point.
    k_rep : float, N m³
    rho_0 : float, m
        Range of the interaction; the potential is zero beyond it.
    """
    near = np.clip(distance, CONTACT_DISTANCE, rho_0)
    energy = 0.5 * k_rep * (1.0 / near - 1.0 / rho_0) ** 2
    inside = np.maximum(CONTACT_DISTANCE - distance, 0.0)
    return np.asarray(energy + inside * _repulsion_at(np.array(CONTACT_DISTANCE), k_rep, rho_0))


def repulsive_force(offset: Array, distance: Array, k_rep: float, rho_0: float) -> Array:
    """Return the repulsive force (24), (m, 2) N, away from the other end of each pair.

    Parameters
    ----------
    offset : (m, 2) m
        q - q_i: from the other robot or the obstacle point to the robot.
    distance : (m,) m
        Its length; where it is zero the force is zero (see `separation` for robots).
    k_rep : float, N m³
    rho_0 : float, m
    """
    size = np.maximum(distance, CONTACT_DISTANCE)
    over = _repulsion_at(size, k_rep, rho_0) / np.maximum(distance, 1e-300)
    over[distance <= 0.0] = 0.0
    return np.asarray(offset * over[:, None])


def _repulsion_at(distance: Array, k_rep: float, rho_0: float) -> Array:
    """Return the magnitude of (24), N, at distances of at least `CONTACT_DISTANCE`."""
    inverse = 1.0 / distance
    return np.asarray(k_rep * np.maximum(inverse - 1.0 / rho_0, 0.0) * inverse * inverse)


def separation(robot: IntArray, neighbour: IntArray) -> Array:
    """Return unit vectors, (m, 2), along which robots in one place are told apart.

    Opposite for (i, j) and (j, i), and a function of the two numbers alone.
    """
    angle = _GOLDEN_ANGLE * (np.minimum(robot, neighbour) + 1.0) * (np.maximum(robot, neighbour) + 1.0)
    sign = np.where(robot < neighbour, 1.0, -1.0)
    return np.column_stack([sign * np.cos(angle), sign * np.sin(angle)])


def attractive_potential(distance: Array, k_att: float, limit: float | None = None) -> Array:
    """Return the attractive potential (26), J; beyond the distance where the force reaches `limit`, linear.

    Parameters
    ----------
    distance : (n,) m
        rho_goal, from the robot to its goal.
    k_att : float, N/m³
    limit : float, N, or None
    """
    if limit is None or k_att == 0.0:
        return np.asarray(0.25 * k_att * distance**4)
    knee = np.cbrt(limit / k_att)
    near = np.minimum(distance, knee)
    return np.asarray(0.25 * k_att * near**4 + limit * np.maximum(distance - knee, 0.0))


def attractive_force(offset: Array, k_att: float, limit: float | None = None) -> Array:
    """Return the attractive force (27), (n, 2) N.

    Parameters
    ----------
    offset : (n, 2) m
        q_goal - q: from the robot to its goal.
    k_att : float, N/m³
    limit : float, N, or None
        Cap of the magnitude; None is the paper's formula.
    """
    square = offset[:, 0] ** 2 + offset[:, 1] ** 2
    gain = k_att * square
    if limit is not None:
        gain = np.minimum(gain, limit / np.maximum(np.sqrt(square), 1e-300))
    return np.asarray(offset * gain[:, None])
