"""The path of an obstacle that moves: where it is at any time, where it comes by, and what stands there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal, TypeAlias, TypeVar, get_args

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array

Key = TypeVar("Key")

Repeat: TypeAlias = Literal["loop", "back-and-forth"]
"""What happens at the end of a path: straight to its beginning, or back the way it came."""

REPEATS: tuple[str, ...] = get_args(Repeat)

LEAST = 1e-6
"""Area in m² from which an obstacle is in the way: what is less is rounding, of obstacles that touch."""


@dataclass(frozen=True)
class ObstaclePath:
    """A poly-line along which an obstacle is shifted at a constant speed, without turning.

    The obstacle is where its map has it when the path's point is at the first of `points`, at time zero;
    at other times it is shifted by as much as the path's point has moved.

    Attributes
    ----------
    points : ring of [x, y], m
        At least two.
    speed : float, m/s
    repeat : "loop" or "back-and-forth"
    """

    points: tuple[tuple[float, float], ...]
    speed: float
    repeat: Repeat = "loop"

    @cached_property
    def _line(self) -> tuple[Array, Array]:
        """One turn, from the first point back to it, (k, 2) m, and how far each is along it, (k,) m."""
        points = np.array(self.points, dtype=float)
        back = points[:1] if self.repeat == "loop" else points[-2::-1]
        line = np.concatenate([points, back])
        length = np.hypot(*np.diff(line, axis=0).T)
        return line, np.concatenate([[0.0], np.cumsum(length)])

    @property
    def period(self) -> float:
        """Seconds until the obstacle is back, and about to go the same way again."""
        return float(self._line[1][-1]) / self.speed

    def shift(self, time: float) -> Array:
        """Return by how much the obstacle has moved at a time, s; (2,) m.

        >>> path = ObstaclePath(((1.0, 1.0), (3.0, 1.0)), 0.5, "back-and-forth")
        >>> path.shift(2.0).tolist(), path.shift(5.0).tolist(), path.period
        ([1.0, 0.0], [1.5, 0.0], 8.0)
        """
        line, along = self._line
        place = (time * self.speed) % along[-1]
        at = np.array([np.interp(place, along, line[:, k]) for k in (0, 1)])
        return np.asarray(at - line[0])


def swept_area(polygon: Polygon, path: ObstaclePath) -> BaseGeometry:
    """Return all places that an obstacle comes by on its path, given its polygon at time zero.

    >>> swept_area(shapely.box(0, 0, 1, 1), ObstaclePath(((0, 0), (2, 0)), 1.0)).area
    3.0
    """
    points = np.array([*path.points, *path.points[: path.repeat == "loop"]], dtype=float).reshape(-1, 2)
    shifts = points - points[:1]
    return shapely.union_all([polygon, *(_along(polygon, a, b) for a, b in pairwise(shifts))])


def in_the_way(
    area: BaseGeometry, others: Mapping[Key, BaseGeometry], inside: BaseGeometry | None = None
) -> tuple[dict[Key, BaseGeometry], BaseGeometry | None]:
    """Return what of an area the others take, by more than they touch it, and what of it is not inside.

    Without `inside`, the polygon of the boundary, all is inside.
    """
    shared = {name: area.intersection(shape) for name, shape in others.items()}
    beyond = None if inside is None else area.difference(inside)
    return (
        {name: part for name, part in shared.items() if part.area > LEAST},
        beyond if beyond is not None and beyond.area > LEAST else None,
    )


def _along(polygon: Polygon, begin: Array, end: Array) -> BaseGeometry:
    """Return the Minkowski sum of a polygon and a line: the polygon at both ends, and what each edge sweeps.

    Whoever gets outside of the polygon on the way does so through its rim.
    """
    parts: list[BaseGeometry] = []
    for ring in (polygon.exterior, *polygon.interiors):
        at = shapely.get_coordinates(ring)
        quads = np.stack([at[:-1] + begin, at[1:] + begin, at[1:] + end, at[:-1] + end], axis=1)
        one, other = at[1:] - at[:-1], end - begin
        flat = np.abs(one[:, 0] * other[1] - one[:, 1] * other[0]) < 1e-12
        parts += shapely.polygons(quads[~flat]).tolist()
    ends = [shapely.transform(polygon, lambda at, by=by: at + by) for by in (begin, end)]
    return shapely.union_all([*parts, *ends])
