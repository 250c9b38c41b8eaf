"""Measurements of a sketch: its free area and components, narrowest gap, and impassable areas."""

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon

from robocov.arrays import Array, BoolArray, IntArray
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import MAX_SAGITTA_M, Gap, Point, find_narrow_gaps, find_narrowest_gap
from robocov_app.editor.model.geometry import compute_center
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.editor.model.validation import Problem, find_problems, format_position
from robocov_app.jobs.messages import Channel, Wire
from robocov_app.jobs.workers import DirectWorker, LatestWorker, Worker

_WALL_TOLERANCE_M = 1e-5
"""Distance within which an edge lies on a wall."""
_FIT_TOLERANCE_M = 1e-6
"""Length by which a passage may be narrower than a robot that just fits."""
_MAX_GAPS = 20
"""Maximum number of gaps with a warning of their own."""


@dataclass(frozen=True, eq=False)
class Measurement:
    """Measurements of a sketch for robots of a radius.

    Attributes
    ----------
    free_area : float, m²
    components : tuple of float, m²
        Areas of the connected components of the free space, the largest first.
    reached : tuple of float, m²
        Areas that a robot can sweep without leaving its part of the free space, the largest first.
    gap : Gap or None
        The narrowest passage.
    impassable : MultiPolygon
        For each passage that is too narrow, the largest disc that passes; and the space that no robot
        touches, see `compute_reach`.
    sealed : MultiPolygon
        Free space where robots fit, but that they cannot reach from the largest part.
    vertices : int
        Number of vertices of the boundary, walls, polygons and their holes.
    problems : tuple of Problem
    radius : float, m
        Radius of the robots.
    """

    free_area: float
    components: tuple[float, ...]
    reached: tuple[float, ...]
    gap: Gap | None
    impassable: MultiPolygon
    sealed: MultiPolygon
    vertices: int
    problems: tuple[Problem, ...]
    radius: float


def measure(sketch: Sketch, radius: float = DEFAULT_RADIUS_M) -> Measurement:
    """Measure a sketch.

    Parameters
    ----------
    sketch : Sketch
        It may break rules, as long as its free space can be determined.
    radius : float, m
        Radius of the robots.

    Returns
    -------
    Measurement
    """
    rule_problems, free = find_problems(sketch, radius)
    narrow_gaps = find_narrow_gaps(free, 2.0 * radius - _FIT_TOLERANCE_M)
    narrowest_gap = next(iter(narrow_gaps), None) or find_narrowest_gap(free)
    swept, untouched = compute_reach(free, radius)
    discs = [shapely.Point(_compute_middle(gap)).buffer(gap.width / 2) for gap in narrow_gaps]
    impassable = _list_polygons(shapely.union_all([*discs, untouched]) & free)
    sealed = MultiPolygon([polygon for part in swept[1:] for polygon in _list_polygons(part)])
    return Measurement(
        free_area=float(free.area),
        components=tuple(float(part.area) for part in free.geoms),
        reached=tuple(float(part.area) for part in swept),
        gap=narrowest_gap,
        impassable=MultiPolygon(impassable),
        sealed=sealed,
        vertices=_count_vertices(sketch),
        problems=(
            *rule_problems,
            *_build_gap_warnings(narrow_gaps, impassable, radius),
            *_build_reach_warnings(free, swept, sealed, radius),
        ),
        radius=radius,
    )


def _count_vertices(sketch: Sketch) -> int:
    return sum(len(points) for owner in sketch.owners for _, points, _ in sketch.list_rings(owner))


def compute_reach(free: MultiPolygon, radius: float) -> tuple[tuple[shapely.Geometry, ...], MultiPolygon]:
    """Compute the space that robots can sweep, and the space that none of them can touch.

    The results are right to about a hundredth of the radius.

    Parameters
    ----------
    free : MultiPolygon, m
    radius : float, m

    Returns
    -------
    swept : tuple of geometries, m
        The space that a robot sweeps from anywhere in each part that it can drive in, the largest first: the
        connected components of the opening of the free space by the robot's disc.
    untouched : MultiPolygon, m
        Passages and niches that are too narrow for robots. The remainders in corners do not count; they meet
        the swept space in one arc, and lie within the radius of it.
    """
    eroded = _list_polygons(free.buffer(_FIT_TOLERANCE_M - radius))
    dilated = [part.buffer(radius) & free for part in eroded if part.area > 0.0]
    swept = tuple(sorted(dilated, key=lambda part: -part.area))
    opening = shapely.union_all(swept)
    remainder = free - opening.buffer(MAX_SAGITTA_M / 2)
    parts = np.array([part for part in _list_polygons(remainder) if part.area > 0.0], dtype=object)
    if not len(parts):
        return swept, MultiPolygon()
    is_beyond_corner = _exceeds_distance(parts, opening, radius) | (_count_open_stretches(parts, free) != 1)
    # A part that is no wider than a crack counts as touched.
    is_wide = ~shapely.is_empty(shapely.buffer(parts, -MAX_SAGITTA_M, quad_segs=2))
    return swept, MultiPolygon(list(parts[is_beyond_corner & is_wide]))


def _exceeds_distance(parts: Array, target: shapely.Geometry, distance: float) -> BoolArray:
    """Return for each polygon whether any vertex is farther from the target than a distance, m."""
    if target.is_empty:
        return np.ones(len(parts), dtype=bool)
    points, part_of_point = shapely.get_coordinates(parts, return_index=True)
    # GEOS uses the prepared geometry for `dwithin`, but not for `distance`, which matters with many walls.
    shapely.prepare(target)
    exceeds = np.zeros(len(parts), dtype=bool)
    np.logical_or.at(exceeds, part_of_point, ~shapely.dwithin(target, shapely.points(points), distance))
    return exceeds


def _count_open_stretches(parts: Array, free: MultiPolygon) -> IntArray:
    """Return for each polygon the number of stretches of its outline that do not lie on walls."""
    walls = free.boundary
    shapely.prepare(walls)
    rings, part_of_ring = shapely.get_rings(parts, return_index=True)
    points, ring_of_point = shapely.get_coordinates(rings, return_index=True)
    is_edge = ring_of_point[1:] == ring_of_point[:-1]
    middles = ((points[1:] + points[:-1]) / 2)[is_edge]
    ring_of_edge = ring_of_point[1:][is_edge]
    is_open = ~shapely.dwithin(walls, shapely.points(middles), _WALL_TOLERANCE_M)
    # The edge before the first one of a ring is its last one.
    first_edges = np.searchsorted(ring_of_edge, np.arange(len(rings)))
    previous_edge = np.arange(len(ring_of_edge)) - 1
    previous_edge[first_edges] = np.append(first_edges[1:], len(ring_of_edge)) - 1
    counts = np.zeros(len(parts), dtype=np.intp)
    begins_stretch = is_open & ~is_open[previous_edge]
    np.add.at(counts, part_of_ring[ring_of_edge[begins_stretch]], 1)
    # A ring that does not touch any wall is one stretch without a beginning.
    is_all_open = np.logical_and.reduceat(is_open, first_edges)
    np.add.at(counts, part_of_ring[is_all_open], 1)
    return counts


def _compute_middle(gap: Gap) -> Point:
    return compute_center((*gap.between[0], *gap.between[1]))


def _build_gap_warnings(gaps: tuple[Gap, ...], marks: list[Polygon], radius: float) -> list[Problem]:
    """Warn of each passage that is too narrow; of several gaps in the same mark, only of the narrowest."""
    reason = f"too narrow for robots of radius {radius:g} m"
    tree = shapely.STRtree(marks)
    problem_by_mark: dict[int, Problem] = {}
    for gap in gaps:
        middle = _compute_middle(gap)
        message = f"the gap at {format_position(*middle)} is {gap.width:.3g} m wide: {reason}"
        mark = int(tree.nearest(shapely.Point(middle)))
        problem = Problem(message, LineString(gap.between), None, False, "narrow")
        problem_by_mark.setdefault(mark, problem)
    problems = list(problem_by_mark.values())
    others = problems[_MAX_GAPS:]
    if not others:
        return problems
    geometry = shapely.union_all([problem.geometry for problem in others])
    return [*problems[:_MAX_GAPS], Problem(f"{len(others)} more gaps are {reason}", geometry, None, False)]


def _build_reach_warnings(
    free: MultiPolygon, swept: tuple[shapely.Geometry, ...], sealed: MultiPolygon, radius: float
) -> list[Problem]:
    """Warn of free space that no robot can enter, or that robots cannot reach from the largest part."""
    if not free.is_empty and not swept:
        return [Problem(f"no robot of radius {radius:g} m fits anywhere", free, None, False)]
    min_area = np.pi * radius**2
    if len(swept) <= sum(part.area >= min_area for part in free.geoms):
        return []
    sealed_area = sum(part.area for part in swept[1:])
    message = (
        f"robots of radius {radius:g} m cannot pass between {len(swept)} parts of the free space: "
        f"{sealed_area:.3g} m² are cut off from the largest"
    )
    return [Problem(message, sealed, None, False, "cut off")]


def _list_polygons(geometry: shapely.Geometry) -> list[Polygon]:
    return [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon)]


Question: TypeAlias = tuple[Sketch, tuple[int, ...], float]
"""A sketch with the obstacles that the process does not know, the keys of all, and a radius, m."""


class MeasurementWire(Wire):
    """Sends a process only the changes of each sketch."""

    def __init__(self) -> None:
        self._known: dict[int, Item] = {}

    def encode(self, question: tuple[Sketch, float]) -> Question:
        """Return a question with only those obstacles that the process does not know."""
        sketch, radius = question
        changed = tuple(item for item in sketch.obstacles if self._known.get(item.key) is not item)
        self._known = {item.key: item for item in sketch.obstacles}
        return replace(sketch, obstacles=changed), tuple(self._known), radius


class SketchMeasurer:
    """Measures sketches; it receives only their changes."""

    failure_message = "the map could not be measured"

    def __init__(self) -> None:
        self._known: dict[int, Item] = {}

    def __call__(self, questions: list[Question], channel: Channel) -> Measurement:
        """Apply the changes of all questions, and measure the last sketch."""
        for sketch, order, _ in questions:
            known = self._known | {item.key: item for item in sketch.obstacles}
            self._known = {key: known[key] for key in order}
        return measure(replace(sketch, obstacles=tuple(self._known.values())), questions[-1][2])


def create_measurement_worker(*, direct: bool = False) -> Worker[Measurement]:
    """Create a worker that measures sketches; its questions are (sketch, radius in m).

    Parameters
    ----------
    direct : bool
        Whether it measures at once in this process, instead of in another one.
    """
    if direct:
        return DirectWorker(SketchMeasurer(), MeasurementWire())
    return LatestWorker(f"{__name__}:{SketchMeasurer.__name__}", "measures the map", MeasurementWire)
