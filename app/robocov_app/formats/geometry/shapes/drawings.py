"""Drawings and their meaning: the input and the result of an interpretation."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import CircleObstacle
from robocov_app.formats.foreign_map import Primitive
from robocov_app.formats.geometry.shapes.drawn_shapes import ClosedOutline, WallLine
from robocov_app.formats.geometry.shapes.snapping import close_gaps, compute_default_snap
from robocov_app.formats.options import ReadOptions


@dataclass(frozen=True, eq=False)
class Boundary:
    """The boundary of a drawing.

    Attributes
    ----------
    area : MultiPolygon, m
        Area of the boundary, which may have holes.
    source : str
        Description for the import report; empty if the format defines the boundary.
    outlines, lines : frozenset
        The shapes that it consists of.
    is_named : bool
        Whether the file or the user calls it the boundary.
    gaps : str
        Description of the gaps between its outlines that were closed, for the import report.
    is_guess : bool
        Whether nothing in the drawing marks it as the boundary.
    """

    area: MultiPolygon
    source: str = ""
    outlines: frozenset[ClosedOutline] = frozenset()
    lines: frozenset[WallLine] = frozenset()
    is_named: bool = False
    gaps: str = ""
    is_guess: bool = False


def get_outlines(boundary: Boundary | None) -> frozenset[ClosedOutline]:
    """Return the outlines that a boundary consists of; an empty set if there is no boundary."""
    return frozenset() if boundary is None else boundary.outlines


@dataclass(frozen=True, eq=False)
class Drawing:
    """The shapes of a file.

    Attributes
    ----------
    source_name : str
        The file, for messages.
    outlines : sequence of ClosedOutline
    lines : sequence of WallLine
    pillars : sequence of CircleObstacle
        Round obstacles. They are solid even if outlines are free.
    options : ReadOptions
    world : MultiPolygon or None, m
        The free space without the shapes, if the format defines it.
    page : Polygon or None, m
        The sheet of the drawing, a rectangle, if the format defines it.
    """

    source_name: str
    outlines: Sequence[ClosedOutline]
    lines: Sequence[WallLine]
    pillars: Sequence[CircleObstacle]
    options: ReadOptions
    world: MultiPolygon | None = None
    page: Polygon | None = None

    @property
    def areas(self) -> list[BaseGeometry]:
        """Areas of the outlines, m."""
        return [outline.area for outline in self.outlines]

    @property
    def paths(self) -> list[BaseGeometry]:
        """Center lines of the walls, m."""
        return [shapely.linestrings(line.points) for line in self.lines]

    @property
    def snap(self) -> float:
        """Snapping tolerance, m."""
        if self.options.snap is not None:
            return self.options.snap
        return compute_default_snap([*self.areas, *self.paths])


@dataclass(eq=False)
class InterpretationReport:
    """Lines for the import report.

    Attributes
    ----------
    repaired, notes : list of str
    """

    repaired: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def join_areas(self, areas: Sequence[BaseGeometry], snap: float) -> MultiPolygon:
        """Unite areas, close the hairline gaps between them, and report how many were closed."""
        joined = close_gaps(areas, snap)
        if joined.number:
            self.repaired.append(joined.describe())
        return joined.area


@dataclass(eq=False)
class Interpretation:
    """The map content recognized in a drawing.

    Attributes
    ----------
    free : MultiPolygon, m
    boundary : MultiPolygon or None, m
        See `ForeignMap`.
    has_named_boundary : bool
    boundary_source : str
        Description of the boundary for the import report.
    primitives : tuple of obstacles
    outside : int
        Number of shapes outside the boundary.
    page : Polygon or None, m
        See `ForeignMap`.
    repaired, notes : list of str
        Lines for the import report.
    """

    free: MultiPolygon
    boundary: MultiPolygon | None
    has_named_boundary: bool
    boundary_source: str
    primitives: tuple[Primitive, ...]
    outside: int
    page: Polygon | None = None
    repaired: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def fill_area_holes(area: MultiPolygon) -> MultiPolygon:
    """Return the parts of an area without holes, m."""
    return MultiPolygon([Polygon(part.exterior) for part in area.geoms])
