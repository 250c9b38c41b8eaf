"""A picture of a density: constant in each of its cells, or linear between their middles."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, ClassVar, Literal, TypeAlias

import numpy as np

from robocov.arrays import Array, frozen
from robocov.density.base import HEAVIEST, Density
from robocov.density.moments import Moments
from robocov.density.raster_moments import Patches, patch_moments
from robocov.errors import ParameterError, shown

if TYPE_CHECKING:
    from collections.abc import Iterable

    from robocov.voronoi.cell_edges import CellEdges

FINEST = 1024
"""Most rows, and most columns, of a raster."""

Interpolation: TypeAlias = Literal["cells", "bilinear"]
"""Whether a raster is constant in each of its cells, or linear between the middles of these both ways."""


@dataclass(frozen=True, eq=False)
class Raster(Density):
    """A picture of the density. Its integrals are exact.

    Attributes
    ----------
    values : (rows, columns)
        From 0, **the lowest row first**, read-only.
    extent : (x_min, y_min, x_max, y_max) m
        What the picture covers. Beyond it, its nearest border counts.
    interpolation : {"bilinear", "cells"}
    """

    kind: ClassVar[str] = "raster"

    values: Array = field(repr=False)
    extent: tuple[float, float, float, float]
    interpolation: Interpolation = "bilinear"

    def __post_init__(self) -> None:
        values = frozen(self.values)
        shape = values.shape
        if values.ndim != 2 or not 1 <= min(shape) <= max(shape) <= FINEST:
            wanted = f"rows and columns, from 1 to {FINEST} each"
            raise ParameterError(f"values: an array of shape {shape}, but {wanted}, were wanted")
        if not (np.isfinite(values) & (values >= 0.0) & (values <= HEAVIEST)).all():
            raise ParameterError(f"values: numbers from 0 to {HEAVIEST:.0f} were wanted")
        if not values.max() > 0.0:
            raise ParameterError("values: all are 0, but some weight was wanted")
        x_min, y_min, x_max, y_max = self.extent
        if not (-math.inf < x_min < x_max < math.inf and -math.inf < y_min < y_max < math.inf):
            wanted = "[x_min, y_min, x_max, y_max] with a width and a height was wanted"
            raise ParameterError(f"extent: {shown(self.extent)}, but {wanted}")
        if self.interpolation not in ("bilinear", "cells"):
            raise ParameterError(
                f"interpolation: {shown(self.interpolation)}, but bilinear or cells was wanted"
            )
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
    def lowest(self) -> float:
        """The smallest value."""
        return float(self.values.min())

    @property
    def highest(self) -> float:
        """The largest value."""
        return float(self.values.max())

    def value(self, points: Array) -> Array:
        """Return φ at (k, 2) points in metres, (k,)."""
        return _patches(self).value(np.asarray(points, dtype=float))

    def moments(self, edges: CellEdges, origins: Array) -> Moments:
        """Return mass, first and polar moments of cells about their origins."""
        return patch_moments(_patches(self), edges, origins)


# ten times as large as the picture; while one is painted there are many, and all but the last few are past
@lru_cache(maxsize=4)
def _patches(raster: Raster) -> Patches:
    return Patches.of(raster.values, raster.extent, raster.interpolation == "bilinear")


def sampled(density: Density | None, extent: Iterable[float], columns: int, rows: int) -> Raster:
    """Return a bilinear raster with the values of a density at the middles of its cells.

    Parameters
    ----------
    density : Density or None
        None counts as 1 everywhere.
    extent : (x_min, y_min, x_max, y_max) m
    columns, rows : int
    """
    x_min, y_min, x_max, y_max = extent
    x = x_min + (np.arange(columns) + 0.5) * ((x_max - x_min) / columns)
    y = y_min + (np.arange(rows) + 0.5) * ((y_max - y_min) / rows)
    points = np.column_stack([np.tile(x, rows), np.repeat(y, columns)])
    values = np.ones(len(points)) if density is None else density.value(points)
    return Raster(values.reshape(rows, columns), (x_min, y_min, x_max, y_max))
