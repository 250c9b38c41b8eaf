"""Areas of constant weight, and their exact integrals over cells, without clipping.

A polygon is a signed sum of strips, one for each edge. The strip of an edge is the area to its left, up to
infinity. It is added if the edge rises, and subtracted if the edge falls. The integral over the intersection
of two polygons is therefore a signed sum over all pairs of an edge e of one and an edge f of the other. For
the area, a term of this sum is

    ∫ max(0, x_e(y) - x_f(y)) dy,

where y runs over the heights that both edges have in common, and for the other moments, the integrand is
multiplied by powers of x and y. Since both edges are straight, the integrand is a polynomial in y. The result
does not depend on decisions that rounding errors could change: each term is a continuous function of the end
points, even where edges meet, touch or coincide.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
import shapely

from robocov.arrays import to_tuples
from robocov.compiled import inlined_kernel, kernel
from robocov.density.base import Density, require_weight
from robocov.density.cell_edges import MASS, MOMENT_X, MOMENT_Y, POLAR_MOMENT, CellEdges
from robocov.errors import ParameterError, quote
from robocov.typing import FloatArray, IntArray, Ring

_LOW_X = 0
"""Column of a jump, a line across which the density changes: x of its lower end, m."""
_LOW_Y = 1
"""Column of a jump: y of its lower end, m."""
_HIGH_X = 2
"""Column of a jump: x of its upper end, m."""
_HIGH_Y = 3
"""Column of a jump: y of its upper end, m."""
_STEP = 4
"""Column of a jump: the density to the right of the line minus the density to the left."""
_JUMP_COLUMNS = 5
"""Number of columns of a jump."""

_GAUSS_NODE = 0.5 - 0.5 / 3.0**0.5
"""First node of the Gauss rule with two nodes on [0, 1], which is exact for cubic polynomials."""


@dataclass(frozen=True)
class WeightedArea:
    """A polygon in which a density is constant.

    Parameters
    ----------
    vertices : tuple of (x, y), m
        Vertices of the outer ring, in either direction. The first vertex is not repeated.
    weight : float
        The density in the polygon, at least 0.
    holes : tuple of rings
        Vertices of each hole, like `vertices`.
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
        object.__setattr__(self, "vertices", to_tuples(self.vertices))
        object.__setattr__(self, "holes", to_tuples(self.holes))

    @cached_property
    def polygon(self) -> shapely.Polygon:
        """The area as a shapely polygon.

        Raises
        ------
        ParameterError
            If a ring has fewer than three vertices, or a coordinate is not finite.
        """
        _require_ring("vertices", self.vertices)
        for number, hole in enumerate(self.holes):
            _require_ring(f"holes[{number}]", hole)
        return shapely.Polygon(self.vertices, self.holes)


@dataclass(frozen=True)
class WeightedPolygons(Density):
    """A density that is constant in each of several polygons, and outside all of them.

    Its integrals over cells are exact.

    Parameters
    ----------
    areas : tuple of WeightedArea
        The polygons. Where several of them overlap, the density is the weight of the last one.
    background : float
        Density outside all areas, at least 0.

    Raises
    ------
    ParameterError
        If all weights are 0, or the background is out of range.

    See Also
    --------
    WeightedArea : A polygon of this density.
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
        object.__setattr__(self, "areas", to_tuples(self.areas))
        require_weight("background", self.background)
        if not self.upper_bound > 0.0:
            raise ParameterError(
                "background: expected a number above 0 or an area with a weight above 0, got 0"
            )

    @property
    def lower_bound(self) -> float:
        """The minimum of the weights and the background."""
        return min([self.background, *(area.weight for area in self.areas)])

    @property
    def upper_bound(self) -> float:
        """The maximum of the weights and the background."""
        return max([self.background, *(area.weight for area in self.areas)])

    @cached_property
    def _jumps(self) -> FloatArray:
        """The lines across which the density changes, (j, 5): the edges of the visible parts of the areas.

        For the columns, see `_LOW_X` and the following constants. Horizontal edges are left out, because
        their strips have no height.

        Raises
        ------
        ParameterError
            If an area is not a valid polygon, for example because its edges cross.
        """
        for number, area in enumerate(self.areas):
            if not area.polygon.is_valid:
                reason = shapely.is_valid_reason(area.polygon)
                raise ParameterError(
                    f"areas[{number}]: expected a valid polygon, got one with an error: {reason}"
                )
        jumps_by_ring = [np.empty((0, _JUMP_COLUMNS))]
        covered = shapely.MultiPolygon()
        # The last area is on top, and covers the others.
        for area in reversed(self.areas):
            visible = area.polygon if covered.is_empty else shapely.difference(area.polygon, covered)
            covered = shapely.union(covered, area.polygon)
            # Where areas touch, the difference may contain points and lines, which have no rings.
            for ring in shapely.get_rings(shapely.orient_polygons(shapely.get_parts(visible))):
                points = shapely.get_coordinates(ring)
                jumps_by_ring.append(_build_jumps(points, area.weight - self.background))
        all_jumps = np.concatenate(jumps_by_ring)
        is_horizontal = all_jumps[:, _LOW_Y] >= all_jumps[:, _HIGH_Y]
        has_step = all_jumps[:, _STEP] != 0.0
        return np.asarray(all_jumps[~is_horizontal & has_step])

    def evaluate(self, points: FloatArray) -> FloatArray:
        """Evaluate the density at points.

        Parameters
        ----------
        points : (k, 2) array, m
            The points.

        Returns
        -------
        (k,) array
            Weight of the last area that contains each point, or the background if no area does.
        """
        x, y = np.asarray(points, dtype=float).T
        values = np.full(len(x), float(self.background))
        for area in self.areas:
            values[shapely.contains_xy(area.polygon, x, y)] = area.weight
        return values

    def compute_moments(self, edges: CellEdges, origins: FloatArray) -> FloatArray:
        """Compute the mass, first moments and polar moment of each cell exactly.

        Parameters
        ----------
        edges, origins
            See `Density.compute_moments`.

        Returns
        -------
        (n, 4) array, m², m³, m³ and m⁴
            See `Density.compute_moments`.
        """
        moments = self.background * edges.compute_moments(len(origins))
        _add_jumps(moments, self._jumps, edges.starts, edges.ends, edges.cells, np.ascontiguousarray(origins))
        return moments


def _require_ring(name: str, ring: Ring) -> None:
    """Raise a ParameterError unless a ring has at least three vertices, and all coordinates are finite."""
    if len(ring) < 3 or not np.isfinite(ring).all():
        raise ParameterError(f"{name}: expected at least 3 points with finite coordinates, got {quote(ring)}")


def _build_jumps(points: FloatArray, step: float) -> FloatArray:
    """Return the jumps across the edges of a closed ring with an area on its left, (k, 5).

    The ring runs counter-clockwise around the area, or clockwise around a hole in it. The density in the
    area exceeds that outside by `step`. A jump runs from the lower to the upper end of its edge, and contains
    the change of the density from its left side to its right side: -step if the area is on the left, and
    +step if it is on the right.
    """
    starts = points[:-1]
    ends = points[1:]
    # The array has one column, so that it selects both coordinates of an end.
    is_falling = starts[:, 1:] > ends[:, 1:]
    low_ends = np.where(is_falling, ends, starts)
    high_ends = np.where(is_falling, starts, ends)
    # The area lies to the left of a rising edge.
    signed_steps = np.where(is_falling, 1.0, -1.0) * step
    return np.hstack([low_ends, high_ends, signed_steps])


class _Segment(NamedTuple):
    """An edge or a jump that is not horizontal, from its lower to its upper end, relative to an origin."""

    low_x: float
    low_y: float
    high_x: float
    high_y: float


class _Strip(NamedTuple):
    """The area between a jump, on the left, and an edge, on the right, at the heights common to both.

    If the two cross, the jump is on the left only below or above the crossing.
    """

    bottom: float
    """The minimum common height."""
    top: float
    """The maximum common height."""
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
    moments: FloatArray,
    jumps: FloatArray,
    starts: FloatArray,
    ends: FloatArray,
    cells: IntArray,
    origins: FloatArray,
) -> None:
    """Add the contribution of the jumps of a density to the moments of cells, (n, 4).

    Edges bound the cells, and jumps are the lines across which the density changes. The strip of an edge and
    a jump is the area to the left of the edge and to the right of the jump, at the heights that both have in
    common. A jump changes the density everywhere to its right. The integral over a cell is therefore the sum,
    over all pairs of an edge and a jump, of the change of the density integrated over their strip. The strips
    of rising edges are added and those of falling edges subtracted, so that only the inside of the cell
    counts.

    The edges run from `starts` to `ends`, relative to the origins of their cells.
    """
    for k in range(len(cells)):
        cell = cells[k]
        origin_x = origins[cell, 0]
        origin_y = origins[cell, 1]
        # A falling edge is reversed, and its integrals are subtracted. A horizontal edge has no strip.
        if starts[k, 1] < ends[k, 1]:
            sign = 1.0
            edge = _Segment(starts[k, 0], starts[k, 1], ends[k, 0], ends[k, 1])
        elif starts[k, 1] > ends[k, 1]:
            sign = -1.0
            edge = _Segment(ends[k, 0], ends[k, 1], starts[k, 0], starts[k, 1])
        else:
            continue
        for jump_index in range(len(jumps)):
            jump = _Segment(
                jumps[jump_index, _LOW_X] - origin_x,
                jumps[jump_index, _LOW_Y] - origin_y,
                jumps[jump_index, _HIGH_X] - origin_x,
                jumps[jump_index, _HIGH_Y] - origin_y,
            )
            # Skip pairs without a common height, or with the edge entirely to the left of the jump.
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
            _add_strip(moments, cell, strip, sign * jumps[jump_index, _STEP])


@inlined_kernel
def _add_strip(moments: FloatArray, cell: int, strip: _Strip, weight: float) -> None:
    """Add the integrals of a weight over a strip to the moments of a cell.

    At each height, the strip extends from the jump, at x = left, to the edge, at x = right. Heights at which
    the jump is to the right of the edge are left out. The integrals over x are polynomials of the height, of
    degree 3 at most, so that the Gauss rule with two nodes is exact.
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
            moments[cell, MASS] += mass
            moments[cell, MOMENT_X] += 0.5 * mass * (right + left)
            moments[cell, MOMENT_Y] += height * mass
            moments[cell, POLAR_MOMENT] += mass * (mean_square + height * height)


@kernel
def _find_x(segment: _Segment, height: float) -> float:
    """Return the x coordinate of a segment at a height between its ends."""
    fraction = (height - segment.low_y) / (segment.high_y - segment.low_y)
    fraction = min(max(fraction, 0.0), 1.0)
    return segment.low_x + fraction * (segment.high_x - segment.low_x)
