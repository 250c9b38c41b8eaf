"""Maps on which the cost is known, and its comparison with distances from point to point."""

from __future__ import annotations

import numpy as np

from robocov.cost import CoverageCost
from robocov.environment import CircleObstacle, Environment, PolygonObstacle, WallObstacle

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))


def box(x0, y0, x1, y1):
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def environment(*obstacles, boundary=SQUARE):
    return Environment("test", boundary, tuple(PolygonObstacle(ring) for ring in obstacles))


PILLAR = environment(box(3 / 8, 3 / 8, 5 / 8, 5 / 8))
CUP = environment(
    (
        *((1 / 4, 1 / 4), (3 / 4, 1 / 4), (3 / 4, 3 / 4), (5 / 8, 3 / 4)),
        *((5 / 8, 3 / 8), (3 / 8, 3 / 8), (3 / 8, 3 / 4), (1 / 4, 3 / 4)),
    )
)
L_ROOM = environment(box(1 / 2, 1 / 2, 1, 1))
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


def compared(environment, lattice, robots):
    """Return the largest error of any distance, as a part of the map's size, having checked the rest."""
    cost = CoverageCost(environment, lattice)
    result = cost(robots)
    everything = cost.geodesics.compute_distances(robots, cost.points)
    nearest = everything.min(axis=0)
    size = cost.geodesics.size
    reached = np.isfinite(nearest)
    np.testing.assert_array_equal(np.isfinite(result.distances), reached)
    np.testing.assert_array_equal(result.owner >= 0, reached)
    site = np.nonzero(reached)[0]
    # the owner is as near as the nearest
    own = everything[result.owner[site], site]
    assert np.abs(own - nearest[site]).max(initial=0.0) < 1e-12 * size
    # the first way-point is on a shortest way, and so is the last
    straight = np.hypot(*(result.first_waypoints[site] - robots[result.owner[site]]).T)
    assert (straight <= nearest[site] * (1 + 1e-12) + 1e-12 * size).all()
    bent = site[result.first_corner[site] >= 0]
    corners, number = np.unique(result.first_corner[bent], return_inverse=True)
    if len(bent):
        rest = cost.geodesics.compute_distances(cost.corners[corners], cost.points[bent])[
            number, np.arange(len(bent))
        ]
        total = np.hypot(*(result.first_waypoints[bent] - robots[result.owner[bent]]).T) + rest
        # a corner at a pinch belongs to both sides at once, and would be a short cut
        assert (total <= nearest[bent] + 1e-12 * size).all()
    last = (
        np.where(
            result.last_corner[site, None] >= 0,
            cost.corners[result.last_corner[site]],
            robots[result.owner[site]],
        )
        if len(cost.corners)
        else robots[result.owner[site]]
    )
    assert (np.hypot(*(cost.points[site] - last).T) <= nearest[site] * (1 + 1e-12) + 1e-12 * size).all()
    return float(np.abs(result.distances[site] - nearest[site]).max(initial=0.0)) / size
