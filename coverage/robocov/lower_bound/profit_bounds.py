"""Upper bounds on the profits of the points of a triangle, from tangents of distances; see `lower_bound`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.geodesic.angular_index import NO_SPACE, ONLY_SOURCE, AngularWallIndex, index_walls, is_visible
from robocov.geodesic.corner_graph import find_visible_corners
from robocov.geodesic.walls import Walls
from robocov.typing import FloatArray, IntArray

CENTER_PROFIT = 0
"""Row of the result of `bound_profits`: the profits of the centers of the triangles."""
PROFIT_BOUND = 1
"""Row of the result of `bound_profits`: the upper bounds on the profits of all points of the triangles."""

_MIN_SEGMENT_LENGTH = 1.0
"""Length of the shortest segment between different points, in grid steps: all coordinates are whole
numbers."""


class SiteData(NamedTuple):
    """The walls of a map, and the sites with their weights and distances from the corners, in grid steps."""

    walls: Walls
    """The boundary of the free space."""
    sites: FloatArray
    """(m, 2) Positions of the sites."""
    weights: FloatArray
    """(m,) Weights of the sites."""
    from_corners: FloatArray
    """(m, k) Geodesic distance of each site from each corner."""


class TriangleScratch(NamedTuple):
    """Scratch space for one triangle, in grid steps.

    Bounds at a vertex use, in place of the distances to the sites, the minimum of their tangents at the
    center.
    """

    corners: IntArray
    """(k,) The corners that are visible from the center, at the beginning of the array."""
    corner_distances: FloatArray
    """(k,) Distances from the center to these corners."""
    vertices: FloatArray
    """(3, 2) The vertices, relative to the center."""
    min_distances: FloatArray
    """(3,) A lower bound on the distance from each vertex to the current site."""
    max_profits: FloatArray
    """(3,) An upper bound on the profit of each vertex, from the sites so far."""

    @classmethod
    def allocate(cls, corner_count: int) -> TriangleScratch:
        """Allocate space for a given number of corners.

        Parameters
        ----------
        corner_count : int

        Returns
        -------
        TriangleScratch
        """
        return cls(
            corners=np.empty(corner_count, np.int64),
            corner_distances=np.empty(corner_count),
            vertices=np.empty((3, 2)),
            min_distances=np.empty(3),
            max_profits=np.empty(3),
        )


class _Center(NamedTuple):
    """The point of a triangle at which distances are replaced by their tangents, in grid steps."""

    x: float
    y: float
    radius: float
    """Distance from the center to the farthest vertex."""
    corner_count: int
    """Number of corners that are visible from the center."""


@kernel
def bound_profits(
    site_data: SiteData,
    wall_index: AngularWallIndex,
    prices: FloatArray,
    triangles: FloatArray,
    centers: FloatArray,
    scratch: TriangleScratch,
    profits: FloatArray,
) -> bool:
    """Compute the profit of the center of each triangle, and an upper bound on the profit of all its points.

    The profit of a point is the sum over the sites of weight * max(price - distance, 0). In a triangle, the
    distance of a site is never below the minimum of the tangents, at the center, of the lengths of the paths
    to the site. If this minimum replaces the distance, the profit becomes convex, and therefore has its
    maximum at one of the three vertices.

    Parameters
    ----------
    site_data : SiteData
    wall_index : AngularWallIndex
        Scratch space for one source.
    prices : (m,) array, grid steps
        Prices of the sites.
    triangles : (t, 3, 2) array, grid steps
        Vertices of the triangles, which must lie in the free space: across a wall, the bound would not hold.
    centers : (t, 2) array, grid steps
        A point of the free space in each triangle.
    scratch : TriangleScratch
    profits : (2, t) array, grid steps
        Output: the profits of the centers in row `CENTER_PROFIT`, the bounds in row `PROFIT_BOUND`.

    Returns
    -------
    bool
        Whether the index had enough entries.
    """
    for t in range(len(triangles)):
        if index_walls(site_data.walls, wall_index, centers[t, 0], centers[t, 1]) == NO_SPACE:
            return False
        center = _set_triangle(site_data, wall_index, scratch, triangles[t], centers[t])
        profit = 0.0
        for site in range(len(prices)):
            profit += _add_site(site_data, wall_index, scratch, center, site, prices[site])
        profits[CENTER_PROFIT, t] = profit
        profits[PROFIT_BOUND, t] = max(scratch.max_profits[0], scratch.max_profits[1], scratch.max_profits[2])
    return True


@kernel
def _set_triangle(
    site_data: SiteData,
    wall_index: AngularWallIndex,
    scratch: TriangleScratch,
    triangle: FloatArray,
    center: FloatArray,
) -> _Center:
    """Write a triangle, and the corners that are visible from its center, to the scratch space.

    The profit bounds of the vertices are set to 0; `_add_site` adds to them.
    """
    x = center[0]
    y = center[1]
    radius = 0.0
    for vertex in range(3):
        scratch.vertices[vertex, 0] = triangle[vertex, 0] - x
        scratch.vertices[vertex, 1] = triangle[vertex, 1] - y
        radius = max(radius, np.hypot(scratch.vertices[vertex, 0], scratch.vertices[vertex, 1]))
        scratch.max_profits[vertex] = 0.0
    corners = site_data.walls.corners
    first_corner = 0  # No corner is left out.
    corner_count = find_visible_corners(
        site_data.walls, wall_index, ONLY_SOURCE, first_corner, scratch.corners
    )
    for k in range(corner_count):
        corner = scratch.corners[k]
        scratch.corner_distances[k] = np.hypot(x - corners[corner, 0], y - corners[corner, 1])
    return _Center(x, y, radius, corner_count)


@kernel
def _add_site(
    site_data: SiteData,
    wall_index: AngularWallIndex,
    scratch: TriangleScratch,
    center: _Center,
    site: int,
    price: float,
) -> float:
    """Add the payment of a site to the profit bounds of the vertices; return its payment at the center.

    A site pays weight * max(price - distance, 0) to a robot. At each vertex, the distance is replaced by the
    minimum of the tangents of the path lengths: of the straight path, if the site is visible from the center,
    and of the paths via the corners that are visible from the center.
    """
    site_x = site_data.sites[site, 0]
    site_y = site_data.sites[site, 1]
    dx = center.x - site_x
    dy = center.y - site_y
    straight_length = np.sqrt(dx * dx + dy * dy)
    # The distance of every point of the triangle from the site is at least `straight_length - center.radius`.
    if straight_length - center.radius >= price:
        return 0.0
    # A site pays nothing to a robot at a distance of its price or more, so larger bounds make no difference.
    for vertex in range(3):
        scratch.min_distances[vertex] = price
    distance = np.inf
    if is_visible(site_data.walls, wall_index, ONLY_SOURCE, site_x, site_y):
        distance = straight_length
        _apply_tangent_bound(scratch, straight_length, dx, dy, straight_length)
    distance = min(distance, _lower_by_corners(site_data, scratch, center, site))
    weight = site_data.weights[site]
    for vertex in range(3):
        scratch.max_profits[vertex] += weight * (price - scratch.min_distances[vertex])
    return float(weight * max(price - distance, 0.0))


@kernel
def _lower_by_corners(site_data: SiteData, scratch: TriangleScratch, center: _Center, site: int) -> float:
    """Lower the distance bounds of a site to the tangents of its paths via corners.

    The corners are those visible from the center. Return the length of the shortest of these paths from the
    center; inf if there is none.
    """
    corners = site_data.walls.corners
    min_distances = scratch.min_distances
    min_length = np.inf
    for k in range(center.corner_count):
        corner = scratch.corners[k]
        length = scratch.corner_distances[k] + site_data.from_corners[site, corner]
        min_length = min(min_length, length)
        # At a vertex, a tangent is lower than at the center by at most the radius, because its slope is 1.
        if length - center.radius < max(min_distances[0], min_distances[1], min_distances[2]):
            dx = center.x - corners[corner, 0]
            dy = center.y - corners[corner, 1]
            _apply_tangent_bound(scratch, length, dx, dy, scratch.corner_distances[k])
    return min_length


@kernel
def _apply_tangent_bound(
    scratch: TriangleScratch, length: float, dx: float, dy: float, first_length: float
) -> None:
    """Lower the distance bound of each vertex to the tangent of a path length if the tangent is smaller.

    The length of a path is a convex function of the point where it starts. Its tangent at the center of the
    triangle is therefore never larger than the length of the path from any other point, here from a vertex.

    The path from the center has the given length. Its first segment leads from the center to the point at
    offset (-dx, -dy), and has the length `first_length`. The tangent rises with slope 1 in the
    direction (dx, dy), away from the end of this segment.
    """
    # If the segment has no length, (dx, dy) is zero, and the divisor does not matter.
    divisor = max(first_length, _MIN_SEGMENT_LENGTH)
    for vertex in range(3):
        vertex_x = scratch.vertices[vertex, 0]
        vertex_y = scratch.vertices[vertex, 1]
        rise = (dx * vertex_x + dy * vertex_y) / divisor
        scratch.min_distances[vertex] = min(scratch.min_distances[vertex], length + rise)


def halve_triangles(triangles: FloatArray) -> FloatArray:
    """Halve triangles by a cut from the middle of their longest edge to the opposite vertex.

    Parameters
    ----------
    triangles : (t, 3, 2) array
        Vertices of the triangles.

    Returns
    -------
    (2 t, 3, 2) array
        The first halves of all triangles, then the second halves.
    """
    # The longest edge leads from `start` to `end`, and the apex is the vertex opposite to it.
    edges = triangles - np.roll(triangles, -1, axis=1)
    longest = (edges * edges).sum(axis=2).argmax(axis=1)
    rows = np.arange(len(triangles))
    start = triangles[rows, longest]
    end = triangles[rows, (longest + 1) % 3]
    apex = triangles[rows, (longest + 2) % 3]
    middle = (start + end) / 2.0
    first_halves = np.stack([start, middle, apex], axis=1)
    second_halves = np.stack([middle, end, apex], axis=1)
    return np.concatenate([first_halves, second_halves])
