"""Smooth random fields on a mesh, and the polygons where they are below a level.

A field is a sum of waves of random direction, length and phase (M. Shinozuka and G. Deodatis, *Simulation
of stochastic processes by spectral representation*, Applied Mechanics Reviews 44, 1991). Its contours are
those of the linear interpolation on triangles ("marching triangles", two to each square of the mesh): there
are no cases in which it is left open what hangs together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from robocov.arrays import Array
    from robocov.generator.request import Request

_WAVES = 48
"""Waves that a field is the sum of."""

_LENGTHS = 0.7, 1.7
"""Their shortest and longest length, in sides of a usual obstacle."""

_FINENESS, _MOST = 12, 160
"""Points of the mesh in the side of a usual obstacle, and at most in the longer side of the map."""


@dataclass(frozen=True, eq=False)
class Field:
    """A field on the points of a mesh.

    Attributes
    ----------
    points : (rows, columns, 2) m
        Of a rectangle from [0, 0], to its edges.
    values : (rows, columns)
        With a mean of about 0 and a variance of about 1.
    """

    points: Array
    values: Array

    @classmethod
    def drawn(cls, request: Request, rng: np.random.Generator) -> Field:
        """Return a field that varies over the length of a usual obstacle."""
        sides = request.width, request.height
        step = max(request.unit / _FINENESS, max(sides) / _MOST)
        x, y = (np.linspace(0.0, side, math.ceil(side / step) + 1) for side in sides)
        points = np.stack(np.meshgrid(x, y), axis=-1)
        length = request.unit * rng.uniform(*_LENGTHS, _WAVES)
        angle, phase = rng.uniform(0.0, 2.0 * np.pi, (2, _WAVES))
        values = np.zeros(points.shape[:2])
        for k in range(_WAVES):
            along = points[..., 0] * math.cos(angle[k]) + points[..., 1] * math.sin(angle[k])
            values += np.cos(2.0 * np.pi / length[k] * along + phase[k])
        return cls(points, values * math.sqrt(2.0 / _WAVES))

    def raised(self, width: float, height: float) -> Field:
        """Return the field raised by a height on the edges, and less and less to a width from there, m."""
        low, high = self.points[0, 0], self.points[-1, -1]
        off = np.minimum(self.points - low, high - self.points).min(axis=-1)
        return replace(self, values=self.values + height * np.exp(-((off / width) ** 2)))

    def lowered(self, center: tuple[float, float], width: float, depth: float) -> Field:
        """Return the field lowered by a depth at a place, m, and less and less to a width from there, m."""
        off = np.hypot(*np.moveaxis(self.points - np.array(center), -1, 0))
        return replace(self, values=self.values - depth * np.exp(-((off / width) ** 2)))

    @property
    def range(self) -> tuple[float, float]:
        """The least and the largest value."""
        return float(self.values.min()), float(self.values.max())

    def below(self, level: float) -> BaseGeometry:
        """Return the polygons where the field is below a level; the edge of the mesh counts as above it."""
        values = self.values - level
        outside = np.ones(values.shape, dtype=bool)
        outside[1:-1, 1:-1] = False
        values = np.where(outside, np.maximum(values, 1.0), values)
        # the edges from each point to the right, upwards, and to the point above the right one
        right = _crossed(self.points[:, :-1], self.points[:, 1:], values[:, :-1], values[:, 1:])
        up = _crossed(self.points[:-1], self.points[1:], values[:-1], values[1:])
        aslant = _crossed(self.points[:-1, :-1], self.points[1:, 1:], values[:-1, :-1], values[1:, 1:])
        triangles = ((right[:-1], up[:, 1:], aslant), (aslant, right[1:], up[:, :-1]))
        edges = np.concatenate([np.stack(three, axis=2).reshape(-1, 3, 2) for three in triangles])
        crossed = ~np.isnan(edges[..., 0])
        # a contour that enters a triangle leaves it
        segments = edges[crossed].reshape(-1, 2, 2)
        return shapely.build_area(shapely.multilinestrings(shapely.linestrings(segments)))


def _crossed(start: Array, end: Array, here: Array, there: Array) -> Array:
    """Return where edges cross the level 0, (..., 2) m, nan where they do not."""
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.where((here < 0.0) != (there < 0.0), here / (here - there), np.nan)
    return np.asarray(start + (end - start) * part[..., None])
