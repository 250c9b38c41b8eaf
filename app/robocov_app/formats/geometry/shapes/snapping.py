"""Closing of hairline gaps between outlines of free space.

Rooms that are drawn one by one are often separated by a rounding error. Such a gap is not a wall, but it
would divide the free space. A gap between two outlines is closed

- if it is narrower than `robocov.mapfile.models.MIN_SIZE_M`, because no obstacle of a map is that thin, or
- if it is narrower than the snapping tolerance and separates parts that are not connected elsewhere. If a
  door leads through the gap, it is a wall, however thin.

Only gaps between outlines are closed. Slits and holes in a single outline, lines, and solid outlines
are drawn on purpose and stay.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import LineString, MultiPolygon, STRtree
from shapely.geometry.base import BaseGeometry

from robocov.environment import GRID_M
from robocov.errors import format_count
from robocov.mapfile.models import MIN_SIZE_M
from robocov.typing import AnyArray, FloatArray, IntArray
from robocov_app.formats.geometry.polygons import buffer_with_mitres, to_multipolygon, unite

DEFAULT_SNAP_M = 0.01
"""Default snapping tolerance, thinner than any wall of a building."""
MAX_DEFAULT_SNAP = 1e-3
"""Maximum default tolerance, as a fraction of a drawing's larger side: a table-top arena has thin walls."""
_OVERLAP_M = 2 * GRID_M
"""Distance by which the filling of a gap overlaps its surroundings."""
_REACH = 1.01
"""Distance, in tolerances, within which an outline is close to another one."""
_MIN_LENGTH = 3.0
"""Minimum length of a gap, in tolerances. Where only corners are close, the length is at most two."""
_MAX_WIDENING = 0.25
"""Maximum variation of the width along the middle half of a gap, in tolerances."""


class ClosedGaps(NamedTuple):
    """An area whose gaps were closed.

    Attributes
    ----------
    area : MultiPolygon, m
    number : int
        Number of gaps that were closed.
    widest : float, m
        Width of the widest gap.
    """

    area: MultiPolygon
    number: int = 0
    widest: float = 0.0

    def describe(self) -> str:
        """Return the line of the import report about the gaps."""
        width = f"{1000 * self.widest:.2g} mm"
        size = f"{width} wide" if self.number == 1 else f"the widest {width}"
        return f"{format_count(self.number, 'gap')} between outlines closed, {size} (--snap 0 keeps them)"


def compute_default_snap(areas: Sequence[BaseGeometry]) -> float:
    """Return the snapping tolerance, m, that is used for areas if the user gives none."""
    if not len(areas):
        return DEFAULT_SNAP_M
    left, low, right, high = shapely.total_bounds(areas)
    return float(min(DEFAULT_SNAP_M, MAX_DEFAULT_SNAP * max(right - left, high - low)))


def close_gaps(areas: Sequence[BaseGeometry], snap: float) -> ClosedGaps:
    """Unite areas and close the hairline gaps between them.

    Parameters
    ----------
    areas : sequence of polygons or multipolygons, m, valid
    snap : float, m
        Wider gaps stay.

    Returns
    -------
    ClosedGaps
    """
    outlines = shapely.get_parts(np.array(areas, dtype=object))
    if not len(outlines):
        return ClosedGaps(MultiPolygon())
    if len(outlines) == 1:
        return ClosedGaps(to_multipolygon(outlines[0]))
    area = union_on_grid(outlines)
    if snap <= 0.0 or not _are_close(outlines, snap):
        return ClosedGaps(area)
    # First close the gaps thinner than any obstacle of a map, between all outlines. Wider gaps are then
    # closed only between the parts that are still separate.
    hairline_width = min(snap, MIN_SIZE_M)
    hairlines = _find_gaps(outlines, hairline_width)
    area = _fill(area, hairlines, hairline_width)
    cracks = _find_gaps(shapely.get_parts(area), snap)
    area = _fill(area, cracks, snap)
    widths = np.concatenate([hairlines.widths, cracks.widths])
    return ClosedGaps(area, len(widths), float(widths.max(initial=0.0)))


class _Gaps(NamedTuple):
    """Gaps between polygons.

    Attributes
    ----------
    surroundings : (n,) array of areas, m
        Area around each gap.
    widths : (n,) array, m
    """

    surroundings: FloatArray
    widths: FloatArray


def union_on_grid(areas: Sequence[BaseGeometry]) -> MultiPolygon:
    """Return the union of areas, m, with coordinates rounded to the micrometer."""
    # Uniting before rounding is ten times as fast.
    return to_multipolygon(shapely.set_precision(unite(areas), GRID_M))


def are_edge_to_edge(first: BaseGeometry, second: BaseGeometry, tolerance: float) -> bool:
    """Return whether two areas touch along an edge, within a tolerance, m, without overlapping."""
    if shapely.relate_pattern(first, second, "2********"):  # the interiors have an area in common
        return False
    reach = shapely.buffer(second, _REACH * tolerance + GRID_M)
    wall = shapely.intersection(shapely.boundary(first), reach)
    return bool(_find_longest(wall).length > _MIN_LENGTH * tolerance)


def join_line_ends(lines: Sequence[LineString], tolerance: float) -> list[LineString]:
    """Move the ends of lines that are within a tolerance, m, of each other to the same point.

    A chain of such ends moves to the same point, too. Ends that already coincide with others are joints,
    which may be the vertices of a curve that consists of many short lines. Joints move by at most the
    tolerance, and no chain leads from joint to joint, so that the curve keeps its shape.
    """
    if not lines:
        return []
    # The starts of all lines come before their ends.
    ends = [shapely.get_point(lines, 0), shapely.get_point(lines, -1)]
    points = np.concatenate(ends)
    joined = shapely.get_coordinates(points[_choose_common_ends(points, tolerance)])
    result = []
    for k, line in enumerate(lines):
        vertices = shapely.get_coordinates(line)
        vertices[0] = joined[k]
        vertices[-1] = joined[len(lines) + k]
        result.append(LineString(vertices))
    return result


def _choose_common_ends(points: AnyArray, tolerance: float) -> IntArray:
    """Return the index of the end to whose original position each of n ends moves, (n,).

    Parameters
    ----------
    points : (n,) array of shapely points, m
    tolerance : float, m
    """
    first, second = STRtree(points).query(points, predicate="dwithin", distance=tolerance)
    is_same_point = (shapely.distance(points[first], points[second]) == 0.0) & (first != second)
    is_joint = np.zeros(len(points), dtype=bool)
    is_joint[first[is_same_point]] = True
    # A joint moves to the original position of the close joint with the lowest index.
    targets = np.arange(len(points))
    is_joint_pair = is_joint[first] & is_joint[second]
    np.minimum.at(targets, first[is_joint_pair], second[is_joint_pair])
    # A chain moves to the original position of its end with the lowest index.
    is_link = ~is_joint[first] & ~is_joint[second]
    chains = _number_chains(first[is_link], second[is_link], len(points))
    _, first_ends = np.unique(chains, return_index=True)
    chain_targets = targets[first_ends]
    # A chain that is close to joints moves with one of them instead: to the lowest of their targets.
    is_near_joint = ~is_joint[first] & is_joint[second]
    near_chains = chains[first[is_near_joint]]
    chain_targets[near_chains] = len(points)  # above every index
    np.minimum.at(chain_targets, near_chains, targets[second[is_near_joint]])
    return np.asarray(chain_targets[chains])


def _number_chains(first: IntArray, second: IntArray, count: int) -> IntArray:
    """Return the number of the chain of each of `count` ends, given the pairs of linked ends.

    An end without links, such as a joint, is a chain of its own.
    """
    links = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    _, chains = connected_components(links, directed=False)
    return np.asarray(chains)


def _are_close(outlines: FloatArray, snap: float) -> bool:
    """Return whether any two outlines are within the tolerance of each other."""
    first, second = STRtree(outlines).query(outlines, predicate="dwithin", distance=snap)
    return bool((first != second).any())


def _find_gaps(parts: FloatArray, tolerance: float) -> _Gaps:
    """Return the gaps narrower than a tolerance, m, between pairs of polygons."""
    first, second = STRtree(parts).query(parts, predicate="dwithin", distance=tolerance)
    is_ordered = first < second
    first = first[is_ordered]
    second = second[is_ordered]
    near = np.unique(np.concatenate([first, second]))
    reach = np.full(len(parts), None, dtype=object)
    reach[near] = shapely.buffer(parts[near], _REACH * tolerance, quad_segs=2)
    # The wall of a pair is the longest piece of the first polygon's boundary that runs along the second one.
    walls = shapely.intersection(shapely.boundary(parts[first]), reach[second])
    walls = np.array([_find_longest(wall) for wall in walls], dtype=object)
    # The width of a gap is measured at three points of its wall.
    widths = np.stack([_measure_distances(walls, parts[second], location) for location in (0.25, 0.5, 0.75)])
    # Where the gaps between four rooms cross, only the corners of diagonally opposite rooms are close to each
    # other. Their wall is short, and there is no gap to close between them.
    is_long = shapely.length(walls) > _MIN_LENGTH * tolerance
    # Parts that touch have no gap between them.
    is_open = widths[1] > 0.0
    # Between parts that are not parallel, there is a wedge-shaped wall instead of a gap.
    is_even = np.ptp(widths, axis=0) <= _MAX_WIDENING * tolerance
    is_gap = is_long & is_open & is_even
    surroundings = shapely.intersection(reach[first[is_gap]], reach[second[is_gap]])
    return _Gaps(surroundings, widths[1, is_gap])


def _find_longest(wall: BaseGeometry) -> BaseGeometry:
    """Return the longest line in a geometry, or an empty line if there is none."""
    lines = [part for part in shapely.get_parts(shapely.line_merge(wall)) if isinstance(part, LineString)]
    return max(lines, key=shapely.length, default=LineString())


def _measure_distances(walls: FloatArray, parts: FloatArray, fraction: float) -> FloatArray:
    """Return the distance, (n,) m, from a point on each wall, at a fraction of its length, to its part."""
    points = shapely.line_interpolate_point(walls, fraction, normalized=True)
    return np.asarray(np.nan_to_num(shapely.distance(points, parts)))


def _find_narrow(area: MultiPolygon, width: float) -> FloatArray:
    """Return the gaps in an area that are narrower than `width`, m."""
    grown = buffer_with_mitres(area, width / 2)
    closed = buffer_with_mitres(grown, -width / 2)
    pieces = shapely.get_parts(shapely.difference(closed, area))
    return np.asarray(pieces[shapely.area(pieces) > GRID_M * GRID_M])


def _fill(area: MultiPolygon, gaps: _Gaps, width: float) -> MultiPolygon:
    """Fill gaps in an area that are narrower than `width`, m."""
    if not len(gaps.widths):
        return area
    around = shapely.union_all(gaps.surroundings)
    fillings = shapely.intersection(shapely.union_all(_find_narrow(area, width)), around)
    fillings = buffer_with_mitres(fillings, _OVERLAP_M)
    return union_on_grid([area, fillings])
