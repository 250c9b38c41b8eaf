"""Snapping of the pointer, and of dragged objects, to grid, vertices, edges, angles and aligned points."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice
from typing import Literal, NamedTuple, Self, TypeAlias, get_args

import numpy as np
import shapely

from robocov_app.toolkit.tools.geometry import Point, compute_bearing, compute_cos_sin
from robocov_app.toolkit.tools.snap_targets import PointKind, SnapTargets

SnapKind: TypeAlias = Literal[
    "vertex", "midpoint", "center", "intersection", "edge", "angle", "aligned", "grid"
]
KINDS: frozenset[SnapKind] = frozenset(get_args(SnapKind))

MAX_ALIGNMENT_REACHES = 60.0  # maximum distance of aligned points, relative to the reach
MAX_MOVED_POINTS = 16  # points of a dragged object that are tried
MAX_EDGE_LINES = 4  # edges near a point that are combined with other lines
_PARALLEL = 1e-9  # sine of the angle below which lines are parallel
_MIN_SHIFT_M = 1e-9  # a smaller shift along an axis means that nothing has snapped along it
_EDGE_TOLERANCE_M = 1e-9


@dataclass(frozen=True)
class Guide:
    """A line or mark that explains why a point has snapped.

    Attributes
    ----------
    kind : str
        Kind of the snap.
    line : tuple of Point
        Line to the snapped point, m; a single point for a mark.
    label : str
        Short text such as "vertex", "45°" or "aligned".
    """

    kind: SnapKind
    line: tuple[Point, ...]
    label: str


@dataclass(frozen=True)
class Snap:
    """A snapped point and the guides that explain it. Without guides, the point has not snapped."""

    point: Point
    guides: tuple[Guide, ...] = ()


@dataclass(frozen=True)
class SnapSettings:
    """Snap settings.

    Attributes
    ----------
    reach : float
        Maximum distance over which a point snaps, m.
    grid : float
        Spacing of the grid, m.
    angle : float
        Directions from the previous point snap to multiples of this angle, degrees from the x axis.
    kinds : frozenset of str
        Kinds of snaps that are enabled; empty for none.
    """

    reach: float
    grid: float = 0.1
    angle: float = 15.0
    kinds: frozenset[SnapKind] = KINDS


def snap_point(
    point: Point, targets: SnapTargets, settings: SnapSettings, origin: Point | None = None
) -> Snap:
    """Snap a point to marks, intersections of lines, lines, or the grid, in this order of priority.

    Parameters
    ----------
    point : Point
        Position of the pointer, m.
    targets : SnapTargets
        Points and edges to which it can snap.
    settings : SnapSettings
        Reach, grid, and kinds of snaps that are on.
    origin : Point, optional
        Point from which directions are measured, m, such as the previous point of an outline.

    Returns
    -------
    Snap
        The snapped point; the unchanged point without guides if nothing is within reach.
    """
    return _SnapSearch(point, targets, settings, origin).find_best().snap


def snap_move(
    points: Sequence[Point], dx: float, dy: float, targets: SnapTargets, settings: SnapSettings
) -> Snap:
    """Snap the displacement of points that move together, by the point with the best snap.

    Along each axis without such a snap, the first point snaps to the grid, however far that is.

    Parameters
    ----------
    points : sequence of Point
        Points that move together, m. Only the first one snaps to grid, angles, midpoints and intersections.
    dx, dy : float
        Displacement, m.
    targets : SnapTargets
        Points and edges to which they can snap.
    settings : SnapSettings
        Reach, grid, and kinds of snaps that are enabled.

    Returns
    -------
    Snap
        The snapped displacement as `Snap.point`, m.
    """
    best = _find_best_displacement(points, (dx, dy), targets, settings)
    if "grid" not in settings.kinds or settings.grid <= 0.0 or not points:
        return best
    return Snap(_snap_remaining_axes(points[0], (dx, dy), best.point, settings.grid), best.guides)


def _find_best_displacement(
    points: Sequence[Point], displacement: Point, targets: SnapTargets, settings: SnapSettings
) -> Snap:
    """Return the displacement by which the moved point with the best snap moves to its target.

    The parameters are those of `snap_move`. If no point snaps, the displacement is unchanged.
    """
    dx, dy = displacement
    best_rank = (math.inf, math.inf)
    best = Snap(displacement)
    # Among many points, some lie near the grid by chance, which is not a reason to snap.
    other_kinds = settings.kinds - {"grid", "angle", "midpoint", "intersection"}
    other_settings = replace(settings, kinds=other_kinds)
    for number, (x, y) in enumerate(_choose_moved_points(points)):
        moved = (x + dx, y + dy)
        ranked = _SnapSearch(moved, targets, settings if number == 0 else other_settings).find_best()
        snapped_x, snapped_y = ranked.snap.point
        snapped = (dx + snapped_x - moved[0], dy + snapped_y - moved[1])
        # The gap is computed from the displacement, so that rounding errors do not extend the reach.
        gap = math.hypot(snapped[0] - dx, snapped[1] - dy)
        if ranked.snap.guides and gap <= settings.reach and (ranked.rank, gap) < best_rank:
            best_rank = (ranked.rank, gap)
            best = Snap(snapped, ranked.snap.guides)
    return best


def _snap_remaining_axes(first: Point, displacement: Point, snapped: Point, grid: float) -> Point:
    """Snap the displacement to the grid along each axis along which it has not snapped yet.

    Parameters
    ----------
    first : Point
        The first moved point before the move, m.
    displacement, snapped : Point
        Displacement before and after snapping, m.
    grid : float
        Spacing of the grid, m.

    Returns
    -------
    Point
        Displacement after which the first point lies on a grid line of each of these axes, m.
    """
    on_grid = list(snapped)
    for axis in (0, 1):
        if abs(snapped[axis] - displacement[axis]) < _MIN_SHIFT_M:
            on_grid[axis] = grid * round((first[axis] + snapped[axis]) / grid) - first[axis]
    return on_grid[0], on_grid[1]


def _choose_moved_points(points: Sequence[Point]) -> Sequence[Point]:
    """Return the points to try: all, or if there are many, the first one and some of the convex hull."""
    if len(points) <= MAX_MOVED_POINTS:
        return points
    hull = shapely.convex_hull(shapely.multipoints(np.array(points)))
    corners = shapely.get_coordinates(hull).tolist()
    step = math.ceil(len(corners) / (MAX_MOVED_POINTS - 1))
    return [points[0], *corners[::step]]


def snap_angle(degrees: float, step: float = 15.0, reach: float = 3.0) -> float:
    """Return the nearest multiple of `step` if it is within `reach`, all in degrees."""
    nearest = step * round(degrees / step)
    if abs(nearest - degrees) <= reach:
        return nearest + 0.0  # Turns -0.0 into 0.0.
    return degrees


@dataclass(frozen=True)
class _SnapLine:
    """A line to which points can snap. Edges have a finite length; other lines are infinite."""

    kind: SnapKind
    origin: Point
    direction: Point
    guide: tuple[Point, ...]
    label: str
    length: float = math.inf

    def project(self, point: Point) -> float:
        """Return the signed distance from the origin to the projection of a point onto the line, m."""
        dx = point[0] - self.origin[0]
        dy = point[1] - self.origin[1]
        return dx * self.direction[0] + dy * self.direction[1]

    def find_foot(self, point: Point) -> Point:
        """Return the nearest point on the line."""
        along = self.project(point)
        if self.kind == "edge":
            along = min(max(along, 0.0), self.length)
        return self.locate(along)

    def locate(self, along: float) -> Point:
        """Return the point at a distance from the origin along the line, m."""
        return self.origin[0] + along * self.direction[0], self.origin[1] + along * self.direction[1]

    def find_intersection(self, other: Self) -> Point | None:
        """Return the intersection with another line; None if there is none."""
        ux, uy = self.direction
        vx, vy = other.direction
        cross = ux * vy - uy * vx
        if abs(cross) < _PARALLEL:
            return None
        dx = other.origin[0] - self.origin[0]
        dy = other.origin[1] - self.origin[1]
        along = (dx * vy - dy * vx) / cross
        along_other = (dx * uy - dy * ux) / cross
        if not self._covers(along) or not other._covers(along_other):
            return None
        return self.locate(along)

    def _covers(self, along: float) -> bool:
        if self.kind != "edge":
            return True
        return -_EDGE_TOLERANCE_M <= along <= self.length + _EDGE_TOLERANCE_M

    def find_grid_point(self, foot: Point, grid: float) -> Point | None:
        """Return the grid point on the line that is nearest to a point on the line; None if there is none.

        On a ray at a fixed angle, these are the points at multiples of the spacing from its origin. Other
        lines must be parallel to an axis.
        """
        if grid <= 0.0:
            return None
        if self.kind == "angle":
            return self.locate(_round_to_multiple(self.project(foot), grid))
        if min(map(abs, self.direction)) >= _PARALLEL:
            return None
        if abs(self.direction[1]) < _PARALLEL:
            point = (_round_to_multiple(foot[0], grid), foot[1])
        else:
            point = (foot[0], _round_to_multiple(foot[1], grid))
        is_beyond_end = self.kind == "edge" and math.dist(self.find_foot(point), point) > _EDGE_TOLERANCE_M
        return None if is_beyond_end else point

    def build_guide(self, point: Point) -> Guide:
        """Return the guide for a point that has snapped to the line."""
        line = self.guide if self.kind == "edge" else (*self.guide, point)
        return Guide(self.kind, line, self.label)


class _RankedSnap(NamedTuple):
    rank: int  # lower is better
    snap: Snap


@dataclass(frozen=True)
class _SnapSearch:
    """Search for the best snap of a point; directions are measured from `origin`."""

    point: Point
    targets: SnapTargets
    settings: SnapSettings
    origin: Point | None = None

    def find_best(self) -> _RankedSnap:
        """Return the best snap within reach: vertices rank before other marks, lines and the grid."""
        groups = (
            self.list_marks("vertex"),
            self.list_marks_and_intersections(),
            self.list_line_snaps(),
            self.list_grid_snaps(),
        )
        for rank, group in enumerate(groups):
            near = [snap for snap in group if self._is_near(snap.point)]
            if near:
                return _RankedSnap(rank, min(near, key=self._sort_key))
        return _RankedSnap(len(groups), Snap(self.point))

    def _is_near(self, point: Point) -> bool:
        return math.dist(self.point, point) <= self.settings.reach

    def _sort_key(self, snap: Snap) -> tuple[int, int, float]:
        # An intersection of two lines is better than a point on one line, and both are better than the grid.
        lines = sum(guide.kind != "grid" for guide in snap.guides)
        return -lines, -len(snap.guides), math.dist(self.point, snap.point)

    def list_marks(self, *kinds: PointKind) -> Iterator[Snap]:
        """Yield the snaps to the nearest mark of each given kind that is enabled."""
        for kind in kinds:
            if kind not in self.settings.kinds:
                continue
            mark = self.targets.find_nearest(self.point, kind, self.settings.reach)
            if mark is not None:
                yield _snap_to_mark(kind, mark)

    def list_marks_and_intersections(self) -> Iterator[Snap]:
        """Yield the snaps to centers, midpoints of edges and intersections of edges."""
        yield from self.list_marks("center", "midpoint")
        if "intersection" in self.settings.kinds:
            for edge, other in combinations(self.list_edges(), 2):
                intersection = other.find_intersection(edge)
                if intersection is not None:
                    yield _snap_to_mark("intersection", intersection)

    def list_line_snaps(self) -> Iterator[Snap]:
        """Yield the snaps to lines, to their intersections, and to grid points on lines."""
        lines: list[_SnapLine] = []
        for line in self.list_lines():
            for other in lines:
                # Intersections of two edges are a kind of snap of their own, "intersection".
                are_edges = line.kind == other.kind == "edge"
                intersection = None if are_edges else line.find_intersection(other)
                if intersection is not None:
                    yield Snap(
                        intersection, (other.build_guide(intersection), line.build_guide(intersection))
                    )
            lines.append(line)
            foot = line.find_foot(self.point)
            if "grid" in self.settings.kinds:
                grid_point = line.find_grid_point(foot, self.settings.grid)
                if grid_point is not None:
                    grid_guide = Guide("grid", (grid_point,), "grid")
                    yield Snap(grid_point, (line.build_guide(grid_point), grid_guide))
            yield Snap(foot, (line.build_guide(foot),))

    def list_lines(self) -> Iterator[_SnapLine]:
        """Yield the lines near the point: a ray at a multiple of the angle step, alignment lines, edges."""
        reach = self.settings.reach
        origin = self.origin
        if "angle" in self.settings.kinds and origin is not None and not self._is_near(origin):
            step = self.settings.angle
            degrees = step * round(compute_bearing(origin, self.point) / step)
            label = f"{math.remainder(degrees, 360.0) % 360.0:g}°"
            yield _SnapLine("angle", origin, compute_cos_sin(degrees), (origin,), label)
        if "aligned" in self.settings.kinds:
            for axis, direction in ((0, (0.0, 1.0)), (1, (1.0, 0.0))):
                mark = self.targets.find_aligned(self.point, axis, reach, MAX_ALIGNMENT_REACHES * reach)
                if mark is not None:
                    yield _SnapLine("aligned", mark, direction, (mark,), "aligned")
        if "edge" in self.settings.kinds:
            yield from islice(self.list_edges(), MAX_EDGE_LINES)

    def list_grid_snaps(self) -> Iterator[Snap]:
        """Yield the snaps to grid points, then to grid lines."""
        grid = self.settings.grid
        if "grid" not in self.settings.kinds or grid <= 0.0:
            return
        x, y = self.point
        grid_x = _round_to_multiple(x, grid)
        grid_y = _round_to_multiple(y, grid)
        for point in ((grid_x, grid_y), (grid_x, y), (x, grid_y)):
            yield _snap_to_mark("grid", point)
            if self._is_near(point):
                return

    def list_edges(self) -> Iterator[_SnapLine]:
        """Yield the edges near the point as lines."""
        for start, end in self.targets.list_edges_near(self.point, self.settings.reach):
            length = math.dist(start, end)
            if length > 0.0:
                direction = ((end[0] - start[0]) / length, (end[1] - start[1]) / length)
                yield _SnapLine("edge", start, direction, (start, end), "edge", length)


def _snap_to_mark(kind: SnapKind, mark: Point) -> Snap:
    label: str = kind
    if kind == "midpoint":
        label = "midpoint of an edge"
    return Snap(mark, (Guide(kind, (mark,), label),))


def _round_to_multiple(value: float, step: float) -> float:
    """Return the nearest multiple of a step, rounded to 9 decimals so that 3 steps of 0.1 are 0.3."""
    return round(step * round(value / step), 9) + 0.0
