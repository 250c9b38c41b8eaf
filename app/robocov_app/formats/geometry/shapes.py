"""The shapes of a drawing in metres: closed outlines, lines, points; and what was left out of it."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import CircleObstacle, WallObstacle
from robocov.errors import MapError, ParameterError, counted, one_line, unknown_name
from robocov.mapfile.models import FARTHEST, LONGEST_LABEL, SMALLEST
from robocov_app.formats import files
from robocov_app.formats.geometry.polygons import Crossings, Rule, enclosed
from robocov_app.formats.options import ReadOptions

Kind: TypeAlias = Literal["polygon", "line", "point"]

THICKNESS = 0.1
"""Width of walls that are drawn as lines without one, in metres."""

_SHOWN = 20  # names that are listed where one is wrong
_DIGITS = 9


@dataclass(frozen=True, eq=False)
class Figure:
    """A geometry of a file, before it is known what its coordinates are; `at` is its place, for messages.

    `rule`: what the rings of a polygon enclose; see `polygons.enclosed`. `width`, m: of a line, where the
    file says it.
    """

    kind: Kind
    rings: tuple[Array, ...]
    labels: tuple[str, ...] = ()
    at: str = ""
    rule: Rule = "holes"
    width: float | None = None


@dataclass(frozen=True, eq=False)
class Outline:
    """What a closed outline encloses, m, valid; its names, ids, classes, layers, the most particular first.

    `circle`: the same as an obstacle of a map, where it is a disc.
    """

    area: MultiPolygon
    labels: tuple[str, ...] = ()
    circle: CircleObstacle | None = None


@dataclass(frozen=True, eq=False)
class Line:
    """An open or closed line, (k, 2) m, that is a wall; `cap` and `join` are shapely's words.

    `stretched`, (points, width, matrix) or None: a pen that is no circle: (k, 2) points and a width in other
    units, and the (3, 3) matrix that makes them metres.
    """

    points: Array
    width: float
    labels: tuple[str, ...] = ()
    cap: Literal["flat", "square", "round"] = "flat"
    join: Literal["mitre", "bevel", "round"] = "mitre"
    mitre_limit: float = 4.0  # as of walls in `robocov.environment`
    stretched: tuple[Array, float, Array] | None = None

    @cached_property
    def solid(self) -> BaseGeometry:
        """What the wall covers."""
        points, width, matrix = self.stretched or (self.points, self.width, None)
        solid = LineString(points).buffer(
            width / 2, cap_style=self.cap, join_style=self.join, mitre_limit=self.mitre_limit
        )
        if matrix is None:
            return solid
        return shapely.transform(solid, lambda places: places @ matrix[:2, :2].T + matrix[:2, 2])

    @property
    def wall(self) -> WallObstacle | None:
        """The same as an obstacle of a map, but for its corners; None where its ends are of another kind."""
        if self.stretched is not None or self.cap == "round":
            return None
        points = self.points.copy()
        for end, inner in ((0, 1), (-1, -2)) if self.cap == "square" else ():
            along = points[end] - self.points[inner]
            points[end] += along / max(np.hypot(*along), 1e-300) * self.width / 2
        return WallObstacle(tuple((x, y) for x, y in points.tolist()), self.width, name_of(self.labels))


@dataclass(eq=False)
class Shapes:
    """What a reader has found in the file `where`, as it finds it: checked, counted, chosen by name.

    `pillars` are obstacles whatever outlines are. `left_out`, `mended`: how many of which things are no part
    of the map, and why, or had to be put right, and how. `labels`: as they are compared and as they are
    written. `robots`, `notes`, `cell`: as of a `ForeignMap`.
    """

    where: str
    options: ReadOptions
    outlines: list[Outline] = field(default_factory=list)
    lines: list[Line] = field(default_factory=list)
    pillars: list[CircleObstacle] = field(default_factory=list)
    vertices: int = 0
    left_out: Counter[tuple[str, str]] = field(default_factory=Counter)
    mended: Counter[tuple[str, str]] = field(default_factory=Counter)
    labels: dict[str, str] = field(default_factory=dict)
    robots: list[tuple[float, float]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    cell: float | None = None
    _heights: list[Array] = field(default_factory=list)
    _met: list[str] = field(default_factory=list)

    @cached_property
    def _crossings(self) -> Crossings:
        return Crossings(self.where)

    def wants(self, labels: Iterable[str]) -> bool:
        """Return whether something with these labels is asked for; what is not is counted."""
        found = {label.casefold(): label for label in labels}
        self.labels |= found
        only, skip = self.options.only, self.options.skip
        if (only is None or folded(only) & found.keys()) and not folded(skip or ()) & found.keys():
            return True
        self.leave_out("shape", "by the names that were asked for")
        return False

    def add_all(self, figures: Iterable[Figure]) -> None:
        """Add geometries as `add`, and join the lines that meet."""
        for figure in figures:
            self.add(figure)
        self.join_lines()

    def add(self, figure: Figure) -> None:
        """Add a geometry whose coordinates are metres. Raises MapError as `add_outline`."""
        if not self.wants(figure.labels):
            return
        if figure.kind == "point":
            self.add_point(figure.rings[0][0], figure.labels, at=figure.at)
        elif figure.kind == "line":
            width = figure.width if figure.width and self.options.thickness is None else self.thickness
            self.add_line(Line(figure.rings[0], width, figure.labels), at=figure.at)
        elif not self.add_outline(figure.rings, figure.labels, rule=figure.rule, at=figure.at):
            self.leave_out("outline", "without an area")

    def add_outline(
        self, rings: Sequence[Array], labels: Sequence[str] = (), *, rule: Rule = "holes", at: str = ""
    ) -> bool:
        """Add the area that rings, (k, 2) m, enclose, if any; MapError where one is out of range."""
        rings = self._checked(rings, at)
        area, reason, lost = enclosed(rings, rule, self._crossings)
        for why, count in lost.items():
            self.leave_out("hole", why, count)
        if reason is not None:
            self._met.append(f"{at}: {reason}" if at else reason)
        if not area.is_empty:
            self.outlines.append(Outline(area, tuple(labels)))
        return not area.is_empty

    def add_line(self, line: Line, *, at: str = "") -> None:
        """Add a wall. Raises MapError as `add_outline`."""
        (points,) = self._checked([line.points], at)
        width = max(line.width, 0.0)
        files.require_length(width, ": ".join(filter(None, (self.where, at, "width"))), 0.0)
        if width < SMALLEST:
            self.mended["line", f"thinner than {1000 * SMALLEST:g} mm, made as wide"] += 1
            width = SMALLEST
        if not (points[1:] != points[:-1]).any():
            self.leave_out("line", "without a length")
        else:
            self.lines.append(replace(line, points=points, width=width))

    def join_lines(self) -> None:
        """Join lines of the same width and labels whose ends meet, so that their corners are whole."""
        alike: dict[tuple[float, tuple[str, ...]], list[LineString]] = {}
        for line in self.lines:
            alike.setdefault((line.width, line.labels), []).append(LineString(line.points))
        self.lines = [
            Line(np.asarray(joined.coords), width, labels)
            for (width, labels), lines in alike.items()
            for joined in shapely.get_parts(shapely.line_merge(shapely.MultiLineString(lines)))
        ]

    def add_circle(self, centre: Array, radius: float, labels: Sequence[str] = (), *, at: str = "") -> None:
        """Add a disc, as the polygon that stands for a round obstacle. Raises MapError as `add_outline`."""
        self._checked([centre + np.array([[-radius, -radius], [radius, radius]])], at)
        circle = CircleObstacle((float(centre[0]), float(centre[1])), radius, name_of(labels))
        (ring,) = self._checked([np.asarray(circle.polygon.exterior.coords)[:-1]], at)
        self.outlines.append(Outline(MultiPolygon([Polygon(ring)]), tuple(labels), circle))

    def add_point(self, point: Array, labels: Sequence[str] = (), *, at: str = "") -> None:
        """Add a pillar, if points were asked for. Raises MapError as `add_outline`."""
        ((x, y),) = self._checked([point[None]], at)[0].tolist()
        if self.options.pillar is None:
            self.leave_out("point", "(--pillar RADIUS makes pillars of them)")
        else:
            self.pillars.append(CircleObstacle((x, y), self.options.pillar, name_of(labels)))

    def leave_heights(self, heights: Array) -> None:
        """Count third coordinates, which no map has; nan is none."""
        heights = heights[~np.isnan(heights)]
        if len(heights):
            self._heights.append(heights)

    def leave_out(self, thing: str, why: str = "", count: int = 1) -> None:
        """Count something that is no part of the map."""
        self.left_out[thing, why] += count

    @property
    def thickness(self) -> float:
        """Width of lines that have none of their own, m."""
        return THICKNESS if self.options.thickness is None else self.options.thickness

    @property
    def areas(self) -> list[BaseGeometry]:
        """What the outlines enclose."""
        return [outline.area for outline in self.outlines]

    @property
    def paths(self) -> list[BaseGeometry]:
        """The lines without their width."""
        return [shapely.linestrings(line.points) for line in self.lines]

    @property
    def repaired(self) -> tuple[str, ...]:
        """What had to be put right."""
        told = [f"{counted(count, thing)} {what}" for (thing, what), count in sorted(self.mended.items())]
        if len(self._met) == 1:
            told.append(f"the outline met itself: {self._met[0]}")
        elif self._met:
            told.append(f"{len(self._met)} outlines met themselves, the first: {self._met[0]}")
        return tuple(told)

    @property
    def dropped(self) -> tuple[str, ...]:
        """What was left out."""
        left = sorted(self.left_out.items())
        told = [f"{_many(count, thing)} {why}".strip() for (thing, why), count in left]
        if self._heights:
            heights = np.concatenate(self._heights)
            span = f"z from {heights.min():.4g} to {heights.max():.4g}"
            told.append(f"{counted(len(heights), 'third coordinate')}, {span}")
        return tuple(told)

    def require_known_names(self) -> None:
        """Raise ParameterError on a name of the options that the file has not; it names the nearest."""
        options = self.options
        boundary = () if options.boundary is None else (options.boundary,)
        for name, labels in (("boundary", boundary), ("only", options.only), ("skip", options.skip)):
            for label in labels or ():
                if label.casefold() not in self.labels:
                    known = list(self.labels.values())[:_SHOWN]
                    what = unknown_name("name", label, known) if known else "no shape has a name"
                    raise ParameterError(f"{self.where}: {name}: {what}")

    def count(self, vertices: int) -> None:
        """Count vertices that were read. Raises MapError when there are too many."""
        self.vertices += vertices
        files.require_vertices(self.vertices, self.where)

    def _checked(self, rings: Sequence[Array], at: str) -> list[Array]:
        """Count the points of rings, and return them to a nanometre: next to nothing is nothing."""
        self.count(sum(map(len, rings)))
        for ring in rings:
            good = np.abs(ring) <= FARTHEST  # nan is not good either
            if not good.all():
                x, y = ring[int(np.argmin(good.all(axis=1)))].tolist()
                place = f"{self.where}: {at}" if at else self.where
                raise MapError(
                    f"{place}: a point at [{x:g}, {y:g}] m, but coordinates from {-FARTHEST:.0f} to "
                    f"{FARTHEST:.0f} m were wanted"
                )
        return [np.round(ring, _DIGITS) + 0.0 for ring in rings]


def _many(count: int, thing: str) -> str:
    """Return how many things there are, also of nouns in y and x.

    >>> _many(2, "empty geometry"), _many(2, "box")
    ('2 empty geometries', '2 boxes')
    """
    if count != 1 and thing.endswith(("y", "x")):
        return f"{count} {thing[:-1]}ies" if thing[-1] == "y" else f"{count} {thing}es"
    return counted(count, thing)


def name_of(labels: Sequence[str]) -> str | None:
    """Return what an obstacle with these labels is called in a map; layer 0 of a drawing is no name."""
    names = (one_line(label)[:LONGEST_LABEL].strip() for label in labels[:1] if label != "0")
    return next(names, None) or None


def folded(labels: Iterable[str]) -> set[str]:
    """Return labels as they are compared."""
    return {label.casefold() for label in labels}


def polygonised(lines: Iterable[Line]) -> BaseGeometry:
    """Return the area that lines enclose together, in whatever order they stand."""
    noded = shapely.union_all([LineString(line.points) for line in lines])
    return shapely.union_all(shapely.get_parts(shapely.polygonize(shapely.get_parts(noded))))
