"""Parts of a drawing: figures as a file has them, and the outlines and lines in metres made of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import CircleObstacle, WallObstacle
from robocov.errors import to_one_line
from robocov.mapfile.models import MAX_LABEL_CHARACTERS
from robocov_app.formats.colours import Colour, Role
from robocov_app.formats.geometry.painting import PaintLayer
from robocov_app.formats.geometry.polygons import Rule

Kind: TypeAlias = Literal["polygon", "line", "point"]
BOUNDARY = "boundary"  # a shape of this name, id, class or layer is the boundary


@dataclass(frozen=True, eq=False)
class SourceGeometry:
    """A geometry of a file, before it is known what its coordinates are.

    Attributes
    ----------
    kind : "polygon", "line" or "point"
    rings : tuple of (k, 2) arrays
    labels : tuple of str
    at : str
        Its place in the file, for messages.
    rule : str
        As of `polygons.enclosed`.
    width : float or None, m
        Of a line, if the file gives it.
    whole : str
        Place of the geometry of several parts that this is one of, if it is.
    """

    kind: Kind
    rings: tuple[Array, ...]
    labels: tuple[str, ...] = ()
    at: str = ""
    rule: Rule = "holes"
    width: float | None = None
    whole: str = ""


@dataclass(frozen=True, eq=False)
class ClosedOutline:
    """A closed outline.

    Attributes
    ----------
    area : MultiPolygon, m
        Valid.
    labels : tuple of str
        The most particular one first.
    circle : CircleObstacle or None
        The disc that it is, if any.
    whole : str
        As of `Figure`.
    colour : tuple of 3 int, or None
        Of its fill, as it is seen on white, if known.
    role : str or None
        Of that colour, if one was declared.
    order : int
        Outlines and lines of a higher one are painted later.
    edges : tuple of Line
        Its stroke, which is a wall only if the outline is free.
    """

    area: MultiPolygon
    labels: tuple[str, ...] = ()
    circle: CircleObstacle | None = None
    whole: str = ""
    colour: Colour | None = None
    role: Role | None = None
    order: int = 0
    edges: tuple["WallLine", ...] = ()

    @property
    def coat(self) -> PaintLayer:
        return PaintLayer(self.area, self.order, self.colour)

    @property
    def filled_area(self) -> float:
        """Area with its holes, m²."""
        return float(sum(Polygon(part.exterior).area for part in self.area.geoms))


@dataclass(frozen=True, eq=False)
class WallLine:
    """A line, open or closed, that is a wall.

    Attributes
    ----------
    points : (k, 2) array, m
    width : float, m
    labels : tuple of str
    cap, join : str
        As of `shapely.buffer`.
    mitre_limit : float
        As of walls in `robocov.environment`.
    stretched : tuple or None
        Of a pen that is no circle: (k, 2) points, a width, and the (3, 3) matrix that makes them metres.
    colour, role, order
        As of `Outline`.
    """

    points: Array
    width: float
    labels: tuple[str, ...] = ()
    cap: Literal["flat", "square", "round"] = "flat"
    join: Literal["mitre", "bevel", "round"] = "mitre"
    mitre_limit: float = 4.0
    stretched: tuple[Array, float, Array] | None = None
    colour: Colour | None = None
    role: Role | None = None
    order: int = 0

    @cached_property
    def solid(self) -> BaseGeometry:
        """The area that the wall covers, m."""
        points, width, matrix = self.stretched or (self.points, self.width, None)
        solid = LineString(points).buffer(
            width / 2, cap_style=self.cap, join_style=self.join, mitre_limit=self.mitre_limit
        )
        if matrix is None:
            return solid
        return shapely.transform(solid, lambda places: places @ matrix[:2, :2].T + matrix[:2, 2])

    @property
    def coat(self) -> PaintLayer:
        return PaintLayer(self.solid, self.order, self.colour)

    @property
    def wall(self) -> WallObstacle | None:
        """The same as an obstacle of a map, but for its corners; None where its ends are of another kind."""
        if self.stretched is not None or self.cap == "round":
            return None
        points = self.points.copy()
        for end, inner in ((0, 1), (-1, -2)) if self.cap == "square" else ():
            along = points[end] - self.points[inner]
            points[end] += along / max(np.hypot(*along), 1e-300) * self.width / 2
        return WallObstacle(
            tuple((x, y) for x, y in points.tolist()), self.width, get_obstacle_name(self.labels)
        )

    def measure_widths(self) -> tuple[float, float]:
        """Return the least and the greatest width across the segments of the line, m.

        They differ where the pen is stretched: a line along the stretch is as wide as the pen was, a line
        across it is wider.
        """
        if self.stretched is None:
            return self.width, self.width
        points, width, matrix = self.stretched
        along = np.diff(points, axis=0)
        along = along[(along != 0.0).any(axis=1)]
        if not len(along):
            return self.width, self.width
        linear = matrix[:2, :2]
        # a strip keeps its area in proportion to the determinant, and its length changes with its direction
        stretch = np.hypot(*(along @ linear.T).T) / np.hypot(*along.T)
        widths = width * abs(np.linalg.det(linear)) / np.maximum(stretch, 1e-300)
        return float(widths.min()), float(widths.max())


def get_obstacle_name(labels: Sequence[str]) -> str | None:
    """Return what an obstacle with these labels is called in a map; layer 0 of a drawing is no name."""
    names = (to_one_line(label)[:MAX_LABEL_CHARACTERS].strip() for label in labels[:1] if label != "0")
    return next(names, None) or None
