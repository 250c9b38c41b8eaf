"""Passages of the free space: where walls face each other, and the widest disc that fits through."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.arrays import Array, BoolArray, IntArray, Point, compute_lengths
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment.obstacles import MAX_SAGITTA_M
from robocov.environment.polygons import GRID_M

MIN_POCKET_AREA_M2 = math.pi * DEFAULT_RADIUS_M**2
"""A gap that leads only to a smaller pocket is not a passage: no robot would go there."""
_MAX_CRACK_M = 2 * MAX_SAGITTA_M
"""Walls closer than this count as touching, because the polygon of a touching circle may leave a crack."""
_FUSED_CRACK_M = 1e-9
"""Remaining width of a closed crack, so that walls do not touch in a single point."""
_MITRE_LIMIT = 100.0
"""Corners of less than about a degree are cut off."""
_CORNERS_AT_ONCE = 256
"""Corners that are examined together; limits the use of memory."""
_CANDIDATES_AT_ONCE = 512
"""Candidates that are examined together, the narrowest first: most searches end after the first batch."""
_FIRST_RANGE_FRACTION = 1 / 4096
"""First range of the search around each corner, as a fraction of the diagonal; it is then doubled."""
_COSINE_TOLERANCE = 1e-9
"""Cosines up to this value count as those of right angles."""
_DISC_RELATIVE_TOLERANCE = 1e-9
_DISC_TOLERANCE_M = 1e-12
"""Discs are smaller by these amounts, so that rounding does not put the two walls that they touch inside."""
_DIGITS = 6
"""Results are rounded to the grid of the derived geometry, a micrometer."""


class Gap(NamedTuple):
    """A passage between two walls.

    Attributes
    ----------
    width : float, m
        Diameter of the largest disc that passes.
    between : pair of (x, y), m
        Points at which the walls face each other.
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
        Counter-clockwise polygons.

    Returns
    -------
    Gap or None
        None if there is no passage.

    Examples
    --------
    >>> rooms = shapely.box(0, 0, 10, 4) - shapely.box(4.9, 0, 5.1, 3.2)
    >>> find_narrowest_gap(MultiPolygon([shapely.orient_polygons(rooms)])).width
    0.8
    """
    search = PassageSearch(_close_cracks(free))
    diagonal = math.dist(search.free.bounds[:2], search.free.bounds[2:])
    narrowest: Gap | None = None
    low = _MAX_CRACK_M / 2
    high = diagonal * _FIRST_RANGE_FRACTION
    # On most maps, the narrowest gap is far narrower than the map: search near each corner first, for widths
    # between `low` and `high`, and double the range until a gap is found.
    while narrowest is None and low < diagonal:
        for corners in search.split_corners():
            limit = high if narrowest is None else narrowest.width
            gap = next(search.list_gaps(corners, low, limit), None)
            if gap is not None:
                narrowest = gap
        low = high
        high = 2 * high
    return narrowest


def find_narrow_gaps(free: MultiPolygon, width: float) -> tuple[Gap, ...]:
    """Find all passages of a free space that are narrower than a width.

    Parameters
    ----------
    free : MultiPolygon, m
        Counter-clockwise polygons.
    width : float, m

    Returns
    -------
    tuple of Gap
        The narrowest first. One passage may have several gaps, for example at all corners of a door.
    """
    search = PassageSearch(_close_cracks(free))
    gaps: set[Gap] = set()
    for corners in search.split_corners():
        gaps.update(search.list_gaps(corners, _MAX_CRACK_M / 2, width))
    return tuple(sorted(gaps, key=lambda gap: (gap.width, gap.between)))


class FacingPoints(NamedTuple):
    """Pairs of a corner p and the nearest point q of an edge.

    Attributes
    ----------
    corner, edge : (k,) int arrays
    p, q : (k, 2) arrays, m
    width : (k,) array, m
        Distance between p and q.
    """

    corner: IntArray
    edge: IntArray
    p: Array
    q: Array
    width: Array

    def select(self, rows: IntArray | BoolArray) -> FacingPoints:
        """Return the pairs in the given rows.

        Parameters
        ----------
        rows : (r,) int array or (k,) bool array

        Returns
        -------
        FacingPoints
        """
        return FacingPoints(
            corner=self.corner[rows],
            edge=self.edge[rows],
            p=self.p[rows],
            q=self.q[rows],
            width=self.width[rows],
        )


class PassageSearch:
    """Search for passages between the edges of a free space, which lies to the left of each edge.

    As a disc grows, it can reach the same points along the same routes until its diameter exceeds the width
    of a gap. At a gap, two wall points face each other, and the disc whose diameter is the segment between
    them contains no other wall point. At least one of the two points is a reflex corner, which juts into the
    free space.

    Parameters
    ----------
    free : MultiPolygon, m
        Counter-clockwise polygons.

    Attributes
    ----------
    free : MultiPolygon, m
    edge_starts, edge_ends : (k, 2) arrays, m
        Ends of each edge.
    """

    def __init__(self, free: MultiPolygon) -> None:
        self.free = free
        self._boundary = self.free.boundary
        shapely.prepare(self._boundary)
        shapely.prepare(self.free)
        all_rings = shapely.get_rings(shapely.get_parts(self.free))
        rings = [shapely.get_coordinates(ring)[:-1] for ring in all_rings]
        sizes = np.array([len(ring) for ring in rings], dtype=np.intp)
        # The ring, the start and the end of each edge.
        self._ring = np.repeat(np.arange(len(rings)), sizes)
        self.edge_starts = np.concatenate([np.empty((0, 2)), *rings])
        self.edge_ends = np.concatenate([np.empty((0, 2)), *(np.roll(ring, -1, axis=0) for ring in rings)])
        # The edges of ring r are `_first[r]` to `_stop[r] - 1`.
        self._stop = np.cumsum(sizes)
        self._first = self._stop - sizes
        # The edge that ends where each edge starts.
        self._previous = np.arange(len(self.edge_starts)) - 1
        self._previous[self._first] = self._stop - 1
        turns = _cross(self.edge_starts - self.edge_starts[self._previous], self.edge_ends - self.edge_starts)
        self._reflex_corners = np.flatnonzero(turns < 0)
        # The index only needs bounding boxes, which can be built in one call.
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
        group_count = math.ceil(len(self._reflex_corners) / _CORNERS_AT_ONCE)
        return np.array_split(self._reflex_corners, max(group_count, 1))

    def list_gaps(self, corners: IntArray, low: float, high: float) -> Iterator[Gap]:
        """Yield the passages at some corners whose width is between `low` and `high`, the narrowest first."""
        for facing in self.find_facing_points(corners, low, high):
            for k in range(len(facing.width)):
                width = float(facing.width[k])
                if self._is_passage(facing.corner[k], facing.edge[k], facing.q[k], width):
                    # Adding zero turns minus zero into zero.
                    ends = np.round([facing.p[k], facing.q[k]], _DIGITS) + 0.0
                    first, second = sorted((x, y) for x, y in ends.tolist())
                    yield Gap(round(width, _DIGITS), (first, second))

    def find_facing_points(self, corners: IntArray, low: float, high: float) -> Iterator[FacingPoints]:
        """Find pairs of wall points that face each other across free space.

        The disc whose diameter is the segment between the points contains no other wall point.

        Parameters
        ----------
        corners : (c,) int array
            Reflex corners, as returned by `split_corners`.
        low, high : float, m
            The distance between the points is between these limits.

        Yields
        ------
        FacingPoints
            Groups of bounded size, the closest pairs first. Two facing corners are found from both of them.
        """
        candidates = self._find_candidates(corners, low, high)
        batch_count = max(1, len(candidates.width) // _CANDIDATES_AT_ONCE)
        for rows in np.array_split(np.arange(len(candidates.width)), batch_count):
            batch = candidates.select(rows)
            yield batch.select(self._has_empty_disc(batch))

    def _find_candidates(self, corners: IntArray, low: float, high: float) -> FacingPoints:
        """Return pairs of a corner and an edge whose distance is between two limits, sorted by distance."""
        box_low = self.edge_starts[corners] - high
        box_high = self.edge_starts[corners] + high
        boxes = shapely.box(box_low[:, 0], box_low[:, 1], box_high[:, 0], box_high[:, 1])
        row, edge = self._tree.query(boxes)
        corner = corners[row]
        p = self.edge_starts[corner]
        edge_start = self.edge_starts[edge]
        along = self.edge_ends[edge] - edge_start
        fraction = _dot(p - edge_start, along) / _dot(along, along)
        q = edge_start + np.clip(fraction, 0.0, 1.0)[:, None] * along
        offset = q - p
        width = compute_lengths(offset)
        is_candidate = (width > low) & (width < high)
        # The disc must not contain part of the two edges that meet at the corner.
        for other_end in (self.edge_starts[self._previous[corner]], self.edge_ends[corner]):
            side = other_end - p
            side_length = compute_lengths(side)
            is_candidate &= _dot(side, offset) <= _COSINE_TOLERANCE * width * side_length
        rows = np.flatnonzero(is_candidate)
        rows = rows[np.argsort(width[rows], kind="stable")]
        return FacingPoints(corner, edge, p, q, width).select(rows)

    def _has_empty_disc(self, candidates: FacingPoints) -> BoolArray:
        """Return whether the disc whose diameter is the segment of each pair is in the free space, (k,)."""
        middles = shapely.points((candidates.p + candidates.q) / 2)
        radii = candidates.width / 2 * (1 - _DISC_RELATIVE_TOLERANCE) - _DISC_TOLERANCE_M
        # Unlike `shapely.distance`, this uses the prepared boundary, which is faster with thousands of walls.
        is_empty: BoolArray = ~shapely.dwithin(self._boundary, middles, radii)
        # A disc that touches no wall may still lie entirely inside an obstacle.
        is_empty[is_empty] = shapely.contains_properly(self.free, middles[is_empty])
        return is_empty

    def _is_passage(self, corner: int, edge: int, q: Array, width: float) -> bool:
        """Return whether the gap from a corner to the point q of an edge leads to more than a pocket.

        A cut along the gap separates part of the free space only if it joins two points of the same ring.
        """
        ring = self._ring[corner]
        if ring != self._ring[edge]:
            return True
        # The points of the ring, starting at the corner; the cut ends after the first `cut` of them.
        first = self._first[ring]
        points = np.roll(self.edge_starts[first : self._stop[ring]], first - corner, axis=0)
        cut = (edge - corner) % len(points) + 1
        near_side = np.vstack([points[:cut], q])
        far_side = np.vstack([q, points[cut:], points[:1]])
        areas = np.array([_compute_ring_area(near_side), _compute_ring_area(far_side)])
        # The outside of a hole has a negative area and is not a pocket.
        pocket_area = areas.min(where=areas > 0, initial=np.inf)
        return bool(pocket_area >= max(MIN_POCKET_AREA_M2, width * width))


def _close_cracks(free: MultiPolygon) -> MultiPolygon:
    """Return the free space without parts that are narrower than `_MAX_CRACK_M`.

    Cracks between walls that nearly touch shrink to a nanometer. Corners of less than a degree are cut off,
    and vertices that deviate from a straight wall by less than a micrometer are removed.
    """
    for distance in (-_MAX_CRACK_M / 2, _MAX_CRACK_M / 2 - _FUSED_CRACK_M):
        free = free.buffer(distance, join_style="mitre", mitre_limit=_MITRE_LIMIT)
    free = free.simplify(GRID_M)
    return MultiPolygon([shapely.orient_polygons(polygon) for polygon in shapely.get_parts(free)])


def _dot(a: Array, b: Array) -> Array:
    """Return the dot products of two lists of vectors, (k,)."""
    products: Array = np.einsum("kd,kd->k", a, b)
    return products


def _cross(a: Array, b: Array) -> Array:
    """Return the cross products of two lists of vectors, (k,)."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _compute_ring_area(ring: Array) -> float:
    """Return the area of a ring, m², negative if it is clockwise."""
    points = ring - ring[0]
    return float(_cross(points[:-1], points[1:]).sum()) / 2
