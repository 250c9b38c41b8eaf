"""Snapping of drawn points to nearby ends of walls, corners and edges of the map."""

import numpy as np
import shapely

from robocov.environment import Environment, Point
from robocov.typing import FloatArray
from robocov_app.toolkit.tools.snap_targets import Edges, SnapTargets, list_outline_edges
from robocov_app.toolkit.tools.snapping import SnapKind, SnapSettings, snap_point

SNAP_REACH_FRACTION = 0.6  # fraction of the pointer's reach within which points snap
MAX_WALL_END_M = 0.6  # an edge that is at most this long, between two outer corners, is the end of a wall
_KINDS: frozenset[SnapKind] = frozenset({"vertex", "edge"})


class MapSnapper:
    """Snaps points to ends of walls, corners or edges of the map; caches the targets of the latest map."""

    def __init__(self) -> None:
        self._environment: Environment | None = None
        self._targets: SnapTargets | None = None
        self._wall_ends: SnapTargets | None = None

    def snap(self, environment: Environment, point: Point, reach: float) -> Point:
        """Snap a point to the map.

        Parameters
        ----------
        environment : Environment
            The map.
        point : Point
            Position, m.
        reach : float
            Reach of the pointer on the map, m; points snap within a fraction of it.

        Returns
        -------
        Point
            The center of the nearest wall end within reach, so that a wall continues in line with the other
            one. Otherwise the nearest corner within reach, or the nearest point on an edge, or the point
            itself.
        """
        if self._targets is None or self._wall_ends is None or environment is not self._environment:
            self._environment = environment
            edges = list_outline_edges(shapely.get_parts(environment.free).tolist())
            self._targets = _build_targets(edges.starts, edges)
            ends = _find_wall_ends(environment)
            self._wall_ends = _build_targets((ends.starts + ends.ends) / 2, ends)
        snap_reach = SNAP_REACH_FRACTION * reach
        center = self._wall_ends.find_nearest(point, "vertex", snap_reach)
        if center is not None:
            return center
        settings = SnapSettings(snap_reach, kinds=_KINDS)
        return snap_point(point, self._targets, settings).point


def _build_targets(vertices: FloatArray, edges: Edges) -> SnapTargets:
    return SnapTargets(vertices=vertices, centers=np.empty((0, 2)), edges=edges)


def _find_wall_ends(environment: Environment) -> Edges:
    """Return the short edges of obstacles between two corners that stick out into the free space."""
    starts: list[FloatArray] = []
    ends: list[FloatArray] = []
    for part in shapely.get_parts(environment.free):
        # The free space is to the left of every edge of an oriented polygon.
        for ring in shapely.get_rings(shapely.orient_polygons(part)):
            points = shapely.get_coordinates(ring)[:-1]
            edges = np.roll(points, -1, axis=0) - points
            before = np.roll(edges, 1, axis=0)
            sticks_out = before[:, 0] * edges[:, 1] - before[:, 1] * edges[:, 0] < 0.0
            is_short = np.hypot(edges[:, 0], edges[:, 1]) <= MAX_WALL_END_M
            is_end = is_short & sticks_out & np.roll(sticks_out, -1)
            starts.append(points[is_end])
            ends.append(np.roll(points, -1, axis=0)[is_end])
    return Edges(np.concatenate(starts), np.concatenate(ends))
