"""Integrals of piecewise constant densities over polygons, exact and without clipping.

The area to the left of a rising edge e counts as a part of a polygon, that to the left of a falling one
as none: so a polygon is a signed sum of strips, one an edge. Of two polygons, the integral over what they
have in common is a signed sum over the pairs of their edges e and f, each the integral of a polynomial
over what lies between f and e,

    ∫ max(0, x_e(y) - x_f(y)) dy          (the area; over the heights y that both have)

and the same with other powers of x and y in it. Both edges are straight, so that this is an integral of
a polynomial in y over one interval. Nothing is decided by rounding: each pair adds what depends
continuously on all ends, however edges meet, touch or coincide.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.arrays import Array, BoolArray, IntArray
from robocov.density.moments import Moments

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry.base import BaseGeometry

    from robocov.voronoi.cell_edges import CellEdges

_AT_ONCE = 1 << 18
"""Pairs of edges that are looked at at once, which bounds the memory."""

_NODES = np.array([0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0)])
"""Of Gauss's rule with two points, exact for cubic polynomials."""


@dataclass(frozen=True, slots=True, eq=False)
class Jumps:
    """The edges at which a piecewise constant density jumps; none is level.

    Attributes
    ----------
    low, high : (e, 2) m
        The lower and the upper end of each.
    jump : (e,)
        By how much the density is larger to the right of the edge than to the left.
    """

    low: Array
    high: Array
    jump: Array

    @classmethod
    def of(cls, areas: Sequence[tuple[BaseGeometry, float]]) -> Jumps:
        """Return the edges of polygons with their weights above the background; the last ones are on top."""
        starts, ends, jumps = [np.empty((0, 2))], [np.empty((0, 2))], [np.empty(0)]
        above = shapely.MultiPolygon()
        for polygon, weight in reversed(areas):
            seen = shapely.difference(polygon, above) if not above.is_empty else polygon
            above = shapely.union(above, polygon)
            for part in shapely.get_parts(seen):
                if part.geom_type != "Polygon" or part.is_empty:
                    continue
                part = shapely.orient_polygons(part)
                for ring in (part.exterior, *part.interiors):
                    points = shapely.get_coordinates(ring)
                    starts.append(points[:-1])
                    ends.append(points[1:])
                    jumps.append(np.full(len(points) - 1, weight))
        start, end, jump = (np.concatenate(pieces) for pieces in (starts, ends, jumps))
        falls = start[:, 1] > end[:, 1]
        # the inside of a polygon lies to the left of an edge that rises
        jump = np.where(falls, jump, -jump)
        low, high = np.where(falls[:, None], end, start), np.where(falls[:, None], start, end)
        steep = (low[:, 1] < high[:, 1]) & (jump != 0.0)
        return cls(low[steep], high[steep], jump[steep])


def step_moments(jumps: Jumps, edges: CellEdges, origins: Array) -> Moments:
    """Return the moments of cells with a piecewise constant density, about the cells' origins.

    Parameters
    ----------
    jumps : Jumps
    edges : CellEdges
        Relative to the origins of their cells.
    origins : (n, 2) m
    """
    sums = np.zeros((4, len(origins)))
    if not len(jumps.jump):
        return Moments(sums[0], sums[1:3].T, sums[3])
    origin = origins[edges.cell]
    rises = (edges.start[:, 1] <= edges.end[:, 1])[:, None]
    low, high = np.where(rises, edges.start, edges.end), np.where(rises, edges.end, edges.start)
    steep = low[:, 1] < high[:, 1]
    chunk = max(1, _AT_ONCE // len(jumps.jump))
    for k in range(0, len(low), chunk):
        some = slice(k, k + chunk)
        pair = _pairs(low[some] + origin[some], high[some] + origin[some], steep[some], jumps)
        edge = pair[0] + k
        parts = _between(low[edge], high[edge], origin[edge], jumps, pair[1])
        sign = np.where(rises[edge, 0], 1.0, -1.0) * jumps.jump[pair[1]]
        for row, part in zip(sums, parts, strict=True):
            # one after the other: a cell's sum does not depend on what was looked at together
            np.add.at(row, edges.cell[edge], part * sign)
    return Moments(sums[0], sums[1:3].T, sums[3])


def _pairs(low: Array, high: Array, steep: BoolArray, jumps: Jumps) -> tuple[IntArray, IntArray]:
    """Return which edges have heights in common with which jumps, and do not lie wholly to their left."""
    right = np.maximum(low[:, 0], high[:, 0])[:, None]
    left = np.minimum(jumps.low[:, 0], jumps.high[:, 0])
    may = (low[:, 1:] < jumps.high[:, 1]) & (high[:, 1:] > jumps.low[:, 1]) & (right > left)
    edge, jump = np.nonzero(may & steep[:, None])
    return edge, jump


def _between(low: Array, high: Array, origin: Array, jumps: Jumps, jump: IntArray) -> list[Array]:
    """Return the integrals of 1, x, y and x² + y² between pairs of a jump and an edge to its right.

    Coordinates are relative to the origins, where the edges are small.
    """
    f_low, f_high = jumps.low[jump] - origin, jumps.high[jump] - origin
    bottom, top = np.maximum(low[:, 1], f_low[:, 1]), np.minimum(high[:, 1], f_high[:, 1])
    height = np.maximum(top - bottom, 0.0)
    e = _at(low, high, bottom), _at(low, high, top)
    f = _at(f_low, f_high, bottom), _at(f_low, f_high, top)
    gap = e[0] - f[0], e[1] - f[1]
    # where they cross, one part of the interval counts
    cross = gap[0] - gap[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.clip(gap[0] / cross, 0.0, 1.0)
    begin = np.where(gap[0] >= 0.0, 0.0, np.where(gap[1] > 0.0, at, 1.0))
    end = np.where(gap[1] >= 0.0, 1.0, np.where(gap[0] > 0.0, at, 0.0))
    part = np.maximum(end - begin, 0.0)
    weight = 0.5 * part * height
    sums = [np.zeros(len(weight)) for _ in range(4)]
    for node in _NODES:
        where = begin + part * node
        x, left = e[0] + where * (e[1] - e[0]), f[0] + where * (f[1] - f[0])
        y = bottom + where * height
        width = x - left
        sums[0] += width
        sums[1] += 0.5 * width * (x + left)
        sums[2] += y * width
        sums[3] += width * ((x * x + x * left + left * left) / 3.0 + y * y)
    return [total * weight for total in sums]


def _at(low: Array, high: Array, y: Array) -> Array:
    """Return x where edges have the height y."""
    # an edge that is level but for rounding has no height in common with anything
    with np.errstate(over="ignore"):
        part = np.clip((y - low[:, 1]) / np.maximum(high[:, 1] - low[:, 1], 1e-300), 0.0, 1.0)
    return np.asarray(low[:, 0] + part * (high[:, 0] - low[:, 0]))
