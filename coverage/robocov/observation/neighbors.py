"""The communication graph of a team."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from robocov.errors import InputError
from robocov.observation.close_pairs import find_pairs_in_range
from robocov.typing import BoolArray, FloatArray, IntArray

_NO_INDICES: IntArray = np.empty(0, dtype=np.intp)
_NO_POSITIONS: FloatArray = np.empty((0, 2))


@dataclass(frozen=True, slots=True, eq=False)
class Neighbors:
    """A communication graph in compressed sparse row format. A complete graph has no rows, to save memory.

    Attributes
    ----------
    robot_count : int
        Number of robots n.
    ranges : (n,) array or None, m
        Communication ranges; None if they do not limit the distance of neighbors.
    indptr : (n + 1,) int array or None
        ``indices[indptr[i]:indptr[i + 1]]``, ascending, are the neighbors of robot i. None if the graph is
        complete.
    indices : (m,) int array or None
        See `indptr`.

    See Also
    --------
    Observations : Contain the neighbors of all robots.
    partition : Voronoi cells, each bounded only by neighbors.

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> rc.Neighbors(3).list_neighbors(1)
    array([0, 2])
    >>> positions = np.array([[0.0, 0.0], [1.0, 0.0], [5.0, 0.0]])
    >>> rc.Neighbors.from_ranges(positions, np.full(3, 2.0)).list_neighbors(1)
    array([0])
    """

    robot_count: int
    ranges: FloatArray | None = None
    indptr: IntArray | None = None
    indices: IntArray | None = None

    @classmethod
    def from_ranges(cls, positions: FloatArray, ranges: FloatArray) -> Neighbors:
        """Build the graph that links two robots if each is within the communication range of the other.

        Parameters
        ----------
        positions : (n, 2) array, m
        ranges : (n,) array, m
            Communication ranges. If all are infinite, the graph is complete.

        Returns
        -------
        Neighbors

        Examples
        --------
        >>> import numpy as np
        >>> import robocov as rc
        >>> positions = np.array([[0.0, 0.0], [1.0, 0.0], [5.0, 0.0]])
        >>> rc.Neighbors.from_ranges(positions, np.full(3, 2.0)).list_neighbors(0)
        array([1])
        """
        if np.isinf(ranges).all():
            return cls(len(positions))
        indptr, pairs = find_pairs_in_range(positions, ranges)
        return cls(len(positions), ranges, indptr, pairs.second)

    @classmethod
    def from_pairs(
        cls, robot_count: int, robot: IntArray, neighbor: IntArray, ranges: FloatArray | None = None
    ) -> Neighbors:
        """Build the graph from its directed pairs.

        Parameters
        ----------
        robot_count : int
            Number of robots n.
        robot, neighbor : (m,) int arrays
            Indices of the two robots of each pair, sorted by robot, then neighbor.
        ranges : (n,) array or None, m
            Communication ranges, which the graph stores.

        Returns
        -------
        Neighbors

        Raises
        ------
        InputError
            If there is no robot with one of these indices.
        """
        for indices in (robot, neighbor):
            # Kernels do not check bounds: they would read memory beyond the arrays.
            if len(indices) > 0 and not 0 <= indices.min() <= indices.max() < robot_count:
                raise InputError(
                    f"neighbors: expected indices of {robot_count} robots, "
                    f"got {indices.min()} to {indices.max()}"
                )
        indptr = np.zeros(robot_count + 1, dtype=np.intp)
        np.cumsum(np.bincount(robot, minlength=robot_count), out=indptr[1:])
        return cls(robot_count, ranges, indptr, neighbor)

    @classmethod
    def combine(cls, graphs: Sequence[Neighbors]) -> Neighbors:
        """Combine the graphs of separate runs into one.

        Parameters
        ----------
        graphs : sequence of Neighbors
            The graph of each run.

        Returns
        -------
        Neighbors
            Graph of the robots of all runs, in the order of `graphs`, without links between runs.
        """
        if len(graphs) == 1:
            return graphs[0]
        robot_count = 0
        robots = []
        neighbors = []
        joined_ranges = []
        for graph in graphs:
            robot, neighbor = graph.list_pairs()
            robots.append(robot + robot_count)
            neighbors.append(neighbor + robot_count)
            if graph.ranges is None:
                joined_ranges.append(np.full(graph.robot_count, np.inf))
            else:
                joined_ranges.append(graph.ranges)
            robot_count += graph.robot_count
        ranges = None
        if any(graph.ranges is not None for graph in graphs):
            ranges = np.concatenate(joined_ranges)
        return cls.from_pairs(robot_count, np.concatenate(robots), np.concatenate(neighbors), ranges)

    @property
    def is_complete(self) -> bool:
        """Whether the graph is complete, so that all robots communicate at any distance."""
        return self.indptr is None

    def list_neighbors(self, robot: int) -> IntArray:
        """List the neighbors of a robot.

        Parameters
        ----------
        robot : int
            Index of the robot, from 0.

        Returns
        -------
        (k,) int array
            Indices of its neighbors, ascending.
        """
        if self.indptr is None or self.indices is None:
            return np.delete(np.arange(self.robot_count), robot)
        return self.indices[self.indptr[robot] : self.indptr[robot + 1]]

    def list_pairs(self) -> tuple[IntArray, IntArray]:
        """List all directed pairs of a robot and a neighbor.

        Returns
        -------
        robot, neighbor : (m,) int arrays
            Sorted by robot, then neighbor.
        """
        if self.indptr is None or self.indices is None:
            robot, neighbor = np.nonzero(~np.eye(self.robot_count, dtype=bool))
            return robot, neighbor
        return np.repeat(np.arange(self.robot_count), np.diff(self.indptr)), self.indices

    def restrict_to_working(self, is_working: BoolArray) -> Neighbors:
        """Return the graph without the links of robots that have failed or have not joined yet.

        Parameters
        ----------
        is_working : (n,) bool array
            Mask of the robots that work.

        Returns
        -------
        Neighbors
        """
        if is_working.all():
            return self
        robot, neighbor = self.list_pairs()
        both_work = is_working[robot] & is_working[neighbor]
        return Neighbors.from_pairs(self.robot_count, robot[both_work], neighbor[both_work], self.ranges)


class NeighborPositions(NamedTuple):
    """The neighbors of each robot, and their positions as the robot knows them, as arrays for kernels."""

    is_complete: bool
    """Whether each robot knows the current positions of all others. The arrays are then empty."""
    has_reports: bool
    """Whether robots know the reported positions of their neighbors, instead of the current ones."""
    indptr: IntArray
    """(n + 1,) ``indices[indptr[i]:indptr[i + 1]]`` are the neighbors of robot i."""
    indices: IntArray
    """(k,) Indices of the neighbors of all robots, one robot after another."""
    positions: FloatArray
    """(k, 2) Reported positions in the order of `indices`, m; empty without reports."""

    @classmethod
    def from_graph(cls, neighbors: Neighbors, reported_positions: FloatArray | None) -> NeighborPositions:
        """Build the positions from a communication graph.

        Parameters
        ----------
        neighbors : Neighbors
            The graph.
        reported_positions : (m, 2) array or None, m
            As in `Observations`; ignored if the graph is complete.

        Returns
        -------
        NeighborPositions
        """
        if neighbors.indptr is None or neighbors.indices is None:
            return cls(
                is_complete=True,
                has_reports=False,
                indptr=_NO_INDICES,
                indices=_NO_INDICES,
                positions=_NO_POSITIONS,
            )
        positions = _NO_POSITIONS
        if reported_positions is not None:
            positions = np.ascontiguousarray(reported_positions, dtype=np.float64)
        return cls(
            is_complete=False,
            has_reports=reported_positions is not None,
            indptr=neighbors.indptr,
            indices=neighbors.indices,
            positions=positions,
        )

    @classmethod
    def build_empty(cls, robot_count: int) -> NeighborPositions:
        """Build the positions for robots that have no neighbors.

        Parameters
        ----------
        robot_count : int

        Returns
        -------
        NeighborPositions
        """
        return cls(
            is_complete=False,
            has_reports=False,
            indptr=np.zeros(robot_count + 1, dtype=np.intp),
            indices=_NO_INDICES,
            positions=_NO_POSITIONS,
        )
