"""Collection of the shapes in a file, and construction of the map that they describe."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import CircleObstacle
from robocov.errors import MapError
from robocov.mapfile.models import MAX_COORDINATE_M, MIN_SIZE_M
from robocov.typing import FloatArray
from robocov_app.formats import files
from robocov_app.formats.colors import UNPAINTED, ColorKey, Paint, describe_color_counts, name_color
from robocov_app.formats.foreign_map import ForeignMap, Painted
from robocov_app.formats.geometry.crossings import CrossingCounter
from robocov_app.formats.geometry.shapes.boundary_search import find_surrounding
from robocov_app.formats.geometry.shapes.drawings import Boundary, Drawing
from robocov_app.formats.geometry.shapes.drawn_shapes import (
    BOUNDARY,
    ClosedOutline,
    SourceGeometry,
    WallLine,
)
from robocov_app.formats.geometry.shapes.enclosed_area import Rule, find_enclosed_area
from robocov_app.formats.geometry.shapes.interpretation import interpret
from robocov_app.formats.geometry.shapes.label_filter import LabelFilter
from robocov_app.formats.geometry.shapes.obstacle_names import get_obstacle_name
from robocov_app.formats.omissions import Omissions
from robocov_app.formats.options import ReadOptions, get_or_default
from robocov_app.formats.repairs import Repairs

__all__ = ["BOUNDARY", "ClosedOutline", "Shapes", "SourceGeometry", "WallLine"]
DEFAULT_THICKNESS_M = 0.1
"""Width of walls that are drawn as lines without a width."""
_MAX_RELATIVE_THINNING = 1e-6
"""Fraction of its width by which rounding may make a shape thinner."""
_DIGITS = 9
"""Decimals of coordinates in meters: shapes smaller than a nanometer vanish."""


class Shapes:
    """The shapes of a file. They are checked, counted, and selected by name as they are added.

    Parameters
    ----------
    source_name : str
        The file, for messages.
    options : ReadOptions

    Attributes
    ----------
    outlines : list of ClosedOutline
    lines : list of WallLine
    pillars : list of CircleObstacle
        Round obstacles. They are solid even if outlines are free.
    labels : LabelFilter
    omissions : Omissions
    repairs : Repairs
    vertices : int
        Number of vertices read.
    thickness : float, m
        Width of lines without a width.
    robots, notes, cell, page
        See `ForeignMap`.
    """

    def __init__(self, source_name: str, options: ReadOptions) -> None:
        self.source_name = source_name
        self.options = options
        self.outlines: list[ClosedOutline] = []
        self.lines: list[WallLine] = []
        self.pillars: list[CircleObstacle] = []
        self.labels = LabelFilter(source_name, options)
        self.omissions = Omissions()
        self.repairs = Repairs()
        self.vertices = 0
        self.thickness = get_or_default(options.thickness, DEFAULT_THICKNESS_M)
        self.robots: list[tuple[float, float]] = []
        self.notes: list[str] = []
        self.cell: float | None = None
        self.page: Polygon | None = None
        self._crossings = CrossingCounter(source_name)

    def accept(self, labels: Iterable[str], count: int = 1) -> bool:
        """Return whether to read `count` shapes with these labels; if not, count them as left out."""
        is_accepted = self.labels.accepts(labels)
        if not is_accepted:
            self.count_omission("shape", "by their names (--only, --skip)", count)
        return is_accepted

    def add_all(self, geometries: Iterable[SourceGeometry]) -> None:
        """Add geometries with coordinates in meters, and join their lines."""
        for geometry in geometries:
            self.add(geometry)
        self.join_lines()

    def add(self, geometry: SourceGeometry) -> None:
        """Add a geometry with coordinates in meters; raise MapError if a coordinate is out of range."""
        if not self.accept(geometry.labels):
            return
        if geometry.kind == "point":
            self.add_point(geometry.rings[0][0], geometry.labels, location=geometry.location)
        elif geometry.kind == "line":
            width = self.thickness
            if geometry.width and self.options.thickness is None:
                width = geometry.width
            self.add_line(WallLine(geometry.rings[0], width, geometry.labels), location=geometry.location)
        else:
            self.add_outline(
                geometry.rings,
                geometry.labels,
                rule=geometry.rule,
                location=geometry.location,
                parent_location=geometry.parent_location,
            )

    def add_outline(
        self,
        rings: Sequence[FloatArray],
        labels: Sequence[str] = (),
        *,
        rule: Rule = "holes",
        location: str = "",
        kind: str = "outline",
        parent_location: str = "",
        paint: Paint = UNPAINTED,
    ) -> bool:
        """Add the area that rings enclose.

        Parameters
        ----------
        rings : sequence of (k, 2) arrays, m
        labels : sequence of str
        rule : str
            See `enclosed_area.find_enclosed_area`.
        location : str
            Location in the file, for messages.
        kind : str
            Kind of shape, for the report if it is left out because it encloses no area. If empty, such a
            shape is not reported.
        parent_location : str
            See `SourceGeometry`.
        paint : Paint

        Returns
        -------
        bool
            Whether the rings enclose an area.
        """
        enclosed = find_enclosed_area(self._check_rings(rings, location), rule, self._crossings)
        for reason, count in enclosed.lost_holes.items():
            self.count_omission("hole", reason, count)
        if enclosed.invalidity is not None:
            self.repairs.add_self_crossing(enclosed.invalidity, location)
        if enclosed.area.is_empty:
            if kind:
                self.count_omission(kind, "without an area")
            return False
        self._store_outline(
            ClosedOutline(enclosed.area, tuple(labels), parent_location=parent_location), paint
        )
        return True

    def add_circle(
        self,
        center: FloatArray,
        radius: float,
        labels: Sequence[str] = (),
        *,
        location: str = "",
        paint: Paint = UNPAINTED,
    ) -> None:
        """Add a disc with a center, (2,) m, and a radius, m."""
        self._check_rings([center + np.array([[-radius, -radius], [radius, radius]])], location)
        circle = CircleObstacle((float(center[0]), float(center[1])), radius, get_obstacle_name(labels))
        (ring,) = self._check_rings([np.asarray(circle.polygon.exterior.coords)[:-1]], location)
        self._store_outline(ClosedOutline(MultiPolygon([Polygon(ring)]), tuple(labels), circle), paint)

    def _store_outline(self, outline: ClosedOutline, paint: Paint) -> None:
        self.outlines.append(
            replace(outline, color=paint.color, role=paint.role, order=self._get_next_order())
        )

    def _get_next_order(self) -> int:
        return len(self.outlines) + len(self.lines)

    def add_edges(self, lines: Sequence[WallLine]) -> None:
        """Add the stroke of the outline that was added last; it is a wall only if the outline is free."""
        last = self.outlines[-1]
        edges = tuple(replace(line, order=last.order) for line in lines)
        self.outlines[-1] = replace(last, edges=edges)

    def add_line(self, line: WallLine, *, location: str = "") -> None:
        """Add a wall.

        A wall that is too thin is widened and counted as a repair, and one without a length is left out.

        Raises
        ------
        MapError
            If a coordinate or the width is out of range.
        """
        (points,) = self._check_rings([line.points], location)
        # A negative width is no reason to reject a file: the wall is only too thin.
        width = max(line.width, 0.0)
        source = self.source_name
        if location:
            source = f"{self.source_name}: {location}"
        files.require_length(width, f"{source}: width", 0.0)
        if (points[1:] == points[:-1]).all():
            self.count_omission("line", "without a length")
            return
        if width < MIN_SIZE_M:
            minimum = f"{1000 * MIN_SIZE_M:g} mm"
            self.repairs.counts["line", f"thinner than {minimum}, widened to {minimum}"] += 1
            width = MIN_SIZE_M
        self.lines.append(replace(line, points=points, width=width, order=self._get_next_order()))

    def add_point(self, point: FloatArray, labels: Sequence[str] = (), *, location: str = "") -> None:
        """Add a point, (2,) m; it becomes a pillar if the option ``pillar`` is given, else it is left out."""
        ((x, y),) = self._check_rings([point[None]], location)[0].tolist()
        if self.options.pillar is None:
            self.count_omission("point", "(--pillar RADIUS makes pillars of them)")
        else:
            self.pillars.append(CircleObstacle((x, y), self.options.pillar, get_obstacle_name(labels)))

    def join_lines(self) -> None:
        """Join lines of the same width and labels whose ends meet, so that their corners are filled."""
        groups: dict[tuple[float, tuple[str, ...]], list[LineString]] = {}
        for line in self.lines:
            groups.setdefault((line.width, line.labels), []).append(LineString(line.points))
        self.lines = []
        for (width, labels), paths in groups.items():
            merged = shapely.line_merge(shapely.MultiLineString(paths))
            for path in shapely.get_parts(merged):
                self.lines.append(WallLine(np.asarray(path.coords), width, labels))

    def drop_thin_outlines(self, width: float) -> None:
        """Drop outlines that are everywhere narrower than `width`, m, and count them as left out."""
        if not width > 0.0 or not self.outlines:
            return
        areas = [outline.area for outline in self.outlines]
        inset = width / 2 * (1.0 - _MAX_RELATIVE_THINNING)
        is_thin = shapely.is_empty(shapely.buffer(areas, -inset, quad_segs=4))
        if is_thin.any():
            self.count_omission("shape", f"thinner than {width:.3g} m (--min-stroke)", int(is_thin.sum()))
            self.outlines = [
                outline for outline, thin in zip(self.outlines, is_thin, strict=True) if not thin
            ]

    def build_polygon(
        self, rings: Iterable[FloatArray], labels: tuple[str, ...], location: str, parent_location: str = ""
    ) -> SourceGeometry:
        """Build a polygon of a format that requires closed rings; open rings are counted as repaired."""
        rings = tuple(rings)
        unclosed = sum(bool((ring[0] != ring[-1]).any()) for ring in rings)
        if unclosed:
            self.repairs.counts["ring", "closed: the last point was not the first"] += unclosed
        return SourceGeometry("polygon", rings, labels, location, parent_location=parent_location)

    def drop_heights(self, points: FloatArray) -> FloatArray:
        """Return points without their third coordinate, (k, 2); the report mentions dropped coordinates."""
        self.omissions.add_heights(points[:, 2:3])
        return points[:, :2]

    def count_omission(self, kind: str, reason: str = "", count: int = 1) -> None:
        """Count shapes that are left out of the map, for the report.

        The reason follows the noun, and must fit one shape as well as several: "without an area".
        """
        self.omissions.counts[kind, reason] += count

    @property
    def geometries(self) -> list[BaseGeometry]:
        """All outlines and lines, m."""
        areas = [outline.area for outline in self.outlines]
        return [*areas, *(LineString(line.points) for line in self.lines)]

    def count_vertices(self, number: int) -> None:
        """Count vertices; raise MapError if the file has too many."""
        self.vertices += number
        files.require_vertices(self.vertices, self.source_name)

    def _check_rings(self, rings: Sequence[FloatArray], location: str) -> list[FloatArray]:
        """Count and round the points of rings; raise MapError if a coordinate is out of range."""
        self.count_vertices(sum(map(len, rings)))
        for ring in rings:
            is_valid = np.abs(ring) <= MAX_COORDINATE_M  # False for nan, too
            if not is_valid.all():
                x, y = ring[int(np.argmin(is_valid.all(axis=1)))].tolist()
                source = self.source_name
                if location:
                    source = f"{self.source_name}: {location}"
                expected = f"expected coordinates from {-MAX_COORDINATE_M:.0f} to {MAX_COORDINATE_M:.0f} m"
                raise MapError(f"{source}: {expected}, got a point at [{x:g}, {y:g}] m")
        return [np.round(ring, _DIGITS) + 0.0 for ring in rings]

    def build_foreign_map(
        self,
        name: str,
        description: str,
        *,
        solid: bool,
        overlap: bool = False,
        world: MultiPolygon | None = None,
    ) -> ForeignMap:
        """Build the map that the shapes describe, by the rules of `geometry.shapes.interpretation`.

        Parameters
        ----------
        name, description : str
        solid : bool
            Whether closed outlines are solid if the option ``outlines`` is not given. If False, they are free
            space, except for those inside a larger one.
        overlap : bool
            Whether outlines may overlap and are all free, like JuPedSim's accessible areas.
        world : MultiPolygon or None, m
            The free space without the shapes, if the format defines it.

        Raises
        ------
        MapError
            If there are no shapes, if they cross too often, or if the boundary has no area.
        ParameterError
            If the options contain a name that the file does not have.
        """
        self.labels.require_known_names()
        if world is None and not self.outlines and not self.lines:
            message = "expected at least one closed outline or line, got none"
            omissions = "; ".join(self.omissions.describe())
            if omissions:
                message = f"{message} ({omissions} left out)"
            raise MapError(f"{self.source_name}: {message}")
        result = interpret(self._build_drawing(world), solid=solid, overlap=overlap)
        if result.outside:
            self.count_omission("shape", "outside of the boundary", result.outside)
        return ForeignMap(
            name=name,
            description=description,
            free=result.free,
            boundary=result.boundary,
            has_named_boundary=result.has_named_boundary,
            boundary_source=result.boundary_source,
            vertices_read=self.vertices,
            cell=self.cell,
            primitives=result.primitives,
            robots=tuple(self.robots),
            repaired=(*self.repairs.describe(), *result.repaired),
            dropped=self.omissions.describe(),
            notes=(*self.notes, *result.notes),
            page=result.page,
            painted=_list_paint(self),
        )

    def find_surrounding(self) -> Boundary:
        """Return the outer edge of the shapes, treated as walls, or a rectangle around them."""
        return find_surrounding(self._build_drawing(None))

    def _build_drawing(self, world: MultiPolygon | None) -> Drawing:
        """Collect the shapes as input of an interpretation; for `world`, see `build_foreign_map`."""
        return Drawing(
            source_name=self.source_name,
            outlines=self.outlines,
            lines=self.lines,
            pillars=self.pillars,
            options=self.options,
            world=world,
            page=self.page,
        )


def note_colors(shapes: Shapes, key: ColorKey) -> None:
    """Report how often declared colors occur; if none of a role does, list the colors in the file."""
    painted: list[ClosedOutline | WallLine] = [*shapes.outlines, *shapes.lines, *_list_edges(shapes)]
    for role in ("free", "solid"):
        declared = [color for color, its_role in key.entries if its_role == role]
        matches = [shape for shape in painted if shape.role == role]
        if matches:
            counts = describe_color_counts(shape.color for shape in matches)
            shapes.notes.append(f"painted as {role}: {counts} (--{role}-color)")
        elif declared:
            known = describe_color_counts(shape.color for shape in painted)
            others = f"; there are {known}" if known else ""
            names = ", ".join(map(name_color, declared))
            shapes.notes.append(f"nothing is painted {names} (--{role}-color){others}")


def _list_edges(shapes: Shapes) -> list[WallLine]:
    return [edge for outline in shapes.outlines for edge in outline.edges]


def _list_paint(shapes: Shapes) -> tuple[Painted, ...]:
    """Return all shapes that have a color, from bottom to top."""
    layers = [outline.paint_layer for outline in shapes.outlines if outline.color is not None]
    lines = [*shapes.lines, *_list_edges(shapes)]
    layers += [line.paint_layer for line in lines if line.color is not None]
    # A fill and its stroke have the same order. The sort is stable, so the stroke stays on top.
    layers.sort(key=lambda layer: layer.order)
    return tuple(Painted(layer.area, layer.color) for layer in layers if layer.color is not None)
