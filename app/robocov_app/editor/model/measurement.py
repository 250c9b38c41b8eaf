"""Measurements of a sketch: free area, parts, narrowest gap, and where robots cannot pass."""

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon

from robocov.arrays import Array, IntArray
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import MAX_SAGITTA_M, Gap, Point, find_narrow_gaps, find_narrowest_gap
from robocov_app.editor.model.geometry import compute_center
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.editor.model.validation import Problem, find_problems, format_position
from robocov_app.jobs.messages import Line, Wire
from robocov_app.jobs.workers import DirectWorker, LatestWorker, Worker

_TOUCHING = 1e-5  # meters within which an edge lies on a wall
_EXACTLY = 1e-6  # meters by which a gap may be narrower than a robot that passes: it fits where it just fits
_MOST_GAPS = 20  # gaps that are told of one by one


@dataclass(frozen=True, eq=False)
class Measurement:
    """Measurements of a sketch for robots of some radius."""

    free_area: float  # m²
    components: tuple[float, ...]  # m²; areas of the connected parts of the free space, the largest first
    reached: tuple[float, ...]  # m²; areas that a robot can sweep, each out of reach from the others, too
    gap: Gap | None  # the narrowest passage; None where there is none
    # at passages that are too narrow, the largest disc that passes; and what no robot touches, as `reach_of`
    impassable: MultiPolygon
    sealed: MultiPolygon  # free space where robots fit, but that is cut off from the largest part for them
    vertices: int  # of boundary, walls, polygons and their holes
    problems: tuple[Problem, ...]
    radius: float  # m; of the robots that were asked about


def measure(sketch: Sketch, radius: float = DEFAULT_RADIUS_M) -> Measurement:
    """Measure a sketch for robots of a radius, m; a broken one as far as its free space can be made out."""
    found, free = find_problems(sketch, radius)
    narrow = find_narrow_gaps(free, 2.0 * radius - _EXACTLY)
    reached, untouched = compute_reach(free, radius)
    discs = [shapely.Point(_middle(gap)).buffer(gap.width / 2) for gap in narrow]
    marks = _polygons(shapely.union_all([*discs, untouched]) & free)
    sealed = MultiPolygon([polygon for part in reached[1:] for polygon in _polygons(part)])
    problems = [*found, *_too_narrow(narrow, marks, radius)]
    if not free.is_empty and not reached:
        problems.append(Problem(f"no robot of radius {radius:g} m fits anywhere", free, None, False))
    elif len(reached) > sum(part.area >= np.pi * radius**2 for part in free.geoms):
        words = f"robots of radius {radius:g} m cannot pass between {len(reached)} parts of the free space"
        words += f": {sum(part.area for part in reached[1:]):.3g} m² are cut off from the largest"
        problems.append(Problem(words, sealed, None, False, "cut off"))
    return Measurement(
        free_area=float(free.area),
        components=tuple(float(part.area) for part in free.geoms),
        reached=tuple(float(part.area) for part in reached),
        gap=narrow[0] if narrow else find_narrowest_gap(free),
        impassable=MultiPolygon(marks),
        sealed=sealed,
        vertices=sum(len(ring) for owner in sketch.owners for _, ring, _ in sketch.list_rings(owner)),
        problems=tuple(problems),
        radius=radius,
    )


def compute_reach(free: MultiPolygon, radius: float) -> tuple[tuple[shapely.Geometry, ...], MultiPolygon]:
    """Return what a robot sweeps from anywhere in each part that it can drive in, and what it never touches.

    Swept parts, the largest first, are the connected pieces of the free space's opening by the robot's disc.
    Never touched are passages and niches too narrow for it, but no crumbs in corners, which touch the rest in
    one arc and lie within the radius of it. Right to about a hundredth of the radius.
    """
    centers = [part for part in _polygons(free.buffer(_EXACTLY - radius)) if part.area > 0.0]
    swept = sorted((part.buffer(radius) & free for part in centers), key=lambda part: -part.area)
    opened = shapely.union_all(swept)
    left = free - opened.buffer(MAX_SAGITTA_M / 2)
    parts = np.array([part for part in _polygons(left) if part.area > 0.0], dtype=object)
    if not len(parts):
        return tuple(swept), MultiPolygon()
    points, of = shapely.get_coordinates(parts, return_index=True)
    deep = np.full(len(parts), opened.is_empty)
    if not opened.is_empty:
        # `dwithin` is prepared, which `distance` would not be: that counts with thousands of walls
        shapely.prepare(opened)
        np.logical_or.at(deep, of, ~shapely.dwithin(opened, shapely.points(points), radius))
    wanted = deep | (_arcs(parts, free) != 1)
    # what is no wider than a crack is taken for touching
    wide = ~shapely.is_empty(shapely.buffer(parts, -MAX_SAGITTA_M, quad_segs=2))
    return tuple(swept), MultiPolygon(list(parts[wanted & wide]))


def _arcs(parts: Array, free: MultiPolygon) -> IntArray:
    """Return for each polygon in how many stretches its outline leaves the walls."""
    walls = free.boundary
    shapely.prepare(walls)
    rings, of = shapely.get_rings(parts, return_index=True)
    points, ring_of = shapely.get_coordinates(rings, return_index=True)
    is_edge = ring_of[1:] == ring_of[:-1]
    ring = ring_of[1:][is_edge]
    off = ~shapely.dwithin(walls, shapely.points(((points[1:] + points[:-1]) / 2)[is_edge]), _TOUCHING)
    first = np.searchsorted(ring, np.arange(len(rings)))
    before = np.arange(len(ring)) - 1
    before[first] = np.append(first[1:], len(ring)) - 1
    counts = np.zeros(len(parts), dtype=np.intp)
    np.add.at(counts, of[ring[off & ~off[before]]], 1)
    np.add.at(counts, of[np.logical_and.reduceat(off, first)], 1)  # an outline that touches no wall at all
    return counts


def _middle(gap: Gap) -> Point:
    return compute_center((*gap.between[0], *gap.between[1]))


def _too_narrow(narrow: tuple[Gap, ...], marks: list[Polygon], radius: float) -> list[Problem]:
    """Warn of each passage that is too narrow: of several gaps in one marked place, of the narrowest."""
    found: dict[int, Problem] = {}
    tree, narrows = shapely.STRtree(marks), f"too narrow for robots of radius {radius:g} m"
    for gap in narrow:
        words = f"the gap at {format_position(*_middle(gap))} is {gap.width:.3g} m wide: {narrows}"
        mark = int(tree.nearest(shapely.Point(_middle(gap))))
        found.setdefault(mark, Problem(words, LineString(gap.between), None, False, "narrow"))
    problems = list(found.values())
    if more := problems[_MOST_GAPS:]:
        where = shapely.union_all([problem.geometry for problem in more])
        problems[_MOST_GAPS:] = [Problem(f"{len(more)} more gaps are {narrows}", where, None, False)]
    return problems


def _polygons(geometry: shapely.Geometry) -> list[Polygon]:
    return [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon)]


# a sketch with those obstacles only that the process does not know, the keys of all, and a radius, m
Question: TypeAlias = tuple[Sketch, tuple[int, ...], float]


class MeasurementWire(Wire):
    """Tells a process of each sketch only what is new."""

    def __init__(self) -> None:
        self._known: dict[int, Item] = {}

    def encode(self, question: tuple[Sketch, float]) -> Question:
        """Return a question with only those obstacles that the process does not know."""
        sketch, radius = question
        changed = tuple(item for item in sketch.obstacles if self._known.get(item.key) is not item)
        self._known = {item.key: item for item in sketch.obstacles}
        return replace(sketch, obstacles=changed), tuple(self._known), radius


class SketchMeasurer:
    """Measures sketches of which it is told what is new."""

    failing = "the map could not be measured"

    def __init__(self) -> None:
        self._known: dict[int, Item] = {}

    def __call__(self, questions: list[Question], line: Line) -> Measurement:
        for sketch, order, _ in questions:
            known = self._known | {item.key: item for item in sketch.obstacles}
            self._known = {key: known[key] for key in order}
        return measure(replace(sketch, obstacles=tuple(self._known.values())), questions[-1][2])


def create_measurement_worker(*, direct: bool = False) -> Worker[Measurement]:
    """Return what measures sketches, asked by (sketch, radius), in another process or at once in this one."""
    if direct:
        return DirectWorker(SketchMeasurer(), MeasurementWire())
    return LatestWorker(f"{__name__}:{SketchMeasurer.__name__}", "measures the map", MeasurementWire)
