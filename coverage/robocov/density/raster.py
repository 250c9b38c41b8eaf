"""A picture of a density: constant in each of its cells, or linear between their middles."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import Array, IntArray, freeze
from robocov.compiled import kernel
from robocov.density.base import MAX_WEIGHT, CellEdges, Density
from robocov.errors import ParameterError, quote

if TYPE_CHECKING:
    from collections.abc import Iterable

_NODE = 0.5 * 0.6**0.5
"""Distance of the outer nodes of Gauss's rule with three points from the middle one."""

MAX_RASTER_SIZE = 1024
"""Most rows, and most columns, of a raster."""

Interpolation: TypeAlias = Literal["cells", "bilinear"]
"""Whether a raster is constant in each of its cells, or linear between the middles of these both ways."""


@dataclass(frozen=True, eq=False)
class Raster(Density):
    """A picture of the density. Its integrals are exact."""

    kind: ClassVar[str] = "raster"

    values: Array = field(repr=False)
    """(rows, columns) From 0, **the lowest row first**, read-only."""
    extent: tuple[float, float, float, float]
    """(x_min, y_min, x_max, y_max) m, what the picture covers. Beyond it, its nearest border counts."""
    interpolation: Interpolation = "bilinear"

    def __post_init__(self) -> None:
        values = freeze(self.values)
        shape = values.shape
        if values.ndim != 2 or not 1 <= min(shape) <= max(shape) <= MAX_RASTER_SIZE:
            wanted = f"rows and columns, from 1 to {MAX_RASTER_SIZE} each"
            raise ParameterError(f"values: an array of shape {shape}, but {wanted}, were wanted")
        if not (np.isfinite(values) & (values >= 0.0) & (values <= MAX_WEIGHT)).all():
            raise ParameterError(f"values: numbers from 0 to {MAX_WEIGHT:.0f} were wanted")
        if not values.max() > 0.0:
            raise ParameterError("values: all are 0, but some weight was wanted")
        x_min, y_min, x_max, y_max = self.extent
        if not (-math.inf < x_min < x_max < math.inf and -math.inf < y_min < y_max < math.inf):
            wanted = "[x_min, y_min, x_max, y_max] with a width and a height was wanted"
            raise ParameterError(f"extent: {quote(self.extent)}, but {wanted}")
        if self.interpolation not in ("bilinear", "cells"):
            wanted = "bilinear or cells was wanted"
            raise ParameterError(f"interpolation: {quote(self.interpolation)}, but {wanted}")
        object.__setattr__(self, "values", values)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Raster):
            return NotImplemented
        same = self.extent == other.extent and self.interpolation == other.interpolation
        return same and np.array_equal(self.values, other.values)

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((self.extent, self.interpolation, self.values.shape, self.values.tobytes()))

    @property
    def min_value(self) -> float:
        return float(self.values.min())

    @property
    def max_value(self) -> float:
        return float(self.values.max())

    def evaluate(self, points: Array) -> Array:
        grid = _grid(self)
        u, v = ((np.asarray(points, dtype=float) - grid.origin) / grid.step).T
        rows, columns = grid.coefficients.shape[1:]
        column = np.clip(np.floor(u), 0, columns - 1).astype(np.intp)
        row = np.clip(np.floor(v), 0, rows - 1).astype(np.intp)
        a, b, c, d = grid.coefficients[:, row, column]
        xi, eta = u - column, v - row
        return np.asarray(a + b * xi + (c + d * xi) * eta)

    def compute_moments(self, edges: CellEdges, origins: Array) -> Array:
        grid = _grid(self)
        at = (origins - grid.origin)[edges.cell]
        start, end = (edges.start + at) / grid.step, (edges.end + at) / grid.step
        sums = _integrals(grid.coefficients, grid.left, start, end, edges.cell, len(origins))
        # from grid steps to metres, about the origins
        (dx, dy), (px, py) = grid.step, (origins - grid.origin).T
        mass, x, y, xx, yy = (sums * (dx * dy)).T
        x, y = x * dx, y * dy
        polar = xx * (dx * dx) - px * (2.0 * x - px * mass) + yy * (dy * dy) - py * (2.0 * y - py * mass)
        return np.column_stack([mass, x - px * mass, y - py * mass, polar])


class _Grid(NamedTuple):
    """A density that is bilinear in each cell of a grid, and what its integrals need.

    Places are measured in steps of the grid, from its lower left corner. In the cell of column i and row j
    it is ``a + b ξ + c η + d ξ η``, with ξ and η from 0 to 1. The outermost cells reach to infinity; there
    b and c are such that nothing changes outwards.
    """

    origin: Array
    """(2,) m, as the `step`."""
    step: Array
    coefficients: Array
    """(4, rows, columns) a, b, c, d."""
    left: Array
    """(3, 2, rows, columns) Integrals of φ, u φ and u² φ over the part of a row to the left of each cell, at
    η = 0, and by how much they grow to η = 1."""


# ten times as large as the picture; while one is painted there are many, and all but the last few are past
@lru_cache(maxsize=4)
def _grid(raster: Raster) -> _Grid:
    values, low, high = raster.values, np.array(raster.extent[:2]), np.array(raster.extent[2:])
    step = (high - low) / values.shape[::-1]
    zero = np.zeros_like(values)
    coefficients = np.stack([values, zero, zero, zero])
    if raster.interpolation == "bilinear":
        # from middle to middle; what lies beyond the outermost is as they are
        padded = np.pad(values, 1, mode="edge")
        a, right, up = padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1]
        coefficients = np.stack([a, right - a, up - a, padded[1:, 1:] - right - up + a])
        low = low - 0.5 * step
    a, b, c, d = coefficients
    i = np.arange(a.shape[1])
    flat, slope = np.stack([a, c]), np.stack([b, d])
    # integrals over ξ from 0 to 1 of ξ^k (flat + ξ slope)
    whole = [flat / (k + 1) + slope / (k + 2) for k in range(3)]
    powers = np.stack([whole[0], i * whole[0] + whole[1], i * i * whole[0] + 2 * i * whole[1] + whole[2]])
    left = np.zeros_like(powers)
    np.cumsum(powers[..., :-1], axis=-1, out=left[..., 1:])
    return _Grid(low, step, coefficients, left)


@kernel
def _integrals(
    coefficients: Array, left: Array, start: Array, end: Array, cell: IntArray, count: int
) -> Array:
    """Return the integrals of φ times 1, u, v, u² and v² over cells, (n, 5), from their edges.

    With P(x, y) the integral of φ along the row from the picture's left side to x, the integral of φ over a
    polygon is that of P dy along its edges. P is a prefix sum over the pixels and a polynomial within one:
    cut where it passes from one pixel into the next, an edge is integrated by Gauss's rule without error.
    """
    rows, columns = coefficients.shape[1], coefficients.shape[2]
    sums = np.zeros((count, 5))
    for e in range(len(cell)):
        u0, v0, du, dv = start[e, 0], start[e, 1], end[e, 0] - start[e, 0], end[e, 1] - start[e, 1]
        # level edges enclose nothing with the side
        t, line_u, line_v = 0.0 if dv != 0.0 else 1.0, _first_line(u0, du, columns), _first_line(v0, dv, rows)
        while t < 1.0:
            next_u, next_v = _crossed(line_u, u0, du, columns), _crossed(line_v, v0, dv, rows)
            stop = max(min(next_u, next_v, 1.0), t)
            if next_u <= stop:
                line_u += 1 if du > 0.0 else -1
            if next_v <= stop:
                line_v += 1 if dv > 0.0 else -1
            middle = 0.5 * (t + stop)
            i = min(max(int(np.floor(u0 + middle * du)), 0), columns - 1)
            j = min(max(int(np.floor(v0 + middle * dv)), 0), rows - 1)
            for node in range(3):
                where = t + (0.5 + _NODE * (node - 1)) * (stop - t)
                weight = (8.0 if node == 1 else 5.0) / 18.0 * (stop - t) * dv
                v = v0 + where * dv
                xi, eta = u0 + where * du - i, v - j
                # along the row φ is p + q ξ
                p = coefficients[0, j, i] + coefficients[2, j, i] * eta
                q = coefficients[1, j, i] + coefficients[3, j, i] * eta
                zeroth, first = xi * (p + xi * q / 2.0), xi * xi * (p / 2.0 + xi * q / 3.0)
                second = xi * xi * xi * (p / 3.0 + xi * q / 4.0)
                one = left[0, 0, j, i] + eta * left[0, 1, j, i] + zeroth
                sums[cell[e], 0] += weight * one
                sums[cell[e], 1] += weight * (left[1, 0, j, i] + eta * left[1, 1, j, i] + i * zeroth + first)
                sums[cell[e], 2] += weight * v * one
                sums[cell[e], 3] += weight * (
                    left[2, 0, j, i] + eta * left[2, 1, j, i] + i * (i * zeroth + 2.0 * first) + second
                )
                sums[cell[e], 4] += weight * v * v * one
            t = stop
    return sums


@kernel
def _first_line(begin: float, along: float, lines: int) -> int:
    """Return the first inner line of a grid that is crossed on a way along an axis."""
    if along > 0.0:
        return int(max(np.floor(begin) + 1.0, 1.0))
    return int(min(np.ceil(begin), lines + 0.0) - 1.0)


@kernel
def _crossed(line: int, begin: float, along: float, lines: int) -> float:
    """Return at which part of the way a line is crossed, if it is an inner one."""
    return (line - begin) / along if 0 < line < lines and along != 0.0 else np.inf


def sample_density(density: Density | None, extent: Iterable[float], columns: int, rows: int) -> Raster:
    """Return a bilinear raster with the values of a density at the middles of its cells.

    No density counts as 1 everywhere. The extent is (x_min, y_min, x_max, y_max) in metres.
    """
    x_min, y_min, x_max, y_max = extent
    x = x_min + (np.arange(columns) + 0.5) * ((x_max - x_min) / columns)
    y = y_min + (np.arange(rows) + 0.5) * ((y_max - y_min) / rows)
    points = np.column_stack([np.tile(x, rows), np.repeat(y, columns)])
    values = np.ones(len(points)) if density is None else density.evaluate(points)
    return Raster(values.reshape(rows, columns), (x_min, y_min, x_max, y_max))
