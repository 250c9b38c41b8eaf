"""A density given by an image: constant in each pixel, or interpolated between the centers of pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import copy_read_only
from robocov.compiled import inlined_kernel, kernel
from robocov.density.base import MAX_WEIGHT, Density
from robocov.density.cell_edges import CellEdges
from robocov.errors import ParameterError, quote, to_floats
from robocov.typing import FloatArray, IntArray

if TYPE_CHECKING:
    from collections.abc import Iterable

MAX_RASTER_SIZE = 1024
"""Maximum number of rows, and of columns, of a raster."""

Interpolation: TypeAlias = Literal["cells", "bilinear"]
"""Whether a raster is constant in each pixel ("cells") or bilinear between the centers of four pixels."""

_MAX_CACHED_GRIDS = 4
"""Maximum number of grids that are cached. A grid takes ten times the memory of its image. While a user
paints a raster, a new grid is built for each change, but only the last few are still in use."""

_ONE = 0
"""Column of the integrals of a grid over cells: the integral of φ."""
_U = 1
"""Column of the same integrals: the integral of φ u."""
_V = 2
"""Column of the same integrals: the integral of φ v."""
_UU = 3
"""Column of the same integrals: the integral of φ u²."""
_VV = 4
"""Column of the same integrals: the integral of φ v²."""
_INTEGRAL_COLUMNS = 5
"""Number of columns of these integrals."""

_CONSTANT = 0
"""Row of the coefficients of a grid: the constants; see `_Grid`."""
_SLOPE_X = 1
"""Row of the same coefficients: the slopes in x."""
_SLOPE_Y = 2
"""Row of the same coefficients: the slopes in y."""
_TWIST = 3
"""Row of the same coefficients: the twists."""

_TIMES_ONE = 0
"""Row of the integrals along the rows of a grid: the integrals of φ; see `_Grid`."""
_TIMES_U = 1
"""Row of the same integrals: the integrals of φ u."""
_TIMES_UU = 2
"""Row of the same integrals: the integrals of φ u²."""

_GAUSS_NODE = 0.5 * 0.6**0.5
"""Distance of the outer nodes of the Gauss rule with three nodes on [0, 1] from the middle node."""
_MIDDLE_NODE = 1
"""Index of the middle node."""
_MIDDLE_WEIGHT = 8.0 / 18.0
"""Weight of the middle node."""
_OUTER_WEIGHT = 5.0 / 18.0
"""Weight of each outer node."""


@dataclass(frozen=True, eq=False)
class Raster(Density):
    """A density given by an image. Its integrals over cells are exact.

    Parameters
    ----------
    values : (rows, columns) array
        Values of the pixels, at least 0, **the lowest row first**. The attribute is read-only.
    extent : (x_min, y_min, x_max, y_max), m
        Extent of the image. Points outside have the value of the nearest border pixel.
    interpolation : {"bilinear", "cells"}
        "bilinear" interpolates between the centers of pixels; with "cells", each pixel is constant.

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

    values: FloatArray = field(repr=False)
    extent: tuple[float, float, float, float]
    interpolation: Interpolation = "bilinear"

    def __post_init__(self) -> None:
        values = copy_read_only(to_floats("values", self.values, "rows of numbers"))
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
        extent = to_floats("extent", self.extent, "[x_min, y_min, x_max, y_max]")
        if extent.shape != (4,):
            raise ParameterError(f"extent: expected [x_min, y_min, x_max, y_max], got {quote(self.extent)}")
        x_min, y_min, x_max, y_max = extent.tolist()
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
        object.__setattr__(self, "extent", (x_min, y_min, x_max, y_max))

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
    def lower_bound(self) -> float:
        """The minimum value of a pixel."""
        return float(self.values.min())

    @property
    def upper_bound(self) -> float:
        """The maximum value of a pixel."""
        return float(self.values.max())

    def evaluate(self, points: FloatArray) -> FloatArray:
        """Evaluate the density at points. A point outside has the value of the nearest point of the image.

        Parameters
        ----------
        points : (k, 2) array, m
            The points.

        Returns
        -------
        (k,) array
            Value of the image at each point.
        """
        grid = _build_grid(self)
        u, v = ((np.asarray(points, dtype=float) - grid.origin) / grid.step).T
        row_count, column_count = grid.coefficients.shape[1:]
        columns = np.clip(np.floor(u), 0, column_count - 1).astype(np.intp)
        rows = np.clip(np.floor(v), 0, row_count - 1).astype(np.intp)
        # In a square of the grid, the density is a polynomial in ξ and η, the offsets from the lower left
        # corner of the square; see `_Grid`. Beyond the grid, the polynomial of the nearest square is constant
        # in the outward direction, so that ξ and η need no limits.
        constants, slopes_x, slopes_y, twists = grid.coefficients[:, rows, columns]
        xi = u - columns
        eta = v - rows
        return np.asarray(constants + slopes_x * xi + (slopes_y + twists * xi) * eta)

    def compute_moments(self, edges: CellEdges, origins: FloatArray) -> FloatArray:
        """Compute the exact mass, first moments and polar moment of each cell.

        Parameters
        ----------
        edges, origins
            See `Density.compute_moments`.

        Returns
        -------
        (n, 4) array, m², m³, m³ and m⁴
            See `Density.compute_moments`.
        """
        grid = _build_grid(self)
        offsets = origins - grid.origin
        edge_offsets = offsets[edges.cells]
        integrals = _integrate_cells(
            grid,
            (edges.starts + edge_offsets) / grid.step,
            (edges.ends + edge_offsets) / grid.step,
            edges.cells,
            len(origins),
        )
        # Convert the integrals of φ times 1, u, v, u² and v² from grid steps to meters.
        step_x, step_y = grid.step
        integrals = integrals * (step_x * step_y)
        mass = integrals[:, _ONE]
        first_x = integrals[:, _U] * step_x
        first_y = integrals[:, _V] * step_y
        second_x = integrals[:, _UU] * (step_x * step_x)
        second_y = integrals[:, _VV] * (step_y * step_y)
        # Convert moments about the origin of the grid to moments about the origins of the cells. If the
        # origin of a cell is at the offset a, ∫ φ (x - a)² = ∫ φ x² - a (2 ∫ φ x - a ∫ φ).
        offset_x, offset_y = offsets.T
        polar = (
            second_x
            - offset_x * (2.0 * first_x - offset_x * mass)
            + second_y
            - offset_y * (2.0 * first_y - offset_y * mass)
        )
        return np.column_stack([mass, first_x - offset_x * mass, first_y - offset_y * mass, polar])


def sample_density(density: Density | None, extent: Iterable[float], columns: int, rows: int) -> Raster:
    """Sample a density at the centers of pixels.

    Parameters
    ----------
    density : Density or None
        The density; None means 1 everywhere.
    extent : (x_min, y_min, x_max, y_max), m
        Extent of the image.
    columns, rows : int
        Number of columns and rows of the image.

    Returns
    -------
    Raster
        A bilinear raster with these values.
    """
    x_min, y_min, x_max, y_max = extent
    x = x_min + (np.arange(columns) + 0.5) * ((x_max - x_min) / columns)
    y = y_min + (np.arange(rows) + 0.5) * ((y_max - y_min) / rows)
    points = np.column_stack([np.tile(x, rows), np.repeat(y, columns)])
    values = np.ones(len(points)) if density is None else density.evaluate(points)
    return Raster(values.reshape(rows, columns), (x_min, y_min, x_max, y_max))


class _Grid(NamedTuple):
    """A density φ that is bilinear in each square of a grid, and its integrals along rows.

    The coordinates u and v are in steps of the grid, from its lower left corner. In the square of column i
    and row j, the density is ``constant + slope_x ξ + slope_y η + twist ξ η``, with ξ = u - i and η = v - j
    from 0 to 1. The outermost squares extend to infinity. Their slopes and twists are such that the density
    is constant in the outward direction.

    Attributes
    ----------
    origin : (2,) array, m
        Lower left corner of the grid.
    step : (2,) array, m
        Width and height of a square.
    coefficients : (4, rows, columns) array
        Coefficients of each square; for the rows, see `_CONSTANT` and the following constants.
    left : (3, rows, columns) array
        Integrals along a row, at η = 0, from the left side of the grid to each square. For the rows of this
        array, see `_TIMES_ONE` and the following constants.
    left_change : (3, rows, columns) array
        Change of these integrals from η = 0 to η = 1. In between, they are linear in η.
    """

    origin: FloatArray
    step: FloatArray
    coefficients: FloatArray
    left: FloatArray
    left_change: FloatArray


class _Edge(NamedTuple):
    """An edge of a cell, from (u, v) to (u + du, v + dv) in grid steps."""

    u: float
    v: float
    du: float
    dv: float


@lru_cache(maxsize=_MAX_CACHED_GRIDS)
def _build_grid(raster: Raster) -> _Grid:
    """Build the grid of a raster.

    With "cells" interpolation, the squares of the grid are the pixels, and the density is constant in
    each. With "bilinear", the corners of each square are the centers of four pixels.
    """
    values = raster.values
    origin = np.array(raster.extent[:2])
    step = (np.array(raster.extent[2:]) - origin) / values.shape[::-1]
    if raster.interpolation == "bilinear":
        # The border pixels are repeated around the image.
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
    # φ = (constant + slope_x ξ) + η (slope_y + twist ξ). The first term is φ at η = 0, and the factor of η is
    # the change of φ from η = 0 to η = 1.
    return _Grid(
        origin=origin,
        step=step,
        coefficients=np.stack([constant, slope_x, slope_y, twist]),
        left=_integrate_rows(constant, slope_x),
        left_change=_integrate_rows(slope_y, twist),
    )


def _integrate_rows(start: FloatArray, slope: FloatArray) -> FloatArray:
    """Return the integrals of f, u f and u² f along rows, from the left side of the grid to each square.

    In the square of column i, f is start + slope ξ, with u = i + ξ. The result has the shape (3, rows,
    columns).
    """
    i = np.arange(start.shape[1])
    # Integrals over ξ from 0 to 1 of f, ξ f and ξ² f.
    zeroth = start + slope / 2
    first = start / 2 + slope / 3
    second = start / 3 + slope / 4
    square_integrals = np.stack([zeroth, i * zeroth + first, i * i * zeroth + 2 * i * first + second])
    left = np.zeros_like(square_integrals)
    np.cumsum(square_integrals[..., :-1], axis=-1, out=left[..., 1:])
    return left


@kernel
def _integrate_cells(
    grid: _Grid, starts: FloatArray, ends: FloatArray, cells: IntArray, cell_count: int
) -> FloatArray:
    """Return the integrals of φ times 1, u, v, u² and v² over cells, (n, 5), from their edges in grid steps.

    Let P(u, v) be the integral of φ along the row at height v, from the left side of the image to u. By
    Green's theorem, the integral of φ over a cell is the integral of P dv along its edges. In a square of the
    grid, P is the sum of the integrals over the squares to the left and of a polynomial. Each edge is
    therefore divided into sections that lie in one square each. The Gauss rule is exact on each section.
    """
    _, row_count, column_count = grid.coefficients.shape
    sums = np.zeros((cell_count, _INTEGRAL_COLUMNS))
    for e in range(len(cells)):
        edge = _Edge(starts[e, 0], starts[e, 1], ends[e, 0] - starts[e, 0], ends[e, 1] - starts[e, 1])
        if edge.dv == 0.0:
            # Along a horizontal edge, P dv is zero.
            continue
        # The next vertical and horizontal grid lines that the edge crosses, and t, the fraction of the edge
        # that has been integrated.
        line_u = _find_first_line(edge.u, edge.du, column_count)
        line_v = _find_first_line(edge.v, edge.dv, row_count)
        t = 0.0
        while t < 1.0:
            next_u = _find_crossing(line_u, edge.u, edge.du, column_count)
            next_v = _find_crossing(line_v, edge.v, edge.dv, row_count)
            # The section ends where the edge crosses the next grid line, or where the edge ends.
            section_end = max(min(next_u, next_v, 1.0), t)
            if next_u <= section_end:
                line_u += 1 if edge.du > 0.0 else -1
            if next_v <= section_end:
                line_v += 1 if edge.dv > 0.0 else -1
            _add_section(sums, cells[e], grid, edge, t, section_end)
            t = section_end
    return sums


@inlined_kernel
def _add_section(sums: FloatArray, cell: int, grid: _Grid, edge: _Edge, start: float, end: float) -> None:
    """Add the contribution of a section of an edge, within one square of the grid, to the sums of a cell.

    The section runs from t = start to t = end, where t goes from 0 to 1 along the edge. By Green's theorem,
    the integral of φ over a cell is the integral of P dv along its edges, where P is the integral of φ along
    the row at height v, from the left side of the image to the edge. P is the sum of the integrals over the
    squares to the left, in `grid.left`, and of an integral within the square. The same holds for φ u and φ
    u². For φ v and φ v², P is multiplied by v or v², which are constant along a row. The Gauss rule with
    three nodes is exact for these polynomials.
    """
    coefficients = grid.coefficients
    left = grid.left
    left_change = grid.left_change
    _, row_count, column_count = coefficients.shape
    # The square, in column i and row j, that contains the middle of the section.
    middle = 0.5 * (start + end)
    i = min(max(int(np.floor(edge.u + middle * edge.du)), 0), column_count - 1)
    j = min(max(int(np.floor(edge.v + middle * edge.dv)), 0), row_count - 1)
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
        # Along the row at this η, φ is row_start + row_slope ξ. These are the integrals of φ, φ ξ and φ ξ²
        # from the left side of the square.
        row_start = constant + slope_y * eta
        row_slope = slope_x + twist * eta
        zeroth = xi * (row_start + xi * row_slope / 2.0)
        first = xi * xi * (row_start / 2.0 + xi * row_slope / 3.0)
        second = xi * xi * xi * (row_start / 3.0 + xi * row_slope / 4.0)
        # The integrals of φ, φ u and φ u² from the left side of the image to the square, and to the edge.
        left_one = left[_TIMES_ONE, j, i] + eta * left_change[_TIMES_ONE, j, i]
        left_u = left[_TIMES_U, j, i] + eta * left_change[_TIMES_U, j, i]
        left_uu = left[_TIMES_UU, j, i] + eta * left_change[_TIMES_UU, j, i]
        row_one = left_one + zeroth
        row_u = left_u + i * zeroth + first
        row_uu = left_uu + i * (i * zeroth + 2.0 * first) + second
        sums[cell, _ONE] += weight * row_one
        sums[cell, _U] += weight * row_u
        sums[cell, _V] += weight * v * row_one
        sums[cell, _UU] += weight * row_uu
        sums[cell, _VV] += weight * v * v * row_one


@kernel
def _find_first_line(start: float, change: float, square_count: int) -> int:
    """Return the first inner grid line that an edge crosses, for vertical or for horizontal lines.

    `start` is the coordinate at which the edge starts, and `change` the change of this coordinate to its end.
    There are `square_count` squares side by side. The inner lines are between them, and are numbered from 1
    to ``square_count - 1``. If the edge crosses no inner line, the result may be outside this range.
    """
    if change > 0.0:
        return int(max(np.floor(start) + 1.0, 1.0))
    return int(min(np.ceil(start), float(square_count)) - 1.0)


@kernel
def _find_crossing(line: int, start: float, change: float, square_count: int) -> float:
    """Return the fraction of an edge at which it crosses a grid line; inf if that is not an inner line.

    The parameters are those of `_find_first_line`. The outermost squares extend to infinity, so that only the
    lines between squares count.
    """
    if 0 < line < square_count and change != 0.0:
        return (line - start) / change
    return np.inf
