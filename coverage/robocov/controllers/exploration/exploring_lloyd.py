"""Lloyd's algorithm for an unknown density, which robots sense, share and explore."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from robocov.controllers.base import BaseController, Information, is_plan_due
from robocov.controllers.density_exchange import (
    MeasurementExchange,
    MeasurementMemory,
    MessageLists,
    add_received_measurements,
    find_possible_senders,
)
from robocov.controllers.driving import compute_approach_velocities, compute_drive_forces
from robocov.controllers.exploration.sightings import Sightings
from robocov.controllers.gains import gain, response_time_gain
from robocov.controllers.square_grid import SquareGrid
from robocov.observation import Decision, Message, Observations
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov.voronoi.sampled_cells import compute_sample_centroids, find_own_samples

NO_SQUARE = -1
"""Index that stands for no square."""
_MIN_RELATIVE_MASS = 1e-6
"""Minimum mass of a square, relative to an unknown one.

Without it, the centroid of a cell in which φ is zero would be undefined.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ExploringMemory(MeasurementMemory):
    """Memory of the robots, with the last known positions of others, and the squares that they explore."""

    grid: SquareGrid
    sightings: Sightings
    is_report_due: BoolArray
    """(n,) Whether each robot still has to report its sightings in this period."""
    viewpoints: IntArray
    """(n,) Index of the square to which each robot moves to measure there, or `NO_SQUARE`."""


@dataclass(frozen=True)
class ExploringLloyd(BaseController):
    """Lloyd's algorithm for an unknown density, which robots sense, share and explore.

    A robot measures the density only within its sensing range. Robots send each other measurements and the
    last known positions of all robots, their own and received ones. A robot's cell is the part of the region
    that is nearer to it than to any other robot that it knows of. The robot explores its cell as long as
    much of the cell's mass may be in squares without a measurement. Then it moves to the centroid.

    The gains are the fields of the dataclass; `get_gains` returns their meanings, units and ranges.

    Parameters
    ----------
    squares : float
        Number of squares along the longer side of the region. The density is measured once in each.
    prior : float
        Density of unknown squares, relative to the mean of the known ones.
    exploration : float
        Fraction of the mass of its cell that must be in unknown squares for a robot to explore it. With 1,
        robots never explore.
    period : float, s
        Time between two plans.
    k_prop : float, 1/s
        Desired speed per meter of distance to the goal.
    response_time : float, s
        Time constant with which the desired velocity is reached.

    See Also
    --------
    Adaptive : Learns the density only at the positions of the robots, without exploring.
    Lloyd : Knows the density.

    Notes
    -----
    *Masses.* The mass of a square is the density measured in it. For an unknown square, it is `prior` times
    the mean of all measurements that the robot knows.

    *Exploration.* A robot moves to a viewpoint: the unknown square of its cell with the largest number of
    unknown squares around it, within the sensing range, divided by the distance plus the sensing range. It
    keeps this viewpoint until the square is measured or belongs to the cell of another robot.

    *Messages.* Once in each period, a robot sends at most 50 measurements, 4 + 10 k bytes for k of them
    (`robocov.controllers.density_exchange`), and the last known positions of k robots, 4 + 14 k bytes
    (`robocov.controllers.exploration.sightings`).

    Obstacles are not known; robots slide along them as with `Lloyd`. On a map without a density, all robots
    know that the density is the same everywhere, and do not explore.

    Examples
    --------
    >>> from robocov.environment import Environment
    >>> from robocov.simulation import Simulation
    >>> room = Environment("room", ((0, 0), (8, 0), (8, 6), (0, 6)))
    >>> simulation = Simulation(room, ExploringLloyd(), [[1.0, 1.0]])
    >>> simulation.run(20.0).positions[-1].round(1)
    array([[4., 3.]])
    """

    name = "exploring-lloyd"
    label = "Exploring Lloyd"
    summary = "Lloyd's algorithm on a density that robots sense, share and explore"
    information: ClassVar[Information] = "shared map"

    squares: float = gain(
        64.0, "1", "number of squares along the longer side of the region", low=4.0, high=200.0, whole=True
    )
    prior: float = gain(1.0, "1", "density of unknown squares, relative to known ones", low=1e-3, high=1e3)
    exploration: float = gain(0.6, "1", "unknown fraction of a cell's mass that is explored", high=1.0)
    period: float = gain(1.0, "s", "time between two plans", low=0.05, high=60.0)
    k_prop: float = gain(2.0, "1/s", "desired speed per meter of distance to the goal", high=100.0)
    response_time: float = response_time_gain()

    def begin(self, region: Region, team: Team) -> ExploringMemory:
        """Return the initial memory, without any measurements."""
        robot_count = len(team)
        grid = SquareGrid.build(region, int(self.squares))
        square_count = len(grid.centers)
        return ExploringMemory(
            team=team,
            grid=grid,
            measurements=np.full((robot_count, square_count), np.nan),
            measurement_exchange=MeasurementExchange.build_empty(robot_count, square_count),
            sightings=Sightings.build_empty(robot_count),
            is_report_due=np.zeros(robot_count, dtype=bool),
            viewpoints=np.full(robot_count, NO_SQUARE),
        )

    def decide(self, seen: Observations, memory: ExploringMemory) -> Decision:
        """Receive messages, update the goals if they are due, and compute the forces toward them."""
        memory = replace(
            memory,
            measurements=add_received_measurements(seen, memory.measurements),
            sightings=memory.sightings.receive(seen),
        )
        if memory.goals is None or is_plan_due(memory.plan_time, self.period, seen.time):
            memory = self._plan(seen, memory)
        assert memory.goals is not None
        velocities = compute_approach_velocities(
            memory.goals - seen.positions, self.k_prop, memory.team.max_speed
        )
        forces = compute_drive_forces(velocities, seen, memory.team, self.response_time)
        memory, messages = _send(seen, memory)
        return Decision(forces, memory.goals, {"attraction": forces}, memory=memory, messages=messages)

    def _plan(self, seen: Observations, memory: ExploringMemory) -> ExploringMemory:
        """Return the memory with new measurements and new goals."""
        grid = memory.grid
        measurements = memory.measurements
        measurement_exchange = memory.measurement_exchange
        if seen.has_known_uniform_density:
            # A uniform φ can be taken as 1, because a constant factor does not change the centroids. These
            # values are not stored, because the density may change later.
            values = np.ones_like(measurements)
        else:
            measurements = _measure(seen, memory)
            measurement_exchange = measurement_exchange.start_period(measurements)
            values = measurements
        sightings = memory.sightings.update(seen, memory.team)
        robots, other_positions = sightings.list_pairs()
        is_own = find_own_samples(grid.centers, seen.positions, robots, other_positions) & grid.is_inside
        goals = np.empty_like(seen.positions)
        viewpoints = np.empty_like(memory.viewpoints)
        for robot in range(len(goals)):
            is_unknown = is_own[robot] & np.isnan(values[robot])
            masses = self._estimate_masses(values[robot])
            viewpoints[robot] = NO_SQUARE
            if masses[is_unknown].sum() > self.exploration * masses[is_own[robot]].sum():
                viewpoints[robot] = _choose_viewpoint(
                    grid,
                    is_unknown,
                    position=seen.positions[robot],
                    previous=int(memory.viewpoints[robot]),
                    sensing_range=float(memory.team.sensing_range[robot]),
                )
                goals[robot] = grid.centers[viewpoints[robot]]
            else:
                row = slice(robot, robot + 1)
                goals[row] = compute_sample_centroids(is_own[row], grid.centers, masses, seen.positions[row])
        return replace(
            memory,
            measurements=measurements,
            measurement_exchange=measurement_exchange,
            sightings=sightings,
            is_report_due=np.ones(len(goals), dtype=bool),
            viewpoints=viewpoints,
            goals=goals,
            plan_time=seen.time,
        )

    def _estimate_masses(self, measurements: FloatArray) -> FloatArray:
        """Estimate the mass of each square, (s,), from the measurements of a robot, (s,)."""
        is_known = ~np.isnan(measurements)
        mean = 0.0
        if is_known.any():
            mean = float(measurements[is_known].mean())
        # If only zeros have been measured so far, the mass must be in the unknown squares.
        unknown_mass = self.prior * mean if mean > 0.0 else self.prior
        masses = np.where(is_known, measurements, unknown_mass)
        return np.maximum(masses, _MIN_RELATIVE_MASS * unknown_mass)


def _measure(seen: Observations, memory: ExploringMemory) -> FloatArray:
    """Return the measurements, (n, s), including those that the robots make in this step.

    A robot measures φ at the centers of the squares within its sensing range whose φ it does not know yet.
    """
    measurements = memory.measurements.copy()
    centers = memory.grid.centers
    for robot, position in enumerate(seen.positions):
        squared_distances = ((centers - position) ** 2).sum(axis=1)
        is_sensed = squared_distances <= memory.team.sensing_range[robot] ** 2
        is_new = is_sensed & np.isnan(measurements[robot])
        measurements[robot, is_new] = seen.measure_density(robot, centers[is_new])
    return measurements


def _choose_viewpoint(
    grid: SquareGrid, is_unknown: BoolArray, *, position: FloatArray, previous: int, sensing_range: float
) -> int:
    """Choose the square to which a robot moves next, to measure there.

    Parameters
    ----------
    grid : SquareGrid
    is_unknown : (s,) bool array
        The squares of the robot's cell in which it knows no measurement; at least one.
    position : (2,) array, m
        Position of the robot.
    previous : int
        The previous viewpoint, or `NO_SQUARE`. It is chosen again as long as it is unknown.
    sensing_range : float, m

    Returns
    -------
    int
    """
    if previous != NO_SQUARE and is_unknown[previous]:
        return previous
    candidates = np.flatnonzero(is_unknown)
    counts = grid.count_nearby(is_unknown, sensing_range)[candidates]
    distances = np.sqrt(((grid.centers[candidates] - position) ** 2).sum(axis=1))
    return int(candidates[np.argmax(counts / (distances + sensing_range))])


def _send(seen: Observations, memory: ExploringMemory) -> tuple[ExploringMemory, MessageLists]:
    """Return the memory after this step's messages have been sent, and the messages."""
    measurement_exchange, measurement_messages = memory.measurement_exchange.send(seen, memory.measurements)
    is_reporting = memory.is_report_due & find_possible_senders(seen)
    messages: list[list[Message]] = [[] for _ in is_reporting]
    for robot, own_messages in enumerate(measurement_messages):
        messages[robot] += own_messages
    for robot in np.flatnonzero(is_reporting).tolist():
        messages[robot].append(memory.sightings.build_message(robot))
    memory = replace(
        memory,
        measurement_exchange=measurement_exchange,
        is_report_due=memory.is_report_due & ~is_reporting,
    )
    return memory, messages
