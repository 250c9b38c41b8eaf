"""Outlines of obstacles for drawing, cached for each obstacle."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely

from robocov.typing import FloatArray
from robocov_app.editor.model.geometry import Box
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.render.surface_cache import LatestValue

MAX_OUTLINES_PER_OBSTACLE = 4  # cached outlines; more than one, because undo may restore earlier obstacles
SPARE_OUTLINES = 1000  # additional cached outlines, regardless of the number of obstacles
MIN_NAME_GAIN = 1.2  # a position for a name replaces an earlier one only if it is wider by this factor


class NameSpace(NamedTuple):
    """Space for the name of an obstacle: center, width and height, m."""

    x: float = 0.0
    y: float = 0.0
    width: float = 0.0
    height: float = 0.0


@dataclass(frozen=True, eq=False)
class Outline:
    """Outline of a geometry as rings and lines.

    Attributes
    ----------
    rings : list of (k, 2) array
        Outer ring and holes of each part, m, without the repeated last point.
    outer : list of bool
        Whether each ring is an outer ring.
    lines : list of (k, 2) array
        Lines and points, which have no area, m.
    bounds : (4,) array
        Minimum x and y, maximum x and y, m; nan for an empty geometry.
    geometry : shapely.Geometry
        The geometry.
    """

    rings: list[FloatArray]
    outer: list[bool]
    lines: list[FloatArray]
    bounds: FloatArray
    geometry: shapely.Geometry

    @property
    def has_holes(self) -> bool:
        """Whether any ring is a hole."""
        return not all(self.outer)

    @cached_property
    def name_space(self) -> NameSpace:
        """Space for the name of the obstacle; all 0 for an empty geometry.

        The candidates are at the middles of two horizontal cuts: through the centroid, and through a point
        inside. Each is then centered vertically in the obstacle. A later candidate replaces an earlier one
        only if it is wider by the factor `MIN_NAME_GAIN`.
        """
        best = NameSpace()
        if self.geometry.is_empty:
            return best
        for y in (self.geometry.centroid.y, self.geometry.representative_point().y):
            for row in _cut_horizontally(self.geometry, y):
                x = row.centroid.x
                columns = [
                    column
                    for column in _cut_vertically(self.geometry, x)
                    if column.bounds[1] <= y <= column.bounds[3]
                ]
                if not columns:
                    continue
                middle_y = columns[0].centroid.y
                width = min(row.length, _measure_row(self.geometry, x, middle_y))
                if width > best.width * MIN_NAME_GAIN:
                    best = NameSpace(x, middle_y, width, columns[0].length)
        return best


def _cut_horizontally(geometry: shapely.Geometry, y: float) -> list[shapely.Geometry]:
    """Return the parts of a geometry on the horizontal line at height y, m, as lines."""
    low_x, _, high_x, _ = geometry.bounds
    return _intersect_line(geometry, [(low_x - 1.0, y), (high_x + 1.0, y)])


def _measure_row(geometry: shapely.Geometry, x: float, y: float) -> float:
    """Return the width of a geometry, m, at a point: the length of its part on the horizontal line there."""
    for row in _cut_horizontally(geometry, y):
        if row.bounds[0] <= x <= row.bounds[2]:
            return float(row.length)
    return 0.0


def _cut_vertically(geometry: shapely.Geometry, x: float) -> list[shapely.Geometry]:
    """Return the parts of a geometry on the vertical line at x, m, as lines."""
    _, low_y, _, high_y = geometry.bounds
    return _intersect_line(geometry, [(x, low_y - 1.0), (x, high_y + 1.0)])


def _intersect_line(
    geometry: shapely.Geometry, ends: Iterable[tuple[float, float]]
) -> list[shapely.Geometry]:
    parts = shapely.get_parts(shapely.intersection(geometry, shapely.LineString(ends)))
    return [part for part in parts if part.length > 0.0]


def build_outline(geometry: shapely.Geometry) -> Outline:
    """Build the outline of a geometry: rings of its polygons, and coordinates of all other parts."""
    rings: list[FloatArray] = []
    outer: list[bool] = []
    lines: list[FloatArray] = []
    for part in shapely.get_parts(geometry):
        if isinstance(part, shapely.Polygon):
            rings += [np.asarray(ring.coords)[:-1] for ring in (part.exterior, *part.interiors)]
            outer += [True] + [False] * len(part.interiors)
        elif not part.is_empty:
            lines.append(shapely.get_coordinates(part))
    return Outline(rings, outer, lines, np.array(shapely.bounds(geometry)), geometry)


class Outlines:
    """Cache of the outlines of obstacles."""

    def __init__(self) -> None:
        # By the id of the item. The item is stored as well, because Python reuses ids.
        self._outlines: dict[int, tuple[Item, Outline]] = {}
        self._bounds: LatestValue[FloatArray] = LatestValue()

    def get(self, item: Item) -> Outline:
        """Return the outline of an obstacle, from the cache if possible."""
        entry = self._outlines.get(id(item))
        if entry is None or entry[0] is not item:
            entry = (item, build_outline(item.geometry))
            self._outlines[id(item)] = entry
        return entry[1]

    def find_items(self, sketch: Sketch, box: Box) -> list[Item]:
        """Return the obstacles that are not hidden and whose bounds meet a box, m, from bottom to top."""
        bounds = self._bounds.get_or_compute(sketch, None, lambda: self._list_bounds(sketch))
        low_x, low_y, high_x, high_y = bounds.T
        is_near = (low_x <= box[2]) & (high_x >= box[0]) & (low_y <= box[3]) & (high_y >= box[1])
        items = [sketch.obstacles[k] for k in np.flatnonzero(is_near)]
        return [item for item in items if not item.hidden]

    def _list_bounds(self, sketch: Sketch) -> FloatArray:
        """Return the (n, 4) bounds of all obstacles, m."""
        # Old outlines are dropped once there are far more of them than obstacles.
        if len(self._outlines) > MAX_OUTLINES_PER_OBSTACLE * len(sketch.obstacles) + SPARE_OUTLINES:
            self._outlines = {}
        return np.array([self.get(item).bounds for item in sketch.obstacles]).reshape(-1, 4)
