"""The range sensor: nearest obstacle points and ray scans, by pymunk queries.

A sensor has a space of its own, which contains the obstacles and the robots that have failed. Working robots
are not in this space, so that they neither hide obstacles nor are mistaken for obstacles.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pymunk

from robocov.observation import compute_ray_directions
from robocov.typing import BoolArray, FloatArray
from robocov.world.bodies import build_obstacle_space
from robocov.world.obstacle_pieces import MovingObstacle, Obstacles

_MAX_RANGE_M = 1e6
"""Maximum range of a query, even if the sensing range is infinite, because bounding boxes in pymunk must be
finite."""
_INDEXING_STEP_S = 1e-9
"""Duration of the step in which pymunk builds its spatial index. Nothing moves in this step."""
_EVERYTHING = pymunk.ShapeFilter()
"""Filter of queries that find all shapes."""


class RangeSensor:
    """Simulates the range sensors of robots among static and moving obstacles.

    Parameters
    ----------
    walls : tuple of (k, 2) arrays, m
        Convex polygons that tile the static obstacles and the surroundings of the map; see
        `world.obstacle_pieces.build_solid_pieces`.
    moving_obstacles : tuple of MovingObstacle
        Moving obstacles. They are at their positions at time zero until `set_time` is called.

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

    def __init__(
        self, walls: tuple[FloatArray, ...], moving_obstacles: tuple[MovingObstacle, ...] = ()
    ) -> None:
        self._walls = walls
        self._moving_obstacles = moving_obstacles
        self._space, self._moving_bodies = build_obstacle_space(Obstacles(walls, moving_obstacles))
        # A step builds the spatial index, which queries need but do not build.
        self._space.step(_INDEXING_STEP_S)
        self._failed_robots: dict[tuple[float, float, float], pymunk.Circle] = {}

    def copy(self) -> RangeSensor:
        """Return a sensor among the same obstacles at time zero, without failed robots.

        Returns
        -------
        RangeSensor
            An independent sensor.
        """
        return RangeSensor(self._walls, self._moving_obstacles)

    def __reduce__(self) -> tuple[type[RangeSensor], tuple[Any, ...]]:
        """Pickle the obstacles only. The space is built again, at time zero."""
        return RangeSensor, (self._walls, self._moving_obstacles)

    def set_time(self, time: float, failed_robots: FloatArray | None = None) -> None:
        """Move the obstacles to their positions at a given time, and set the failed robots.

        Parameters
        ----------
        time : float, s
            Simulation time.
        failed_robots : (w, 3) array or None, m
            Center x and y and radius of the robots that have failed by this time. They count as obstacles.
        """
        for body, obstacle in zip(self._moving_bodies, self._moving_obstacles, strict=True):
            body.position = tuple(obstacle.path.compute_displacement(time).tolist())
            self._space.reindex_shapes_for_body(body)
        failed = set() if failed_robots is None else set(map(tuple, failed_robots.tolist()))
        for robot in self._failed_robots.keys() - failed:
            self._space.remove(self._failed_robots.pop(robot))
        # The order in which shapes are added must not depend on the arbitrary order of a set.
        for x, y, radius in sorted(failed - self._failed_robots.keys()):
            disc = pymunk.Circle(self._space.static_body, radius, (x, y))
            self._space.add(disc)
            self._failed_robots[x, y, radius] = disc

    def find_nearest_points(self, positions: FloatArray, ranges: FloatArray) -> FloatArray:
        """Find the nearest obstacle point of each robot.

        Parameters
        ----------
        positions : (n, 2) array, m
            Centers of the robots.
        ranges : (n,) array, m
            Sensing ranges, which may be infinite.

        Returns
        -------
        (n, 2) array, m
            Nearest point of each robot; nan if no obstacle is in range. Read-only.
        """
        limits = np.minimum(ranges, _MAX_RANGE_M)
        points = np.full((len(positions), 2), np.nan)
        for row, (position, limit) in enumerate(zip(positions.tolist(), limits.tolist(), strict=True)):
            nearest = self._space.point_query_nearest(tuple(position), limit, _EVERYTHING)
            if nearest is not None:
                # pymunk returns nan if the position is exactly on a surface.
                points[row] = position if math.isnan(nearest.point.x) else nearest.point
        points.setflags(write=False)
        return points

    def scan(self, positions: FloatArray, rays: int, ranges: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Cast rays at even angles over a full turn from each position. The first ray points along +x.

        Parameters
        ----------
        positions : (n, 2) array, m
            Centers of the robots.
        rays : int
            Number of rays of each robot.
        ranges : (n,) array, m
            Sensing ranges. An infinite range counts as 1e6 m.

        Returns
        -------
        distances : (n, rays) array, m
            Distance to the first obstacle on each ray; the range if there is none. Read-only.
        is_hit : (n, rays) bool array
            Whether there is an obstacle in range on each ray. Read-only.
        """
        limits = np.minimum(ranges, _MAX_RANGE_M)
        ends = positions[:, None, :] + limits[:, None, None] * compute_ray_directions(rays)
        fractions, is_hit = self._cast_rays(positions, ends)
        distances = limits[:, None] * fractions
        distances.setflags(write=False)
        is_hit.setflags(write=False)
        return distances, is_hit

    def scan_from(
        self, position: FloatArray, rays: int, sensing_range: float
    ) -> tuple[FloatArray, FloatArray]:
        """Cast rays at even angles over a full turn from one position. The first ray points along +x.

        Parameters
        ----------
        position : (2,) array, m
            Start of the rays.
        rays : int
            Number of rays.
        sensing_range : float, m
            Sensing range. An infinite range counts as 1e6 m.

        Returns
        -------
        distances : (rays,) array, m
            Distance to the first obstacle on each ray; the range if there is none.
        ends : (rays, 2) array, m
            Points at which the rays end.
        """
        distances, _ = self.scan(np.asarray(position)[None], rays, np.array([sensing_range]))
        return distances[0], position + distances[0][:, None] * compute_ray_directions(rays)

    def _cast_rays(self, positions: FloatArray, ends: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return the fraction of each ray up to the first shape, and whether there is one.

        Parameters
        ----------
        positions : (n, 2) array, m
            Start of the rays of each robot.
        ends : (n, rays, 2) array, m
            End of each ray.

        Returns
        -------
        fractions : (n, rays) array
            1 for a ray that meets no shape.
        is_hit : (n, rays) bool array
        """
        fractions = np.ones(ends.shape[:2])
        is_hit = np.zeros(ends.shape[:2], dtype=bool)
        for row, (position, robot_ends) in enumerate(zip(positions.tolist(), ends.tolist(), strict=True)):
            for ray, end in enumerate(robot_ends):
                hit = self._space.segment_query_first(tuple(position), tuple(end), 0.0, _EVERYTHING)
                if hit is not None:
                    fractions[row, ray] = hit.alpha
                    is_hit[row, ray] = True
        return fractions, is_hit
