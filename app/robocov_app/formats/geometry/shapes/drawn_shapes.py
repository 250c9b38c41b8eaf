"""Shapes of drawings: geometries as in a file, and the outlines and walls in meters built from them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import CircleObstacle, WallObstacle
from robocov.typing import FloatArray
from robocov_app.formats.colors import Color, Role
from robocov_app.formats.geometry.shapes.enclosed_area import Rule
from robocov_app.formats.geometry.shapes.obstacle_names import get_obstacle_name
from robocov_app.formats.geometry.shapes.painting import PaintLayer

Kind: TypeAlias = Literal["polygon", "line", "point"]
BOUNDARY = "boundary"
"""A shape with this name, id, class or layer is the boundary."""


@dataclass(frozen=True, eq=False)
class SourceGeometry:
    """A geometry in a file, before the unit of its coordinates is known.

    Attributes
    ----------
    kind : "polygon", "line" or "point"
    rings : tuple of (k, 2) arrays
        Rings of a polygon; a line or a point is a single array.
    labels : tuple of str
    location : str
        Location in the file, for messages.
    rule : str
        See `enclosed_area.find_enclosed_area`.
    width : float or None, m
        Width of a line, if the file gives it.
    parent_location : str
        If this is one of several parts of a geometry: the location of that geometry in the file.
    """

    kind: Kind
    rings: tuple[FloatArray, ...]
    labels: tuple[str, ...] = ()
    location: str = ""
    rule: Rule = "holes"
    width: float | None = None
    parent_location: str = ""


@dataclass(frozen=True, eq=False)
class ClosedOutline:
    """A closed outline.

    Attributes
    ----------
    area : MultiPolygon, m
        Valid.
    labels : tuple of str
        Names of the shape, the most specific one first.
    circle : CircleObstacle or None
        The disc, if the outline is a circle.
    parent_location : str
        See `SourceGeometry`.
    color : Color or None
        Color of the fill on a white page, if known.
    role : str or None
        Role that the user declared for this color.
    order : int
        Outlines and lines with a higher order are painted later.
    edges : tuple of WallLine
        The stroke of the outline, which is a wall only if the outline is free.
    """

    area: MultiPolygon
    labels: tuple[str, ...] = ()
    circle: CircleObstacle | None = None
    parent_location: str = ""
    color: Color | None = None
    role: Role | None = None
    order: int = 0
    edges: tuple["WallLine", ...] = ()

    @property
    def paint_layer(self) -> PaintLayer:
        """The fill as a layer of paint."""
        return PaintLayer(self.area, self.order, self.color)

    @property
    def filled_area(self) -> float:
        """Area of the outline including its holes, m²."""
        return float(sum(Polygon(part.exterior).area for part in self.area.geoms))


@dataclass(frozen=True, eq=False)
class PenStroke:
    """A line drawn with a pen that a transform has stretched, so that its width depends on the direction.

    Attributes
    ----------
    points : (k, 2) array
        Vertices, in the units of the pen.
    width : float
    matrix : (3, 3) array
        Transform from the pen's units to meters.
    """

    points: FloatArray
    width: float
    matrix: FloatArray


@dataclass(frozen=True, eq=False)
class WallLine:
    """A line, open or closed, that is a wall.

    Attributes
    ----------
    points : (k, 2) array, m
    width : float, m
    labels : tuple of str
    cap, join : str
        See `shapely.buffer`.
    mitre_limit : float
        See `robocov.environment.WallObstacle`.
    stretched : PenStroke or None
        The stroke, if its width depends on the direction.
    color, role, order
        See `ClosedOutline`.
    """

    points: FloatArray
    width: float
    labels: tuple[str, ...] = ()
    cap: Literal["flat", "square", "round"] = "flat"
    join: Literal["mitre", "bevel", "round"] = "mitre"
    mitre_limit: float = 4.0
    stretched: PenStroke | None = None
    color: Color | None = None
    role: Role | None = None
    order: int = 0

    @cached_property
    def solid(self) -> BaseGeometry:
        """Area that the line covers, m."""
        stroke = self.stretched
        if stroke is None:
            return self._buffer(self.points, self.width)
        linear = stroke.matrix[:2, :2].T
        offset = stroke.matrix[:2, 2]
        solid = self._buffer(stroke.points, stroke.width)
        return shapely.transform(solid, lambda points: points @ linear + offset)

    def _buffer(self, points: FloatArray, width: float) -> BaseGeometry:
        area: BaseGeometry = LineString(points).buffer(
            width / 2, cap_style=self.cap, join_style=self.join, mitre_limit=self.mitre_limit
        )
        return area

    @property
    def paint_layer(self) -> PaintLayer:
        """The stroke as a layer of paint."""
        return PaintLayer(self.solid, self.order, self.color)

    @property
    def wall(self) -> WallObstacle | None:
        """The line as an obstacle of a map, which may differ at its corners.

        None if an obstacle cannot represent it, because its ends are round or its width varies.
        """
        if self.stretched is not None or self.cap == "round":
            return None
        points = self.points.copy()
        if self.cap == "square":
            # A square cap extends each end by half the width.
            for end, inner in ((0, 1), (-1, -2)):
                vector = points[end] - self.points[inner]
                points[end] += vector / max(np.hypot(*vector), 1e-300) * self.width / 2
        vertices = tuple((x, y) for x, y in points.tolist())
        return WallObstacle(vertices, self.width, get_obstacle_name(self.labels))

    def measure_widths(self) -> tuple[float, float]:
        """Return the smallest and the largest width of the segments, m.

        They differ if the pen is stretched: a line along the stretch is as wide as the pen, and a line across
        it is wider.
        """
        stroke = self.stretched
        if stroke is None:
            return self.width, self.width
        segments = np.diff(stroke.points, axis=0)
        segments = segments[(segments != 0.0).any(axis=1)]
        if not len(segments):
            return self.width, self.width
        linear = stroke.matrix[:2, :2]
        # Width is area over length: the area of a strip grows by the determinant, its length by `stretch`.
        stretch = np.hypot(*(segments @ linear.T).T) / np.hypot(*segments.T)
        widths = stroke.width * abs(np.linalg.det(linear)) / np.maximum(stretch, 1e-300)
        return float(widths.min()), float(widths.max())
