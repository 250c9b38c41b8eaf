"""Where the cursor means: grid, vertices, edges, angles, in line with others; never beyond its reach."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal, TypeAlias, get_args

import numpy as np
import shapely

from robocov.environment import Point
from robocov_app.editor.model.geometry import cos_sin
from robocov_app.editor.tools.snap_targets import Targets

Kind: TypeAlias = Literal["vertex", "middle", "centre", "crossing", "edge", "angle", "aligned", "grid"]

KINDS: frozenset[Kind] = frozenset(get_args(Kind))
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
    """Where a point went, and why; no guides where it stayed."""

    point: Point
    guides: tuple[Guide, ...] = ()


@dataclass(frozen=True)
class Snapping:
    """What to snap to."""

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

    def foot(self, point: Point) -> Point:
        dx, dy = point[0] - self.through[0], point[1] - self.through[1]
        along = dx * self.direction[0] + dy * self.direction[1]
        if self.kind == "edge":
            along = min(max(along, 0.0), self.length)
        return self.at(along)

    def at(self, along: float) -> Point:
        return self.through[0] + along * self.direction[0], self.through[1] + along * self.direction[1]

    def crossing(self, other: _Line) -> Point | None:
        """Return where it crosses another line; None where it does not."""
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
            dx, dy = foot[0] - self.through[0], foot[1] - self.through[1]
            return self.at(_multiple(dx * self.direction[0] + dy * self.direction[1], grid))
        if min(map(abs, self.direction)) >= _PARALLEL:
            return None
        axis = 0 if abs(self.direction[1]) < _PARALLEL else 1
        there = _multiple(foot[axis], grid)
        place = (there, foot[1]) if axis == 0 else (foot[0], there)
        beyond = self.kind == "edge" and math.dist(self.foot(place), place) > _PARALLEL
        return None if beyond else place

    def shown(self, at: Point) -> Guide:
        line = self.guide if self.kind == "edge" else (*self.guide, at)
        return Guide(self.kind, line, self.words)


def snapped(point: Point, targets: Targets, snapping: Snapping, origin: Point | None = None) -> Snap:
    """Return where a point snaps to; angles count from the `origin`, where the line that is drawn comes from.

    Points come before lines, two lines (where they cross) before one, lines before the grid.
    """
    return _ranked(point, targets, snapping, origin)[1]


def snapped_move(points: Sequence[Point], dx: float, dy: float, targets: Targets, snapping: Snapping) -> Snap:
    """Return as `point` the move near (dx, dy) m that snaps the nearest of some points."""
    best: tuple[tuple[int, float], Snap] | None = None
    # what many points meet somewhere means little of one of them
    telling = snapping.to - {"grid", "angle", "middle", "crossing"}
    of_others = Snapping(snapping.reach, snapping.grid, snapping.angle, telling)
    for k, (x, y) in enumerate(_outermost(points)):
        at = x + dx, y + dy
        rank, snap = _ranked(at, targets, snapping if k == 0 else of_others, None)
        by = dx + snap.point[0] - at[0], dy + snap.point[1] - at[1]
        # what rounding adds is not to add to the reach
        away = math.hypot(by[0] - dx, by[1] - dy)
        if snap.guides and away <= snapping.reach and (best is None or (rank, away) < best[0]):
            best = (rank, away), Snap(by, snap.guides)
    return best[1] if best else Snap((dx, dy))


def snapped_angle(degrees: float, step: float = 15.0, reach: float = 3.0) -> float:
    """Return the nearest multiple of `step` degrees if it is within `reach` degrees, else the angle itself.

    >>> snapped_angle(43.0), snapped_angle(40.0)
    (45.0, 40.0)
    """
    nearest = step * round(degrees / step)
    return nearest + 0.0 if abs(nearest - degrees) <= reach else degrees


def _ranked(point: Point, targets: Targets, snapping: Snapping, origin: Point | None) -> tuple[int, Snap]:
    """Return how well a point snapped, the lower the better, and where to."""
    ways = (_at_vertices, _at_points, _on_lines, _on_grid)
    for rank, way in enumerate(ways):
        found = [(math.dist(point, snap.point), snap) for snap in way(point, targets, snapping, origin)]
        near = [each for each in found if each[0] <= snapping.reach]
        if near:
            return rank, min(near, key=lambda each: (*_telling(each[1]), each[0]))[1]
    return 4, Snap(point)


def _telling(snap: Snap) -> tuple[int, int]:
    """Return how much the guides say, the lower the more: two lines more than one, and the grid little."""
    lines = sum(guide.kind != "grid" for guide in snap.guides)
    return -lines, -len(snap.guides)


def _mark(kind: Kind, place: Point, words: str = "") -> Snap:
    return Snap(place, (Guide(kind, (place,), words or kind),))


def _at_vertices(point: Point, targets: Targets, snapping: Snapping, origin: Point | None) -> Iterator[Snap]:
    place = targets.nearest(point, "vertex", snapping.reach) if "vertex" in snapping.to else None
    if place is not None:
        yield _mark("vertex", place)


def _at_points(point: Point, targets: Targets, snapping: Snapping, origin: Point | None) -> Iterator[Snap]:
    place = targets.nearest(point, "centre", snapping.reach) if "centre" in snapping.to else None
    if place is not None:
        yield _mark("centre", place)
    place = targets.nearest(point, "middle", snapping.reach) if "middle" in snapping.to else None
    if place is not None:
        yield _mark("middle", place, "middle of an edge")
    if "crossing" in snapping.to:
        for edge, other in combinations(_edges(point, targets, snapping), 2):
            place = other.crossing(edge)
            if place is not None:
                yield _mark("crossing", place)


def _on_lines(point: Point, targets: Targets, snapping: Snapping, origin: Point | None) -> Iterator[Snap]:
    lines = []
    if "angle" in snapping.to and origin is not None and math.dist(point, origin) > snapping.reach:
        lines.append(_ray(point, origin, snapping.angle))
    if "aligned" in snapping.to:
        for axis, direction in ((0, (0.0, 1.0)), (1, (1.0, 0.0))):
            mark = targets.in_line(point, axis, snapping.reach, _HORIZON * snapping.reach)
            if mark is not None:
                lines.append(_Line("aligned", mark, direction, (mark,), "in line"))
    if "edge" in snapping.to:
        lines += list(_edges(point, targets, snapping))[:4]
    for k, line in enumerate(lines):
        for other in lines[:k]:
            # where two edges cross is a matter of its own
            both_edges = line.kind == other.kind == "edge"
            place = None if both_edges else line.crossing(other)
            if place is not None:
                yield Snap(place, (other.shown(place), line.shown(place)))
        foot = line.foot(point)
        place = line.grid_place(foot, snapping.grid) if "grid" in snapping.to else None
        if place is not None:
            yield Snap(place, (line.shown(place), Guide("grid", (place,), "grid")))
        yield Snap(foot, (line.shown(foot),))


def _on_grid(point: Point, targets: Targets, snapping: Snapping, origin: Point | None) -> Iterator[Snap]:
    if "grid" in snapping.to and snapping.grid > 0.0:
        x, y = (_multiple(value, snapping.grid) for value in point)
        for place in ((x, y), (x, point[1]), (point[0], y)):
            yield _mark("grid", place)
            if math.dist(place, point) <= snapping.reach:
                return


def _ray(point: Point, origin: Point, step: float) -> _Line:
    degrees = math.degrees(math.atan2(point[1] - origin[1], point[0] - origin[0]))
    nearest = step * round(degrees / step)
    words = f"{math.remainder(nearest, 360.0) % 360.0:g}°"
    return _Line("angle", origin, cos_sin(nearest), (origin,), words)


def _edges(point: Point, targets: Targets, snapping: Snapping) -> Iterator[_Line]:
    starts, ends = targets.edges_near(point, snapping.reach)
    for (ax, ay), (bx, by) in zip(starts.tolist(), ends.tolist(), strict=True):
        length = math.hypot(bx - ax, by - ay)
        if length > 0.0:
            direction = (bx - ax) / length, (by - ay) / length
            yield _Line("edge", (ax, ay), direction, ((ax, ay), (bx, by)), "edge", length)


def _multiple(value: float, step: float) -> float:
    """Return the nearest multiple of a step, as the decimal that it is: 3 steps of 0.1 are 0.3."""
    return round(step * round(value / step), 9) + 0.0


def _outermost(points: Sequence[Point]) -> Sequence[Point]:
    """Return the first point, and of many others those on their hull."""
    if len(points) <= _MOST_POINTS:
        return points
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(np.array(points)))).tolist()
    step = math.ceil(len(hull) / (_MOST_POINTS - 1))
    return [points[0], *((x, y) for x, y in hull[::step])]
