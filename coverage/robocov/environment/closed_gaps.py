"""Gaps through which a disc does not fit, and the thin bars that close them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.arrays import Array, BoolArray, IntArray, Point, compute_lengths
from robocov.environment.passages import FacingPoints, PassageSearch
from robocov.environment.polygons import GRID_M, extract_polygons

_WIDTH_TOLERANCE_M = 2 * GRID_M
"""A gap may be narrower than the disc by this and still count as wide enough: vertices are rounded."""
_SNAP_DISTANCE_M = 2 * GRID_M
"""An end of a gap this close to a vertex is moved to the vertex."""
_BAR_THICKNESS_M = 3 * GRID_M
"""Thickness of a bar at its middle. No point inside is farther than 2 µm from free space, so that
`Geodesics.snap_to_free_space` accepts it."""
_BAR_DEPTH_M = 3 * GRID_M
"""Length by which a bar extends into a wall beyond a point that is not a vertex. The exact point is not on
the grid, so that a bar which ends there might leave a crack."""
_EDGES_PER_QUARTER = 32
"""Edges per quarter circle of the eroded free space, which deviates from the exact one by 3e-4 of the radius
at corners. Walls with vertices that are finer than 1 % of the radius are simplified by up to that."""
_NO_FACE = -1
"""Used in place of a face if an edge is not on the boundary of any."""


class _Segments(NamedTuple):
    """Segments between wall points that face each other.

    Attributes
    ----------
    start, end : (s, 2) arrays, m
        The start is a vertex of the free space.
    edge : (s,) int array
        The edge of the free space that contains the end.
    ends_at_vertex : (s,) bool array
        Whether the end is a vertex, too.
    width : (s,) array, m
        Length of each segment.
    """

    start: Array
    end: Array
    edge: IntArray
    ends_at_vertex: BoolArray
    width: Array

    def select(self, rows: IntArray | BoolArray) -> _Segments:
        """Return the segments in the given rows."""
        return _Segments(
            start=self.start[rows],
            end=self.end[rows],
            edge=self.edge[rows],
            ends_at_vertex=self.ends_at_vertex[rows],
            width=self.width[rows],
        )


def build_bars(free: MultiPolygon, radius: float) -> list[Polygon]:
    """Build thin bars that close the gaps of a free space through which a disc does not fit.

    Parameters
    ----------
    free : MultiPolygon, m
        Counter-clockwise polygons, with vertices on the grid of `GRID_M`.
    radius : float, m
        Radius of the disc.

    Returns
    -------
    list of Polygon, m
        Triangles of 3 µm height, the narrowest gap first.

    Notes
    -----
    Consider the distance d(x) from each point x of the free space to the nearest wall. A disc of radius r can
    be where d(x) ≥ r. As r shrinks, parts of this area merge only at saddle points of d. At a saddle point,
    two wall points face each other: the disc whose diameter is the segment between them contains no other
    wall point. Cutting the free space along all such segments that are shorter than 2 r therefore separates
    any two points between which a disc cannot move. It does not separate other points, because the distance
    to a wall is less than r everywhere on such a segment.

    Some of the parts that these cuts leave are too small for the disc: niches, and insides of cracks. They
    are joined to their neighbors again, at the widest segments first, unless this would join two parts that
    contain a disc. So what lies in an open niche stays connected to the part in front of it.
    """
    search = PassageSearch(free)
    segments = _find_segments(search, 2.0 * radius - _WIDTH_TOLERANCE_M)
    if segments is None:
        return []
    faces = _split_into_faces(search, segments)
    left_face, right_face = _find_adjacent_faces(faces, segments)
    has_disc = _find_faces_with_disc(faces, free, radius)
    is_closed = _choose_closed_segments(left_face, right_face, has_disc)
    return _build_bars(segments.select(is_closed))


def compute_center_areas(
    free: MultiPolygon, closed: MultiPolygon, clearance: float, edges_per_quarter: int
) -> np.ndarray:
    """Compute where the center of a disc can be in each component of a free space whose gaps are closed.

    Unlike walls, bars need no clearance: a disc in front of a crack may reach into it.

    Parameters
    ----------
    free : MultiPolygon, m
        Free space.
    closed : MultiPolygon, m
        The same free space with closed gaps; the same object if there are none.
    clearance : float, m
        Minimum distance of the center from walls.
    edges_per_quarter : int
        Edges per quarter circle around corners.

    Returns
    -------
    (c,) array of geometries, m
        One area for each component of `closed`, which may be empty.
    """
    areas: np.ndarray = shapely.buffer(np.array(free.geoms), -clearance, quad_segs=edges_per_quarter)
    if closed is free:
        return areas
    parts = shapely.intersection(np.array(closed.geoms), shapely.union_all(areas))
    return np.array([extract_polygons(part) for part in parts], dtype=object)


def _find_segments(search: PassageSearch, max_width: float) -> _Segments | None:
    """Find the segments between facing wall points that are shorter than a width, without crossings.

    The shortest ones come first. A segment between two vertices occurs only once. None if there are none.
    """
    if max_width <= 0.0:
        return None
    found: list[FacingPoints] = []
    for corners in search.split_corners():
        found += search.find_facing_points(corners, 0.0, max_width)
    if sum(len(facing.width) for facing in found) == 0:
        return None
    segments = _snap_ends(search, found)
    # Sort by width, then by coordinates, so that the result does not depend on the order of the rings.
    lower_end = np.minimum(segments.start, segments.end)
    upper_end = np.maximum(segments.start, segments.end)
    keys = (upper_end[:, 1], upper_end[:, 0], lower_end[:, 1], lower_end[:, 0], segments.width)
    segments = segments.select(np.lexsort(keys))
    return _remove_crossings(_remove_duplicates(segments))


def _snap_ends(search: PassageSearch, found: Sequence[FacingPoints]) -> _Segments:
    """Return segments for pairs of facing points, whose ends near a vertex are moved to the vertex."""
    start = np.concatenate([facing.p for facing in found])
    end = np.concatenate([facing.q for facing in found])
    edge = np.concatenate([facing.edge for facing in found])
    ends_at_vertex = np.zeros(len(end), dtype=bool)
    for vertices in (search.edge_starts, search.edge_ends):
        is_near_vertex = compute_lengths(end - vertices[edge]) < _SNAP_DISTANCE_M
        end[is_near_vertex] = vertices[edge[is_near_vertex]]
        ends_at_vertex |= is_near_vertex
    return _Segments(
        start=start,
        end=end,
        edge=edge,
        ends_at_vertex=ends_at_vertex,
        width=compute_lengths(end - start),
    )


def _remove_duplicates(segments: _Segments) -> _Segments:
    """Keep the first of several segments with the same ends, in either order."""
    seen: set[frozenset[Point]] = set()
    rows = []
    for row, ends in enumerate(zip(segments.start.tolist(), segments.end.tolist(), strict=True)):
        pair = frozenset((x, y) for x, y in ends)
        if pair not in seen and len(pair) == 2:
            seen.add(pair)
            rows.append(row)
    return segments.select(np.array(rows, dtype=np.intp))


def _remove_crossings(segments: _Segments) -> _Segments:
    """Remove segments that cross an earlier one.

    Segments cross only if all of their ends are on one circle without a wall inside, whose center is then no
    saddle point.
    """
    lines = _build_lines(segments.start, segments.end)
    first, second = shapely.STRtree(lines).query(lines, predicate="crosses")
    is_kept = np.ones(len(lines), dtype=bool)
    pairs = np.column_stack([first, second])[first < second]
    for earlier, later in pairs[np.lexsort(pairs.T[::-1])].tolist():
        if is_kept[earlier]:
            is_kept[later] = False
    return segments.select(is_kept)


def _build_lines(starts: Array, ends: Array) -> np.ndarray:
    """Return lines between pairs of points, (n,) geometries."""
    lines: np.ndarray = shapely.linestrings(np.stack([starts, ends], axis=1))
    return lines


def _split_into_faces(search: PassageSearch, segments: _Segments) -> np.ndarray:
    """Split the plane along walls and segments; return the bounded faces as counter-clockwise polygons."""
    starts = [segments.start]
    ends = [segments.end]
    is_split = np.zeros(len(search.edge_starts), dtype=bool)
    is_split[segments.edge] = True
    starts.append(search.edge_starts[~is_split])
    ends.append(search.edge_ends[~is_split])
    for edge in np.flatnonzero(is_split).tolist():
        chain = _split_edge(search, edge, segments.end[segments.edge == edge])
        starts.append(chain[:-1])
        ends.append(chain[1:])
    lines = _build_lines(np.concatenate(starts), np.concatenate(ends))
    faces: np.ndarray = shapely.orient_polygons(shapely.get_parts(shapely.polygonize(lines)))
    return faces


def _split_edge(search: PassageSearch, edge: int, points: Array) -> Array:
    """Return an edge as a chain of points that contains the given ones, (k, 2)."""
    start = search.edge_starts[edge]
    end = search.edge_ends[edge]
    chain = np.vstack([start, end, points])
    order = np.argsort((chain - start) @ (end - start), kind="stable")
    chain = chain[order]
    is_new = np.ones(len(chain), dtype=bool)
    is_new[1:] = (chain[1:] != chain[:-1]).any(axis=1)
    return chain[is_new]


def _find_adjacent_faces(faces: np.ndarray, segments: _Segments) -> tuple[IntArray, IntArray]:
    """Find the faces to the left and to the right of each segment, (s,) each.

    Both are `_NO_FACE` if the segment has the same face on both sides.
    """
    rings, face_of_ring = shapely.get_rings(faces, return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    face_by_edge: dict[tuple[float, ...], int] = {}
    starts_edge = np.flatnonzero(ring[1:] == ring[:-1])
    edges = np.hstack([points[starts_edge], points[starts_edge + 1]])
    for edge, face in zip(edges.tolist(), face_of_ring[ring[starts_edge]].tolist(), strict=True):
        face_by_edge[tuple(edge)] = face
    forward = np.hstack([segments.start, segments.end]).tolist()
    backward = np.hstack([segments.end, segments.start]).tolist()
    left_face = np.array([face_by_edge.get(tuple(edge), _NO_FACE) for edge in forward], dtype=np.intp)
    right_face = np.array([face_by_edge.get(tuple(edge), _NO_FACE) for edge in backward], dtype=np.intp)
    return left_face, right_face


def _find_faces_with_disc(faces: np.ndarray, free: MultiPolygon, radius: float) -> BoolArray:
    """Return whether the center of a disc can be in each face, (f,)."""
    centers = shapely.get_parts(free.buffer(-radius, quad_segs=_EDGES_PER_QUARTER))
    # Each component of the possible centers is in one face: they keep the radius from walls, while each point
    # of a segment is closer to a wall than that.
    points = shapely.point_on_surface(centers)
    _, face = shapely.STRtree(faces).query(points, predicate="intersects")
    has_disc = np.zeros(len(faces), dtype=bool)
    has_disc[face] = True
    return has_disc


def _choose_closed_segments(left_face: IntArray, right_face: IntArray, has_disc: BoolArray) -> BoolArray:
    """Choose the segments that stay closed, (s,); the shortest segments come first.

    Faces without a disc are joined to their neighbors at the widest segments. A segment stays closed if it
    would join two faces that contain a disc, or a face to itself around an obstacle.
    """
    # Joined faces have the same group.
    group = np.arange(len(has_disc))
    group_has_disc = has_disc.copy()
    is_closed = np.ones(len(left_face), dtype=bool)
    for k in reversed(range(len(left_face))):
        if left_face[k] == _NO_FACE or right_face[k] == _NO_FACE:
            continue
        left = group[left_face[k]]
        right = group[right_face[k]]
        if left == right or (group_has_disc[left] and group_has_disc[right]):
            continue
        is_closed[k] = False
        group[group == right] = left
        group_has_disc[left] |= group_has_disc[right]
    return is_closed


def _build_bars(segments: _Segments) -> list[Polygon]:
    """Build a thin triangle along each segment.

    At vertices, it touches the wall only in a point, so that it does not stick out at acute corners.
    """
    along = (segments.end - segments.start) / segments.width[:, None]
    across = np.column_stack([-along[:, 1], along[:, 0]])
    extension = np.where(segments.ends_at_vertex, 0.0, _BAR_DEPTH_M)
    end = segments.end + extension[:, None] * along
    apex = (segments.start + segments.end) / 2.0 + _BAR_THICKNESS_M * across
    triangles = np.stack([segments.start, end, apex], axis=1)
    return list(shapely.polygons(triangles))
