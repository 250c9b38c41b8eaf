"""The spring with which the pointer pulls a robot."""

import numpy as np

from robocov.environment import Point
from robocov.simulation import Simulation
from robocov.typing import FloatArray

STIFFNESS_PER_KG = 60.0
"""Stiffness of the spring divided by the mass of the robot, 1/s²."""
MAX_ACCELERATION_M_S2 = 80.0
"""Maximum force of the spring divided by the mass of the robot."""
_MIN_MAGNITUDE = 1e-12
"""Avoids a division by zero."""


def compute_spring_forces(simulation: Simulation, robot: int, target: Point) -> FloatArray:
    """Compute the force of a critically damped spring between a robot and the pointer.

    Parameters
    ----------
    simulation : Simulation
        Simulation of n robots.
    robot : int
        Row of the dragged robot.
    target : (x, y), m
        Position of the pointer.

    Returns
    -------
    (n, 2) array, N
        Forces on all robots; zero except for the dragged one.
    """
    acceleration = STIFFNESS_PER_KG * (np.array(target) - simulation.positions[robot])
    # Critical damping: 2 sqrt(k / m).
    acceleration -= 2.0 * np.sqrt(STIFFNESS_PER_KG) * simulation.velocities[robot]
    magnitude = float(np.hypot(*acceleration))
    fraction = min(1.0, MAX_ACCELERATION_M_S2 / max(magnitude, _MIN_MAGNITUDE))
    forces = np.zeros_like(simulation.positions)
    forces[robot] = acceleration * (simulation.team.mass[robot] * fraction)
    return forces
