"""What the robots of one evaluation see: sites and corners in direct view, and the way to every corner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.visibility import Fans

if TYPE_CHECKING:
    from robocov.geodesic import Geodesics


_FEW = 1 << 13
"""Pairs of robots and walls that are few enough to look at all."""


@dataclass(frozen=True, slots=True, eq=False)
class Ways:
    """The shortest ways from the robots to the corners.

    Attributes
    ----------
    distance : (k,) grid steps
        From the nearest robot, inf where none can come.
    owner : (k,)
        That robot.
    first : (k,)
        The corner where the way bends first, the corner itself if the robot sees it.
    """

    distance: Array
    owner: IntArray
    first: IntArray


class RobotViews:
    """The views of n robots.

    Parameters
    ----------
    paths : Geodesics
    x, y : (n,) grid steps
        Where the robots are.
    reach : (n,) grid steps
        The walls up to here are looked at in any case.
    """

    def __init__(self, paths: Geodesics, x: Array, y: Array, reach: Array) -> None:
        self._paths = paths
        self.x, self.y = x, y
        self._vertex = paths.walls.vertex_at(x, y)
        # targets at the very end belong to it; with few walls a second look costs more than all of them
        few = len(x) * len(paths.index.ax) <= _FEW
        self._reach = np.full(len(x), np.inf) if few else reach * (1.0 + 1e-9)
        self._fans = Fans(paths.index, x, y, self._reach)

    def see(self, robot: IntArray, x: Array, y: Array) -> BoolArray:
        """Return for (m,) pairs of a robot and a target in its reach whether it sees the target."""
        return self._paths.see(self._fans, self._vertex, robot, x, y)

    def see_beyond(self, robot: IntArray, x: Array, y: Array, distance: Array) -> BoolArray:
        """Return the same for targets at any `distance` (m,)."""
        far = distance > self._reach[robot]
        if not far.any():
            return self.see(robot, x, y)
        seen = np.empty(len(robot), dtype=bool)
        seen[~far] = self.see(robot[~far], x[~far], y[~far])
        looking, source = np.unique(robot[far], return_inverse=True)
        reach = np.zeros(len(looking))
        np.maximum.at(reach, source, distance[far])
        fans = Fans(self._paths.index, self.x[looking], self.y[looking], reach * (1.0 + 1e-9))
        seen[far] = self._paths.see(fans, self._vertex[looking], source, x[far], y[far])
        return seen

    def to_corners(self, robot: IntArray, straight: Array) -> Ways:
        """Return the shortest ways to the corners.

        Parameters
        ----------
        robot : (k,)
            The robot nearest to each corner as the crow flies.
        straight : (k,) grid steps
            Its distance.
        """
        paths = self._paths
        corner = np.arange(len(robot))
        good = paths.walls.useful(corner, self.x[robot], self.y[robot])
        good &= paths.corner_fans.see(corner, self.x[robot], self.y[robot])
        owner, reach = robot.copy(), np.where(good, straight, np.inf)
        distance = paths.relax(reach)
        # whoever else is nearer than that may see the corner
        corner, other, away = paths.corner_clusters.within(self.x, self.y, distance)
        pairs = other != robot[corner]
        corner, other, away = corner[pairs], other[pairs], away[pairs]
        pairs = paths.walls.useful(corner, self.x[other], self.y[other])
        corner, other, away = corner[pairs], other[pairs], away[pairs]
        pairs = paths.corner_fans.see(corner, self.x[other], self.y[other])
        corner, other, away = first_of_least(corner[pairs], other[pairs], away[pairs])
        reach[corner], owner[corner] = away, other
        distance = paths.relax(np.minimum(distance, reach))
        before = paths.previous(distance, reach)
        first = np.where(before < 0, np.arange(len(before)), before)
        while (first != first[first]).any():
            first = first[first]
        return Ways(distance, owner[first], first)


def first_of_least(target: IntArray, robot: IntArray, distance: Array) -> tuple[IntArray, IntArray, Array]:
    """Return for every target that occurs the pair of least distance, the first of equals.

    >>> first_of_least(np.array([4, 2, 4, 4]), np.array([0, 0, 1, 2]), np.array([7.0, 5.0, 6.0, 6.0]))
    (array([2, 4]), array([0, 1]), array([5., 6.]))
    """
    order = np.lexsort((distance, target))
    target = target[order]
    first = np.ones(len(order), dtype=bool)
    first[1:] = target[1:] != target[:-1]
    order = order[first]
    return target[first], robot[order], distance[order]
