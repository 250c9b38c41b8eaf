"""The shapes of a drawing in metres: closed outlines, lines, points; and the map that they stand for."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import GRID, CircleObstacle, WallObstacle
from robocov.errors import MapError, ParameterError, counted, one_line, shown, unknown_name
from robocov.mapfile.models import FARTHEST, LARGEST, LONGEST_LABEL, SMALLEST
from robocov_app.formats import files
from robocov_app.formats.base import ForeignMap, ReadOptions
from robocov_app.formats.geometry.polygons import Crossings, Rule, enclosed, polygons_of, united
from robocov_app.formats.geometry.snapping import close_gaps, default_snap

Kind: TypeAlias = Literal["polygon", "line", "point"]
THICKNESS = 0.1  # width of walls that are drawn as lines without one, in metres
BOUNDARY = "boundary"  # a shape of this name, id, class or layer is the boundary
AROUND = 1.0  # room left around the shapes where none of them is the boundary, in metres
_MOST = 0.5  # a boundary holds more of the other shapes; walls that are one leave so much of it open
_FARTHEST_PARTS = 10.0 * LARGEST  # m; shapes farther from each other are of no map: unions take seconds
_SHOWN = 20  # names that are listed where one is wrong
_DIGITS = 9


@dataclass(frozen=True, eq=False)
class Figure:
    """A geometry of a file, before it is known what its coordinates are; `at` is its place, for messages.

    `rule`: as of `polygons.enclosed`. `width`, m: of a line, where the file says it.
    """

    kind: Kind
    rings: tuple[Array, ...]
    labels: tuple[str, ...] = ()
    at: str = ""
    rule: Rule = "holes"
    width: float | None = None


@dataclass(frozen=True, eq=False)
class Outline:
    """A closed outline: its valid area, m; labels, the most particular first; the disc that it is, if any."""

    area: MultiPolygon
    labels: tuple[str, ...] = ()
    circle: CircleObstacle | None = None


@dataclass(frozen=True, eq=False)
class Line:
    """A line, (k, 2) m, open or closed, that is a wall; `cap` and `join` are shapely's words.

    `stretched`: of a pen that is no circle, (k, 2) points, a width and the (3, 3) matrix that makes them
    metres.
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


class _Enclosure(NamedTuple):
    """A boundary that was found: its area with whatever holes it has, and the shapes that made it."""

    area: MultiPolygon
    words: str
    outlines: frozenset[Outline] = frozenset()
    lines: frozenset[Line] = frozenset()


class Shapes:
    """Shapes that a reader has found in the file `where`: checked, counted, chosen by name.

    `pillars` are obstacles whatever outlines are. `left_out`, `mended`: counts of what is no part of the map
    or was put right, and why. `labels`: as compared and as written. `robots`, `notes`, `cell`: of a
    `ForeignMap`.
    """

    def __init__(self, where: str, options: ReadOptions) -> None:
        self.where, self.options = where, options
        self.outlines: list[Outline] = []
        self.lines: list[Line] = []
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
        self.thickness = THICKNESS if options.thickness is None else options.thickness
        self._heights: list[Array] = []
        self._met: list[str] = []
        self._crossings = Crossings(where)

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

    def add_all(self, figures: Iterable[Figure]) -> None:
        for figure in figures:
            self.add(figure)
        self.join_lines()

    def add(self, figure: Figure) -> None:
        """Add a geometry whose coordinates are metres; MapError where one is out of range."""
        if not self.wants(figure.labels):
            return
        if figure.kind == "point":
            self.add_point(figure.rings[0][0], figure.labels, at=figure.at)
        elif figure.kind == "line":
            width = figure.width if figure.width and self.options.thickness is None else self.thickness
            self.add_line(Line(figure.rings[0], width, figure.labels), at=figure.at)
        else:
            self.add_outline(figure.rings, figure.labels, rule=figure.rule, at=figure.at)

    def add_outline(
        self, rings: Sequence[Array], labels: Sequence[str] = (), *,
        rule: Rule = "holes", at: str = "", thing: str = "outline",
    ) -> bool:  # fmt: skip
        """Add the area of rings, (k, 2) m; without one the `thing`, if it has a name, is counted."""
        rings = self._checked(rings, at)
        area, reason, lost = enclosed(rings, rule, self._crossings)
        for why, count in lost.items():
            self.leave_out("hole", why, count)
        if reason is not None:
            self._met.append(f"{at}: {reason}" if at else reason)
        if not area.is_empty:
            self.outlines.append(Outline(area, tuple(labels)))
        elif thing:
            self.leave_out(thing, "without an area")
        return not area.is_empty

    def add_line(self, line: Line, *, at: str = "") -> None:
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
        self._checked([centre + np.array([[-radius, -radius], [radius, radius]])], at)
        circle = CircleObstacle((float(centre[0]), float(centre[1])), radius, name_of(labels))
        (ring,) = self._checked([np.asarray(circle.polygon.exterior.coords)[:-1]], at)
        self.outlines.append(Outline(MultiPolygon([Polygon(ring)]), tuple(labels), circle))

    def add_point(self, point: Array, labels: Sequence[str] = (), *, at: str = "") -> None:
        ((x, y),) = self._checked([point[None]], at)[0].tolist()
        if self.options.pillar is None:
            self.leave_out("point", "(--pillar RADIUS makes pillars of them)")
        else:
            self.pillars.append(CircleObstacle((x, y), self.options.pillar, name_of(labels)))

    def polygon(self, rings: Iterable[Array], labels: tuple[str, ...], at: str) -> Figure:
        """Return a polygon of a format that closes rings; those that are not closed are counted."""
        rings = tuple(rings)
        if unclosed := sum(bool((ring[0] != ring[-1]).any()) for ring in rings):
            self.mended["ring", "closed: the last point was not the first"] += unclosed
        return Figure("polygon", rings, labels, at)

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
    def areas(self) -> list[BaseGeometry]:
        return [outline.area for outline in self.outlines]

    @property
    def paths(self) -> list[BaseGeometry]:
        return [shapely.linestrings(line.points) for line in self.lines]

    @property
    def repaired(self) -> tuple[str, ...]:
        told = [f"{counted(count, thing)} {what}" for (thing, what), count in sorted(self.mended.items())]
        if len(self._met) == 1:
            told.append(f"the outline met itself: {self._met[0]}")
        elif self._met:
            told.append(f"{len(self._met)} outlines met themselves, the first: {self._met[0]}")
        return tuple(told)

    @property
    def dropped(self) -> tuple[str, ...]:
        left = sorted(self.left_out.items())
        told = [f"{_many(count, thing)} {why}".strip() for (thing, why), count in left]
        heights = np.concatenate([*self._heights, np.empty(0)])
        if len(heights):
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
                wanted = f"coordinates from {-FARTHEST:.0f} to {FARTHEST:.0f} m were wanted"
                raise MapError(f"{place}: a point at [{x:g}, {y:g}] m, but {wanted}")
        return [np.round(ring, _DIGITS) + 0.0 for ring in rings]

    def foreign_map(
        self, name: str, text: str, *, solid: bool, overlap: bool = False, world: MultiPolygon | None = None
    ) -> ForeignMap:
        """Return the map that the shapes of a file stand for.

        Closed outlines are either *free space*, all of them together; or they are *solid*, but for one which
        is the boundary. Lines and pillars are obstacles in both. The boundary is, in this order,

        1. the shape whose name, id, class or layer the option ``boundary`` gives, or that is called so; lines
           of that name are one when they enclose an area; outlines around it are frames, and left out;
        2. the largest closed outline, if it is the only shape, or more than half of the others lie in it;
        3. the outer edge of the walls, if they close and what they enclose is mostly open;
        4. a rectangle around everything, at the distance of the option ``around``.

        `solid`: what closed outlines are unless the option ``outlines`` says it: True is solid; False is
        free, but solid where 1 or 2 (of outlines alone) finds a boundary of others, or where there are only
        lines. `overlap`: outlines may overlap and are all free, as JuPedSim's accessible areas: then 2 holds
        only where all others lie wholly in the largest. `world`, m: what is free before the shapes stand in
        it, where the format says so. Raises MapError when there are no shapes, the boundary has no area, or
        they cross too often; ParameterError when a name in the options is none of the file's.
        """
        self.require_known_names()
        if world is None and not self.outlines and not self.lines:
            dropped = f" ({'; '.join(self.dropped)} left out)" if self.dropped else ""
            raise MapError(f"{self.where}: no closed outline and no line{dropped}, but a drawing was wanted")
        everything = [*self.areas, *self.paths, *([] if world is None else [world])]
        # one of many parts may be a map, if they are not all too far from each other
        _require_size(shapely.total_bounds(everything), self.where, _FARTHEST_PARTS)
        # nor may they cross each other so often that what is free among them cannot be computed
        Crossings(self.where).add([*shapely.get_rings(shapely.get_parts(self.areas)), *self.paths])
        asked = self.options.outlines
        boundary = self._named() if world is None else _Enclosure(world, "")
        if boundary is None and asked != "free":
            boundary = self._largest(solid or asked == "solid", wholly=overlap and asked is None)
        if asked is not None:
            solid = asked == "solid"
        elif not solid:
            others = boundary is not None and len(self.outlines) > len(boundary.outlines)
            solid = not self.outlines or others
        if solid:
            boundary = boundary or self.surrounding()
            area = boundary.area
        else:
            area = self._joined([o.area for o in self.outlines if not boundary or o not in boundary.outlines])
            if area.is_empty and boundary is not None:
                area = boundary.area
        if area.is_empty:
            raise MapError(f"{self.where}: no closed outline, but one that encloses free space was wanted")
        _require_size(area.geoms[0].bounds, self.where)
        used = boundary or _Enclosure(area, "")
        inner = [outline for outline in self.outlines if solid and outline not in used.outlines]
        walls = [line for line in self.lines if line not in used.lines]
        blocks = np.array([outline.area for outline in inner], dtype=object)
        shapely.prepare(area)
        around = shapely.covered_by(area, blocks)
        solids = [*blocks[~around], *(line.solid for line in walls), *(each.polygon for each in self.pillars)]
        if outside := int((~shapely.intersects(area, solids)).sum() + around.sum()):
            self.leave_out("shape", "outside of the boundary", outside)
        free = polygons_of(shapely.difference(area, united(solids), grid_size=GRID)) if solids else area
        # what is free of a grid has its own outline
        plain = world is None or (len(world.geoms) == 1 and not world.geoms[0].interiors)
        if boundary is not None and (solid or boundary.area is not area) and plain:
            outer = Polygon(boundary.area.geoms[0].exterior)
        elif (walls or self.pillars) and len(area.geoms) == len(free.geoms) == 1:
            # walls that begin at the edge are no part of it
            outer = Polygon(area.geoms[0].exterior)
        else:
            outer = None
        notes = [*self.notes]
        if boundary and boundary.words and solid:
            notes.append(f"the boundary is {boundary.words}")
        many = counted(int((~around).sum()), "closed outline")
        told = boundary is None or boundary.words  # else the format says what all of it is
        if told and not around.all():
            notes.append(f"{many} taken as solid (--outlines free: as free space)")
        elif not solid and len(self.outlines) > 1:
            many = counted(len(self.outlines), "closed outline")
            notes.append(f"{many} taken as free space (--outlines solid: as obstacles)")
        if walls:
            narrow, wide = (f"{most(line.width for line in walls):.3g}" for most in (min, max))
            span = narrow if narrow == wide else f"{narrow} to {wide}"
            notes.append(f"{counted(len(walls), 'line')} taken as walls, {span} m wide (--thickness)")
        if self.pillars:
            notes.append(f"{counted(len(self.pillars), 'point')} taken as pillars")
        circles = (outline.circle for outline in inner if outline.circle is not None)
        straight = (wall for line in walls if (wall := line.wall) is not None)
        return ForeignMap(
            name=name,
            description=text,
            free=free,
            boundary=outer,
            vertices_read=self.vertices,
            cell=self.cell,
            primitives=(*circles, *straight, *self.pillars),
            robots=tuple(self.robots),
            repaired=self.repaired,
            dropped=self.dropped,
            notes=tuple(notes),
        )

    def _joined(self, areas: Sequence[BaseGeometry]) -> MultiPolygon:
        """Return areas of free space as one, hairline gaps between them closed and counted."""
        snap = default_snap(areas) if self.options.snap is None else self.options.snap
        joined = close_gaps(areas, snap)
        if joined.number:
            self.notes.append(joined.describe())
        return joined.area

    def surrounding(self) -> _Enclosure:
        """Return what the shapes enclose as walls, else a rectangle around them."""
        solids = [*self.areas, *(line.solid for line in self.lines)]
        solid = _together(solids)
        fills = [Polygon(part.exterior) for part in solid.geoms]
        if fills:  # else what there is is thinner than the grid
            k = int(np.argmax([fill.area for fill in fills]))
            fill, area = fills[k], fills[k].area
            if solid.geoms[k].area <= (1.0 - _MOST) * area and _holds(fill, list(solid.geoms)):
                return _Enclosure(MultiPolygon([fill]), f"the outer edge of the walls, around {area:.4g} m²")
        around = AROUND if self.options.around is None else self.options.around
        x, y, right, top = shapely.total_bounds(solids)
        box = shapely.box(x - around, y - around, right + around, top + around)
        words = f"a rectangle {around:g} m around everything (--around): no shape holds the others"
        return _Enclosure(MultiPolygon([box]), words)

    def _named(self) -> _Enclosure | None:
        wanted = self.options.boundary
        key = (wanted or BOUNDARY).casefold()
        outlines = frozenset(o for o in self.outlines if key in map(str.casefold, o.labels))
        lines = frozenset(line for line in self.lines if key in map(str.casefold, line.labels))
        noded = shapely.union_all([LineString(line.points) for line in lines])
        rooms = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
        area = _together([*(o.area for o in outlines), shapely.union_all(rooms)])
        if not area.is_empty:
            return _Enclosure(area, f"what is called {shown(wanted or BOUNDARY)}", outlines, lines)
        if wanted is not None:
            what = f"boundary {shown(wanted)}: encloses no area, but a closed outline was wanted"
            raise MapError(f"{self.where}: {what}")
        return None

    def _largest(self, solid: bool, *, wholly: bool) -> _Enclosure | None:
        """Return the largest closed outline if most others lie in it, or all wholly; if solid, lines too."""
        if not self.outlines:
            return None
        outline = max(self.outlines, key=_filled)
        inner = [area for area in self.areas if area is not outline.area]
        if solid:
            inner += [*self.paths, *(pillar.polygon for pillar in self.pillars)]
            # walls as one shape have rooms as holes
            if outline.area.area < _MOST * _filled(outline):
                return None
        wholly |= not inner
        if not (shapely.covers(outline.area, inner).all() if wholly else _holds(outline.area, inner)):
            return None
        called = f", {shown(outline.labels[0])}," if outline.labels else ""
        words = f"the largest closed outline{called} of {_filled(outline):.4g} m²"
        return _Enclosure(outline.area, words if inner else "the only closed outline", frozenset([outline]))


def _many(count: int, thing: str) -> str:
    """Return how many things there are, also of nouns in y and x."""
    if count != 1 and thing.endswith(("y", "x")):
        return f"{count} {thing[:-1]}ies" if thing[-1] == "y" else f"{count} {thing}es"
    return counted(count, thing)


def name_of(labels: Sequence[str]) -> str | None:
    """Return what an obstacle with these labels is called in a map; layer 0 of a drawing is no name."""
    names = (one_line(label)[:LONGEST_LABEL].strip() for label in labels[:1] if label != "0")
    return next(names, None) or None


def _require_size(bounds: Iterable[float], where: str, most: float = LARGEST) -> None:
    x, y, right, top = bounds
    if max(right - x, top - y) > most:
        wanted = f"at most {LARGEST / 1000:g} km was wanted: is the scale right?"
        raise MapError(f"{where}: {right - x:.6g} x {top - y:.6g} m, but {wanted}")


def _filled(outline: Outline) -> float:
    return float(sum(Polygon(part.exterior).area for part in outline.area.geoms))


def _holds(outer: BaseGeometry, inner: Sequence[BaseGeometry]) -> bool:
    """Return whether most of the inner shapes lie in the outer one, each by a place on it."""
    shapely.prepare(outer)
    return bool(shapely.covers(outer, shapely.point_on_surface(inner)).mean() > _MOST)


def _together(areas: Sequence[BaseGeometry]) -> MultiPolygon:
    """Return areas as one; a single one stays exactly as it is."""
    areas = [area for area in areas if not area.is_empty]
    if len(areas) == 1:
        return polygons_of(areas[0])
    # to unite first and round then takes a tenth of the time
    return polygons_of(shapely.set_precision(united(areas), GRID))
