"""Closing of hairline gaps between outlines of free space.

Rooms that are drawn one by one often miss each other by a rounding error. Such a gap is no wall, but it would
cut the free space apart. A gap between two outlines is closed

- if it is narrower than `robocov.mapfile.models.MIN_SIZE_M`, as no obstacle of a map is that thin, or
- if it is narrower than the snapping tolerance and lies between parts that the file does not connect in
  another way. Where a door leads through it, it is a wall, however thin.

Only gaps between outlines are closed. A slit or a hole that an outline has by itself, a line and an outline
that is solid are drawn on purpose and stay.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, STRtree
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import GRID_M
from robocov.errors import format_count
from robocov.mapfile.models import MIN_SIZE_M
from robocov_app.formats.geometry.polygons import buffer_with_mitres, to_multipolygon, unite

DEFAULT_SNAP_M = 0.01  # thinner than any wall of a building
MAX_DEFAULT_SNAP = 1e-3  # as a fraction of the larger side of a drawing: a table-top arena has thin walls
_OVERLAP_M = 2 * GRID_M  # by how much what fills a gap reaches into what is beside it
_REACH = 1.01  # in tolerances: how far beside an outline its neighbours are looked for
_MIN_LENGTH = 3.0  # of a gap, in tolerances: beside a corner not more than two of them are near
_MAX_WIDENING = 0.25  # by how many tolerances the middle half of a gap may widen


class ClosedGaps(NamedTuple):
    """An area whose gaps were closed, the number of gaps, and the width of the widest, m."""

    area: MultiPolygon
    number: int = 0
    widest: float = 0.0

    def describe(self) -> str:
        """Return a line for the report of an import."""
        width = f"{1000 * self.widest:.2g} mm"
        size = f"{width} wide" if self.number == 1 else f"the widest {width}"
        return f"{format_count(self.number, 'gap')} between outlines closed, {size} (--snap 0 keeps them)"


def compute_default_snap(areas: Sequence[BaseGeometry]) -> float:
    """Return the snapping tolerance, m, for areas where the user gives none."""
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
        Gaps of this width and more stay.

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
    # what is thinner than any obstacle of a map, wherever it is; then what cuts the area apart
    hairlines = _find_gaps(outlines, min(snap, MIN_SIZE_M))
    area = _fill(area, hairlines, min(snap, MIN_SIZE_M))
    cracks = _find_gaps(shapely.get_parts(area), snap)
    area = _fill(area, cracks, snap)
    widths = np.concatenate([hairlines.widths, cracks.widths])
    return ClosedGaps(area, len(widths), float(widths.max(initial=0.0)))


class _Gaps(NamedTuple):
    """The surroundings of gaps, (n,) areas around each, and their widths, (n,) m."""

    surroundings: Array
    widths: Array


def union_on_grid(areas: Sequence[BaseGeometry]) -> MultiPolygon:
    """Return the union of areas, m, to the micrometre."""
    # to unite first and round then takes a tenth of the time
    return to_multipolygon(shapely.set_precision(unite(areas), GRID_M))


def are_edge_to_edge(one: BaseGeometry, other: BaseGeometry, tolerance: float) -> bool:
    """Return whether two areas that do not overlap touch along an edge, or nearly do."""
    if shapely.relate_pattern(one, other, "2********"):
        return False
    wall = shapely.intersection(shapely.boundary(one), shapely.buffer(other, _REACH * tolerance + GRID_M))
    return bool(_find_longest(wall).length > _MIN_LENGTH * tolerance)


def join_line_ends(lines: Sequence[LineString], tolerance: float) -> list[LineString]:
    """Return lines whose ends, where they are nearer to each other than a tolerance, m, meet."""
    if not lines:
        return []
    ends = [shapely.get_point(lines, 0), shapely.get_point(lines, -1)]
    places = np.concatenate(ends)
    one, other = STRtree(places).query(places, predicate="dwithin", distance=tolerance)
    # of all that are near, the first in the file
    first = np.full(len(places), len(places))
    np.minimum.at(first, one, other)
    joined = shapely.get_coordinates(places[first])
    result = []
    for k, line in enumerate(lines):
        points = shapely.get_coordinates(line)
        points[0] = joined[k]
        points[-1] = joined[len(lines) + k]
        result.append(LineString(points))
    return result


def _are_close(outlines: Array, snap: float) -> bool:
    """Return whether any two outlines are nearer to each other than the tolerance."""
    one, other = STRtree(outlines).query(outlines, predicate="dwithin", distance=snap)
    return bool((one != other).any())


def _find_gaps(parts: Array, tolerance: float) -> _Gaps:
    """Return the gaps between any two of some polygons that are narrower than a tolerance all along."""
    one, other = STRtree(parts).query(parts, predicate="dwithin", distance=tolerance)
    first = one < other
    one, other = one[first], other[first]
    near = np.unique(np.concatenate([one, other]))
    reach = np.full(len(parts), None, dtype=object)
    reach[near] = shapely.buffer(parts[near], _REACH * tolerance, quad_segs=2)
    walls = shapely.intersection(shapely.boundary(parts[one]), reach[other])
    walls = np.array([_find_longest(wall) for wall in walls], dtype=object)
    widths = np.stack([_measure_distance(walls, parts[other], place) for place in (0.25, 0.5, 0.75)])
    # where only corners are near, as of rooms across a crossing of gaps, there is nothing to close
    is_gap = shapely.length(walls) > _MIN_LENGTH * tolerance
    # nor where the parts touch, or where a wall between them becomes thicker, as a wedge
    is_gap &= (widths[1] > 0.0) & (np.ptp(widths, axis=0) <= _MAX_WIDENING * tolerance)
    one, other = one[is_gap], other[is_gap]
    return _Gaps(shapely.intersection(reach[one], reach[other]), widths[1, is_gap])


def _find_longest(wall: BaseGeometry) -> BaseGeometry:
    """Return the longest line of a geometry; an empty one where there is none."""
    lines = [part for part in shapely.get_parts(shapely.line_merge(wall)) if isinstance(part, LineString)]
    return max(lines, key=shapely.length, default=LineString())


def _measure_distance(walls: Array, parts: Array, place: float) -> Array:
    """Return the distances, (n,) m, from a place on each wall, as a fraction of its length, to a part."""
    points = shapely.line_interpolate_point(walls, place, normalized=True)
    return np.asarray(np.nan_to_num(shapely.distance(points, parts)))


def _find_narrow(area: MultiPolygon, width: float) -> Array:
    """Return what is not in an area, and narrower than `width`: what a disc of that width cannot reach."""
    grown = buffer_with_mitres(area, width / 2)
    closed = buffer_with_mitres(grown, -width / 2)
    pieces = shapely.get_parts(shapely.difference(closed, area))
    return np.asarray(pieces[shapely.area(pieces) > GRID_M * GRID_M])


def _fill(area: MultiPolygon, gaps: _Gaps, width: float) -> MultiPolygon:
    """Return an area with gaps, none wider than `width`, as a part of it."""
    if not len(gaps.widths):
        return area
    around = shapely.union_all(gaps.surroundings)
    fillings = shapely.intersection(shapely.union_all(_find_narrow(area, width)), around)
    fillings = buffer_with_mitres(fillings, _OVERLAP_M)
    return union_on_grid([area, fillings])
