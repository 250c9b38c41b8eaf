"""Gaps through which a disc does not fit, and the thin bars that close them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.arrays import compute_lengths
from robocov.environment.passages import FacingPoints, PassageSearch
from robocov.environment.polygons import GRID_M, extract_polygons
from robocov.typing import BoolArray, FloatArray, IntArray, Point

_WIDTH_TOLERANCE_M = 2 * GRID_M
"""Maximum difference by which a gap may be narrower than the disc and still stay open. Vertices are rounded,
so that the width of a gap is not exact."""
_SNAP_DISTANCE_M = 2 * GRID_M
"""Distance from a vertex within which the end of a segment is moved to the vertex."""
_BAR_THICKNESS_M = 3 * GRID_M
"""Thickness of a bar at its middle. All points of a bar are within 2 µm of free space, so that
`Geodesics.snap_to_free_space` accepts points in bars."""
_BAR_DEPTH_M = 3 * GRID_M
"""Length by which a bar extends into a wall if it does not end at a vertex. The exact point on the wall is
not on the grid, and a bar that ended there might leave a crack."""
_EDGES_PER_QUARTER = 32
"""Edges per quarter circle around corners when the free space is eroded. They are closer to the corner than
the circle by at most 3e-4 of the radius, which is less than the gap between robot and wall. GEOS also
simplifies walls with closely spaced vertices, by up to 1% of the radius."""
_NO_FACE = -1
"""Used in place of the index of a face if there is none."""


class _Segments(NamedTuple):
    """Segments between wall points that face each other.

    Attributes
    ----------
    starts, ends : (s, 2) arrays, m
        End points of each segment. The start is a vertex of the free space.
    edges : (s,) int array
        Index of the edge of the free space that contains the end.
    ends_at_vertex : (s,) bool array
        Whether the end is a vertex, too.
    widths : (s,) array, m
        Length of each segment.
    """

    starts: FloatArray
    ends: FloatArray
    edges: IntArray
    ends_at_vertex: BoolArray
    widths: FloatArray

    def select(self, rows: IntArray | BoolArray) -> _Segments:
        """Return the segments in the given rows."""
        return _Segments(
            starts=self.starts[rows],
            ends=self.ends[rows],
            edges=self.edges[rows],
            ends_at_vertex=self.ends_at_vertex[rows],
            widths=self.widths[rows],
        )


def build_bars(free: MultiPolygon, radius: float) -> list[Polygon]:
    """Build thin bars that close the gaps of a free space through which a disc does not fit.

    Parameters
    ----------
    free : MultiPolygon, m
        Free space, as counter-clockwise polygons with vertices on the grid of `GRID_M`.
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

    The cuts divide the free space into parts. Some parts, such as niches and the insides of cracks, are too
    small for the disc. They are joined to their neighbors again, at the widest segments first, unless this
    would join two parts that contain a disc. Points in a niche thus stay connected to the part in front of
    it.
    """
    search = PassageSearch(free)
    segments = _find_segments(search, 2.0 * radius - _WIDTH_TOLERANCE_M)
    if segments is None:
        return []
    faces = _split_into_faces(search, segments)
    left_faces, right_faces = _find_adjacent_faces(faces, segments)
    has_disc = _find_faces_with_disc(faces, free, radius)
    is_closed = _choose_closed_segments(left_faces, right_faces, has_disc)
    return _build_bars(segments.select(is_closed))


def compute_center_areas(
    free: MultiPolygon,
    closed: MultiPolygon,
    clearance: float,
    edges_per_quarter: int = _EDGES_PER_QUARTER,
) -> np.ndarray:
    """Compute the area where the center of a disc can be in each component of a free space with closed gaps.

    The center must keep a clearance from walls, but not from the bars that close gaps: a disc in front of a
    crack may extend into the crack.

    Parameters
    ----------
    free : MultiPolygon, m
        Free space with open gaps.
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
    """Find the segments between facing wall points that are shorter than a width, the shortest ones first.

    No two segments are equal or cross each other. Return None if there are no segments.
    """
    if max_width <= 0.0:
        return None
    found: list[FacingPoints] = []
    for corners in search.split_corners():
        found += search.find_facing_points(corners, 0.0, max_width)
    if sum(len(facing.widths) for facing in found) == 0:
        return None
    segments = _snap_ends(search, found)
    # Sort by width, then by coordinates, so that the result does not depend on the order of the rings.
    low = np.minimum(segments.starts, segments.ends)
    high = np.maximum(segments.starts, segments.ends)
    # `lexsort` sorts by the last key first.
    keys = (high[:, 1], high[:, 0], low[:, 1], low[:, 0], segments.widths)
    segments = segments.select(np.lexsort(keys))
    return _remove_crossings(_remove_duplicates(segments))


def _snap_ends(search: PassageSearch, found: Sequence[FacingPoints]) -> _Segments:
    """Return the segments between facing points; ends near a vertex are moved to the vertex."""
    starts = np.concatenate([facing.p for facing in found])
    ends = np.concatenate([facing.q for facing in found])
    edges = np.concatenate([facing.edges for facing in found])
    ends_at_vertex = np.zeros(len(ends), dtype=bool)
    for vertices in (search.edge_starts, search.edge_ends):
        is_near_vertex = compute_lengths(ends - vertices[edges]) < _SNAP_DISTANCE_M
        ends[is_near_vertex] = vertices[edges[is_near_vertex]]
        ends_at_vertex |= is_near_vertex
    return _Segments(
        starts=starts,
        ends=ends,
        edges=edges,
        ends_at_vertex=ends_at_vertex,
        widths=compute_lengths(ends - starts),
    )


def _remove_duplicates(segments: _Segments) -> _Segments:
    """Remove segments of length 0, and those with the same two ends as an earlier segment."""
    seen: set[frozenset[Point]] = set()
    rows = []
    for row, ends in enumerate(zip(segments.starts.tolist(), segments.ends.tolist(), strict=True)):
        distinct_ends = frozenset((x, y) for x, y in ends)
        if distinct_ends not in seen and len(distinct_ends) == 2:
            seen.add(distinct_ends)
            rows.append(row)
    return segments.select(np.array(rows, dtype=np.intp))


def _remove_crossings(segments: _Segments) -> _Segments:
    """Remove segments that cross an earlier one that remains.

    Two segments cross only if all four ends are on one circle without a wall inside. The center of this
    circle is then not a saddle point of the distance to walls, and the second segment is not needed.
    """
    lines = _build_lines(segments.starts, segments.ends)
    first, second = shapely.STRtree(lines).query(lines, predicate="crosses")
    is_kept = np.ones(len(lines), dtype=bool)
    pairs = np.column_stack([first, second])[first < second]
    in_order = np.lexsort(pairs.T[::-1])
    for earlier, later in pairs[in_order].tolist():
        if is_kept[earlier]:
            is_kept[later] = False
    return segments.select(is_kept)


def _build_lines(starts: FloatArray, ends: FloatArray) -> np.ndarray:
    """Return lines between pairs of points, (n,) geometries."""
    lines: np.ndarray = shapely.linestrings(np.stack([starts, ends], axis=1))
    return lines


def _split_into_faces(search: PassageSearch, segments: _Segments) -> np.ndarray:
    """Split the plane along walls and segments; return the bounded faces as counter-clockwise polygons."""
    # Lines may only meet at their ends. An edge on which segments end is therefore split at these points.
    is_split = np.zeros(len(search.edge_starts), dtype=bool)
    is_split[segments.edges] = True
    starts = [segments.starts, search.edge_starts[~is_split]]
    ends = [segments.ends, search.edge_ends[~is_split]]
    for edge in np.flatnonzero(is_split).tolist():
        chain = _split_edge(search, edge, segments.ends[segments.edges == edge])
        starts.append(chain[:-1])
        ends.append(chain[1:])
    lines = _build_lines(np.concatenate(starts), np.concatenate(ends))
    faces: np.ndarray = shapely.orient_polygons(shapely.get_parts(shapely.polygonize(lines)))
    return faces


def _split_edge(search: PassageSearch, edge: int, points: FloatArray) -> FloatArray:
    """Split an edge at given points; return its points from start to end, (k, 2) m."""
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
    # Faces are counter-clockwise, so that each face is to the left of its edges. `face_by_edge` contains this
    # face for the coordinates (x, y) of the start and of the end of each edge.
    rings, ring_faces = shapely.get_rings(faces, return_index=True)
    points, point_rings = shapely.get_coordinates(rings, return_index=True)
    face_by_edge: dict[tuple[float, ...], int] = {}
    edge_indices = np.flatnonzero(point_rings[1:] == point_rings[:-1])
    edges = np.hstack([points[edge_indices], points[edge_indices + 1]])
    edge_faces = ring_faces[point_rings[edge_indices]]
    for edge, face in zip(edges.tolist(), edge_faces.tolist(), strict=True):
        face_by_edge[tuple(edge)] = face
    forward_edges = np.hstack([segments.starts, segments.ends]).tolist()
    backward_edges = np.hstack([segments.ends, segments.starts]).tolist()
    left_faces = np.array([face_by_edge.get(tuple(edge), _NO_FACE) for edge in forward_edges], dtype=np.intp)
    right_faces = np.array(
        [face_by_edge.get(tuple(edge), _NO_FACE) for edge in backward_edges], dtype=np.intp
    )
    return left_faces, right_faces


def _find_faces_with_disc(faces: np.ndarray, free: MultiPolygon, radius: float) -> BoolArray:
    """Return whether the center of a disc can be in each face, (f,)."""
    centers = shapely.get_parts(free.buffer(-radius, quad_segs=_EDGES_PER_QUARTER))
    # Each component of the possible centers is in one face: the centers keep the radius from walls, while
    # every point of a segment is nearer to a wall.
    points = shapely.point_on_surface(centers)
    _, face_indices = shapely.STRtree(faces).query(points, predicate="intersects")
    has_disc = np.zeros(len(faces), dtype=bool)
    has_disc[face_indices] = True
    return has_disc


def _choose_closed_segments(left_faces: IntArray, right_faces: IntArray, has_disc: BoolArray) -> BoolArray:
    """Choose the segments that stay closed, (s,), from segments in the order of length.

    Faces without a disc are joined to their neighbors, at the longest segments first. A segment stays closed
    if it would join two groups of faces that contain a disc, or a group to itself around an obstacle.
    """
    # The group of each face. Joined faces have the same group.
    groups = np.arange(len(has_disc))
    group_has_disc = has_disc.copy()
    is_closed = np.ones(len(left_faces), dtype=bool)
    for k in reversed(range(len(left_faces))):
        if left_faces[k] == _NO_FACE or right_faces[k] == _NO_FACE:
            continue
        left = groups[left_faces[k]]
        right = groups[right_faces[k]]
        if left == right or (group_has_disc[left] and group_has_disc[right]):
            continue
        is_closed[k] = False
        groups[groups == right] = left
        group_has_disc[left] |= group_has_disc[right]
    return is_closed


def _build_bars(segments: _Segments) -> list[Polygon]:
    """Build a thin triangle along each segment.

    At vertices, a triangle touches the wall only in a point, so that it does not extend through the wall at
    acute corners.
    """
    directions = (segments.ends - segments.starts) / segments.widths[:, None]
    normals = np.column_stack([-directions[:, 1], directions[:, 0]])
    extensions = np.where(segments.ends_at_vertex, 0.0, _BAR_DEPTH_M)
    ends = segments.ends + extensions[:, None] * directions
    apexes = (segments.starts + segments.ends) / 2.0 + _BAR_THICKNESS_M * normals
    triangles = np.stack([segments.starts, ends, apexes], axis=1)
    return list(shapely.polygons(triangles))
