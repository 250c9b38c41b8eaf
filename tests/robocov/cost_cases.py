"""Maps on which the cost is known, and its comparison with distances from point to point."""

from __future__ import annotations

import numpy as np

from robocov.cost import CoverageCost
from robocov.environment import CircleObstacle, Environment, PolygonObstacle, WallObstacle

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))


def build_ring(x0, y0, x1, y1):
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def build_environment(*obstacles, boundary=SQUARE):
    return Environment("test", boundary, tuple(PolygonObstacle(ring) for ring in obstacles))


PILLAR = build_environment(build_ring(3 / 8, 3 / 8, 5 / 8, 5 / 8))
CUP = build_environment(
    (
        *((1 / 4, 1 / 4), (3 / 4, 1 / 4), (3 / 4, 3 / 4), (5 / 8, 3 / 4)),
        *((5 / 8, 3 / 8), (3 / 8, 3 / 8), (3 / 8, 3 / 4), (1 / 4, 3 / 4)),
    )
)
L_ROOM = build_environment(build_ring(1 / 2, 1 / 2, 1, 1))
OFFICE = Environment(
    "office",
    ((0, 0), (12, 0), (12, 5), (9, 5), (9, 8), (0, 8)),
    (
        WallObstacle(((4, 0), (4, 3), (6.5, 3)), 0.2),
        WallObstacle(((3, 8), (3, 5)), 0.2),
        CircleObstacle((8.5, 2.5), 0.8),
        PolygonObstacle(((5, 5), (7, 4.5), (6.5, 6.5))),
    ),
)


def compute_lengths(vectors):
    return np.hypot(vectors[:, 0], vectors[:, 1])


def compute_distance_error(environment, lattice, robots):
    """Return the largest error of a distance, relative to the map's size; check owners and corners."""
    # Narrow gaps stay open: a robot in a closed gap would be moved to its edge.
    cost = CoverageCost(environment, lattice, radius=0.0)
    result = cost(robots)
    size = cost.geodesics.size
    tolerance = 1e-12 * size
    distances = cost.geodesics.compute_distances(robots, cost.points)
    nearest = distances.min(axis=0)
    is_reached = np.isfinite(nearest)
    np.testing.assert_array_equal(np.isfinite(result.distances), is_reached)
    np.testing.assert_array_equal(result.owners >= 0, is_reached)
    # The owner is one of the nearest robots.
    site = np.flatnonzero(is_reached)
    owner = result.owners[site]
    assert np.abs(distances[owner, site] - nearest[site]).max(initial=0.0) < tolerance
    check_first_corners(cost, result, robots, site, nearest, tolerance)
    check_last_corners(cost, result, robots, site, nearest, tolerance)
    return float(np.abs(result.distances[site] - nearest[site]).max(initial=0.0)) / size


def check_first_corners(cost, result, robots, site, nearest, tolerance):
    """Check that the first waypoint of each site is on a shortest path."""
    to_first = compute_lengths(result.first_waypoints[site] - robots[result.owners[site]])
    assert (to_first <= nearest[site] * (1 + 1e-12) + tolerance).all()
    is_bent = result.first_corners[site] >= 0
    bent = site[is_bent]
    if len(bent) == 0:
        return
    corners, number = np.unique(result.first_corners[bent], return_inverse=True)
    from_corners = cost.geodesics.compute_distances(cost.corners[corners], cost.points[bent])
    total = to_first[is_bent] + from_corners[number, np.arange(len(bent))]
    # A corner at a pinch belongs to both of its sides, and may be a short cut: the total is not exact.
    assert (total <= nearest[bent] + tolerance).all()


def check_last_corners(cost, result, robots, site, nearest, tolerance):
    """Check that the last corner of each site is no farther away than its owner."""
    last_points = robots[result.owners[site]]
    is_bent = result.last_corners[site] >= 0
    last_points[is_bent] = cost.corners[result.last_corners[site[is_bent]]]
    from_last = compute_lengths(cost.points[site] - last_points)
    assert (from_last <= nearest[site] * (1 + 1e-12) + tolerance).all()
