"""Observations of the robots in a step: the only input of a controller's decision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from robocov.arrays import compute_point_distances
from robocov.density.base import Density
from robocov.observation.close_pairs import find_close_pairs
from robocov.observation.density_sensor import DensitySensor
from robocov.observation.messages import ReceivedMessage
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.observation.scans import Scans
from robocov.typing import FloatArray, IntArray


class NeighborPairs(NamedTuple):
    """Directed pairs of a robot and one of its neighbors, sorted by robot, then neighbor."""

    robots: IntArray
    """(k,) Index of the robot of each pair."""
    neighbors: IntArray
    """(k,) Index of the neighbor."""
    offsets: FloatArray
    """(k, 2) Vector from the known position of the neighbor to the robot, m."""
    distances: FloatArray
    """(k,) Distance from the neighbor to the robot, m."""


@dataclass(slots=True, eq=False)
class Observations:
    """Everything that the robots know, as a structure of arrays. Only robot i knows row i.

    Attributes
    ----------
    positions : (n, 2) array, m
        Positions as the robots know them, with any localization noise.
    velocities : (n, 2) array, m/s
        A robot knows its own velocity, not those of others.
    neighbors : Neighbors
        The robots within communication range: their positions are known, nothing else.
    obstacle_points : (n, 2) array, m
        The nearest obstacle or boundary point within sensing range; nan if there is none.
    region : Region
        The known convex outer boundary.
    time : float, s
        Simulation time.
    max_speeds : (n,) array or None, m/s
        The maximum speed of each robot, which its neighbors know as well. None if unknown.
    reported_positions : (m, 2) array or None, m
        The position of each neighbor according to the newest message from it, in the order of
        ``neighbors.indices``. None: robots know the current positions of their neighbors.
    report_ages : (m,) array or None, s
        The ages of these messages. None if `reported_positions` is None.
    density : Density or None
        φ, the importance of each point: part of the task, known to all. None: 1 everywhere, or unknown if
        there is a `density_sensor`.
    scans : Scans or None
        A range scan of each robot, in the steps in which the controller requests one.
    steering : (n, 2) array or None, rad and rad/s
        Heading of each unicycle, from +x, and its turning rate; a robot knows only its own. None in a team
        of point robots.
    messages : sequence of sequence of ReceivedMessage
        The messages that have arrived at each robot in this step, in the order in which they were sent;
        empty if no robot has received any.
    send_limits : (n,) array or None, bytes
        The total size of the messages that each robot can send in this step. It is 0 if earlier messages
        still wait in its queue, or if no messages are sent in this step. None: unlimited.
    density_sensor : DensitySensor or None
        The sensor with which robots measure a density that they do not know. None: they know it.

    See Also
    --------
    Decision : The output of a controller for observations.
    OwnView : The knowledge of a single robot.
    Simulation.observe : The current observations of a simulation.

    Notes
    -----
    Treat observations as immutable. The class is not frozen because creating a frozen object takes three
    times as long; for six robots, that is a tenth of a step.

    Examples
    --------
    >>> import robocov as rc
    >>> rooms = rc.load_map("rooms")
    >>> seen = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(3, seed=0)).observe()
    >>> seen.positions.shape, seen.neighbors.list_neighbors(0)
    ((3, 2), array([1, 2]))
    """

    positions: FloatArray
    velocities: FloatArray
    neighbors: Neighbors
    obstacle_points: FloatArray
    region: Region
    time: float = 0.0
    max_speeds: FloatArray | None = None
    reported_positions: FloatArray | None = None
    report_ages: FloatArray | None = None
    density: Density | None = None
    scans: Scans | None = None
    steering: FloatArray | None = None
    messages: Sequence[Sequence[ReceivedMessage]] = ()
    send_limits: FloatArray | None = None
    density_sensor: DensitySensor | None = None

    @property
    def has_known_uniform_density(self) -> bool:
        """Whether the robots know that the density is the same everywhere."""
        if self.density_sensor is not None:
            return False
        return self.density is None or self.density.is_uniform

    def measure_density(self, robots: Any, points: Any) -> FloatArray:
        """Measure the density at points near robots.

        Parameters
        ----------
        robots : int or (k,) int array
            Index of the robot that measures at each point, from 0.
        points : (k, 2) array, m
            Points within the sensing range of these robots. A known density can be evaluated everywhere.

        Returns
        -------
        (k,) array
            φ at each point.

        Raises
        ------
        ParameterError
            If the density is unknown, and a point is not within the sensing range of its robot.

        Examples
        --------
        >>> import robocov as rc
        >>> rooms = rc.load_map("rooms")
        >>> seen = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(3, seed=0)).observe()
        >>> seen.measure_density([0, 1, 2], seen.positions)
        array([1., 1., 1.])
        """
        if self.density_sensor is not None:
            return self.density_sensor.measure(robots, points)
        if self.density is None:
            return np.ones(len(points))
        return self.density.evaluate(points)

    def get_messages(self, robot: int) -> Sequence[ReceivedMessage]:
        """Return the messages that have arrived at a robot in this step.

        Parameters
        ----------
        robot : int
            Index of the robot, from 0.

        Returns
        -------
        sequence of ReceivedMessage
            In the order in which they were sent.
        """
        return self.messages[robot] if self.messages else ()

    def get_neighbor_positions(self, robot: int) -> FloatArray:
        """Return the positions of a robot's neighbors, as the robot knows them.

        With limited communication, these are the positions in their newest messages.

        Parameters
        ----------
        robot : int
            Index of the robot, from 0.

        Returns
        -------
        (k, 2) array, m
            In the order of `Neighbors.list_neighbors`. This may be a view, which must not be changed.
        """
        if self.reported_positions is None:
            return self.positions[self.neighbors.list_neighbors(robot)]
        # Without limited communication, there are no reports.
        assert self.neighbors.indptr is not None
        start, stop = self.neighbors.indptr[robot : robot + 2]
        return self.reported_positions[start:stop]

    def find_neighbors(self, max_distance: float = np.inf) -> NeighborPairs:
        """Find the neighbors of each robot whose known positions are within a distance of it.

        Parameters
        ----------
        max_distance : float, m
            Maximum distance of a neighbor. By default, all neighbors are found.

        Returns
        -------
        NeighborPairs
            Sorted. A sum over the neighbors of a robot therefore has the same rounding errors whatever the
            other robots do.
        """
        if self.reported_positions is None and self.neighbors.is_complete:
            pairs = find_close_pairs(self.positions, max_distance)
            offsets = self.positions[pairs.first] - self.positions[pairs.second]
            return NeighborPairs(pairs.first, pairs.second, offsets, pairs.distances)
        robots, neighbors = self.neighbors.list_pairs()
        if self.reported_positions is None:
            known_positions = self.positions[neighbors]
        else:
            known_positions = self.reported_positions
        offsets = self.positions[robots] - known_positions
        distances = compute_point_distances(self.positions[robots], known_positions)
        is_near = distances <= max_distance
        return NeighborPairs(robots[is_near], neighbors[is_near], offsets[is_near], distances[is_near])
