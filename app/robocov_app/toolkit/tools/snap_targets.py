"""Points and edges to which the pointer can snap."""

from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import shapely
from scipy.spatial import cKDTree

from robocov.typing import FloatArray
from robocov_app.toolkit.tools.geometry import Point, find_nearest_on_edges

PointKind: TypeAlias = Literal["vertex", "center", "midpoint"]
MAX_EDGES = 8  # nearest edges that are considered; if more are near, they are too close to distinguish


class Edges(NamedTuple):
    """Straight edges.

    Attributes
    ----------
    starts, ends : (k, 2) array, m
        Ends of each edge.
    """

    starts: FloatArray
    ends: FloatArray


_NO_EDGES = Edges(np.empty((0, 2)), np.empty((0, 2)))


class SnapTargets:
    """Vertices, centers and edges to which points can snap, and the midpoints of the edges.

    Parameters
    ----------
    vertices, centers : (k, 2) array, m
        Points to snap to. The pointer can also be aligned with them horizontally or vertically.
    edges : Edges
        Edges that can be snapped to, as can their midpoints.
    edges_without_midpoints : Edges
        Edges without snapping to their midpoints, such as the visible outlines of walls and circles.
    """

    def __init__(
        self,
        vertices: FloatArray,
        centers: FloatArray,
        edges: Edges,
        edges_without_midpoints: Edges = _NO_EDGES,
    ) -> None:
        """Index the points by kind, the bounding boxes of the edges, and the coordinates for alignment."""
        middles = (edges.starts + edges.ends) / 2
        points_by_kind = {"vertex": vertices, "center": centers, "midpoint": middles}
        self._trees = {
            kind: (cKDTree(points), points) for kind, points in points_by_kind.items() if len(points)
        }
        self._starts = np.concatenate([edges.starts, edges_without_midpoints.starts])
        self._ends = np.concatenate([edges.ends, edges_without_midpoints.ends])
        low = np.minimum(self._starts, self._ends)
        high = np.maximum(self._starts, self._ends)
        boxes = shapely.box(xmin=low[:, 0], ymin=low[:, 1], xmax=high[:, 0], ymax=high[:, 1])
        self._edges = shapely.STRtree(boxes)
        # The pointer aligns with vertices and centers. Sorting by each coordinate allows a binary search. The
        # sort is stable, so that the choice among equally good points does not depend on the algorithm.
        alignment_points = np.concatenate([vertices, centers])
        self._sorted_alignment_points = tuple(
            alignment_points[np.argsort(alignment_points[:, axis], kind="stable")] for axis in (0, 1)
        )

    def find_nearest(self, point: Point, kind: PointKind, reach: float) -> Point | None:
        """Return the nearest target of a kind within `reach` meters; None if there is none."""
        if kind not in self._trees:
            return None
        tree, points = self._trees[kind]
        # The tree excludes its upper bound; `reach` itself is included.
        gap, index = tree.query(point, distance_upper_bound=np.nextafter(reach, np.inf))
        return _to_point(points[index]) if gap <= reach else None

    def list_edges_near(self, point: Point, reach: float) -> list[tuple[Point, Point]]:
        """Return start and end of each edge within `reach` meters, nearest first, at most `MAX_EDGES`."""
        x, y = point
        indices = np.sort(self._edges.query(shapely.box(x - reach, y - reach, x + reach, y + reach)))
        starts = self._starts[indices]
        ends = self._ends[indices]
        _, gaps = find_nearest_on_edges(starts, ends, point)
        order = np.argsort(gaps, kind="stable")
        order = order[gaps[order] <= reach][:MAX_EDGES]
        return [(_to_point(starts[k]), _to_point(ends[k])) for k in order]

    def find_aligned(self, point: Point, axis: int, reach: float, horizon: float) -> Point | None:
        """Return the vertex or center that is best aligned with a point.

        Parameters
        ----------
        point : Point
            Position of the pointer, m.
        axis : int
            0 for points with nearly the same x coordinate, 1 for nearly the same y coordinate.
        reach : float
            Maximum difference of that coordinate, m.
        horizon : float
            Maximum distance of the vertex or center, m.

        Returns
        -------
        Point or None
            The one with the smallest difference along the axis; among equals, the nearest.
        """
        alignment_points = self._sorted_alignment_points[axis]
        bounds = (point[axis] - reach, point[axis] + reach)
        first, last = np.searchsorted(alignment_points[:, axis], bounds)
        near = alignment_points[first:last]
        near = near[_compute_distances(near, point) <= horizon]
        if not len(near):
            return None
        differences = np.round(np.abs(near[:, axis] - point[axis]), 9)
        order = np.lexsort((_compute_distances(near, point), differences))
        return _to_point(near[order[0]])


def list_outline_edges(polygons: Sequence[shapely.Geometry]) -> Edges:
    """Return the edges of the outlines of polygons."""
    rings = shapely.get_rings(np.array(polygons, dtype=object))
    points, ring_numbers = shapely.get_coordinates(rings, return_index=True)
    # Consecutive points form an edge unless they belong to different rings.
    is_edge = ring_numbers[1:] == ring_numbers[:-1]
    return Edges(points[:-1][is_edge], points[1:][is_edge])


def _compute_distances(points: FloatArray, point: Point) -> FloatArray:
    """Return the distances of points from a point, m."""
    return np.asarray(np.linalg.norm(points - np.asarray(point), axis=1))


def _to_point(coordinates: FloatArray) -> Point:
    x, y = coordinates.tolist()
    return x, y
