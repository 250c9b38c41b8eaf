"""The rings of a sketch's obstacles as arrays, to be drawn many at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely

if TYPE_CHECKING:
    from collections.abc import Iterable

    from shapely.geometry.base import BaseGeometry

    from robocov.arrays import Array
    from robocov_app.editor.model.sketch import Item, Sketch

_FORGOTTEN = 4
"""How many times more outlines than obstacles are kept, those of what was undone among them."""


@dataclass(frozen=True, eq=False)
class Outline:
    """What an obstacle looks like.

    `rings`, (k, 2) m: of each of its parts the outer ring, then its holes. `outer`: which of them are outer
    rings. `lines`, (k, 2) m: of what covers nothing. `bounds`: (4,) m.
    """

    rings: list[Array]
    outer: list[bool]
    lines: list[Array]
    bounds: Array
    geometry: BaseGeometry

    @property
    def has_holes(self) -> bool:
        """Whether something is cut out."""
        return not all(self.outer)

    @cached_property
    def name_place(self) -> tuple[float, float, float, float]:
        """Where a name has most room: x, y, width, height, m."""
        return name_place(self.geometry)


def name_place(geometry: BaseGeometry) -> tuple[float, float, float, float]:
    """Return where a name has most room in a geometry, and how much: x, y, width, height, m."""
    best = (0.0, 0.0, 0.0, 0.0)
    if geometry.is_empty:
        return best
    for y in (geometry.centroid.y, geometry.representative_point().y):
        for part in _cut(geometry, 0, y):
            x = part.centroid.x
            columns = [each for each in _cut(geometry, 1, x) if each.bounds[1] <= y <= each.bounds[3]]
            if columns and part.length > best[2] * 1.2:
                best = (x, columns[0].centroid.y, part.length, columns[0].length)
    return best


def _cut(geometry: BaseGeometry, axis: int, at: float) -> Iterable[BaseGeometry]:
    """Return the parts of a line through a geometry along an axis."""
    low_x, low_y, high_x, high_y = geometry.bounds
    ends = [(low_x - 1.0, at), (high_x + 1.0, at)] if axis == 0 else [(at, low_y - 1.0), (at, high_y + 1.0)]
    parts = shapely.get_parts(shapely.intersection(geometry, shapely.LineString(ends)))
    return [part for part in parts if part.length > 0.0]


def outline_of(geometry: BaseGeometry) -> Outline:
    """Return the outline of a geometry."""
    rings: list[Array] = []
    outer: list[bool] = []
    lines: list[Array] = []
    for part in shapely.get_parts(geometry):
        if isinstance(part, shapely.Polygon):
            rings.append(np.asarray(part.exterior.coords)[:-1])
            outer.append(True)
            for hole in part.interiors:
                rings.append(np.asarray(hole.coords)[:-1])
                outer.append(False)
        else:
            points = shapely.get_coordinates(part)
            if len(points):
                lines.append(points)
    return Outline(rings, outer, lines, np.array(shapely.bounds(geometry)), geometry)


class Outlines:
    """Outlines of obstacles, made once for each."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[Item, Outline]] = {}
        self._bounds: tuple[Sketch | None, Array] = (None, np.empty((0, 4)))

    def of(self, item: Item) -> Outline:
        """Return the outline of an obstacle."""
        known = self._known.get(id(item))
        if known is None or known[0] is not item:
            known = self._known[id(item)] = (item, outline_of(item.geometry))
        return known[1]

    def bounds(self, sketch: Sketch) -> Array:
        """Return the bounds of all obstacles of a sketch, (n, 4) m, in their order."""
        if self._bounds[0] is not sketch:
            if len(self._known) > _FORGOTTEN * len(sketch.obstacles) + 1000:
                self._known = {}
            rows = [self.of(item).bounds for item in sketch.obstacles]
            self._bounds = sketch, np.array(rows) if rows else np.empty((0, 4))
        return self._bounds[1]

    def touching(self, sketch: Sketch, box: tuple[float, float, float, float]) -> list[Item]:
        """Return the obstacles whose bounds touch a box, m, in their order, but for hidden ones."""
        low_x, low_y, high_x, high_y = self.bounds(sketch).T
        there = (low_x <= box[2]) & (high_x >= box[0]) & (low_y <= box[3]) & (high_y >= box[1])
        return [
            item
            for item, is_there in zip(sketch.obstacles, there.tolist(), strict=True)
            if is_there and not item.hidden
        ]
