"""Descent of the coverage cost (22): where discs that keep clear of walls and of each other rest."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np
import shapely
from scipy.optimize import LbfgsInvHessProduct
from scipy.spatial import cKDTree

from robocov.arrays import Array, IntArray
from robocov.environment import START_GAP
from robocov.k_median import Beat

if TYPE_CHECKING:
    from shapely import MultiPolygon
    from shapely.geometry.base import BaseGeometry

    from robocov.cost import CoverageCost, CoverageResult

_SEGMENTS = (
    32  # edges of a quarter circle around corners: they cut 3e-4 of the radius off, less than `START_GAP`
)
_PUSHES = 60  # times that overlapping robots are pushed apart before the place counts as too narrow for them
_FARTHER = 1.005  # they are pushed a little too far, else they would never quite arrive
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # the golden angle: its multiples are spread evenly
_MEMORY = 8  # steps from which the curvature is learnt
_ARMIJO = 1e-4  # part of the fall that the slope promises which is good enough
_HALVINGS = 4, 14  # of a step along the learnt direction, and along the slope, before it counts as none
_SLOW = 5, 1e-7  # so many steps that together lower the cost by less than this part of it are the last ones
_STEPS = 300  # most steps; some tens are usual


class Room:
    """Free configuration space of robots of some radius (m).

    They keep from walls (`clearance`), and from each other (`spacing`, m), the distance that starts leave as
    well: their radius (their diameter), and `robocov.environment.START_GAP` of it. There is a part for each
    component of the free space, empty where no robot fits.
    """

    def __init__(self, free: MultiPolygon, radius: float) -> None:
        self.clearance, self.spacing = radius * (1.0 + START_GAP), 2.0 * radius * (1.0 + START_GAP)
        self.parts: tuple[BaseGeometry, ...] = tuple(
            part.buffer(-self.clearance, quad_segs=_SEGMENTS) for part in free.geoms
        )
        shapely.prepare(list(self.parts))

    def nearest(self, positions: Array, component: IntArray) -> Array | None:
        """Return (n, 2) positions near the given ones where all fit, each in its component, or else None."""
        positions = self._inside(positions, component)
        for _ in range(_PUSHES):
            pairs = cKDTree(positions).query_pairs(self.spacing * (1.0 - 1e-9), output_type="ndarray")
            if not len(pairs):
                return positions
            positions = self._inside(self._apart(positions, pairs[np.lexsort(pairs.T)]), component)
        return None

    def _apart(self, positions: Array, pairs: IntArray) -> Array:
        """Return positions with each of (p, 2) pairs pushed to its distance, half by each."""
        one, other = pairs.T
        between = positions[other] - positions[one]
        apart = np.hypot(between[:, 0], between[:, 1])
        # two robots in one place have no direction apart: a fixed one, another for each pair
        same = apart == 0.0
        angle = _GOLDEN * (one[same] + other[same] * len(positions))
        between[same] = np.column_stack([np.cos(angle), np.sin(angle)])
        part = (_FARTHER * self.spacing - apart) / 2.0 / np.where(same, 1.0, apart)
        push = between * part[:, None]
        positions = positions.copy()
        np.subtract.at(positions, one, push)
        np.add.at(positions, other, push)
        return positions

    def _inside(self, positions: Array, component: IntArray) -> Array:
        """Return the nearest place in the part of its component for each position."""
        part = np.array(self.parts, dtype=object)[component]
        point = shapely.points(positions)
        away = np.nonzero(~shapely.covers(part, point))[0]
        if not len(away):
            return positions
        positions = positions.copy()
        positions[away] = shapely.get_coordinates(shapely.shortest_line(part[away], point[away]))[::2]
        return positions


def descended(
    cost: CoverageCost, room: Room, positions: Array, component: IntArray, beat: Beat = lambda: None
) -> CoverageResult:
    """Return the coverage cost of a local minimum near the given positions, which is never higher.

    Projected quasi-Newton steps: L-BFGS (Nocedal and Wright, *Numerical Optimization*, algorithm 7.4),
    scaled by the curvature that Weiszfeld's iteration for the geometric median uses, from `Room.nearest`
    back into the room, halved until the cost falls enough (Armijo). The cost is only piecewise smooth,
    as sites change owners and ways, and a wall may stop a robot: where the learnt direction does not lead
    down, the scaled slope alone is followed and the curvature learnt anew. No robot leaves its `component`
    of the free space. `beat` is called once a step; it may raise, to give up.
    """
    result = cost(positions)
    slope = _slope(result)
    learnt: deque[tuple[Array, Array]] = deque(maxlen=_MEMORY)
    falls: deque[float] = deque(maxlen=_SLOW[0])

    def lower(way: Array, halvings: int) -> CoverageResult | None:
        """Return the cost after the first of ever shorter steps that lowers it enough, None for none."""
        for k in range(halvings):
            there = room.nearest(result.positions + 0.5**k * way, component)
            promised = 0.0 if there is None else float((slope * (there - result.positions)).sum())
            if there is not None and promised < 0.0:
                after = cost(there)
                if after.mean_distance <= result.mean_distance + _ARMIJO * promised:
                    return after
        return None

    for _ in range(_STEPS):
        beat()
        scale = _curvature(result, cost.spacing / 2.0)[:, None]
        after = lower(_direction(slope, scale, learnt), _HALVINGS[0]) if learnt else None
        if after is None:
            learnt.clear()
            after = lower(-slope / scale, _HALVINGS[1])
        if after is None:
            break
        slope_after = _slope(after)
        step, bend = after.positions - result.positions, slope_after - slope
        # only where it curves upwards the direction stays one of descent
        if (step * bend).sum() > 1e-10 * (bend * bend).sum():
            learnt.append((step, bend))
        falls.append(result.mean_distance - after.mean_distance)
        result, slope = after, slope_after
        if len(falls) == falls.maxlen and sum(falls) < _SLOW[1] * result.mean_distance:
            break
    return result


def _slope(result: CoverageResult) -> Array:
    """Return the derivative of the mean distance by the positions, (n, 2)."""
    if not result.value > 0.0:
        return np.zeros_like(result.positions)
    return result.gradient * (result.mean_distance / result.value)


def _curvature(result: CoverageResult, least: float) -> Array:
    """Return the mean over the sites, by weight, of the inverse distances to first way-points, (n,) 1/m."""
    site = np.nonzero(result.owner >= 0)[0]
    owner = result.owner[site]
    toward = result.first[site] - result.positions[owner]
    # a site under the robot would hold it fast
    length = np.maximum(np.hypot(toward[:, 0], toward[:, 1]), least)
    pull, total = 1.0 / length, float(max(len(site), 1))
    if result.weights is not None:
        pull *= result.weights[site]
        total = float(result.weights[site].sum()) or 1.0
    curvature = np.bincount(owner, pull, minlength=len(result.positions)) / total
    return np.where(curvature > 0.0, curvature, 1.0)


def _direction(slope: Array, scale: Array, learnt: deque[tuple[Array, Array]]) -> Array:
    """Return the quasi-Newton direction (n, 2) m, by the steps that were learnt from."""
    step, bend = np.array(learnt).reshape(len(learnt), 2, -1).transpose(1, 0, 2)
    # in coordinates in which the curvature is about 1, from which scipy's recursion begins
    scale = np.broadcast_to(scale, slope.shape).ravel()
    root = np.sqrt(scale * (bend[-1] @ (bend[-1] / scale) / (step[-1] @ bend[-1])))
    way = LbfgsInvHessProduct(step * root, bend / root) @ (slope.ravel() / root)
    return np.asarray(-(way / root).reshape(slope.shape))
