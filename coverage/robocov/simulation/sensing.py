"""Observations of robots with exact sensors, and the map that robots know."""

from __future__ import annotations

from robocov.conditions import Conditions
from robocov.environment import Environment
from robocov.observation import Observations, Scanning, Scans
from robocov.observation.neighbors import Neighbors
from robocov.sensor import RangeSensor
from robocov.world import ChangingWorld, World


def build_observations(
    world: World | ChangingWorld,
    sensor: RangeSensor,
    environment: Environment,
    neighbors: Neighbors,
    time: float,
    scanning: Scanning | None,
) -> Observations:
    """Build the observations of robots with exact sensors.

    Parameters
    ----------
    world : World or ChangingWorld
        Contains the positions and velocities of the robots.
    sensor : RangeSensor
        The range sensor, with the obstacles at their current positions.
    environment : Environment
        The map, whose convex region and density the robots know.
    neighbors : Neighbors
        The communication graph.
    time : float, s
        Simulation time.
    scanning : Scanning or None
        The scans to take in this step; None if none is due.

    Returns
    -------
    Observations
    """
    team = world.team
    scans = None
    if scanning is not None:
        distances, is_hit = sensor.scan(world.positions, scanning.rays, team.sensing_range)
        scans = Scans(distances, is_hit)
    return Observations(
        positions=world.positions,
        velocities=world.velocities,
        neighbors=neighbors,
        obstacle_points=sensor.find_nearest_points(world.positions, team.sensing_range),
        region=environment.region,
        time=time,
        max_speeds=team.max_speed,
        density=environment.density,
        scans=scans,
        steering=world.steering,
    )


def get_known_map(environment: Environment, conditions: Conditions | None) -> Environment:
    """Return the map that a controller with the information "whole map" receives.

    Parameters
    ----------
    environment : Environment
        The map of the simulation.
    conditions : Conditions or None
        None if they are ideal.

    Returns
    -------
    Environment
        The map without moving obstacles, and without its density if robots do not know it.
    """
    known_map = environment.static
    if conditions is not None and conditions.hides_density:
        return known_map.with_density(None)
    return known_map


def is_scan_due(scanning: Scanning | None, step: int, dt: float) -> bool:
    """Return whether the robots scan in a step.

    Parameters
    ----------
    scanning : Scanning or None
        Settings of the scans; None if the robots never scan.
    step : int
        Index of the step, from 0.
    dt : float, s
        Control period.

    Returns
    -------
    bool
    """
    return scanning is not None and step % scanning.count_steps(dt) == 0
