"""Paths along which obstacles move, and the area that they sweep."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal, TypeAlias, get_args

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import compute_lengths, to_tuples
from robocov.typing import FloatArray, Ring

Repeat: TypeAlias = Literal["loop", "back-and-forth"]
"""Motion of an obstacle at the end of a path: straight to the first point, or back along the path."""
REPEATS: tuple[str, ...] = get_args(Repeat)
"""The values of `Repeat`."""
_PARALLEL_TOLERANCE_M2 = 1e-12
"""Maximum cross product of an edge and the motion if the edge counts as parallel to the motion. Such an edge
sweeps no area."""


@dataclass(frozen=True)
class ObstaclePath:
    """A polyline along which an obstacle moves at constant speed, without turning.

    The polyline gives the displacement of the obstacle, which is at its position in the map at time zero. The
    displacement is the vector from the first of `points` to a point that moves along the polyline.

    Attributes
    ----------
    points : (k, 2) sequence, m
        Vertices of the polyline.
    speed : float, m/s
        Constant speed, above 0.
    repeat : {"loop", "back-and-forth"}
        How the obstacle continues at the end: straight to the first point, or back along the path.

    See Also
    --------
    Environment.at : The map at a time, with its moving obstacles at their positions.
    TimeVaryingCost : The coverage cost of a map whose obstacles move.

    Examples
    --------
    >>> import robocov as rc
    >>> path = rc.ObstaclePath(((0.0, 0.0), (4.0, 0.0)), speed=2.0, repeat="back-and-forth")
    >>> path.period
    4.0
    >>> path.compute_displacement(3.0)
    array([2., 0.])
    """

    points: Ring
    speed: float
    repeat: Repeat = "loop"

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", to_tuples(self.points))

    @cached_property
    def _round_trip(self) -> tuple[FloatArray, FloatArray]:
        """Points of one round trip, (k, 2) m, and the path length up to each point, (k,) m."""
        outward_points = np.array(self.points, dtype=float)
        if self.repeat == "loop":
            return_points = outward_points[:1]
        else:
            # In reverse order, without the last point, at which the obstacle turns around.
            return_points = outward_points[:-1][::-1]
        points = np.concatenate([outward_points, return_points])
        lengths = compute_lengths(np.diff(points, axis=0))
        return points, np.concatenate([[0.0], np.cumsum(lengths)])

    @property
    def period(self) -> float:
        """Duration of one round trip, s."""
        _, path_lengths = self._round_trip
        return float(path_lengths[-1]) / self.speed

    def compute_displacement(self, time: float) -> FloatArray:
        """Compute the displacement of the obstacle since time zero.

        Parameters
        ----------
        time : float, s
            Time since the beginning of a run.

        Returns
        -------
        (2,) array, m
            Vector from the position in the map to the position at this time.
        """
        points, path_lengths = self._round_trip
        path_length = (time * self.speed) % path_lengths[-1]
        x = np.interp(path_length, path_lengths, points[:, 0])
        y = np.interp(path_length, path_lengths, points[:, 1])
        return np.asarray(np.array([x, y]) - points[0])

    def advance(self, time: float) -> ObstaclePath:
        """Return the path that continues this one from a given time, as a loop.

        Parameters
        ----------
        time : float, s
            Time since the beginning of a run.

        Returns
        -------
        ObstaclePath
            Path that starts at the obstacle's position at this time. It is a loop even if this path is not.

        Examples
        --------
        >>> import robocov as rc
        >>> path = rc.ObstaclePath(((0.0, 0.0), (4.0, 0.0)), speed=2.0)
        >>> path.advance(1.0)
        ObstaclePath(points=((2.0, 0.0), (4.0, 0.0), (0.0, 0.0)), speed=2.0, repeat='loop')
        """
        points, path_lengths = self._round_trip
        path_length = (time * self.speed) % path_lengths[-1]
        current_point = points[0] + self.compute_displacement(time)
        # The last point of a round trip is the first one again.
        vertices = points[:-1]
        is_ahead = path_lengths[:-1] > path_length
        is_behind = path_lengths[:-1] < path_length
        loop = np.concatenate([[current_point], vertices[is_ahead], vertices[is_behind]])
        return ObstaclePath(to_tuples(loop.tolist()), self.speed, "loop")


def compute_swept_area(shape: BaseGeometry, path: ObstaclePath) -> BaseGeometry:
    """Compute the area that an obstacle sweeps on its path.

    Parameters
    ----------
    shape : Polygon or MultiPolygon, m
        The obstacle at time zero.
    path : ObstaclePath
        Path along which the obstacle moves.

    Returns
    -------
    geometry, m
        All points that the obstacle covers at some time.
    """
    points = [*path.points]
    if path.repeat == "loop":
        points += path.points[:1]
    displacements = np.array(points, dtype=float)
    displacements = displacements - displacements[:1]
    swept_areas: list[BaseGeometry] = []
    for polygon in shapely.get_parts(shape):
        swept_areas += [_sweep(polygon, start, end) for start, end in pairwise(displacements)]
    return shapely.union_all([shape, *swept_areas])


def _sweep(polygon: Polygon, start: FloatArray, end: FloatArray) -> BaseGeometry:
    """Return the area that a polygon sweeps while its displacement changes from `start` to `end`.

    The area is the union of the polygon at both displacements and the parallelograms that its edges sweep.
    """
    pieces: list[BaseGeometry] = []
    motion = end - start
    for ring in (polygon.exterior, *polygon.interiors):
        corners = shapely.get_coordinates(ring)
        first = corners[:-1]
        second = corners[1:]
        edges = second - first
        parallelograms = np.stack([first + start, second + start, second + end, first + end], axis=1)
        cross_products = edges[:, 0] * motion[1] - edges[:, 1] * motion[0]
        is_parallel = np.abs(cross_products) < _PARALLEL_TOLERANCE_M2
        pieces += shapely.polygons(parallelograms[~is_parallel]).tolist()
    for displacement in (start, end):
        pieces.append(shapely.transform(polygon, lambda points, by=displacement: points + by))
    return shapely.union_all(pieces)
