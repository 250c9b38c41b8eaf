"""Checks that a simplified outline keeps its areas, crosses nothing, and leaves gaps open."""

from collections import Counter

import numpy as np
import shapely
from shapely import MultiPolygon, STRtree

from robocov.arrays import concatenate_ranges, find_run_starts
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.formats.geometry.simplification.narrow_gaps import find_closed_gaps
from robocov_app.formats.geometry.simplification.original_outline import OriginalOutline, ThinParts
from robocov_app.formats.geometry.simplification.ring_vertices import RingVertices
from robocov_app.formats.geometry.vectors import compute_cross, compute_dot

MAX_OUTLINE_CHANGE = 0.1
"""Fraction by which the area of an outline, or of a thin part, may change."""
MAX_AREA_CHANGE = 0.02
"""Fraction by which the whole free area may change."""
_THIN_AREA_SLACK = 0.5
"""Area by which a thin part may change in addition to `MAX_OUTLINE_CHANGE`, in squared tolerances."""


class SimplificationCheck:
    """Checks of a simplified outline. The results are masks of the outline's k vertices.

    Parameters
    ----------
    outline : OriginalOutline
    simplified : RingVertices
    allowed : (k,) array, m
        Tolerance at each vertex of the outline; 0 where it must stay.
    tolerance : float, m
        The initial tolerance, which applies where no problem has been found so far.
    width : float, m
        Diameter of a robot.
    problems : Counter
        Counts problems by kind, where the tolerance is still the initial one.

    Attributes
    ----------
    side_of_vertex : (k,) array of int
        Side of the simplified outline that represents each original vertex, as the index of its start.
    """

    def __init__(
        self,
        outline: OriginalOutline,
        simplified: RingVertices,
        *,
        allowed: FloatArray,
        tolerance: float,
        width: float,
        problems: Counter[str],
    ) -> None:
        self.outline = outline
        self.simplified = simplified
        self.allowed = allowed
        self.tolerance = tolerance
        self.width = width
        self.problems = problems
        self.side_of_vertex = self._assign_sides()

    def _assign_sides(self) -> IntArray:
        """Return, for each vertex of the outline, the side of the simplified outline that represents it."""
        simplified = self.simplified
        ring = self.outline.ring
        order = np.argsort(simplified.source, kind="stable")
        index = np.searchsorted(simplified.source[order], np.arange(len(ring)), side="right") - 1
        # The vertex before the first one of a ring is its last one.
        last = simplified.starts + simplified.size - 1
        return np.asarray(order[np.where(index < simplified.starts[ring], last[ring], index)])

    def find_area_and_distance_errors(self) -> tuple[BoolArray, BoolArray]:
        """Find vertices of rings whose area has changed too much, and vertices too far from the outline.

        Returns
        -------
        has_wrong_area : (k,) array of bool
            Vertices of rings whose area has changed too much.
        is_too_far : (k,) array of bool
            Vertices beyond the tolerance. Of those that one side represents, only the farthest is marked.
        """
        allowed = self.allowed
        is_too_far = self._find_distant_vertices()
        areas_before = self.outline.areas
        areas_after = self.simplified.areas
        ring = self.outline.ring
        has_changed = np.abs(areas_after - areas_before) > MAX_OUTLINE_CHANGE * np.abs(areas_before)
        fresh_rings = np.unique(ring[allowed == self.tolerance])
        self.problems["outline"] += int(np.count_nonzero(has_changed[fresh_rings]))
        has_wrong_area = has_changed[ring] & (allowed > 0.0)
        total_change = abs(areas_after.sum() - areas_before.sum())
        if (
            not (has_wrong_area.any() or is_too_far.any())
            and total_change > MAX_AREA_CHANGE * areas_before.sum()
        ):
            self.problems["area"] += 1
            has_wrong_area = allowed > 0.0
        return has_wrong_area, is_too_far

    def _find_distant_vertices(self) -> BoolArray:
        """Mark the farthest vertex represented by each side if its distance exceeds the tolerance."""
        simplified = self.simplified
        points = self.outline.points
        allowed = self.allowed
        distance = np.full(len(points), np.inf)
        # Next to a restored corner, the preceding or the following side may be closer.
        represented = self.side_of_vertex
        for side in (represented, simplified.before[represented], simplified.after[represented]):
            start = simplified.points[side]
            vector = simplified.sides[side]
            parameter = compute_dot(points - start, vector)
            parameter = parameter / np.maximum(compute_dot(vector, vector), 1e-300)
            foot = start + np.clip(parameter, 0.0, 1.0)[:, None] * vector
            distance = np.minimum(distance, np.hypot(*(points - foot).T))
        by_distance = np.lexsort((-distance, self.side_of_vertex))
        farthest = by_distance[find_run_starts(self.side_of_vertex[by_distance])]
        is_too_far = np.zeros(len(distance), dtype=bool)
        is_too_far[farthest] = distance[farthest] > allowed[farthest] * (1 + 1e-9)
        return is_too_far & (allowed > 0.0)

    def find_thin_part_errors(self, thin: ThinParts) -> BoolArray:
        """Find the vertices of thin parts whose area has changed too much."""
        has_wrong_area = np.zeros(len(self.outline.points), dtype=bool)
        if not len(thin.areas):
            return has_wrong_area
        changes = self._measure_area_changes()
        # A side is counted once, even if it represents several vertices of a part.
        pairs = np.unique(np.column_stack([thin.part, self.side_of_vertex[thin.vertex]]), axis=0)
        change = np.bincount(pairs[:, 0], changes[pairs[:, 1]], minlength=len(thin.areas))
        limit = MAX_OUTLINE_CHANGE * thin.areas + _THIN_AREA_SLACK * self.tolerance**2
        has_changed = np.abs(change) > limit
        vertex = thin.vertex[has_changed[thin.part]]
        part = thin.part[has_changed[thin.part]]
        self.problems["thin part"] += len(np.unique(part[self.allowed[vertex] == self.tolerance]))
        has_wrong_area[vertex] = True
        return has_wrong_area & (self.allowed > 0.0)

    def _measure_area_changes(self) -> FloatArray:
        """Return the change in area of its ring caused by each side of the simplified outline, (m,) m².

        This is the signed area between the side and the run of the outline that it represents. Summed over a
        ring, it is the total change of the ring's area.
        """
        outline = self.outline
        simplified = self.simplified
        first = simplified.vertex
        last = simplified.vertex[simplified.after]
        # Areas along the outline are summed up from the first vertex of each ring. A run that passes this
        # vertex also needs the sum over the whole ring.
        local = outline.points - outline.points[outline.starts[outline.ring]]
        total = np.append(0.0, np.cumsum(compute_cross(local, local[outline.after])))
        run = total[last] - total[first]
        start = outline.starts[simplified.ring]
        size = outline.size[simplified.ring]
        passes_start = last <= first
        run += np.where(passes_start, total[start + size] - total[start], 0.0)
        side_start = simplified.points - outline.points[start]
        side_end = simplified.points[simplified.after] - outline.points[start]
        drawn = compute_cross(local[first], side_start) + compute_cross(side_start, side_end)
        drawn = drawn + compute_cross(side_end, local[last])
        return np.asarray((drawn - run) / 2)

    def find_crossings(self) -> tuple[MultiPolygon, BoolArray]:
        """Build the polygons of the simplified outline, and find where they cross themselves or each other.

        Returns
        -------
        polygons : MultiPolygon, m
        is_near_crossing : (k,) array of bool
            Vertices near the crossings. All False if the polygons are valid.
        """
        outline = self.outline
        allowed = self.allowed
        simplified = outline.restore_necks(self.simplified)
        polygons = outline.to_polygons(simplified)
        if polygons.is_valid:
            return polygons, np.zeros(len(outline.points), dtype=bool)
        after = simplified.after
        sides = shapely.linestrings(simplified.endpoints)
        first, second = STRtree(sides).query(sides, predicate="intersects")
        is_crossing = (first < second) & (after[first] != second) & (after[second] != first)
        crossing = np.append(first[is_crossing], second[is_crossing])
        is_near_crossing = np.isin(self.side_of_vertex, simplified.vertex[crossing])
        is_near_crossing |= is_near_crossing[outline.after]
        is_near_crossing &= allowed > 0.0
        if (allowed[is_near_crossing] == self.tolerance).any():
            self.problems["point"] += int(np.count_nonzero(is_crossing))
        if not is_near_crossing.any():
            # A ring is in the wrong place without crossing anything, such as a hole outside its polygon.
            is_near_crossing = allowed > 0.0
        return polygons, is_near_crossing

    def find_closed_gaps(self, polygons: MultiPolygon) -> BoolArray | None:
        """Find the vertices around gaps through which a robot no longer fits.

        Parameters
        ----------
        polygons : MultiPolygon, m
            The polygons of the simplified outline.

        Returns
        -------
        (k,) array of bool, or None if there are too many gaps to check
        """
        simplified = self.simplified
        # A side that starts or ends at the midpoint of a short side represents the whole short side.
        first = simplified.vertex
        last = np.ceil(simplified.source[simplified.after]).astype(np.intp)
        paths = self._build_paths(first, last)
        moved = 3 * self.tolerance
        closed = find_closed_gaps(simplified.endpoints, paths, polygons, self.width, moved)
        if closed is None:
            return None
        is_near_gap = np.zeros(len(self.outline.points), dtype=bool)
        order = np.argsort(self.side_of_vertex, kind="stable")
        boundaries = np.searchsorted(self.side_of_vertex[order], np.arange(1, len(paths)))
        vertices_by_side = np.split(order, boundaries)
        for pair, middle in zip(*closed, strict=True):
            around = [vertices_by_side[side] for side in pair]
            around.append(first[simplified.after[pair]])
            is_near_gap[self._select_movable_vertices(np.concatenate(around), middle)] = True
        self.problems["narrow passage"] += len(closed[0])
        return is_near_gap

    def _build_paths(self, first: IntArray, last: IntArray) -> FloatArray:
        """Return the run of the outline that each simplified side represents, as (m,) linestrings."""
        outline = self.outline
        starts = outline.starts[self.simplified.ring]
        size = outline.size[self.simplified.ring]
        count = (last - first - 1) % size + 2
        index = starts.repeat(count) + concatenate_ranges(first - starts, count) % size.repeat(count)
        line = np.arange(len(count)).repeat(count)
        return np.asarray(shapely.linestrings(outline.points[index], indices=line))

    def _select_movable_vertices(self, vertices: IntArray, middle: FloatArray) -> IntArray:
        """Return the vertices around a gap that may still move; those near its middle if there are any."""
        movable = vertices[self.allowed[vertices] > 0.0]
        distance = np.hypot(*(self.outline.points[movable] - middle).T)
        nearby: IntArray = movable[distance <= self.width + 3 * self.tolerance]
        if not len(nearby):
            return movable
        return nearby
