"""Areas that count more than others, or less; integrals over polygons, exact and without clipping.

The area to the left of a rising edge e counts as a part of a polygon, that to the left of a falling one
as none: so a polygon is a signed sum of strips, one an edge. Of two polygons, the integral over what they
have in common is a signed sum over the pairs of their edges e and f, each the integral of a polynomial
over what lies between f and e,

    ∫ max(0, x_e(y) - x_f(y)) dy          (the area; over the heights y that both have)

and the same with other powers of x and y in it. Both edges are straight, so that this is an integral of
a polynomial in y over one interval. Nothing is decided by rounding: each pair adds what depends
continuously on all ends, however edges meet, touch or coincide.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, TypeAlias

import numpy as np
import shapely

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.density.base import CellEdges, Density, require_weight
from robocov.errors import ParameterError

Ring: TypeAlias = tuple[tuple[float, float], ...]

_NODE = 0.5 - 0.5 / 3.0**0.5
"""The first of Gauss's rule with two points, exact for cubic polynomials."""


@dataclass(frozen=True)
class WeightedArea:
    """A polygon in which every place has the same weight, from 0.

    The rings, of [x, y] in metres, run either way round; their first vertices are not repeated.
    """

    vertices: Ring
    weight: float
    holes: tuple[Ring, ...] = ()
    name: str | None = None

    def __post_init__(self) -> None:
        require_weight("weight", self.weight)

    @cached_property
    def polygon(self) -> shapely.Polygon:
        """The area as a shapely polygon."""
        return shapely.Polygon(self.vertices, self.holes)


@dataclass(frozen=True)
class WeightedPolygons(Density):
    """A density that is constant in polygons, and outside them all. Its integrals are exact.

    Where areas overlap, the last of them counts; outside them all, the background, from 0.
    """

    kind: ClassVar[str] = "polygons"

    areas: tuple[WeightedArea, ...]
    background: float = 1.0

    def __post_init__(self) -> None:
        require_weight("background", self.background)
        if not self.max_value > 0.0:
            raise ParameterError("background: 0, and no area of a weight above 0, but some weight was wanted")

    @property
    def min_value(self) -> float:
        return min([self.background, *(area.weight for area in self.areas)])

    @property
    def max_value(self) -> float:
        return max([self.background, *(area.weight for area in self.areas)])

    @cached_property
    def _jumps(self) -> Array:
        """The edges at which φ jumps, (e, 5) m: lower end, upper end, how much more there is on the right."""
        pieces, above = [np.empty((0, 5))], shapely.MultiPolygon()
        for area in reversed(self.areas):  # the last ones are on top
            seen = shapely.difference(area.polygon, above) if not above.is_empty else area.polygon
            above = shapely.union(above, area.polygon)
            # of what is no polygon there are no rings
            for ring in shapely.get_rings(shapely.orient_polygons(shapely.get_parts(seen))):
                points = shapely.get_coordinates(ring)
                start, end = points[:-1], points[1:]
                falls = start[:, 1:] > end[:, 1:]
                low, high = np.where(falls, end, start), np.where(falls, start, end)
                # the inside of a polygon lies to the left of an edge that rises
                jump = np.where(falls, 1.0, -1.0) * (area.weight - self.background)
                pieces.append(np.hstack([low, high, jump]))
        jumps = np.concatenate(pieces)
        return np.asarray(jumps[(jumps[:, 1] < jumps[:, 3]) & (jumps[:, 4] != 0.0)])

    def evaluate(self, points: Array) -> Array:
        x, y = np.asarray(points, dtype=float).T
        value = np.full(len(x), float(self.background))
        for area in self.areas:
            value[shapely.contains_xy(area.polygon, x, y)] = area.weight
        return value

    def compute_moments(self, edges: CellEdges, origins: Array) -> Array:
        total = self.background * edges.compute_moments(len(origins))
        _add_steps(self._jumps, edges.start, edges.end, edges.cell, np.ascontiguousarray(origins), total)
        return total


@kernel
def _add_steps(jumps: Array, start: Array, end: Array, cell: IntArray, origins: Array, total: Array) -> None:
    """Add what lies between each edge and each jump to its left."""
    for e in range(len(cell)):
        ox, oy = origins[cell[e], 0], origins[cell[e], 1]
        sign, x, y, u, v = 1.0, start[e, 0], start[e, 1], end[e, 0], end[e, 1]
        if y > v:
            sign, x, y, u, v = -1.0, u, v, x, y
        for f in range(len(jumps) if y < v else 0):
            # relative to the origin, where the edges are small
            low_x, low_y = jumps[f, 0] - ox, jumps[f, 1] - oy
            high_x, high_y = jumps[f, 2] - ox, jumps[f, 3] - oy
            bottom, top = max(y, low_y), min(v, high_y)
            if bottom >= top or max(x, u) <= min(low_x, high_x):
                continue
            e0, e1 = _at(x, y, u, v, bottom), _at(x, y, u, v, top)
            f0, f1 = _at(low_x, low_y, high_x, high_y, bottom), _at(low_x, low_y, high_x, high_y, top)
            gap, then = e0 - f0, e1 - f1
            if gap <= 0.0 and then <= 0.0:
                continue
            # where they cross, one part of the interval counts
            begin = gap / (gap - then) if gap < 0.0 else 0.0
            part = (gap / (gap - then) if then < 0.0 else 1.0) - begin
            weight, c = 0.5 * part * (top - bottom) * sign * jumps[f, 4], cell[e]
            for node in (_NODE, 1.0 - _NODE):
                where = begin + part * node
                right, left = e0 + where * (e1 - e0), f0 + where * (f1 - f0)
                width, height = weight * (right - left), bottom + where * (top - bottom)
                total[c, 0] += width
                total[c, 1] += 0.5 * width * (right + left)
                total[c, 2] += height * width
                total[c, 3] += width * ((right * right + right * left + left * left) / 3.0 + height * height)


@kernel
def _at(x: float, y: float, u: float, v: float, height: float) -> float:
    """Return x where an edge has a height."""
    return x + min(max((height - y) / (v - y), 0.0), 1.0) * (u - x)
