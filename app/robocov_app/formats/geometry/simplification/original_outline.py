"""The outline of a free space before simplification, and simplified outlines with fewer vertices."""

from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon, STRtree

from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.formats.geometry.cells.vectorize import NECK
from robocov_app.formats.geometry.polygons import buffer_with_mitres
from robocov_app.formats.geometry.simplification.ring_vertices import RingVertices
from robocov_app.formats.geometry.simplification.stairs import fit_walls, replace_stairs
from robocov_app.formats.geometry.vectors import compute_dot

_MAX_AREA_LOSS = 0.02
"""If the area of a ring changes by more than this fraction, it is restored."""
_FULL_TOLERANCE_SIZE = 16
"""Rings as large as a square with a side of this many tolerances get the full tolerance, others less."""
_MIN_TOLERANCE_CELLS = 0.4
"""Minimum tolerance, in cells, even for the smallest rings."""
_MAX_RIGHT_ANGLE_COSINE = 1e-5
_MAX_LINE_VERTICES = 1024
"""Maximum number of vertices between two fixed ones, which limits the recursion depth of Douglas-Peucker."""
_MAX_THIN_WIDTH = 1.5
"""Maximum width of a thin part, in tolerances."""
_MIN_THIN_LENGTH = 2.5
"""Minimum length of a thin part, in tolerances; shorter ones are bumps."""
_MIN_THIN_WIDTH = 0.01
"""Minimum width of a thin part, in tolerances; narrower ones are rounding errors."""
_REACH_M = 1e-9
"""Maximum distance of a thin part from its vertices: the rounding errors of the morphological operations."""
_REACH_NECKS = 1.5
"""The same distance in outlines of cells, relative to the side of a neck, because corners replace necks."""
_MAX_THIN_VERTICES = 80_000
"""Maximum number of vertices for which thin parts are searched, because the search takes long."""


class ThinParts(NamedTuple):
    """Parts of a free space, or of the solid space around it, about as thin as the tolerance.

    Attributes
    ----------
    areas : (n,) array, m²
    vertex, part : (m,) arrays of int
        Pairs of a vertex of the outline and the part that it belongs to.
    """

    areas: FloatArray
    vertex: IntArray
    part: IntArray


class OriginalOutline(RingVertices):
    """The outline of polygons, with all their vertices.

    Parameters
    ----------
    polygons : list of Polygon, m
    cell : float or None, m
        Longer side of the cells, if the polygons are an outline of cells. The necks between obstacles that
        touch are then replaced by single corners.

    Attributes
    ----------
    owner : (r,) array of int
        Polygon of each ring; the outer ring of a polygon comes first.
    is_neck : (k,) array of bool
        Whether a vertex replaces a neck.
    cell : float or None, m
    """

    def __init__(self, polygons: list[Polygon], cell: float | None) -> None:
        lines, owner = shapely.get_rings(polygons, return_index=True)
        points, ring = shapely.get_coordinates(lines, return_index=True)
        # Drop the last vertex of each ring, which repeats the first one.
        is_closing = np.append(ring[1:] != ring[:-1], True)
        points = points[~is_closing]
        ring = ring[~is_closing]
        starts = np.searchsorted(ring, np.arange(len(lines)))
        rings = RingVertices(points, starts, np.arange(len(points), dtype=float))
        is_neck = np.zeros(len(points), dtype=bool)
        if cell is not None:
            rings, is_neck = _remove_necks(rings, cell)
        super().__init__(rings.points, rings.starts, rings.source)
        self.owner = owner
        self.is_neck = is_neck
        self.cell = cell

    def simplify_outline(self, tolerance: FloatArray, is_fixed: BoolArray) -> RingVertices:
        """Simplify the outline by the algorithm of Douglas and Peucker.

        Parameters
        ----------
        tolerance : (k,) array, m
            Tolerance at each vertex; a vertex with tolerance 0 stays.
        is_fixed : (k,) array of bool
            Vertices that stay; where a midpoint has replaced them, the midpoint stays.

        Returns
        -------
        RingVertices
        """
        path: RingVertices = self
        if self.cell is not None:
            path = replace_stairs(self, self.cell, tolerance)
        allowed = tolerance[path.vertex]
        is_midpoint = path.source != path.vertex
        is_kept = is_fixed[path.vertex] | (is_midpoint & is_fixed[self.after[path.vertex]])
        is_kept |= path.find_extremes() | (allowed == 0.0)
        is_kept |= np.arange(len(allowed)) % _MAX_LINE_VERTICES == 0
        # Small rings get a smaller tolerance, because they have few corners to lose.
        min_tolerance = 0.0 if self.cell is None else _MIN_TOLERANCE_CELLS * self.cell
        max_tolerance = np.maximum(np.sqrt(np.abs(self.areas)) / _FULL_TOLERANCE_SIZE, min_tolerance)
        kept, starts = path.simplify(allowed, is_kept, max_tolerance)
        simplified = RingVertices(path.points[kept], starts, path.source[kept])
        if self.cell is None:
            return simplified
        return fit_walls(path, kept, simplified, allowed[kept])

    def restore_areas(self, simplified: RingVertices, tolerance: FloatArray) -> RingVertices:
        """Restore the original area of the rings of a simplified outline that have lost or gained much of it.

        All sides of such a ring move by the same distance, at most half the tolerance. Small round obstacles
        need this: with few corners, all of them on the circle, they would shrink.
        """
        areas_before = self.areas
        areas_after = simplified.areas
        has_changed = np.abs(areas_after - areas_before) > _MAX_AREA_LOSS * np.abs(areas_before)
        # Rings that lost more than half of their area, or changed orientation, are not restored.
        has_changed &= 2 * areas_after * np.sign(areas_before) > np.abs(areas_before)
        if not has_changed.any():
            return simplified
        side = simplified.sides
        length = simplified.lengths
        # The outside of a counter-clockwise ring is to the right of its sides.
        normal = np.column_stack([side[:, 1], -side[:, 0]]) / np.maximum(length, 1e-300)[:, None]
        perimeter = np.maximum(np.add.reduceat(length, simplified.starts), 1e-300)
        max_distance = tolerance[simplified.vertex] / 2
        ring_distance = np.where(has_changed, (areas_before - areas_after) / perimeter, 0.0)
        distance = np.clip(ring_distance[simplified.ring], -max_distance, max_distance)
        both_normals = normal + normal[simplified.before]
        # A corner moves farther than its sides: a sharp one moves up to twice as far.
        scale = distance / np.maximum(compute_dot(both_normals, both_normals) / 2, 0.5)
        return RingVertices(
            simplified.points + scale[:, None] * both_normals, simplified.starts, simplified.source
        )

    def restore_necks(self, simplified: RingVertices) -> RingVertices:
        """Insert the necks of the outline into a simplified outline.

        The ``source`` of the result refers to the vertices of `simplified`.
        """
        points = simplified.points
        is_neck = self.is_neck[simplified.vertex] & (simplified.source == simplified.vertex)
        if self.cell is None or not is_neck.any():
            return RingVertices(points, simplified.starts, np.arange(len(points), dtype=float))
        doubled = np.arange(len(points)).repeat(1 + is_neck)
        is_second = np.append(False, doubled[1:] == doubled[:-1])
        neighbor = np.where(is_second, simplified.after[doubled], simplified.before[doubled])
        vector = points[neighbor] - points[doubled]
        length = np.maximum(np.hypot(*vector.T), 1e-300)
        # A neck takes at most 0.4 of a side, so that the necks at both of its ends do not meet.
        fraction = np.where(is_neck[doubled], np.minimum(NECK * self.cell / length, 0.4), 0.0)
        starts = np.searchsorted(doubled, simplified.starts)
        return RingVertices(points[doubled] + fraction[:, None] * vector, starts, doubled.astype(float))

    @cached_property
    def walls(self) -> STRtree:
        """Search tree of the sides of all rings."""
        return STRtree(shapely.linestrings(self.endpoints))

    def limit_movement(self, simplified: RingVertices, tolerance: FloatArray) -> RingVertices:
        """Move simplified vertices back to their origin if they are farther from all walls than allowed."""
        vertex = simplified.vertex
        # A source of k + 0.5 is the midpoint of the side after vertex k.
        half = (simplified.source % 1.0)[:, None]
        origin = (1.0 - half) * self.points[vertex] + half * self.points[self.after[vertex]]
        moved = np.flatnonzero((simplified.points != origin).any(axis=1))
        positions = shapely.points(simplified.points[moved])
        _, distance = self.walls.query_nearest(positions, return_distance=True, all_matches=False)
        too_far = moved[distance > tolerance[vertex[moved]]]
        points = simplified.points.copy()
        points[too_far] = origin[too_far]
        return RingVertices(points, simplified.starts, simplified.source)

    def find_thin_parts(self, free: MultiPolygon, tolerance: float) -> ThinParts:
        """Find the thin parts of a free space and of the solid space around it.

        Parameters
        ----------
        free : MultiPolygon, m
            The free space whose outline this is.
        tolerance : float, m

        Returns
        -------
        ThinParts
        """
        if len(self.points) > _MAX_THIN_VERTICES:
            return ThinParts(np.empty(0), np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp))
        radius = _MAX_THIN_WIDTH * tolerance / 2
        closed = buffer_with_mitres(buffer_with_mitres(free, radius), -radius)
        opened = buffer_with_mitres(buffer_with_mitres(free, -radius), radius)
        thin = [shapely.difference(closed, free), shapely.difference(free, opened)]
        # Twice, because a difference may be a collection that contains multipolygons.
        pieces = shapely.get_parts(shapely.get_parts(thin))
        x, y, right, top = shapely.bounds(pieces).T
        is_long = np.maximum(right - x, top - y) > _MIN_THIN_LENGTH * tolerance
        is_rounding = shapely.area(pieces) < _MIN_THIN_WIDTH * tolerance * shapely.length(pieces)
        pieces = pieces[is_long & ~is_rounding]
        reach = _REACH_M
        if self.cell is not None:
            reach = _REACH_NECKS * NECK * self.cell
        part, vertex = STRtree(shapely.points(self.points)).query(pieces, "dwithin", distance=reach)
        return ThinParts(np.asarray(shapely.area(pieces)), vertex, part)

    def to_polygons(self, simplified: RingVertices) -> MultiPolygon:
        """Return the polygons of this outline after simplification, m. They may be invalid."""
        rings = shapely.linearrings(simplified.points, indices=simplified.ring)
        return MultiPolygon(list(shapely.polygons(rings, indices=self.owner)))


def _remove_necks(rings: RingVertices, cell: float) -> tuple[RingVertices, BoolArray]:
    """Replace each neck, a short side between two perpendicular ones, by the corner where these would meet.

    Returns
    -------
    rings : RingVertices
    is_neck : (k,) array of bool
        Which vertices replace a neck.
    """
    before = rings.before
    after_next = rings.after[rings.after]
    length = rings.lengths
    direction = rings.sides[before] / np.maximum(length[before], 1e-300)[:, None]
    is_neck = np.abs(compute_dot(direction, direction[after_next])) < _MAX_RIGHT_ANGLE_COSINE
    is_neck &= length < np.minimum(length[before], length[rings.after])
    # A neck is the diagonal of a square of side NECK, in cells; the factor allows for rounding.
    is_neck &= length < 1.001 * np.sqrt(2) * NECK * cell
    corner = rings.points + compute_dot(rings.sides, direction)[:, None] * direction
    points = np.where(is_neck[:, None], corner, rings.points)
    is_kept = ~is_neck[before]
    ring = rings.ring[is_kept]
    starts = np.searchsorted(ring, np.arange(len(rings.starts)))
    return RingVertices(points[is_kept], starts, rings.source[: is_kept.sum()]), is_neck[is_kept]
