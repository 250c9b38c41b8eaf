"""The rings of a sketch's obstacles as arrays, to be drawn many at once."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.toolkit.cache import Latest

_FORGOTTEN = 4  # how many times more outlines than obstacles are kept, those of what was undone among them


@dataclass(frozen=True, eq=False)
class Outline:
    """What an obstacle looks like."""

    rings: list[Array]  # (k, 2) m; of each of its parts the outer ring, then its holes
    outer: list[bool]  # which of them are outer rings
    lines: list[Array]  # (k, 2) m; of what covers nothing
    bounds: Array  # (4,) m
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
            rings += [np.asarray(ring.coords)[:-1] for ring in (part.exterior, *part.interiors)]
            outer += [True] + [False] * len(part.interiors)
        elif not part.is_empty:
            lines.append(shapely.get_coordinates(part))
    return Outline(rings, outer, lines, np.array(shapely.bounds(geometry)), geometry)


class Outlines:
    """Outlines of obstacles, made once for each."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[Item, Outline]] = {}
        self._bounds: Latest[Array] = Latest()

    def of(self, item: Item) -> Outline:
        """Return the outline of an obstacle."""
        known = self._known.get(id(item))
        if known is None or known[0] is not item:
            known = self._known[id(item)] = (item, outline_of(item.geometry))
        return known[1]

    def bounds(self, sketch: Sketch) -> Array:
        """Return the bounds of all obstacles of a sketch, (n, 4) m, in their order."""
        return self._bounds.of(sketch, None, lambda: self._all_bounds(sketch))

    def _all_bounds(self, sketch: Sketch) -> Array:
        if len(self._known) > _FORGOTTEN * len(sketch.obstacles) + 1000:
            self._known = {}
        return np.array([self.of(item).bounds for item in sketch.obstacles]).reshape(-1, 4)

    def touching(self, sketch: Sketch, box: tuple[float, float, float, float]) -> list[Item]:
        """Return the obstacles whose bounds touch a box, m, in their order, but for hidden ones."""
        low_x, low_y, high_x, high_y = self.bounds(sketch).T
        there = (low_x <= box[2]) & (high_x >= box[0]) & (low_y <= box[3]) & (high_y >= box[1])
        return [sketch.obstacles[k] for k in np.flatnonzero(there) if not sketch.obstacles[k].hidden]
