"""Snapping of drawn points to nearby corners and walls of the map."""

import numpy as np
import shapely

from robocov.environment import Environment, Point
from robocov_app.toolkit.tools.snap_targets import SnapTargets, list_outline_edges
from robocov_app.toolkit.tools.snapping import SnapKind, SnapSettings, snap_point

SNAP_REACH_FRACTION = 0.6  # fraction of the pointer's reach within which points snap
_KINDS: frozenset[SnapKind] = frozenset({"vertex", "edge"})


class MapSnapper:
    """Snaps points to corners or walls of the map; caches the snap targets of the latest map."""

    def __init__(self) -> None:
        self._environment: Environment | None = None
        self._targets: SnapTargets | None = None

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
            The nearest corner within reach, or the nearest point on a wall, or the point itself.
        """
        if self._targets is None or environment is not self._environment:
            self._environment = environment
            self._targets = _list_targets(environment)
        settings = SnapSettings(SNAP_REACH_FRACTION * reach, kinds=_KINDS)
        return snap_point(point, self._targets, settings).point


def _list_targets(environment: Environment) -> SnapTargets:
    edges = list_outline_edges(shapely.get_parts(environment.free).tolist())
    return SnapTargets(vertices=edges.starts, centers=np.empty((0, 2)), edges=edges)
