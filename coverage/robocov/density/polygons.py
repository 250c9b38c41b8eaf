"""Areas of constant weight, and their exact integrals over polygons, without clipping.

A polygon is a signed sum of strips, one for each edge: the area to the left of a rising edge counts
as positive, that to the left of a falling edge as negative. The integral over the intersection of two
polygons is therefore a signed sum over the pairs of their edges e and f. Each term is the integral of a
polynomial over the area between f and e,

    ∫ max(0, x_e(y) - x_f(y)) dy          (the area; over the heights y common to both edges)

and the same with other powers of x and y in it. Both edges are straight, so that this is an integral of
a polynomial in y over one interval. Rounding decides nothing: each pair adds a term that depends
continuously on all end points, however edges meet, touch or coincide.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
import shapely

from robocov.arrays import Array, IntArray, Ring
from robocov.compiled import inlined_kernel, kernel
from robocov.density.base import Density, require_weight
from robocov.density.cell_edges import MASS, MOMENT_X, MOMENT_Y, POLAR_MOMENT, CellEdges
from robocov.errors import ParameterError

_LOW_X = 0
_LOW_Y = 1
_HIGH_X = 2
_HIGH_Y = 3
"""Columns of a jump: its lower and its upper end, m."""
_STEP = 4
"""Column of a jump: φ to the right of it minus φ to the left."""
_JUMP_COLUMNS = 5

_GAUSS_NODE = 0.5 - 0.5 / 3.0**0.5
"""First node of the Gauss rule with two points on [0, 1], which is exact for cubic polynomials."""


@dataclass(frozen=True)
class WeightedArea:
    """A polygon of constant weight.

    Parameters
    ----------
    vertices : tuple of (x, y), m
        Outer ring, in either direction. The first vertex is not repeated.
    weight : float
        At least 0.
    holes : tuple of rings
        Rings like `vertices`.
    name : str or None
        Displayed name of the area.

    Raises
    ------
    ParameterError
        If the weight is out of range.

    See Also
    --------
    WeightedPolygons : The density that consists of such areas.

    Examples
    --------
    >>> import robocov as rc
    >>> ward = rc.WeightedArea(((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)), weight=5.0, name="ward")
    >>> ward.weight
    5.0
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
    """A density that is constant in each of several polygons and outside them. Its integrals are exact.

    Parameters
    ----------
    areas : tuple of WeightedArea
        Where areas overlap, the weight is that of the last one.
    background : float
        Density outside all areas, at least 0.

    Raises
    ------
    ParameterError
        If all weights are 0, or the background is out of range.

    See Also
    --------
    WeightedArea : One polygon.
    Density : The interface of all densities.

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> room = rc.WeightedArea(((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)), weight=5.0)
    >>> density = rc.WeightedPolygons((room,), background=1.0)
    >>> density.evaluate(np.array([[1.0, 1.0], [3.0, 1.0]]))
    array([5., 1.])
    """

    kind: ClassVar[str] = "polygons"

    areas: tuple[WeightedArea, ...]
    background: float = 1.0

    def __post_init__(self) -> None:
        require_weight("background", self.background)
        if not self.max_value > 0.0:
            raise ParameterError(
                "background: expected a number above 0 or an area with a weight above 0, got 0"
            )

    @property
    def min_value(self) -> float:
        """The smallest weight, of the areas and the background."""
        return min([self.background, *(area.weight for area in self.areas)])

    @property
    def max_value(self) -> float:
        """The largest weight, of the areas and the background."""
        return max([self.background, *(area.weight for area in self.areas)])

    @cached_property
    def _jumps(self) -> Array:
        """The lines across which φ jumps, (j, 5): the edges of the visible parts of the areas.

        A row contains x and y of the lower end, then of the upper end, and the change of φ from left to
        right. Horizontal edges are left out, because their strips have no height.
        """
        jumps = [np.empty((0, _JUMP_COLUMNS))]
        covered = shapely.MultiPolygon()
        # The last area is on top.
        for area in reversed(self.areas):
            visible = area.polygon if covered.is_empty else shapely.difference(area.polygon, covered)
            covered = shapely.union(covered, area.polygon)
            # Where areas touch, the difference may contain points and lines, which have no rings.
            for ring in shapely.get_rings(shapely.orient_polygons(shapely.get_parts(visible))):
                points = shapely.get_coordinates(ring)
                jumps.append(_build_jumps(points, area.weight - self.background))
        all_jumps = np.concatenate(jumps)
        is_horizontal = all_jumps[:, _LOW_Y] >= all_jumps[:, _HIGH_Y]
        has_step = all_jumps[:, _STEP] != 0.0
        return np.asarray(all_jumps[~is_horizontal & has_step])

    def evaluate(self, points: Array) -> Array:
        """Evaluate the weight of the last area that contains each point, or the background.

        Parameters
        ----------
        points : (k, 2) array, m

        Returns
        -------
        (k,) array
        """
        x, y = np.asarray(points, dtype=float).T
        values = np.full(len(x), float(self.background))
        for area in self.areas:
            values[shapely.contains_xy(area.polygon, x, y)] = area.weight
        return values

    def compute_moments(self, edges: CellEdges, origins: Array) -> Array:
        """Compute mass, first moments and polar moment of cells without clipping them.

        Parameters
        ----------
        edges, origins
            See `Density.compute_moments`.

        Returns
        -------
        (n, 4) array, m², m³, m³ and m⁴
        """
        moments = self.background * edges.compute_moments(len(origins))
        _add_jumps(moments, self._jumps, edges.start, edges.end, edges.cell, np.ascontiguousarray(origins))
        return moments


def _build_jumps(points: Array, step: float) -> Array:
    """Convert a closed, counter-clockwise ring to jumps, one for each edge.

    The density φ inside the ring exceeds φ outside by `step`. A jump runs from the lower to the upper end of
    its edge, and contains the change of φ from its left side to its right side: -step if the inside of the
    ring is on the left, and +step if it is on the right.
    """
    start = points[:-1]
    end = points[1:]
    # A column, (k, 1), which applies to both coordinates of each end.
    is_falling = start[:, 1:] > end[:, 1:]
    low = np.where(is_falling, end, start)
    high = np.where(is_falling, start, end)
    # The inside of the polygon lies to the left of a rising edge.
    signed_step = np.where(is_falling, 1.0, -1.0) * step
    return np.hstack([low, high, signed_step])


class _Segment(NamedTuple):
    """An edge or a jump that is not horizontal, from its lower to its upper end, relative to a generator."""

    low_x: float
    low_y: float
    high_x: float
    high_y: float


class _Strip(NamedTuple):
    """The area between a jump, on the left, and an edge, on the right, over the heights common to both."""

    bottom: float
    top: float
    left_bottom: float
    """x of the jump at the bottom."""
    left_top: float
    """x of the jump at the top."""
    right_bottom: float
    """x of the edge at the bottom."""
    right_top: float
    """x of the edge at the top."""


@kernel
def _add_jumps(
    moments: Array, jumps: Array, start: Array, end: Array, cell: IntArray, origins: Array
) -> None:
    """Add the contribution of areas of constant weight to the moments of cells, (n, 4).

    A jump is a line across which the density changes: an edge of an area. An edge is one of a cell. With the
    change of the density to the right of a jump as its weight, the integral over a cell is the sum, over all
    pairs of an edge and a jump, of integrals over the strip between them: the area to the right of the jump
    and to the left of the edge, at the heights y that both of them span. Strips of rising edges are added,
    and those of falling edges subtracted, so that only what lies inside the cell remains.

    Edges run from `start` to `end`, relative to the origin of their cell; horizontal ones span no area.
    """
    for k in range(len(cell)):
        cell_index = cell[k]
        origin_x = origins[cell_index, 0]
        origin_y = origins[cell_index, 1]
        # A falling edge is reversed, and its integrals are subtracted.
        if start[k, 1] < end[k, 1]:
            sign = 1.0
            edge = _Segment(start[k, 0], start[k, 1], end[k, 0], end[k, 1])
        elif start[k, 1] > end[k, 1]:
            sign = -1.0
            edge = _Segment(end[k, 0], end[k, 1], start[k, 0], start[k, 1])
        else:
            continue
        for jump_index in range(len(jumps)):
            jump = _Segment(
                jumps[jump_index, _LOW_X] - origin_x,
                jumps[jump_index, _LOW_Y] - origin_y,
                jumps[jump_index, _HIGH_X] - origin_x,
                jumps[jump_index, _HIGH_Y] - origin_y,
            )
            # Skip pairs without a common height, and edges that are entirely to the left of the jump.
            bottom = max(edge.low_y, jump.low_y)
            top = min(edge.high_y, jump.high_y)
            if bottom >= top or max(edge.low_x, edge.high_x) <= min(jump.low_x, jump.high_x):
                continue
            strip = _Strip(
                bottom=bottom,
                top=top,
                left_bottom=_find_x(jump, bottom),
                left_top=_find_x(jump, top),
                right_bottom=_find_x(edge, bottom),
                right_top=_find_x(edge, top),
            )
            _add_strip(moments, cell_index, strip, sign * jumps[jump_index, _STEP])


@inlined_kernel
def _add_strip(moments: Array, cell_index: int, strip: _Strip, weight: float) -> None:
    """Add the integrals of a weight over a strip to the moments of a cell.

    A strip is the area between a jump of the density, on its left, and an edge of the cell, on its right. The
    part where the jump is to the right of the edge is left out. At a height y, the strip extends from `left`
    to `right`, and the integrals over x are polynomials in y of degree 3 at most. The Gauss rule with two
    nodes is therefore exact.
    """
    width_bottom = strip.right_bottom - strip.left_bottom
    width_top = strip.right_top - strip.left_top
    if width_bottom > 0.0 or width_top > 0.0:
        # Heights are bottom + t (top - bottom), with t from 0 to 1. If the edge crosses the jump, integrate
        # only over the heights on one side of the crossing.
        t_bottom = 0.0
        t_top = 1.0
        if width_bottom < 0.0:
            t_bottom = width_bottom / (width_bottom - width_top)
        if width_top < 0.0:
            t_top = width_bottom / (width_bottom - width_top)
        fraction = t_top - t_bottom
        node_weight = 0.5 * fraction * (strip.top - strip.bottom) * weight
        for node in (_GAUSS_NODE, 1.0 - _GAUSS_NODE):
            t = t_bottom + fraction * node
            right = strip.right_bottom + t * (strip.right_top - strip.right_bottom)
            left = strip.left_bottom + t * (strip.left_top - strip.left_bottom)
            mass = node_weight * (right - left)
            height = strip.bottom + t * (strip.top - strip.bottom)
            mean_square = (right * right + right * left + left * left) / 3.0
            moments[cell_index, MASS] += mass
            moments[cell_index, MOMENT_X] += 0.5 * mass * (right + left)
            moments[cell_index, MOMENT_Y] += height * mass
            moments[cell_index, POLAR_MOMENT] += mass * (mean_square + height * height)


@kernel
def _find_x(segment: _Segment, height: float) -> float:
    """Return the x coordinate of a segment at a height."""
    fraction = (height - segment.low_y) / (segment.high_y - segment.low_y)
    fraction = min(max(fraction, 0.0), 1.0)
    return segment.low_x + fraction * (segment.high_x - segment.low_x)
