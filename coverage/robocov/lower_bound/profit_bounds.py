"""Upper bounds on the profits of positions in a triangle, by tangents of distances; see `lower_bound`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.geodesic.angular_index import AngularWallIndex, add_walls, is_visible
from robocov.geodesic.corner_graph import find_visible_corners
from robocov.geodesic.walls import Walls


class SiteData(NamedTuple):
    """The walls of a map, and the sites with their weights and distances, in grid steps."""

    walls: Walls
    sites: Array
    """(m, 2) Positions."""
    weights: Array
    """(m,) Weights of the sites."""
    from_corners: Array
    """(m, k) Distances from the corners to the sites."""


class TriangleScratch(NamedTuple):
    """Scratch space for one triangle, in grid steps."""

    corners: IntArray
    """(k,) The corners that are visible from the center."""
    corner_distances: Array
    """(k,) Distances from the center to these corners."""
    vertices: Array
    """(3, 2) The vertices, relative to the center."""
    min_distances: Array
    """(3,) A lower bound on the distance from each vertex to the current site."""
    max_profits: Array
    """(3,) An upper bound on the profit of each vertex."""

    @classmethod
    def allocate(cls, corners: int) -> TriangleScratch:
        """Allocate space for a given number of corners.

        Parameters
        ----------
        corners : int

        Returns
        -------
        TriangleScratch
        """
        return cls(
            corners=np.empty(corners, np.int64),
            corner_distances=np.empty(corners),
            vertices=np.empty((3, 2)),
            min_distances=np.empty(3),
            max_profits=np.empty(3),
        )


@kernel
def bound_profits(
    site_data: SiteData,
    index: AngularWallIndex,
    prices: Array,
    triangles: Array,
    centers: Array,
    scratch: TriangleScratch,
    profits: Array,
) -> int:
    """Compute the profit of the center of each triangle, and an upper bound on the profit of all its points.

    The profit of a point is the sum over the sites of weight * max(price - distance, 0).

    Parameters
    ----------
    site_data : SiteData
    index : AngularWallIndex
        Scratch space for one source.
    prices : (m,) array, grid steps
    triangles : (t, 3, 2) array, grid steps
    centers : (t, 2) array, grid steps
        A point in each triangle.
    scratch : TriangleScratch
    profits : (2, t) array, grid steps
        Result: the profits of the centers in the first row, the bounds in the second.

    Returns
    -------
    int
        0, or -1 if the index has too few entries.
    """
    corners = site_data.walls.corners
    min_distances = scratch.min_distances
    for t in range(len(triangles)):
        x = centers[t, 0]
        y = centers[t, 1]
        if add_walls(site_data.walls, index, 0, x, y, np.inf, 0) < 0:
            return -1
        radius = _set_triangle(scratch, triangles[t], x, y)
        count = find_visible_corners(site_data.walls, index, 0, 0, scratch.corners)
        for k in range(count):
            corner = scratch.corners[k]
            scratch.corner_distances[k] = np.hypot(x - corners[corner, 0], y - corners[corner, 1])
        profit = 0.0
        for site in range(len(prices)):
            price = prices[site]
            dx = x - site_data.sites[site, 0]
            dy = y - site_data.sites[site, 1]
            straight = np.sqrt(dx * dx + dy * dy)
            if straight - radius >= price:
                continue
            for vertex in range(3):
                min_distances[vertex] = price
            distance = np.inf
            if is_visible(site_data.walls, index, 0, site_data.sites[site, 0], site_data.sites[site, 1]):
                distance = straight
                _lower_to_tangent(scratch, straight, dx, dy, straight)
            distance = min(distance, _lower_by_corners(site_data, scratch, count, site, x, y, radius))
            profit += site_data.weights[site] * max(price - distance, 0.0)
            for vertex in range(3):
                scratch.max_profits[vertex] += site_data.weights[site] * (price - min_distances[vertex])
        profits[0, t] = profit
        profits[1, t] = max(scratch.max_profits[0], scratch.max_profits[1], scratch.max_profits[2])
    return 0


@kernel
def _set_triangle(scratch: TriangleScratch, triangle: Array, x: float, y: float) -> float:
    """Set the triangle and its center (x, y); return the distance from there to the farthest vertex."""
    radius = 0.0
    for vertex in range(3):
        scratch.vertices[vertex, 0] = triangle[vertex, 0] - x
        scratch.vertices[vertex, 1] = triangle[vertex, 1] - y
        radius = max(radius, np.hypot(scratch.vertices[vertex, 0], scratch.vertices[vertex, 1]))
        scratch.max_profits[vertex] = 0.0
    return radius


@kernel
def _lower_by_corners(
    site_data: SiteData, scratch: TriangleScratch, count: int, site: int, x: float, y: float, radius: float
) -> float:
    """Lower the distance bounds of a site by the tangents of its paths via the first `count` visible corners.

    Return the length of the shortest of these paths from the center (x, y).
    """
    corners = site_data.walls.corners
    min_distances = scratch.min_distances
    shortest = np.inf
    for k in range(count):
        corner = scratch.corners[k]
        length = scratch.corner_distances[k] + site_data.from_corners[site, corner]
        shortest = min(shortest, length)
        if length - radius < max(min_distances[0], min_distances[1], min_distances[2]):
            dx = x - corners[corner, 0]
            dy = y - corners[corner, 1]
            _lower_to_tangent(scratch, length, dx, dy, scratch.corner_distances[k])
    return shortest


@kernel
def _lower_to_tangent(
    scratch: TriangleScratch, length: float, dx: float, dy: float, first_length: float
) -> None:
    """Lower the distance bounds of the vertices where the tangent of a path length is below them.

    The path starts at the center, in the direction -(dx, dy). `length` is the length of the whole path, and
    `first_length` that of its first segment.
    """
    for vertex in range(3):
        rise = dx * scratch.vertices[vertex, 0] + dy * scratch.vertices[vertex, 1]
        tangent = length + rise / max(first_length, 1.0)
        scratch.min_distances[vertex] = min(scratch.min_distances[vertex], tangent)


def halve_triangles(triangles: Array) -> Array:
    """Halve triangles by a cut from the middle of their longest edge to the opposite vertex.

    Parameters
    ----------
    triangles : (t, 3, 2) array

    Returns
    -------
    (2 t, 3, 2) array
    """
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
