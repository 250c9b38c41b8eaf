"""What the robots of one evaluation see: sites and corners in direct view, and the way to every corner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.arrays.grouping import least
from robocov.geodesic.visibility import Fans

if TYPE_CHECKING:
    from collections.abc import Iterator

    from robocov.geodesic import Geodesics


_PAIRS = 1 << 18
"""Pairs of targets and robots looked at in one piece, which bounds the memory."""

_SWEEPS = 2
"""Enough to find for most corners a way that few robots are nearer than."""

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
        # targets at the very end belong to it, and some beyond, which would cost a second look;
        # with few walls that costs more than all of them
        few = len(x) * paths.index.count <= _FEW
        self._reach = np.full(len(x), np.inf) if few else reach * (1.0 + 1e-9) + reach.mean()
        self._fans = Fans(paths.index, x, y, self._reach)
        self._table: Array | None = None

    def see(self, robot: IntArray, dx: Array, dy: Array, distance2: Array) -> BoolArray:
        """Return for (m,) pairs of a robot and a target in its reach whether it sees the target.

        The targets are given by (dx, dy) from the robot, and the square of that distance.
        """
        return self._paths.see_along(self._fans, self._vertex, robot, dx, dy, distance2)

    def see_beyond(self, robot: IntArray, dx: Array, dy: Array, distance2: Array) -> BoolArray:
        """Return the same for targets at any distance."""
        beyond = distance2 > self._reach[robot] ** 2
        if not beyond.any():
            return self.see(robot, dx, dy, distance2)
        seen = np.empty(len(robot), dtype=bool)
        near, far = (~beyond).nonzero()[0], beyond.nonzero()[0]
        seen[near] = self.see(robot[near], dx[near], dy[near], distance2[near])
        reach2 = np.zeros(len(self.x))
        np.maximum.at(reach2, robot[far], distance2[far])
        looking = np.nonzero(reach2)[0]
        number = np.empty(len(self.x), dtype=np.intp)
        number[looking] = np.arange(len(looking))
        reach = np.sqrt(reach2[looking]) * (1.0 + 1e-9)
        fans = Fans(self._paths.index, self.x[looking], self.y[looking], reach)
        seen[far] = self._paths.see_along(
            fans, self._vertex[looking], number[robot[far]], dx[far], dy[far], distance2[far]
        )
        return seen

    def to_corners(self) -> Ways:
        """Return the shortest ways to the corners."""
        paths = self._paths
        corner_x, corner_y = paths.corner_x, paths.corner_y
        corner = np.arange(len(corner_x))
        # few of the other robots matter once it is known how far the nearest one has to go, if not straight
        owner, nearest2 = self._nearest(corner_x, corner_y)
        reach = np.where(self._seen_from(corner, owner), np.sqrt(nearest2), np.inf)
        distance = paths.relax(reach, _SWEEPS)
        corner, other, away = self._nearer(corner_x, corner_y, distance, owner)
        seen = self._seen_from(corner, other).nonzero()[0]
        least(corner[seen], away[seen], reach, (owner, other[seen]))
        distance = paths.relax(np.minimum(distance, reach))
        before = paths.previous(distance, reach)
        first = np.where(before < 0, np.arange(len(before)), before)
        while (first != first[first]).any():
            first = first[first]
        return Ways(distance, owner[first], first)

    def _seen_from(self, corner: IntArray, robot: IntArray) -> BoolArray:
        """Return for (p,) pairs whether a corner sees a robot, and is useful to it."""
        paths = self._paths
        x, y = self.x[robot], self.y[robot]
        good = paths.walls.useful(corner, x, y)
        some = good.nonzero()[0]
        good[some] = paths.corner_fans.see(corner[some], x[some], y[some])
        return good

    def _tables(self, x: Array, y: Array) -> Iterator[tuple[slice, Array]]:
        """Yield slices of (k,) targets, at least one, and the squared distances of all robots to these."""
        if self._table is not None:
            yield slice(0, len(x)), self._table
            return
        # few enough for the memory
        size = max(1, _PAIRS // len(self.x))
        for begin in range(0, max(len(x), 1), size):
            part = slice(begin, begin + size)
            dx, dy = x[part] - self.x[:, None], y[part] - self.y[:, None]
            dx *= dx
            dy *= dy
            dx += dy
            if size >= len(x):
                self._table = dx
            yield part, dx

    def _nearest(self, x: Array, y: Array) -> tuple[IntArray, Array]:
        """Return each target's nearest robot and its squared distance."""
        robot, distance2 = np.empty(len(x), dtype=np.intp), np.empty(len(x))
        for part, away2 in self._tables(x, y):
            robot[part] = away2.argmin(axis=0)
            distance2[part] = away2[robot[part], np.arange(away2.shape[1])]
        return robot, distance2

    def _nearer(self, x: Array, y: Array, bound: Array, but: IntArray) -> tuple[IntArray, IntArray, Array]:
        """Return the pairs of a target and a robot nearer than `bound`, but for the robot `but`."""
        pieces = []
        for part, away2 in self._tables(x, y):
            robot, target = (away2 < bound[part] ** 2).nonzero()
            other = (robot != but[part][target]).nonzero()[0]
            robot, target = robot[other], target[other]
            pieces.append((target + part.start, robot, np.sqrt(away2[robot, target])))
        target, robot, away = (
            pieces[0] if len(pieces) == 1 else map(np.concatenate, zip(*pieces, strict=True))
        )
        return target, robot, away
