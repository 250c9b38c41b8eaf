"""Measurements of a sketch: its free area and components, narrowest gap, and impassable areas."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon

from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import MAX_SAGITTA_M, Gap, Point, find_narrow_gaps, find_narrowest_gap
from robocov.errors import format_area
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.editor.model.geometry import compute_center
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.editor.model.validation import Problem, find_problems, format_position
from robocov_app.jobs.messages import Channel, Codec
from robocov_app.jobs.workers import DirectWorker, LatestWorker, Worker

_WALL_TOLERANCE_M = 1e-5
"""Maximum distance from a wall at which an edge counts as lying on it."""
_FIT_TOLERANCE_M = 1e-6
"""Tolerance for a passage that is exactly as wide as a robot."""
_MAX_GAPS = 20
"""Maximum number of gaps with separate warnings; the others share one."""


@dataclass(frozen=True, eq=False)
class Measurement:
    """Measurements of a sketch for robots with a given radius.

    Attributes
    ----------
    free_area : float, m²
        Area of the free space.
    components : tuple of float, m²
        Areas of the connected components of the free space, the largest first.
    reached : tuple of float, m²
        For each part of the free space in which a robot can move, the area that it can sweep there, the
        largest first.
    gap : Gap or None
        The narrowest passage.
    impassable : MultiPolygon
        Areas to mark as impassable: in each passage that is too narrow, the largest disc that fits through
        it; and the space that no robot can touch; see `compute_reach`.
    cut_off : MultiPolygon
        Parts of the free space in which robots fit, but which they cannot reach from the largest part.
    vertices : int
        Number of vertices of the boundary, walls, polygons and their holes.
    problems : tuple of Problem
        Errors and warnings.
    radius : float, m
        Radius of the robots.
    """

    free_area: float
    components: tuple[float, ...]
    reached: tuple[float, ...]
    gap: Gap | None
    impassable: MultiPolygon
    cut_off: MultiPolygon
    vertices: int
    problems: tuple[Problem, ...]
    radius: float


def measure(sketch: Sketch, radius: float = DEFAULT_RADIUS_M) -> Measurement:
    """Measure a sketch, and find its problems.

    Parameters
    ----------
    sketch : Sketch
        The map. It may break rules; then its free space is approximated.
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
    cut_off = MultiPolygon([polygon for part in swept[1:] for polygon in _list_polygons(part)])
    return Measurement(
        free_area=float(free.area),
        components=tuple(float(part.area) for part in free.geoms),
        reached=tuple(float(part.area) for part in swept),
        gap=narrowest_gap,
        impassable=MultiPolygon(impassable),
        cut_off=cut_off,
        vertices=_count_vertices(sketch),
        problems=(
            *rule_problems,
            *_build_gap_warnings(narrow_gaps, impassable, radius),
            *_build_reach_warnings(free, swept, cut_off, radius),
        ),
        radius=radius,
    )


def is_too_narrow(gap: Gap, radius: float) -> bool:
    """Return whether robots with a radius, m, do not fit through a gap, so that a warning reports it."""
    return gap.width < 2.0 * radius - _FIT_TOLERANCE_M


def compute_shown_width(gap: Gap, radius: float) -> float:
    """Return the width of a gap, m, for a text that compares it with the diameter of robots with a radius, m.

    A gap that is wide enough only because of the tolerance is shown as wide as a robot.
    """
    if is_too_narrow(gap, radius):
        return gap.width
    return max(gap.width, 2.0 * radius)


def _count_vertices(sketch: Sketch) -> int:
    return sum(len(points) for owner in sketch.owners for _, points, _ in sketch.list_rings(owner))


def compute_reach(free: MultiPolygon, radius: float) -> tuple[tuple[shapely.Geometry, ...], MultiPolygon]:
    """Compute the space that robots can sweep, and the space that none of them can touch.

    The results are accurate to about a hundredth of the radius.

    Parameters
    ----------
    free : MultiPolygon, m
        The free space.
    radius : float, m
        Radius of the robots.

    Returns
    -------
    swept : tuple of geometries, m
        For each part in which a robot can move, the space that it sweeps, the largest first. These are the
        connected components of the morphological opening of the free space by the disc of a robot.
    untouched : MultiPolygon, m
        Passages and niches that are too narrow for robots. The remainders in corners are not included: each
        of them meets the swept space in a single arc, and lies within the radius of it.
    """
    eroded = _list_polygons(free.buffer(_FIT_TOLERANCE_M - radius))
    dilated = [part.buffer(radius) & free for part in eroded if part.area > 0.0]
    swept = tuple(sorted(dilated, key=lambda part: -part.area))
    opening = shapely.union_all(swept)
    # Without this margin, the polygons that approximate arcs would leave slivers along the walls.
    remainder = free - opening.buffer(MAX_SAGITTA_M / 2)
    parts = np.array([part for part in _list_polygons(remainder) if part.area > 0.0], dtype=object)
    if not len(parts):
        return swept, MultiPolygon()
    is_beyond_corner = _exceeds_distance(parts, opening, radius) | (_count_open_stretches(parts, free) != 1)
    # Cracks that are hardly wider than the accuracy of arcs are ignored.
    is_wide = ~shapely.is_empty(shapely.buffer(parts, -MAX_SAGITTA_M, quad_segs=2))
    return swept, MultiPolygon(list(parts[is_beyond_corner & is_wide]))


def _exceeds_distance(parts: FloatArray, target: shapely.Geometry, distance: float) -> BoolArray:
    """Return a mask of the polygons with a vertex farther from the target than a distance, m."""
    if target.is_empty:
        return np.ones(len(parts), dtype=bool)
    points, part_of_point = shapely.get_coordinates(parts, return_index=True)
    # GEOS uses prepared geometries for `dwithin` but not for `distance`, which is slow with many walls.
    shapely.prepare(target)
    exceeds = np.zeros(len(parts), dtype=bool)
    np.logical_or.at(exceeds, part_of_point, ~shapely.dwithin(target, shapely.points(points), distance))
    return exceeds


def _count_open_stretches(parts: FloatArray, free: MultiPolygon) -> IntArray:
    """Count, for each polygon, the connected stretches of its outline that do not lie on walls."""
    walls = free.boundary
    shapely.prepare(walls)
    rings, part_of_ring = shapely.get_rings(parts, return_index=True)
    points, ring_of_point = shapely.get_coordinates(rings, return_index=True)
    is_edge = ring_of_point[1:] == ring_of_point[:-1]
    middles = ((points[1:] + points[:-1]) / 2)[is_edge]
    ring_of_edge = ring_of_point[1:][is_edge]
    is_open = ~shapely.dwithin(walls, shapely.points(middles), _WALL_TOLERANCE_M)
    # The predecessor of the first edge of a ring is the last edge of the same ring.
    first_edges = np.searchsorted(ring_of_edge, np.arange(len(rings)))
    previous_edge = np.arange(len(ring_of_edge)) - 1
    previous_edge[first_edges] = np.append(first_edges[1:], len(ring_of_edge)) - 1
    counts = np.zeros(len(parts), dtype=np.intp)
    begins_stretch = is_open & ~is_open[previous_edge]
    np.add.at(counts, part_of_ring[ring_of_edge[begins_stretch]], 1)
    # A ring that touches no wall is a single stretch that begins nowhere.
    is_all_open = np.logical_and.reduceat(is_open, first_edges)
    np.add.at(counts, part_of_ring[is_all_open], 1)
    return counts


def _compute_middle(gap: Gap) -> Point:
    return compute_center((*gap.between[0], *gap.between[1]))


def _build_gap_warnings(gaps: tuple[Gap, ...], marks: list[Polygon], radius: float) -> list[Problem]:
    """Warn about each passage that is too narrow.

    If several gaps are in the same marked area, only the narrowest one is reported.
    """
    reason = f"too narrow for robots of radius {radius:g} m"
    tree = shapely.STRtree(marks)
    problem_by_mark: dict[int, Problem] = {}
    for gap in gaps:
        middle = _compute_middle(gap)
        message = f"the passage at {format_position(*middle)} is {gap.width:.3g} m wide: {reason}"
        mark = int(tree.nearest(shapely.Point(middle)))
        problem = Problem(message, LineString(gap.between), is_error=False, kind="narrow")
        # Gaps are sorted by width, so the first one of a mark is the narrowest.
        problem_by_mark.setdefault(mark, problem)
    problems = list(problem_by_mark.values())
    others = problems[_MAX_GAPS:]
    if not others:
        return problems
    geometry = shapely.union_all([problem.geometry for problem in others])
    summary = f"{len(others)} more passages are {reason}"
    if len(others) == 1:
        summary = f"1 more passage is {reason}"
    return [
        *problems[:_MAX_GAPS],
        Problem(summary, geometry, is_error=False),
    ]


def _build_reach_warnings(
    free: MultiPolygon, swept: tuple[shapely.Geometry, ...], cut_off: MultiPolygon, radius: float
) -> list[Problem]:
    """Warn if robots fit nowhere, or if they cannot reach all parts of the free space from the largest."""
    if not free.is_empty and not swept:
        return [Problem(f"no robot of radius {radius:g} m fits anywhere", free, is_error=False)]
    # Parts without any connection are reported as sealed rooms, so each of them may have one swept part.
    min_area = np.pi * radius**2
    if len(swept) <= sum(part.area >= min_area for part in free.geoms):
        return []
    sealed_area = sum(part.area for part in swept[1:])
    message = (
        f"robots of radius {radius:g} m cannot pass between {len(swept)} parts of the free space: "
        f"{format_area(sealed_area, 3)} are cut off from the largest"
    )
    return [Problem(message, cut_off, is_error=False, kind="cut off")]


def _list_polygons(geometry: shapely.Geometry) -> list[Polygon]:
    return [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon)]


class MeasurementRequest(NamedTuple):
    """Request to measure a sketch, without the obstacles that the service has already received.

    Attributes
    ----------
    sketch : Sketch
        The sketch, with only its new or changed obstacles.
    keys : tuple of int
        Keys of all its obstacles, in order.
    radius : float, m
        Radius of the robots.
    """

    sketch: Sketch
    keys: tuple[int, ...]
    radius: float


class MeasurementCodec(Codec):
    """Codec that sends only the obstacles that have changed since the previous sketch."""

    def __init__(self) -> None:
        self._known: dict[int, Item] = {}

    def encode(self, request: tuple[Sketch, float]) -> MeasurementRequest:
        """Return a request with the obstacles that the process has not received yet; they count as sent."""
        sketch, radius = request
        changed = tuple(item for item in sketch.obstacles if self._known.get(item.key) is not item)
        self._known = {item.key: item for item in sketch.obstacles}
        return MeasurementRequest(replace(sketch, obstacles=changed), tuple(self._known), radius)


class SketchMeasurer:
    """Service that measures sketches and receives only their changes."""

    failure_message = "the map could not be measured"

    def __init__(self) -> None:
        self._known: dict[int, Item] = {}

    def __call__(self, requests: list[MeasurementRequest], channel: Channel) -> Measurement:
        """Apply the changes in all requests, and measure the last sketch."""
        for request in requests:
            known = self._known | {item.key: item for item in request.sketch.obstacles}
            self._known = {key: known[key] for key in request.keys}
        newest = requests[-1]
        return measure(replace(newest.sketch, obstacles=tuple(self._known.values())), newest.radius)


def create_measurement_worker(*, direct: bool = False) -> Worker[Measurement]:
    """Create a worker that measures sketches. Its requests are tuples (sketch, radius in m).

    Parameters
    ----------
    direct : bool
        Whether to measure immediately in this process instead of in a separate one.
    """
    if direct:
        return DirectWorker(SketchMeasurer(), MeasurementCodec())
    return LatestWorker(f"{__name__}:{SketchMeasurer.__name__}", "measures the map", MeasurementCodec)
