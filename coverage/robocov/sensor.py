"""The range sensor: nearest obstacle points and ray scans, by pymunk queries.

A sensor has a space of its own, which contains the obstacles and robots that have failed. Working robots are
not in it: they neither hide obstacles nor are mistaken for any.
"""

from __future__ import annotations

import functools
from types import ModuleType
from typing import Any

import numpy as np
import pymunk

from robocov.arrays import Array, BoolArray
from robocov.compiled import IS_COMPILER_ENABLED, is_interpreting
from robocov.observation import compute_ray_directions
from robocov.world.bodies import build_obstacle_space
from robocov.world.obstacle_pieces import Mover, Obstacles

_MAX_RANGE_M = 1e6
"""Range that replaces an unlimited one, because pymunk's bounding boxes must be finite."""
_INDEXING_STEP_S = 1e-9
"""Duration of the step in which pymunk builds its spatial index; nothing moves in it."""
_EVERYTHING = pymunk.ShapeFilter()


class RangeSensor:
    """Simulates the range sensors of robots among static and moving obstacles.

    Parameters
    ----------
    walls : tuple of (k, 2) arrays, m
        Convex polygons that tile everything that is not free, see
        `world.obstacle_pieces.build_solid_pieces`.
    movers : tuple of Mover
        Moving obstacles, at their positions at time zero until `set_time` is called.

    See Also
    --------
    World : The physics of the robots.
    Simulation : Its attribute ``sensor`` is the sensor of its map.

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> wall = np.array([[2.0, -1.0], [3.0, -1.0], [3.0, 1.0], [2.0, 1.0]])
    >>> sensor = rc.RangeSensor((wall,))
    >>> sensor.find_nearest_points(np.array([[0.0, 0.5]]), ranges=np.array([3.0]))
    array([[2. , 0.5]])
    >>> distances, is_hit = sensor.scan(np.array([[0.0, 0.0]]), rays=4, ranges=np.array([3.0]))
    >>> distances
    array([[2., 3., 3., 3.]])
    """

    def __init__(self, walls: tuple[Array, ...], movers: tuple[Mover, ...] = ()) -> None:
        self._walls = walls
        self._movers = movers
        self._space, self._mover_bodies = build_obstacle_space(Obstacles(walls, movers))
        # An empty step builds the spatial index; queries never change the space.
        self._space.step(_INDEXING_STEP_S)
        self._failed_robots: dict[tuple[float, float, float], pymunk.Circle] = {}

    def copy(self) -> RangeSensor:
        """Return a sensor among the same obstacles at time zero.

        Returns
        -------
        RangeSensor
        """
        return RangeSensor(self._walls, self._movers)

    def __reduce__(self) -> tuple[type[RangeSensor], tuple[Any, ...]]:
        """Pickle the obstacles; pymunk's space is built again, at time zero."""
        return RangeSensor, (self._walls, self._movers)

    def set_time(self, time: float, failed_robots: Array | None = None) -> None:
        """Move the obstacles to their positions at a given time.

        Parameters
        ----------
        time : float, s
            Simulation time.
        failed_robots : (w, 3) array or None, m
            x, y and radius of the robots that have failed by then; they count as obstacles.
        """
        for body, mover in zip(self._mover_bodies, self._movers, strict=True):
            body.position = tuple(mover.path.compute_displacement(time).tolist())
            self._space.reindex_shapes_for_body(body)
        failed = set() if failed_robots is None else set(map(tuple, failed_robots.tolist()))
        for robot in self._failed_robots.keys() - failed:
            self._space.remove(self._failed_robots.pop(robot))
        for x, y, radius in sorted(failed - self._failed_robots.keys()):
            disc = pymunk.Circle(self._space.static_body, radius, (x, y))
            self._space.add(disc)
            self._failed_robots[x, y, radius] = disc

    def find_nearest_points(self, positions: Array, ranges: Array) -> Array:
        """Find the nearest obstacle point of each robot.

        Parameters
        ----------
        positions : (n, 2) array, m
        ranges : (n,) array, m
            Sensing ranges; may be infinite.

        Returns
        -------
        (n, 2) array, m
            nan where no obstacle is in range. Read-only.
        """
        limits = np.minimum(ranges, _MAX_RANGE_M)
        queries = _get_compiled_queries()
        if queries is not None:
            points: Array = queries.find_nearest_points(self._space, positions, limits)
        else:
            points = np.full((len(positions), 2), np.nan)
            for row, (position, limit) in enumerate(zip(positions.tolist(), limits.tolist(), strict=True)):
                nearest = self._space.point_query_nearest(tuple(position), limit, _EVERYTHING)
                if nearest is not None:
                    points[row] = nearest.point
        points.setflags(write=False)
        return points

    def scan(self, positions: Array, rays: int, ranges: Array) -> tuple[Array, BoolArray]:
        """Cast rays at even angles over a full turn from each position; the first points along +x.

        Parameters
        ----------
        positions : (n, 2) array, m
        rays : int
            Number of rays of each robot.
        ranges : (n,) array, m
            Sensing ranges; may be infinite.

        Returns
        -------
        distances : (n, rays) array, m
            Distance to the first obstacle, or the range where there is none. Read-only.
        is_hit : (n, rays) bool array
            Whether an obstacle is in range. Read-only.
        """
        limits = np.minimum(ranges, _MAX_RANGE_M)
        ends = positions[:, None, :] + limits[:, None, None] * compute_ray_directions(rays)
        queries = _get_compiled_queries()
        if queries is not None:
            fractions, is_hit = queries.cast_rays(self._space, np.ascontiguousarray(positions), ends)
        else:
            fractions, is_hit = self._cast_rays(positions, ends)
        distances = limits[:, None] * fractions
        distances.setflags(write=False)
        is_hit.setflags(write=False)
        return distances, is_hit

    def scan_from(self, position: Array, rays: int, sensing_range: float) -> tuple[Array, Array]:
        """Cast rays at even angles over a full turn from one position; the first points along +x.

        Parameters
        ----------
        position : (2,) array, m
        rays : int
            Number of rays.
        sensing_range : float, m
            May be infinite.

        Returns
        -------
        distances : (rays,) array, m
            Distance to the first obstacle, or the range where there is none.
        ends : (rays, 2) array, m
            Ends of the rays.
        """
        distances, _ = self.scan(np.asarray(position)[None], rays, np.array([sensing_range]))
        return distances[0], position + distances[0][:, None] * compute_ray_directions(rays)

    def _cast_rays(self, positions: Array, ends: Array) -> tuple[Array, BoolArray]:
        """Cast rays by pymunk's public query, as `compiled_queries.cast_rays` does."""
        fractions = np.ones(ends.shape[:2])
        is_hit = np.zeros(ends.shape[:2], dtype=bool)
        for row, (position, ends_of_robot) in enumerate(zip(positions.tolist(), ends.tolist(), strict=True)):
            for ray, end in enumerate(ends_of_robot):
                hit = self._space.segment_query_first(tuple(position), tuple(end), 0.0, _EVERYTHING)
                if hit is not None:
                    fractions[row, ray] = hit.alpha
                    is_hit[row, ray] = True
        return fractions, is_hit


def _get_compiled_queries() -> ModuleType | None:
    """Return `robocov.compiled_queries`, or None if pymunk's public queries must be used."""
    return None if is_interpreting() else _load_compiled_queries()


@functools.cache
def _load_compiled_queries() -> ModuleType | None:
    """Return `robocov.compiled_queries`, or None if it does not work on this machine."""
    if not IS_COMPILER_ENABLED:
        return None
    try:
        from robocov import compiled_queries

        return compiled_queries if compiled_queries.is_usable() else None
    except Exception:
        # If anything is wrong with the shortcut, the public queries still work.
        return None
