"""Snapping of the cursor: grid, vertices, edges, angles, alignment; never beyond its reach."""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import chain, combinations, islice
from typing import Any, Literal, Self, TypeAlias, get_args

import numpy as np
import shapely
from scipy.spatial import cKDTree

from robocov.arrays import Array
from robocov.environment import CircleObstacle, DiscStart, Point, PointsStart, WallObstacle
from robocov_app.editor.model.geometry import as_array, bearing, cos_sin, nearest_on
from robocov_app.editor.model.selection import Vertex
from robocov_app.editor.model.sketch import Owner, Sketch, geometry_of
from robocov_app.render.surface_cache import Latest

Dragged: TypeAlias = Iterable[Owner | Vertex]
PointKind: TypeAlias = Literal["vertex", "centre", "middle"]
MANY = 1500  # vertices of a map from which on the window does not wait for its targets
_MOST_EDGES = 8  # edges near a point that are looked at: more can only be where nothing can be told apart


class Targets:
    """Snap targets, with `more` points, without what is dragged; outlines of walls and circles too."""

    def __init__(self, sketch: Sketch, without: Dragged = (), more: Sequence[Point] = ()) -> None:
        dragged: dict[tuple[Owner, int], set[int]] = defaultdict(set)
        owners: set[Owner] = {item.key for item in sketch.obstacles if item.hidden}
        for each in without:
            if isinstance(each, Vertex):
                dragged[each.of, each.ring].add(each.index)
            else:
                owners.add(each)
        points, rims, centres = list[Point](), list(more), list[Point]()
        edges, walls, circles = list[tuple[Point, Point]](), list[Any](), list[Any]()
        for owner in sketch.owners:
            if owner in owners:
                continue
            thing = sketch.thing(owner)
            if isinstance(thing, CircleObstacle | DiscStart):
                centres.append(thing.center)
                rims += sketch.ring_points(owner)[0][1:]
            if isinstance(thing, CircleObstacle):
                circles.append(geometry_of(thing))
            elif isinstance(thing, WallObstacle):
                walls.append(geometry_of(thing))
            elif isinstance(thing, PointsStart):
                centres += [at for k, at in enumerate(thing.positions) if k not in dragged[owner, 0]]
            for ring, line, closed in sketch.rings_of(owner):
                gone, count = dragged[owner, ring], len(line)
                points += [point for k, point in enumerate(line) if k not in gone] if gone else line
                pairs = [(k, (k + 1) % count) for k in range(count if closed else count - 1)]
                edges += [(line[a], line[b]) for a, b in pairs if a not in gone and b not in gone]
        lows, highs = np.array(edges, dtype=float).reshape(-1, 2, 2).transpose(1, 0, 2)
        marks = np.concatenate([as_array([*points, *rims]), _outline(walls)[0]])
        kinds = {"vertex": marks, "centre": as_array(centres), "middle": (lows + highs) / 2}
        self._places = {kind: (cKDTree(at), at) for kind, at in kinds.items() if len(at)}
        around = _outline([*walls, *circles])  # walls and circles are found by what they look like, too
        self.starts, self.ends = np.concatenate([lows, around[0]]), np.concatenate([highs, around[1]])
        low, high = np.minimum(self.starts, self.ends), np.maximum(self.starts, self.ends)
        self._edges = shapely.STRtree(shapely.box(*low.T, *high.T))
        # what is in line counts of vertices and centres, sorted along each axis
        marks = np.concatenate([marks, kinds["centre"]])
        self._sorted = tuple(marks[np.argsort(marks[:, axis], kind="stable")] for axis in (0, 1))

    def nearest(self, point: Point, kind: PointKind, reach: float) -> Point | None:
        if kind not in self._places:
            return None
        tree, places = self._places[kind]
        away, k = tree.query(point, distance_upper_bound=np.nextafter(reach, np.inf))
        return _point(places[k]) if away <= reach else None

    def edges_near(self, point: Point, reach: float) -> list[tuple[Point, Point]]:
        """Return the ends of the edges within `reach` m, the nearest first."""
        x, y = point
        found = np.sort(self._edges.query(shapely.box(x - reach, y - reach, x + reach, y + reach)))
        starts, ends = self.starts[found], self.ends[found]
        _, away = nearest_on(starts, ends, point)
        order = np.argsort(away, kind="stable")
        order = order[away[order] <= reach][:_MOST_EDGES]
        return [(_point(starts[k]), _point(ends[k])) for k in order]

    def in_line(self, point: Point, axis: int, reach: float, horizon: float) -> Point | None:
        """Return the mark within the horizon that is nearest along an axis, within `reach` m, then at all."""
        marks = self._sorted[axis]
        first, last = np.searchsorted(marks[:, axis], (point[axis] - reach, point[axis] + reach))
        some = marks[first:last]
        some = some[np.hypot(*(some - point).T) <= horizon]
        if not len(some):
            return None
        off = np.round(np.abs(some[:, axis] - point[axis]), 9)
        return _point(some[np.lexsort((np.hypot(*(some - point).T), off))[0]])


class Snapper:
    """The targets that were asked for last; of large maps worked out beside the window."""

    def __init__(self) -> None:
        self.patient = False  # to wait for the targets of large maps too
        self._latest: Latest[Future[Targets]] = Latest()
        self._pool = ThreadPoolExecutor(1, "targets")

    def targets(self, sketch: Sketch, without: Dragged = (), more: Sequence[Point] = ()) -> Targets | None:
        """Return what to snap to; None as long as that is being worked out."""
        look = frozenset(without), tuple(more)
        coming = self._latest.of(sketch, look, lambda: self._pool.submit(Targets, sketch, *look))
        return coming.result() if coming.done() or self.patient or vertex_count(sketch) < MANY else None

    def close(self) -> None:
        self._pool.shutdown(cancel_futures=True)


def vertex_count(sketch: Sketch) -> int:
    shapes = (item.shape for item in sketch.obstacles)
    return sum(len(getattr(shape, "vertices", getattr(shape, "points", ()))) for shape in shapes)


def _outline(geometries: list[shapely.Geometry]) -> tuple[Array, Array]:
    rings = shapely.get_rings(np.array(geometries, dtype=object))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    is_edge = ring[1:] == ring[:-1]
    return points[:-1][is_edge], points[1:][is_edge]


def _point(at: Array) -> Point:
    x, y = at.tolist()
    return x, y


Kind: TypeAlias = Literal["vertex", "middle", "centre", "crossing", "edge", "angle", "aligned", "grid"]
KINDS: frozenset[Kind] = frozenset(get_args(Kind))
SNAPS: dict[str, tuple[str, frozenset[Kind]]] = {
    "grid": ("Grid", frozenset({"grid"})),
    "vertices": ("Vertices", frozenset({"vertex", "middle", "centre", "crossing"})),
    "edges": ("Edges", frozenset({"edge"})),
    "angles": ("Angles", frozenset({"angle"})),
    "alignment": ("Alignment", frozenset({"aligned"})),
}
"""Snap modes as people choose them: title, and the kinds of `Snapping`."""

_HORIZON = 60.0  # so many reaches away something still counts as in line: about what a window shows
_MOST_POINTS = 16  # points of what is moved that are looked at
_PARALLEL = 1e-9


@dataclass(frozen=True)
class Guide:
    """Why a point snapped: what a window shows of it."""

    kind: Kind
    line: tuple[Point, ...]  # m; from where it comes to the point; a single point where a mark is enough
    words: str  # such as "vertex", "45°", "in line"


@dataclass(frozen=True)
class Snap:
    """Snapped point and the guides that explain it; no guides where it stayed."""

    point: Point
    guides: tuple[Guide, ...] = ()


@dataclass(frozen=True)
class Snapping:
    """Snap settings."""

    reach: float  # m; nothing moves farther; a window gives what some pixels are
    grid: float = 0.1  # m; spacing of the grid
    angle: float = 15.0  # degrees; directions from the point before, counted from the x axis
    to: frozenset[Kind] = KINDS  # kinds of what is snapped to; empty for nothing


@dataclass(frozen=True)
class _Line:
    """A line that a point can come to lie on; an edge ends, the others do not."""

    kind: Kind
    through: Point
    direction: Point
    guide: tuple[Point, ...]
    words: str
    length: float = math.inf

    def along(self, point: Point) -> float:
        dx, dy = point[0] - self.through[0], point[1] - self.through[1]
        return dx * self.direction[0] + dy * self.direction[1]

    def foot(self, point: Point) -> Point:
        along = self.along(point)
        return self.at(min(max(along, 0.0), self.length) if self.kind == "edge" else along)

    def at(self, along: float) -> Point:
        return self.through[0] + along * self.direction[0], self.through[1] + along * self.direction[1]

    def crossing(self, other: Self) -> Point | None:
        (ux, uy), (vx, vy) = self.direction, other.direction
        across = ux * vy - uy * vx
        if abs(across) < _PARALLEL:
            return None
        dx, dy = other.through[0] - self.through[0], other.through[1] - self.through[1]
        along, beyond = (dx * vy - dy * vx) / across, (dx * uy - dy * ux) / across
        for line, part in ((self, along), (other, beyond)):
            if line.kind == "edge" and not -1e-9 <= part <= line.length + 1e-9:
                return None
        return self.at(along)

    def grid_place(self, foot: Point, grid: float) -> Point | None:
        """Return the place on it, near a foot, where the grid is; a ray has it in steps from its origin."""
        if grid <= 0.0:
            return None
        if self.kind == "angle":
            return self.at(_multiple(self.along(foot), grid))
        if min(map(abs, self.direction)) >= _PARALLEL:
            return None
        axis = 0 if abs(self.direction[1]) < _PARALLEL else 1
        there = _multiple(foot[axis], grid)
        place = (there, foot[1]) if axis == 0 else (foot[0], there)
        beyond = self.kind == "edge" and math.dist(self.foot(place), place) > _PARALLEL
        return None if beyond else place

    def shown(self, at: Point) -> Guide:
        return Guide(self.kind, self.guide if self.kind == "edge" else (*self.guide, at), self.words)


def snapped(point: Point, targets: Targets, snapping: Snapping, origin: Point | None = None) -> Snap:
    """Return where a point snaps: to points, crossing lines, lines, the grid; angles count from `origin`."""
    return _Candidates(point, targets, snapping, origin).best()[1]


def snapped_move(points: Sequence[Point], dx: float, dy: float, targets: Targets, snapping: Snapping) -> Snap:
    """Return as `point` the move near (dx, dy) m that snaps the nearest of some points."""
    best: tuple[tuple[int, float], Snap] | None = None
    # what many points meet somewhere means little of one of them
    of_others = replace(snapping, to=snapping.to - {"grid", "angle", "middle", "crossing"})
    if len(points) > _MOST_POINTS:  # the first one, and those on their hull
        hull = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(np.array(points)))).tolist()
        points = [points[0], *hull[:: math.ceil(len(hull) / (_MOST_POINTS - 1))]]
    for k, (x, y) in enumerate(points):
        at = x + dx, y + dy
        rank, snap = _Candidates(at, targets, snapping if k == 0 else of_others).best()
        by = dx + snap.point[0] - at[0], dy + snap.point[1] - at[1]
        away = math.hypot(by[0] - dx, by[1] - dy)  # what rounding adds is not to add to the reach
        if snap.guides and away <= snapping.reach and (best is None or (rank, away) < best[0]):
            best = (rank, away), Snap(by, snap.guides)
    return best[1] if best else Snap((dx, dy))


def snapped_angle(degrees: float, step: float = 15.0, reach: float = 3.0) -> float:
    nearest = step * round(degrees / step)
    return nearest + 0.0 if abs(nearest - degrees) <= reach else degrees


@dataclass(frozen=True)
class _Candidates:
    """Snap candidates of a point; angles count from `origin`."""

    point: Point
    targets: Targets
    how: Snapping
    origin: Point | None = None

    def best(self) -> tuple[int, Snap]:
        """Return how well the point snapped, the lower the better, and where to."""
        found = chain(self.marks("centre", "middle"), self.crossings())
        ways = (self.marks("vertex"), found, self.on_lines(), self.on_grid())
        for rank, way in enumerate(ways):
            near = [snap for snap in way if math.dist(self.point, snap.point) <= self.how.reach]
            if near:
                return rank, min(near, key=self.telling)
        return len(ways), Snap(self.point)

    def telling(self, snap: Snap) -> tuple[int, int, float]:
        # two lines say more than one, and the grid little
        lines = sum(guide.kind != "grid" for guide in snap.guides)
        return -lines, -len(snap.guides), math.dist(self.point, snap.point)

    def marks(self, *kinds: PointKind) -> Iterator[Snap]:
        for kind in kinds:
            place = self.targets.nearest(self.point, kind, self.how.reach) if kind in self.how.to else None
            if place is not None:
                yield _mark(kind, place)

    def crossings(self) -> Iterator[Snap]:
        for edge, other in combinations(self.edges(), 2) if "crossing" in self.how.to else ():
            place = other.crossing(edge)
            if place is not None:
                yield _mark("crossing", place)

    def on_lines(self) -> Iterator[Snap]:
        lines, reach, origin = list[_Line](), self.how.reach, self.origin
        if "angle" in self.how.to and origin is not None and math.dist(self.point, origin) > reach:
            degrees = self.how.angle * round(bearing(origin, self.point) / self.how.angle)
            words = f"{math.remainder(degrees, 360.0) % 360.0:g}°"
            lines.append(_Line("angle", origin, cos_sin(degrees), (origin,), words))
        for axis, direction in ((0, (0.0, 1.0)), (1, (1.0, 0.0))) if "aligned" in self.how.to else ():
            mark = self.targets.in_line(self.point, axis, reach, _HORIZON * reach)
            if mark is not None:
                lines.append(_Line("aligned", mark, direction, (mark,), "in line"))
        lines += islice(self.edges(), 4) if "edge" in self.how.to else ()
        for k, line in enumerate(lines):
            for other in lines[:k]:
                both_edges = line.kind == other.kind == "edge"  # where two edges cross is a matter of its own
                place = None if both_edges else line.crossing(other)
                if place is not None:
                    yield Snap(place, (other.shown(place), line.shown(place)))
            foot = line.foot(self.point)
            place = line.grid_place(foot, self.how.grid) if "grid" in self.how.to else None
            if place is not None:
                yield Snap(place, (line.shown(place), Guide("grid", (place,), "grid")))
            yield Snap(foot, (line.shown(foot),))

    def on_grid(self) -> Iterator[Snap]:
        if "grid" in self.how.to and self.how.grid > 0.0:
            x, y = (_multiple(value, self.how.grid) for value in self.point)
            for place in ((x, y), (x, self.point[1]), (self.point[0], y)):
                yield _mark("grid", place)
                if math.dist(place, self.point) <= self.how.reach:
                    return

    def edges(self) -> Iterator[_Line]:
        for a, b in self.targets.edges_near(self.point, self.how.reach):
            length = math.dist(a, b)
            if length > 0.0:
                direction = (b[0] - a[0]) / length, (b[1] - a[1]) / length
                yield _Line("edge", a, direction, (a, b), "edge", length)


def _mark(kind: Kind, place: Point) -> Snap:
    return Snap(place, (Guide(kind, (place,), "middle of an edge" if kind == "middle" else kind),))


def _multiple(value: float, step: float) -> float:
    """Return the nearest multiple of a step, as the decimal that it is: 3 steps of 0.1 are 0.3."""
    return round(step * round(value / step), 9) + 0.0
