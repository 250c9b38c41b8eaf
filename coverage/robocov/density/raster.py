"""An image of a density: constant in each of its pixels, or linear between their centers."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import Array, IntArray, freeze
from robocov.compiled import inlined_kernel, kernel
from robocov.density.base import MAX_WEIGHT, Density
from robocov.density.cell_edges import CellEdges
from robocov.errors import ParameterError, quote

if TYPE_CHECKING:
    from collections.abc import Iterable

MAX_RASTER_SIZE = 1024
"""Maximum number of rows, and of columns, of a raster."""

Interpolation: TypeAlias = Literal["cells", "bilinear"]
"""Whether a raster is constant in each of its pixels, or linear between their centers in both directions."""

_MAX_CACHED_GRIDS = 4
"""A grid takes ten times the memory of its image. While a user paints a raster, a new grid is built for each
change, but only the last few are still in use."""

_ONE = 0
_U = 1
_V = 2
_UU = 3
_VV = 4
"""Columns of the integrals of φ times 1, u, v, u² and v² over cells."""
_INTEGRAL_COLUMNS = 5

_CONSTANT = 0
_SLOPE_X = 1
_SLOPE_Y = 2
_TWIST = 3
"""Rows of the coefficients of a grid; see `_Grid`."""

_TIMES_ONE = 0
_TIMES_U = 1
_TIMES_UU = 2
"""Rows of the integrals of φ times 1, u and u² along rows; see `_Grid`."""

_GAUSS_NODE = 0.5 * 0.6**0.5
"""Distance of the outer nodes of the Gauss rule with three points on [0, 1] from the middle one."""
_MIDDLE_NODE = 1
"""Index of the middle node."""
_MIDDLE_WEIGHT = 8.0 / 18.0
_OUTER_WEIGHT = 5.0 / 18.0
"""Weights of the middle node and of the outer nodes."""


@dataclass(frozen=True, eq=False)
class Raster(Density):
    """An image of the density. Its integrals are exact.

    Parameters
    ----------
    values : (rows, columns) array
        At least 0, **the lowest row first**. The attribute is read-only.
    extent : (x_min, y_min, x_max, y_max), m
        Extent of the image. Points outside have the value of the nearest border pixel.
    interpolation : {"bilinear", "cells"}
        Between the centers of pixels, or constant within each pixel.

    Raises
    ------
    ParameterError
        If a value is out of range.

    See Also
    --------
    Density : The interface of all densities.

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> raster = rc.Raster(np.array([[1.0, 2.0]]), extent=(0.0, 0.0, 2.0, 1.0))
    >>> raster.evaluate(np.array([[0.5, 0.5], [1.0, 0.5]]))
    array([1. , 1.5])
    """

    kind: ClassVar[str] = "raster"

    values: Array = field(repr=False)
    extent: tuple[float, float, float, float]
    interpolation: Interpolation = "bilinear"

    def __post_init__(self) -> None:
        values = freeze(self.values)
        shape = values.shape
        if values.ndim != 2 or not 1 <= min(shape) <= max(shape) <= MAX_RASTER_SIZE:
            raise ParameterError(
                f"values: expected an array of 1 to {MAX_RASTER_SIZE} rows and columns, got shape {shape}"
            )
        is_valid = np.isfinite(values) & (values >= 0.0) & (values <= MAX_WEIGHT)
        if not is_valid.all():
            first_wrong = float(values[~is_valid][0])
            raise ParameterError(
                f"values: expected numbers from 0 to {MAX_WEIGHT:.0f}, got {quote(first_wrong)}"
            )
        if not values.max() > 0.0:
            raise ParameterError("values: expected at least one number above 0, got only 0")
        x_min, y_min, x_max, y_max = self.extent
        has_width = -math.inf < x_min < x_max < math.inf
        has_height = -math.inf < y_min < y_max < math.inf
        if not (has_width and has_height):
            raise ParameterError(
                "extent: expected [x_min, y_min, x_max, y_max] with a width and a height, "
                f"got {quote(self.extent)}"
            )
        if self.interpolation not in ("bilinear", "cells"):
            raise ParameterError(
                f"interpolation: expected bilinear or cells, got {quote(self.interpolation)}"
            )
        object.__setattr__(self, "values", values)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Raster):
            return NotImplemented
        has_same_frame = self.extent == other.extent and self.interpolation == other.interpolation
        return has_same_frame and np.array_equal(self.values, other.values)

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((self.extent, self.interpolation, self.values.shape, self.values.tobytes()))

    @property
    def min_value(self) -> float:
        """The smallest value of a pixel."""
        return float(self.values.min())

    @property
    def max_value(self) -> float:
        """The largest value of a pixel."""
        return float(self.values.max())

    def evaluate(self, points: Array) -> Array:
        """Evaluate the image. Points outside have the value of the nearest border pixel.

        Parameters
        ----------
        points : (k, 2) array, m

        Returns
        -------
        (k,) array
        """
        grid = _build_grid(self)
        u, v = ((np.asarray(points, dtype=float) - grid.origin) / grid.step).T
        rows, columns = grid.coefficients.shape[1:]
        column = np.clip(np.floor(u), 0, columns - 1).astype(np.intp)
        row = np.clip(np.floor(v), 0, rows - 1).astype(np.intp)
        # In a square of the grid, the density is a polynomial in ξ and η, the offsets from its lower left
        # corner; see `_Grid`. Outside the grid, the coefficients of the nearest square hold: they make the
        # density constant outwards, so that ξ and η need no limits.
        constant, slope_x, slope_y, twist = grid.coefficients[:, row, column]
        xi = u - column
        eta = v - row
        return np.asarray(constant + slope_x * xi + (slope_y + twist * xi) * eta)

    def compute_moments(self, edges: CellEdges, origins: Array) -> Array:
        """Compute mass, first moments and polar moment of cells exactly.

        Parameters
        ----------
        edges, origins
            See `Density.compute_moments`.

        Returns
        -------
        (n, 4) array, m², m³, m³ and m⁴
        """
        grid = _build_grid(self)
        offsets = origins - grid.origin
        edge_offsets = offsets[edges.cell]
        integrals = _integrate_cells(
            grid,
            (edges.start + edge_offsets) / grid.step,
            (edges.end + edge_offsets) / grid.step,
            edges.cell,
            len(origins),
        )
        # Convert the integrals of φ times 1, u, v, u² and v² from grid steps to meters.
        step_x, step_y = grid.step
        integrals = integrals * (step_x * step_y)
        mass = integrals[:, _ONE]
        x = integrals[:, _U] * step_x
        y = integrals[:, _V] * step_y
        xx = integrals[:, _UU] * (step_x * step_x)
        yy = integrals[:, _VV] * (step_y * step_y)
        # Convert moments about the origin of the grid to moments about the origins of the cells, at offsets a
        # from there: the integral of (x - a)² is that of x² - a (2 x - a).
        offset_x, offset_y = offsets.T
        polar = xx - offset_x * (2.0 * x - offset_x * mass) + yy - offset_y * (2.0 * y - offset_y * mass)
        return np.column_stack([mass, x - offset_x * mass, y - offset_y * mass, polar])


def sample_density(density: Density | None, extent: Iterable[float], columns: int, rows: int) -> Raster:
    """Sample a density at the centers of pixels, and return it as a bilinear raster.

    Parameters
    ----------
    density : Density or None
        None means 1 everywhere.
    extent : (x_min, y_min, x_max, y_max), m
    columns, rows : int

    Returns
    -------
    Raster
    """
    x_min, y_min, x_max, y_max = extent
    x = x_min + (np.arange(columns) + 0.5) * ((x_max - x_min) / columns)
    y = y_min + (np.arange(rows) + 0.5) * ((y_max - y_min) / rows)
    points = np.column_stack([np.tile(x, rows), np.repeat(y, columns)])
    values = np.ones(len(points)) if density is None else density.evaluate(points)
    return Raster(values.reshape(rows, columns), (x_min, y_min, x_max, y_max))


class _Grid(NamedTuple):
    """A density that is bilinear in each square of a grid, and integrals of it.

    u and v are coordinates in steps of the grid, from its lower left corner. In the square of column i and
    row j, the density is ``constant + slope_x ξ + slope_y η + twist ξ η``, with ξ = u - i and η = v - j from
    0 to 1. The outermost squares extend to infinity; their slopes and twists are chosen so that the density
    is constant outwards.

    Attributes
    ----------
    origin, step : (2,) arrays, m
    coefficients : (4, rows, columns) array
        Constants, slopes in x, slopes in y, and twists; see `_CONSTANT` and the following constants.
    left : (3, rows, columns) array
        Integrals of φ, u φ and u² φ along a row, from the left side of the grid to each square, at η = 0.
    left_change : (3, rows, columns) array
        Change of these integrals from η = 0 to η = 1. In between, they are linear in η.
    """

    origin: Array
    step: Array
    coefficients: Array
    left: Array
    left_change: Array


class _Edge(NamedTuple):
    """An edge of a cell, from (u, v) to (u + du, v + dv) in grid steps."""

    u: float
    v: float
    du: float
    dv: float


@lru_cache(maxsize=_MAX_CACHED_GRIDS)
def _build_grid(raster: Raster) -> _Grid:
    """Build the grid of a raster, in whose squares the density is a polynomial.

    For the interpolation "cells", the squares are the pixels, and the density is constant in each. For
    "bilinear", they lie between the centers of four pixels.
    """
    values = raster.values
    origin = np.array(raster.extent[:2])
    step = (np.array(raster.extent[2:]) - origin) / values.shape[::-1]
    if raster.interpolation == "bilinear":
        # Beyond the image, the pixels of its border are repeated.
        padded = np.pad(values, 1, mode="edge")
        lower_left = padded[:-1, :-1]
        lower_right = padded[:-1, 1:]
        upper_left = padded[1:, :-1]
        upper_right = padded[1:, 1:]
        constant = lower_left
        slope_x = lower_right - lower_left
        slope_y = upper_left - lower_left
        twist = upper_right - lower_right - upper_left + lower_left
        origin = origin - 0.5 * step
    else:
        constant = values
        slope_x = np.zeros_like(values)
        slope_y = np.zeros_like(values)
        twist = np.zeros_like(values)
    # φ = (constant + slope_x ξ) + η (slope_y + twist ξ): the first term is φ at η = 0, and the second one its
    # change to η = 1.
    return _Grid(
        origin=origin,
        step=step,
        coefficients=np.stack([constant, slope_x, slope_y, twist]),
        left=_integrate_rows(constant, slope_x),
        left_change=_integrate_rows(slope_y, twist),
    )


def _integrate_rows(start: Array, slope: Array) -> Array:
    """Integrate f, u f and u² f along rows, from the left side of the grid to each square.

    In the square of column i, f is start + slope ξ, with u = i + ξ. The result is (3, rows, columns).
    """
    i = np.arange(start.shape[1])
    # Integrals over ξ from 0 to 1 of f, ξ f and ξ² f.
    zeroth = start + slope / 2
    first = start / 2 + slope / 3
    second = start / 3 + slope / 4
    squares = np.stack([zeroth, i * zeroth + first, i * i * zeroth + 2 * i * first + second])
    left = np.zeros_like(squares)
    np.cumsum(squares[..., :-1], axis=-1, out=left[..., 1:])
    return left


@kernel
def _integrate_cells(grid: _Grid, start: Array, end: Array, cell: IntArray, cell_count: int) -> Array:
    """Return the integrals of φ times 1, u, v, u² and v² over cells, (n, 5), from their edges in grid steps.

    With P(u, v) the integral of φ at height v from the left side of the image to u, the integral of φ over a
    polygon is that of P dv along its edges. P is a prefix sum over squares and a polynomial within a square.
    Each edge is therefore split where it crosses into another square, and the Gauss rule is exact on each
    section.
    """
    _, rows, columns = grid.coefficients.shape
    sums = np.zeros((cell_count, _INTEGRAL_COLUMNS))
    for e in range(len(cell)):
        edge = _Edge(start[e, 0], start[e, 1], end[e, 0] - start[e, 0], end[e, 1] - start[e, 1])
        if edge.dv == 0.0:
            # Along a horizontal edge, P dv is zero.
            continue
        line_u = _find_first_line(edge.u, edge.du, columns)
        line_v = _find_first_line(edge.v, edge.dv, rows)
        t = 0.0
        while t < 1.0:
            next_u = _find_crossing(line_u, edge.u, edge.du, columns)
            next_v = _find_crossing(line_v, edge.v, edge.dv, rows)
            # The section ends where the edge crosses the next grid line, or at its end.
            section_end = max(min(next_u, next_v, 1.0), t)
            if next_u <= section_end:
                line_u += 1 if edge.du > 0.0 else -1
            if next_v <= section_end:
                line_v += 1 if edge.dv > 0.0 else -1
            _add_section(sums, cell[e], grid, edge, t, section_end)
            t = section_end
    return sums


@inlined_kernel
def _add_section(sums: Array, k: int, grid: _Grid, edge: _Edge, start: float, end: float) -> None:
    """Add the contribution of a section of an edge, within one square of the grid, to the sums of cell k.

    The section runs from t = start to t = end, where t goes from 0 to 1 along the edge. By Green's theorem,
    the integral of φ over a cell is that of P dv along its edges, with P the integral of φ along the row at
    height v, from the left side of the image to the edge. P is a sum over the squares to the left, in
    `grid.left`, plus an integral within the square. The same holds for φ times u and u²; v is constant along
    a row. The Gauss rule with three nodes is exact for these polynomials.
    """
    coefficients = grid.coefficients
    left = grid.left
    left_change = grid.left_change
    _, rows, columns = coefficients.shape
    # The square, in column i and row j, that contains the middle of the section.
    middle = 0.5 * (start + end)
    i = min(max(int(np.floor(edge.u + middle * edge.du)), 0), columns - 1)
    j = min(max(int(np.floor(edge.v + middle * edge.dv)), 0), rows - 1)
    constant = coefficients[_CONSTANT, j, i]
    slope_x = coefficients[_SLOPE_X, j, i]
    slope_y = coefficients[_SLOPE_Y, j, i]
    twist = coefficients[_TWIST, j, i]
    for node in range(3):
        t = start + (0.5 + _GAUSS_NODE * (node - _MIDDLE_NODE)) * (end - start)
        node_weight = _MIDDLE_WEIGHT if node == _MIDDLE_NODE else _OUTER_WEIGHT
        weight = node_weight * (end - start) * edge.dv
        v = edge.v + t * edge.dv
        xi = edge.u + t * edge.du - i
        eta = v - j
        # Along the row, at the given η, φ is row_start + row_slope ξ. The integrals of φ times 1, ξ and ξ²
        # start at the left side of the square.
        row_start = constant + slope_y * eta
        row_slope = slope_x + twist * eta
        zeroth = xi * (row_start + xi * row_slope / 2.0)
        first = xi * xi * (row_start / 2.0 + xi * row_slope / 3.0)
        second = xi * xi * xi * (row_start / 3.0 + xi * row_slope / 4.0)
        # The integrals of φ times 1, u and u² start at the left side of the image.
        left_one = left[_TIMES_ONE, j, i] + eta * left_change[_TIMES_ONE, j, i]
        left_u = left[_TIMES_U, j, i] + eta * left_change[_TIMES_U, j, i]
        left_uu = left[_TIMES_UU, j, i] + eta * left_change[_TIMES_UU, j, i]
        row_one = left_one + zeroth
        row_u = left_u + i * zeroth + first
        row_uu = left_uu + i * (i * zeroth + 2.0 * first) + second
        sums[k, _ONE] += weight * row_one
        sums[k, _U] += weight * row_u
        sums[k, _V] += weight * v * row_one
        sums[k, _UU] += weight * row_uu
        sums[k, _VV] += weight * v * v * row_one


@kernel
def _find_first_line(start: float, step: float, line_count: int) -> int:
    """Return the first inner grid line that is crossed from coordinate `start` in the direction of `step`."""
    if step > 0.0:
        return int(max(np.floor(start) + 1.0, 1.0))
    return int(min(np.ceil(start), float(line_count)) - 1.0)


@kernel
def _find_crossing(line: int, start: float, step: float, line_count: int) -> float:
    """Return the fraction of an edge at which it crosses a grid line; inf unless that is an inner line.

    `start` is the coordinate of the start of the edge across the lines, and `step` the change to its end. The
    outermost squares extend to infinity, so that the first and the last line are not crossed.
    """
    if 0 < line < line_count and step != 0.0:
        return (line - start) / step
    return np.inf
