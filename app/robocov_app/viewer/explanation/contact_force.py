"""The force that a robot experiences by contacts, computed from the next step of the simulation."""

import numpy as np

from robocov.environment import Environment
from robocov.observation import Snapshot
from robocov.team import Team
from robocov.world import World
from robocov.world.obstacle_pieces import Obstacles, build_obstacles


def compute_contact_force(
    snapshot: Snapshot, team: Team, environment: Environment, robot: int, *, dt: float
) -> complex:
    """Compute the mean force of all contacts on a robot during the next step.

    The step is simulated twice: with obstacles and all robots, and for this robot alone on an empty plane.
    With mass m, the contacts have the force m (v - v_alone) / dt.

    Parameters
    ----------
    snapshot : Snapshot
        State and decision at the start of the step.
    team : Team
        The team.
    environment : Environment
        The map, with failed robots as obstacles.
    robot : int
        Row of the robot in arrays.
    dt : float, s
        Duration of the step.

    Returns
    -------
    complex
        Force x + i y, N. Forces from outside, such as that of a mouse that drags the robot, are not included.
    """
    world = World(
        build_obstacles(environment),
        team,
        snapshot.positions,
        snapshot.velocities,
        steering=snapshot.steering,
    )
    world.step(snapshot.decision.forces, dt, time=snapshot.time)
    rows = np.array([robot])
    steering = None
    if snapshot.steering is not None:
        steering = snapshot.steering[rows]
    alone = World(
        Obstacles(walls=()),
        team[rows],
        snapshot.positions[rows],
        snapshot.velocities[rows],
        steering=steering,
    )
    alone.step(snapshot.decision.forces[rows], dt)
    x, y = (team.mass[robot] * (world.velocities[robot] - alone.velocities[0]) / dt).tolist()
    return complex(x, y)
