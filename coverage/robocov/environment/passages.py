"""Passages of the free space, where walls face each other, and the widest disc that fits through each."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.arrays import compute_lengths
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment.obstacles import MAX_SAGITTA_M
from robocov.environment.polygons import GRID_M
from robocov.typing import BoolArray, FloatArray, IntArray, Point

MIN_POCKET_AREA_M2 = math.pi * DEFAULT_RADIUS_M**2
"""Minimum area of a part of the free space to which a passage may lead; no robot enters a smaller one."""
_MAX_CRACK_M = 2 * MAX_SAGITTA_M
"""Maximum distance between walls that count as touching. A circle that touches a wall is represented by a
polygon, which may leave a crack."""
_CLOSED_CRACK_M = 1e-9
"""Remaining width of a closed crack, so that walls do not touch in a single point."""
_MITRE_LIMIT = 100.0
"""Mitre limit at which only corners of less than about a degree are cut off."""
_CORNERS_PER_BATCH = 256
"""Maximum number of corners that are examined together, which limits the use of memory."""
_CANDIDATES_PER_BATCH = 512
"""Number of candidates that are examined together, the narrowest first. Most searches end after one batch."""
_FIRST_WIDTH_FRACTION = 1 / 4096
"""Maximum width of the gaps that are searched for first, as a fraction of the diagonal of the free space."""
_COSINE_TOLERANCE = 1e-9
"""Maximum cosine of an angle that counts as a right angle or more."""
_DISC_RELATIVE_TOLERANCE = 1e-9
_DISC_TOLERANCE_M = 1e-12
"""Amounts by which the radii of discs are reduced, relative and absolute. Otherwise, because of rounding
errors, the two walls that a disc touches might lie inside it."""
_DECIMALS = 6
"""Decimal places to which results are rounded: the grid of the derived geometry, `GRID_M`."""


class Gap(NamedTuple):
    """A passage between two walls.

    Attributes
    ----------
    width : float, m
        Diameter of the largest disc that fits through.
    between : pair of (x, y), m
        Points at which the walls face each other.

    See Also
    --------
    find_narrowest_gap : Find the narrowest passage of the free space.
    """

    width: float
    between: tuple[Point, Point]


def find_narrowest_gap(free: MultiPolygon) -> Gap | None:
    """Find the narrowest passage of a free space.

    A passage leads around an obstacle, or to a part of the free space that is larger than both
    `MIN_POCKET_AREA_M2` and the square of the gap's width. Acute corners, and niches that are wider than they
    are deep, are therefore not passages.

    Parameters
    ----------
    free : MultiPolygon, m
        Free space.

    Returns
    -------
    Gap or None
        The narrowest passage. None if there is no passage.

    See Also
    --------
    Gap : A narrow passage.
    check_map : Check a map, for example for passages that are narrower than a robot.

    Examples
    --------
    >>> rooms = shapely.box(0, 0, 10, 4) - shapely.box(4.9, 0, 5.1, 3.2)
    >>> find_narrowest_gap(MultiPolygon([rooms])).width
    0.8
    """
    search = PassageSearch(_close_cracks(free))
    diagonal = math.dist(search.free.bounds[:2], search.free.bounds[2:])
    narrowest: Gap | None = None
    # On most maps, the narrowest gap is far narrower than the map. Search for small widths first, which only
    # compares nearby walls, and double the widths until a gap is found.
    min_width = _MAX_CRACK_M / 2
    max_width = diagonal * _FIRST_WIDTH_FRACTION
    while narrowest is None and min_width < diagonal:
        for corners in search.split_corners():
            limit = max_width if narrowest is None else narrowest.width
            gap = next(search.find_gaps(corners, min_width, limit), None)
            if gap is not None:
                narrowest = gap
        min_width = max_width
        max_width = 2 * max_width
    return narrowest


def find_narrow_gaps(free: MultiPolygon, max_width: float) -> tuple[Gap, ...]:
    """Find all passages of a free space that are narrower than a given width.

    Parameters
    ----------
    free : MultiPolygon, m
        Free space.
    max_width : float, m
        All gaps that are found are narrower, before their widths are rounded.

    Returns
    -------
    tuple of Gap
        The narrowest first. One passage may have several gaps, for example at all corners of a door.
    """
    search = PassageSearch(_close_cracks(free))
    gaps: set[Gap] = set()
    for corners in search.split_corners():
        gaps.update(search.find_gaps(corners, _MAX_CRACK_M / 2, max_width))
    return tuple(sorted(gaps, key=lambda gap: (gap.width, gap.between)))


class FacingPoints(NamedTuple):
    """Pairs of a corner p of the walls and the point q on an edge that is nearest to p.

    Attributes
    ----------
    corners : (k,) int array
        Index of the edge that starts at each corner p.
    edges : (k,) int array
        Index of the edge that contains each point q.
    p, q : (k, 2) arrays, m
        The points of each pair.
    widths : (k,) array, m
        Distance between p and q.
    """

    corners: IntArray
    edges: IntArray
    p: FloatArray
    q: FloatArray
    widths: FloatArray

    def select(self, rows: IntArray | BoolArray) -> FacingPoints:
        """Return some of the pairs.

        Parameters
        ----------
        rows : (r,) int array or (k,) bool array
            Indices of the pairs, or whether to return each pair.

        Returns
        -------
        FacingPoints
            The selected pairs, in the order of `rows`.
        """
        return FacingPoints(
            corners=self.corners[rows],
            edges=self.edges[rows],
            p=self.p[rows],
            q=self.q[rows],
            widths=self.widths[rows],
        )


class PassageSearch:
    """Search for passages between the edges of a free space.

    As a disc grows, it can move along the same routes until its diameter exceeds the width of a gap. At a
    gap, two wall points face each other: the disc whose diameter is the segment between them contains no
    other wall point. At least one of the two points is a reflex corner, where the free space has an interior
    angle of more than 180 degrees.

    Parameters
    ----------
    free : MultiPolygon, m
        Free space, as counter-clockwise polygons, so that it lies to the left of each edge.

    Attributes
    ----------
    free : MultiPolygon, m
        Free space.
    edge_starts, edge_ends : (k, 2) arrays, m
        End points of each edge.
    """

    def __init__(self, free: MultiPolygon) -> None:
        self.free = free
        self._boundary = self.free.boundary
        shapely.prepare(self._boundary)
        shapely.prepare(self.free)
        all_rings = shapely.get_rings(shapely.get_parts(self.free))
        rings = [shapely.get_coordinates(ring)[:-1] for ring in all_rings]
        sizes = np.array([len(ring) for ring in rings], dtype=np.intp)
        # The index of the ring of each edge.
        self._ring_indices = np.repeat(np.arange(len(rings)), sizes)
        self.edge_starts = np.concatenate([np.empty((0, 2)), *rings])
        self.edge_ends = np.concatenate([np.empty((0, 2)), *(np.roll(ring, -1, axis=0) for ring in rings)])
        # The edges of ring r have the indices from `_ring_firsts[r]` to `_ring_stops[r] - 1`.
        self._ring_stops = np.cumsum(sizes)
        self._ring_firsts = self._ring_stops - sizes
        # The index of the edge before each edge on its ring.
        self._previous = np.arange(len(self.edge_starts)) - 1
        self._previous[self._ring_firsts] = self._ring_stops - 1
        # The walls turn right at a reflex corner, so that the cross product of its edges is negative.
        turns = _cross(self.edge_starts - self.edge_starts[self._previous], self.edge_ends - self.edge_starts)
        self._reflex_corners = np.flatnonzero(turns < 0)
        # The tree only needs the bounding boxes of edges, which can be built in one call.
        low = np.minimum(self.edge_starts, self.edge_ends)
        high = np.maximum(self.edge_starts, self.edge_ends)
        self._tree = shapely.STRtree(shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1]))

    def split_corners(self) -> list[IntArray]:
        """Return the reflex corners in groups of bounded size.

        Returns
        -------
        list of (c,) int arrays
            Indices of the edges that start at the corners.
        """
        group_count = math.ceil(len(self._reflex_corners) / _CORNERS_PER_BATCH)
        return np.array_split(self._reflex_corners, max(group_count, 1))

    def find_gaps(self, corners: IntArray, min_width: float, max_width: float) -> Iterator[Gap]:
        """Find the passages at some corners whose width is between two limits.

        Parameters
        ----------
        corners : (c,) int array
            Reflex corners, as returned by `split_corners`.
        min_width, max_width : float, m
            Limits of the width; the first is inclusive.

        Yields
        ------
        Gap
            A passage. The narrowest comes first.
        """
        for facing in self.find_facing_points(corners, min_width, max_width):
            for k in range(len(facing.widths)):
                width = float(facing.widths[k])
                if self._is_passage(facing.corners[k], facing.edges[k], facing.q[k], width):
                    # Adding 0.0 turns -0.0 into 0.0.
                    ends = np.round([facing.p[k], facing.q[k]], _DECIMALS) + 0.0
                    first, second = sorted((x, y) for x, y in ends.tolist())
                    yield Gap(round(width, _DECIMALS), (first, second))

    def find_facing_points(
        self, corners: IntArray, min_width: float, max_width: float
    ) -> Iterator[FacingPoints]:
        """Find pairs of wall points that face each other across free space.

        The disc whose diameter is the segment between the points contains no other wall point.

        Parameters
        ----------
        corners : (c,) int array
            Reflex corners, as returned by `split_corners`.
        min_width, max_width : float, m
            Limits of the distance between the points; the first is inclusive.

        Yields
        ------
        FacingPoints
            Groups of bounded size, the closest pairs first. A pair of two corners is found twice, once from
            each corner.
        """
        candidates = self._find_candidates(corners, min_width, max_width)
        batch_count = max(1, len(candidates.widths) // _CANDIDATES_PER_BATCH)
        for rows in np.array_split(np.arange(len(candidates.widths)), batch_count):
            batch = candidates.select(rows)
            yield batch.select(self._has_empty_disc(batch))

    def _find_candidates(self, corners: IntArray, min_width: float, max_width: float) -> FacingPoints:
        """Return pairs of a corner and an edge whose distance is between two limits, sorted by distance."""
        box_low = self.edge_starts[corners] - max_width
        box_high = self.edge_starts[corners] + max_width
        boxes = shapely.box(box_low[:, 0], box_low[:, 1], box_high[:, 0], box_high[:, 1])
        rows, edges = self._tree.query(boxes)
        # From here on, each array has one row for each pair.
        corners = corners[rows]
        p = self.edge_starts[corners]
        edge_starts = self.edge_starts[edges]
        directions = self.edge_ends[edges] - edge_starts
        fractions = _dot(p - edge_starts, directions) / _dot(directions, directions)
        q = edge_starts + np.clip(fractions, 0.0, 1.0)[:, None] * directions
        offsets = q - p
        widths = compute_lengths(offsets)
        is_candidate = (widths >= min_width) & (widths < max_width)
        # If the angle between the offset and one of the two edges that meet at the corner is less than a
        # right angle, the disc contains part of that edge.
        for other_ends in (self.edge_starts[self._previous[corners]], self.edge_ends[corners]):
            sides = other_ends - p
            side_lengths = compute_lengths(sides)
            is_candidate &= _dot(sides, offsets) <= _COSINE_TOLERANCE * widths * side_lengths
        selected = np.flatnonzero(is_candidate)
        selected = selected[np.argsort(widths[selected], kind="stable")]
        return FacingPoints(corners, edges, p, q, widths).select(selected)

    def _has_empty_disc(self, candidates: FacingPoints) -> BoolArray:
        """Return whether the disc whose diameter is the segment of each pair is in the free space, (k,)."""
        middles = shapely.points((candidates.p + candidates.q) / 2)
        radii = candidates.widths / 2 * (1 - _DISC_RELATIVE_TOLERANCE) - _DISC_TOLERANCE_M
        # Unlike `shapely.distance`, this uses the prepared boundary, which is faster with thousands of walls.
        is_empty: BoolArray = ~shapely.dwithin(self._boundary, middles, radii)
        # A disc that touches no wall may still lie entirely inside an obstacle.
        is_empty[is_empty] = shapely.contains_properly(self.free, middles[is_empty])
        return is_empty

    def _is_passage(self, corner: int, edge: int, q: FloatArray, width: float) -> bool:
        """Return whether the gap from a corner to the point q of an edge leads to more than a pocket.

        A cut along the gap separates part of the free space only if it joins two points of the same ring.
        """
        ring = self._ring_indices[corner]
        if ring != self._ring_indices[edge]:
            return True
        # The points of the ring, starting at the corner. Point q follows after the first `near_count` of
        # them.
        first = self._ring_firsts[ring]
        points = np.roll(self.edge_starts[first : self._ring_stops[ring]], first - corner, axis=0)
        near_count = (edge - corner) % len(points) + 1
        near_side = np.vstack([points[:near_count], q])
        far_side = np.vstack([q, points[near_count:], points[:1]])
        areas = np.array([_compute_ring_area(near_side), _compute_ring_area(far_side)])
        # The outside of a hole has a negative area and is not a pocket.
        pocket_area = areas.min(where=areas > 0, initial=np.inf)
        return bool(pocket_area >= max(MIN_POCKET_AREA_M2, width * width))


def _close_cracks(free: MultiPolygon) -> MultiPolygon:
    """Close the cracks of a free space, which are narrower than `_MAX_CRACK_M`.

    Cracks between walls that nearly touch shrink to a nanometer. Corners of less than a degree are cut off,
    and vertices that deviate from a straight wall by less than a micrometer are removed.
    """
    # Eroding the free space closes the cracks, and dilating it by nearly the same distance restores the rest.
    for distance in (-_MAX_CRACK_M / 2, _MAX_CRACK_M / 2 - _CLOSED_CRACK_M):
        free = free.buffer(distance, join_style="mitre", mitre_limit=_MITRE_LIMIT)
    free = free.simplify(GRID_M)
    return MultiPolygon([shapely.orient_polygons(polygon) for polygon in shapely.get_parts(free)])


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the dot products of two lists of vectors, (k,)."""
    products: FloatArray = np.einsum("kd,kd->k", a, b)
    return products


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross products of two lists of vectors, (k,)."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _compute_ring_area(ring: FloatArray) -> float:
    """Return the area of a ring, m², which is negative if the ring is clockwise."""
    # The shoelace formula. Coordinates relative to a point of the ring keep rounding errors small.
    points = ring - ring[0]
    return float(_cross(points[:-1], points[1:]).sum()) / 2
