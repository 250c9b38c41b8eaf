"""The shapes of a drawing in metres: closed outlines, lines, points; and the map that they stand for."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import CircleObstacle
from robocov.errors import MapError, ParameterError, describe_unknown_name, format_count
from robocov.mapfile.models import MAX_COORDINATE_M, MIN_SIZE_M
from robocov_app.formats import files
from robocov_app.formats.base import ForeignMap, Painted, ReadOptions
from robocov_app.formats.colours import UNPAINTED, ColourKey, Paint, count_colours, name_colour
from robocov_app.formats.geometry.figures import (
    BOUNDARY,
    ClosedOutline,
    SourceGeometry,
    WallLine,
    get_obstacle_name,
)
from robocov_app.formats.geometry.interpretation import Boundary, Drawing, find_surrounding, interpret
from robocov_app.formats.geometry.polygons import CrossingCounter, Rule, find_enclosed_area

__all__ = ["BOUNDARY", "ClosedOutline", "Shapes", "SourceGeometry", "WallLine"]
THICKNESS = 0.1  # width of walls that are drawn as lines without one, in metres
_EVEN = 1e-6  # relative width by which a shape may be thinner by rounding
_SHOWN = 20  # names that are listed where one is wrong
_DIGITS = 9


class Shapes:
    """Shapes that a reader has found in the file `where`: checked, counted, chosen by name.

    `pillars` are obstacles whatever outlines are. `left_out`, `mended`: counts of what is no part of the map
    or was put right, and why. `labels`: as compared and as written. `robots`, `notes`, `cell`: of a
    `ForeignMap`.
    """

    def __init__(self, where: str, options: ReadOptions) -> None:
        self.where, self.options = where, options
        self.outlines: list[ClosedOutline] = []
        self.lines: list[WallLine] = []
        self.pillars: list[CircleObstacle] = []
        self.vertices = 0
        self.left_out: Counter[tuple[str, str]] = Counter()
        self.mended: Counter[tuple[str, str]] = Counter()
        self.labels: dict[str, str] = {}
        self.only = None if options.only is None else set(map(str.casefold, options.only))
        self.skip = set(map(str.casefold, options.skip or ()))
        self.robots: list[tuple[float, float]] = []
        self.notes: list[str] = []
        self.cell: float | None = None
        self.page: Polygon | None = None
        self.thickness = THICKNESS if options.thickness is None else options.thickness
        self._heights: list[Array] = []
        self._met: list[str] = []
        self._crossings = CrossingCounter(where)

    def wants(self, labels: Iterable[str]) -> bool:
        """Return whether something with these labels is asked for; what is not is counted."""
        found = self.seen(labels)
        wanted = (self.only is None or bool(self.only & found)) and not self.skip & found
        if not wanted:
            self.leave_out("shape", "by the names that were asked for")
        return wanted

    def seen(self, labels: Iterable[str]) -> set[str]:
        """Return labels as they are compared, and keep what the file calls them."""
        found = {label.casefold(): label for label in labels}
        self.labels |= found
        return set(found)

    def add_all(self, figures: Iterable[SourceGeometry]) -> None:
        for figure in figures:
            self.add(figure)
        self.join_lines()

    def add(self, figure: SourceGeometry) -> None:
        """Add a geometry whose coordinates are metres; MapError where one is out of range."""
        if not self.wants(figure.labels):
            return
        if figure.kind == "point":
            self.add_point(figure.rings[0][0], figure.labels, at=figure.at)
        elif figure.kind == "line":
            width = figure.width if figure.width and self.options.thickness is None else self.thickness
            self.add_line(WallLine(figure.rings[0], width, figure.labels), at=figure.at)
        else:
            self.add_outline(figure.rings, figure.labels, rule=figure.rule, at=figure.at, whole=figure.whole)

    def add_outline(
        self, rings: Sequence[Array], labels: Sequence[str] = (), *,
        rule: Rule = "holes", at: str = "", thing: str = "outline", whole: str = "", paint: Paint = UNPAINTED,
    ) -> bool:  # fmt: skip
        """Add the area of rings, (k, 2) m; without one the `thing`, if it has a name, is counted."""
        rings = self._checked(rings, at)
        area, reason, lost = find_enclosed_area(rings, rule, self._crossings)
        for why, count in lost.items():
            self.leave_out("hole", why, count)
        if reason is not None:
            self._met.append(f"{at}: {reason}" if at else reason)
        if not area.is_empty:
            self._keep_outline(ClosedOutline(area, tuple(labels), whole=whole), paint)
        elif thing:
            self.leave_out(thing, "without an area")
        return not area.is_empty

    def _keep_outline(self, outline: ClosedOutline, paint: Paint) -> None:
        order = len(self.outlines) + len(self.lines)
        self.outlines.append(replace(outline, colour=paint.colour, role=paint.role, order=order))

    def add_edges(self, lines: Sequence[WallLine]) -> None:
        """Keep the stroke of the outline that was added last; it counts only if the outline is free."""
        last = self.outlines[-1]
        self.outlines[-1] = replace(last, edges=tuple(replace(line, order=last.order) for line in lines))

    def drop_thin_outlines(self, width: float) -> None:
        """Drop outlines that are nowhere as wide as a width in metres, and count them."""
        if not width > 0.0 or not self.outlines:
            return
        areas = [outline.area for outline in self.outlines]
        is_thin = shapely.is_empty(shapely.buffer(areas, -width / 2 * (1.0 - _EVEN), quad_segs=4))
        if is_thin.any():
            self.leave_out("shape", f"thinner than {width:.3g} m (--min-stroke)", int(is_thin.sum()))
            self.outlines = [each for each, goes in zip(self.outlines, is_thin, strict=True) if not goes]

    def note_colours(self, key: ColourKey) -> None:
        """Note how often colours with a declared role occur, and which ones there are where none does."""
        painted: list[ClosedOutline | WallLine] = [*self.outlines, *self.lines]
        painted += [edge for outline in self.outlines for edge in outline.edges]
        for role in ("free", "solid"):
            declared = [colour for colour, its in key.entries if its == role]
            found = [each for each in painted if each.role == role]
            if found:
                counts = count_colours(each.colour for each in found)
                self.notes.append(f"painted as {role}: {counts} (--{role}-colour)")
            elif declared:
                known = count_colours(each.colour for each in painted)
                there = f"; there are {known}" if known else ""
                names = ", ".join(map(name_colour, declared))
                self.notes.append(f"nothing is painted {names} (--{role}-colour){there}")

    def add_line(self, line: WallLine, *, at: str = "") -> None:
        (points,) = self._checked([line.points], at)
        width = max(line.width, 0.0)
        files.require_length(width, ": ".join(filter(None, (self.where, at, "width"))), 0.0)
        if width < MIN_SIZE_M:
            self.mended["line", f"thinner than {1000 * MIN_SIZE_M:g} mm, made as wide"] += 1
            width = MIN_SIZE_M
        if not (points[1:] != points[:-1]).any():
            self.leave_out("line", "without a length")
        else:
            order = len(self.outlines) + len(self.lines)
            self.lines.append(replace(line, points=points, width=width, order=order))

    def join_lines(self) -> None:
        """Join lines of the same width and labels whose ends meet, so that their corners are whole."""
        alike: dict[tuple[float, tuple[str, ...]], list[LineString]] = {}
        for line in self.lines:
            alike.setdefault((line.width, line.labels), []).append(LineString(line.points))
        self.lines = [
            WallLine(np.asarray(joined.coords), width, labels)
            for (width, labels), lines in alike.items()
            for joined in shapely.get_parts(shapely.line_merge(shapely.MultiLineString(lines)))
        ]

    def add_circle(
        self,
        centre: Array,
        radius: float,
        labels: Sequence[str] = (),
        *,
        at: str = "",
        paint: Paint = UNPAINTED,
    ) -> None:
        self._checked([centre + np.array([[-radius, -radius], [radius, radius]])], at)
        circle = CircleObstacle((float(centre[0]), float(centre[1])), radius, get_obstacle_name(labels))
        (ring,) = self._checked([np.asarray(circle.polygon.exterior.coords)[:-1]], at)
        self._keep_outline(ClosedOutline(MultiPolygon([Polygon(ring)]), tuple(labels), circle), paint)

    def add_point(self, point: Array, labels: Sequence[str] = (), *, at: str = "") -> None:
        ((x, y),) = self._checked([point[None]], at)[0].tolist()
        if self.options.pillar is None:
            self.leave_out("point", "(--pillar RADIUS makes pillars of them)")
        else:
            self.pillars.append(CircleObstacle((x, y), self.options.pillar, get_obstacle_name(labels)))

    def polygon(
        self, rings: Iterable[Array], labels: tuple[str, ...], at: str, whole: str = ""
    ) -> SourceGeometry:
        """Return a polygon of a format that closes rings; those that are not closed are counted."""
        rings = tuple(rings)
        if unclosed := sum(bool((ring[0] != ring[-1]).any()) for ring in rings):
            self.mended["ring", "closed: the last point was not the first"] += unclosed
        return SourceGeometry("polygon", rings, labels, at, whole=whole)

    def flat(self, points: Array) -> Array:
        """Return (k, 2) of points, whose third coordinates are counted."""
        self.leave_heights(points[:, 2:3])
        return points[:, :2]

    def leave_heights(self, heights: Array) -> None:
        """Count third coordinates, which no map has; nan is none."""
        self._heights.append(heights[~np.isnan(heights)])

    def leave_out(self, thing: str, why: str = "", count: int = 1) -> None:
        self.left_out[thing, why] += count

    @property
    def geometries(self) -> list[BaseGeometry]:
        """All outlines and lines, m."""
        return [
            *(outline.area for outline in self.outlines),
            *(LineString(line.points) for line in self.lines),
        ]

    @property
    def repaired(self) -> tuple[str, ...]:
        told = [
            f"{format_count(count, thing)} {what}" for (thing, what), count in sorted(self.mended.items())
        ]
        if len(self._met) == 1:
            told.append(f"the outline met itself: {self._met[0]}")
        elif self._met:
            told.append(f"{len(self._met)} outlines met themselves, the first: {self._met[0]}")
        return tuple(told)

    @property
    def dropped(self) -> tuple[str, ...]:
        left = sorted(self.left_out.items())
        told = [f"{_pluralize(count, thing)} {why}".strip() for (thing, why), count in left]
        heights = np.concatenate([*self._heights, np.empty(0)])
        if len(heights):
            span = f"z from {heights.min():.4g} to {heights.max():.4g}"
            told.append(f"{format_count(len(heights), 'third coordinate')}, {span}")
        return tuple(told)

    def require_known_names(self) -> None:
        """Raise ParameterError on a name of the options that the file has not; it names the nearest."""
        options = self.options
        boundary = () if options.boundary is None else (options.boundary,)
        for name, labels in (("boundary", boundary), ("only", options.only), ("skip", options.skip)):
            for label in labels or ():
                if label.casefold() not in self.labels:
                    known = list(self.labels.values())[:_SHOWN]
                    what = describe_unknown_name("name", label, known) if known else "no shape has a name"
                    raise ParameterError(f"{self.where}: {name}: {what}")

    def count(self, vertices: int) -> None:
        self.vertices += vertices
        files.require_vertices(self.vertices, self.where)

    def _checked(self, rings: Sequence[Array], at: str) -> list[Array]:
        """Count the points of rings, and return them to a nanometre: next to nothing is nothing."""
        self.count(sum(map(len, rings)))
        for ring in rings:
            good = np.abs(ring) <= MAX_COORDINATE_M  # nan is not good either
            if not good.all():
                x, y = ring[int(np.argmin(good.all(axis=1)))].tolist()
                place = f"{self.where}: {at}" if at else self.where
                wanted = f"expected coordinates from {-MAX_COORDINATE_M:.0f} to {MAX_COORDINATE_M:.0f} m"
                raise MapError(f"{place}: {wanted}, got a point at [{x:g}, {y:g}] m")
        return [np.round(ring, _DIGITS) + 0.0 for ring in rings]

    def foreign_map(
        self, name: str, text: str, *, solid: bool, overlap: bool = False, world: MultiPolygon | None = None
    ) -> ForeignMap:
        """Return the map that the shapes of a file stand for.

        The rules are those of `robocov_app.formats.geometry.interpretation`.

        Parameters
        ----------
        name, text : str
            Name and description of the map.
        solid : bool
            Whether closed outlines are solid unless the option ``outlines`` says it. Otherwise they are free
            space, except for those that lie in a larger one.
        overlap : bool
            Outlines may overlap and are all free, as JuPedSim's accessible areas.
        world : MultiPolygon or None, m
            What is free before the shapes stand in it, if the format says so.

        Raises
        ------
        MapError
            If there are no shapes, if the boundary has no area, or if they cross too often.
        ParameterError
            If a name in the options is none of the file's.
        """
        self.require_known_names()
        if world is None and not self.outlines and not self.lines:
            dropped = f" ({'; '.join(self.dropped)} left out)" if self.dropped else ""
            raise MapError(f"{self.where}: no closed outline and no line{dropped}, expected a drawing")
        found = interpret(self._to_drawing(world), solid=solid, overlap=overlap)
        if found.outside:
            self.leave_out("shape", "outside of the boundary", found.outside)
        return ForeignMap(
            name=name,
            description=text,
            free=found.free,
            boundary=found.boundary,
            has_named_boundary=found.has_named_boundary,
            boundary_source=found.boundary_source,
            vertices_read=self.vertices,
            cell=self.cell,
            primitives=found.primitives,
            robots=tuple(self.robots),
            repaired=(*self.repaired, *found.repaired),
            dropped=self.dropped,
            notes=(*self.notes, *found.notes),
            page=found.page,
            painted=self._list_painted(),
        )

    def _list_painted(self) -> tuple[Painted, ...]:
        """Return what has a colour, the lowest first."""
        coats = [outline.coat for outline in self.outlines if outline.colour is not None]
        lines = [*self.lines, *(edge for outline in self.outlines for edge in outline.edges)]
        coats += [line.coat for line in lines if line.colour is not None]
        # of one order are a fill and its own stroke, which is above
        coats.sort(key=lambda coat: coat.order)
        return tuple(Painted(coat.area, coat.colour) for coat in coats if coat.colour is not None)

    def find_surrounding(self) -> Boundary:
        """Return what the shapes enclose as walls, else a rectangle around them."""
        return find_surrounding(self._to_drawing(None))

    def _to_drawing(self, world: MultiPolygon | None) -> Drawing:
        return Drawing(
            where=self.where,
            outlines=self.outlines,
            lines=self.lines,
            pillars=self.pillars,
            options=self.options,
            world=world,
            page=self.page,
        )


def _pluralize(count: int, thing: str) -> str:
    """Return how many things there are, also of nouns in y and x."""
    if count != 1 and thing.endswith(("y", "x")):
        return f"{count} {thing[:-1]}ies" if thing[-1] == "y" else f"{count} {thing}es"
    return format_count(count, thing)
