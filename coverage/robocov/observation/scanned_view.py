"""The free space that is visible in a range scan, and the corners that hide more of it."""

import math
from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.density.base import Density
from robocov.observation.observations import Observations
from robocov.observation.scans import Scanning
from robocov.typing import BoolArray, FloatArray, IntArray

_PATH_INTERVALS = 4
"""Number of equal intervals into which a path is divided. The points between them are tested for walls."""
_MIN_DISTANCE_M = 1e-9
"""Minimum divisor; prevents division by zero."""
_MIN_CORNER_DISTANCE_M = 1e-3
"""Minimum distance of a corner used as a divisor; limits the growth of the view at very close corners."""
_DECELERATION_FACTOR = 0.5
"""Factor of the fraction of full speed after the gradient has turned by more than a right angle."""
_ACCELERATION_FACTOR = 1.2
"""Factor of the fraction of full speed otherwise; the fraction does not exceed 1."""


class View(NamedTuple):
    """Visible distances along the rays of the last scan of each robot."""

    distances: FloatArray
    """(n, rays) m, at most the range of the view."""
    is_hit: BoolArray
    """(n, rays) Whether the ray ends at an obstacle."""


class OcclusionEdges(NamedTuple):
    """Edges of views that begin at a corner and turn about it when the robot moves; sorted by robot.

    Seen from a position p, a corner v at distance ρ hides the space behind it. When p moves by d, the point
    of the edge at distance s from p moves by -(d · t) (s - ρ)/ρ, where t is the unit vector across the edge,
    away from the obstacle. The view thus grows by t (s - ρ)/ρ per meter of edge and per meter of motion.
    """

    robots: IntArray
    """(w,) Index of the robot."""
    rays: IntArray
    """(w,) Index of the first ray that passes the corner."""
    motion_directions: FloatArray
    """(w, 2) t, the direction in which the robot has to move to see more."""
    corner_distances: FloatArray
    """(w,) m, ρ."""


def compute_view(
    seen: Observations, previous: View | None, scanning: Scanning, max_distances: FloatArray
) -> View:
    """Return the views of the robots, which are those of their last scans.

    Parameters
    ----------
    seen : Observations
        If they contain scans, the view is taken from these.
    previous : View or None
        The view at the previous step. None before the first scan, when everything in range is assumed free.
    scanning : Scanning
        Settings of the scans.
    max_distances : (n,) array, m
        Range of each robot's view.

    Returns
    -------
    View
    """
    if seen.scans is not None:
        return View(np.minimum(seen.scans.distances, max_distances[:, None]), seen.scans.is_hit)
    if previous is not None:
        return previous
    shape = (len(max_distances), scanning.rays)
    return View(distances=np.broadcast_to(max_distances[:, None], shape), is_hit=np.zeros(shape, dtype=bool))


def find_occlusion_edges(
    view: View, ray_directions: FloatArray, max_distances: FloatArray, min_jump: float
) -> OcclusionEdges:
    """Find the rays that reach abruptly farther than the adjacent ray on either side.

    Seen at a low angle, a wall also becomes deeper from ray to ray. Along a straight wall, 1/distance is a
    sinusoid of the angle, so two rays predict where the next one meets the wall. Only a ray that goes
    farther than predicted passes a corner.

    Parameters
    ----------
    view : View
    ray_directions : (rays, 2) array
        Unit vectors along the rays.
    max_distances : (n,) array, m
        Range of each robot's view.
    min_jump : float, m
        Minimum distance by which a ray past a corner exceeds the predicted depth.

    Returns
    -------
    OcclusionEdges
    """
    robots_by_rotation = []
    rays_by_rotation = []
    motion_directions = []
    corner_distances = []
    # Compare each ray with the one before it, counter-clockwise and clockwise.
    for rotation in (1, -1):
        previous_depths = np.roll(view.distances, rotation, axis=1)
        is_previous_hit = np.roll(view.is_hit, rotation, axis=1)
        is_deeper = view.distances > _predict_depth(view, max_distances, rotation) + min_jump
        robots, rays = np.nonzero(is_previous_hit & is_deeper)
        robots_by_rotation.append(robots)
        rays_by_rotation.append(rays)
        # The direction of the ray, turned by a right angle.
        motion_directions.append(rotation * ray_directions[rays][:, ::-1] * [-1.0, 1.0])
        corner_distances.append(previous_depths[robots, rays])
    all_robots = np.concatenate(robots_by_rotation)
    order = np.argsort(all_robots, kind="stable")
    return OcclusionEdges(
        robots=all_robots[order],
        rays=np.concatenate(rays_by_rotation)[order],
        motion_directions=np.concatenate(motion_directions)[order],
        corner_distances=np.concatenate(corner_distances)[order],
    )


def integrate_over_edges(
    edges: OcclusionEdges, view: View, depths: FloatArray, weight: FloatArray
) -> FloatArray:
    """Compute the growth rate of the weighted area of a view at each of its edges.

    Parameters
    ----------
    edges : OcclusionEdges
    view : View
    depths : (n, rays, k) array, m
        Distances of the midpoints of k equal parts of each ray.
    weight : (n, rays, k) array
        Weight of the area at these points.

    Returns
    -------
    (w, 2) array, m
        The growth of the weighted area per meter of the robot's motion: the integral of weight * (s - ρ)/ρ
        along the edge beyond the corner, times t. For the symbols, see `OcclusionEdges`.
    """
    part_count = depths.shape[2]
    edge_depths = depths[edges.robots, edges.rays]
    beyond_corner = np.maximum(edge_depths - edges.corner_distances[:, None], 0.0)
    integral = (weight[edges.robots, edges.rays] * beyond_corner).sum(axis=1)
    integral /= np.maximum(edges.corner_distances, _MIN_CORNER_DISTANCE_M)
    integral *= view.distances[edges.robots, edges.rays] / part_count
    return np.asarray(integral[:, None] * edges.motion_directions)


def _predict_depth(view: View, max_distances: FloatArray, rotation: int) -> FloatArray:
    """Predict the depth of each ray, (n, rays) m, on the line through the end points of the two before it.

    The rays are in counter-clockwise order if `rotation` is 1, and in clockwise order if it is -1. The
    prediction is never below the depth of the previous ray, which is also used if the second ray before hits
    nothing.
    """
    inverse_distances = 1.0 / np.maximum(view.distances, _MIN_DISTANCE_M)
    # A sinusoid f satisfies f(a + b) = 2 cos(b) f(a) - f(a - b); here b is the angle between two rays.
    factor = 2.0 * np.cos(2.0 * np.pi / view.distances.shape[1])
    first_before = np.roll(inverse_distances, rotation, axis=1)
    second_before = np.roll(inverse_distances, 2 * rotation, axis=1)
    predicted_inverse = factor * first_before - second_before
    wall_depth = 1.0 / np.maximum(predicted_inverse, 1.0 / max_distances[:, None])
    previous_depth = np.roll(view.distances, rotation, axis=1)
    has_second_hit = np.roll(view.is_hit, 2 * rotation, axis=1)
    return np.where(has_second_hit, np.maximum(wall_depth, previous_depth), previous_depth)


def evaluate_density(density: Density | None, points: FloatArray) -> FloatArray:
    """Evaluate a density at points.

    Parameters
    ----------
    density : Density or None
        None: 1 everywhere.
    points : (..., 2) array, m

    Returns
    -------
    (...) array
    """
    if density is None:
        return np.ones(points.shape[:-1])
    return density.evaluate(points.reshape(-1, 2)).reshape(points.shape[:-1])


def compute_speed_fractions(
    gradient: FloatArray, previous: FloatArray | None, fraction: FloatArray | None
) -> FloatArray:
    """Compute the fraction of full speed at which robots follow discontinuous gradients.

    The visible area as a function of the position has ridges, for example at doors. On both sides of a ridge
    the gradient points toward the ridge, so a robot at full speed would oscillate. The fraction is therefore
    halved whenever the gradient turns by more than a right angle, and grows again otherwise.

    Parameters
    ----------
    gradient : (n, 2) array
        Gradients after this scan.
    previous : (n, 2) array or None
        Gradients after the previous scan; None if there was none.
    fraction : (n,) array or None
        Fractions after the previous scan; None if there was none.

    Returns
    -------
    (n,) array
        At most 1.
    """
    if previous is None or fraction is None:
        return np.ones(len(gradient))
    has_turned = (gradient * previous).sum(axis=1) < 0.0
    accelerated = np.minimum(_ACCELERATION_FACTOR * fraction, 1.0)
    return np.where(has_turned, _DECELERATION_FACTOR * fraction, accelerated)


@kernel
def is_behind_wall(x: float, y: float, wall_distances: FloatArray) -> bool:
    """Return whether a point, relative to the robot, is farther away than the wall in its direction.

    Parameters
    ----------
    x, y : float, m
    wall_distances : (rays,) array, m
        Distances of the walls along evenly spaced rays, counter-clockwise from the direction of x; infinite
        where there is none. The ray nearest to the direction of the point is used.

    Returns
    -------
    bool
    """
    ray_count = len(wall_distances)
    nearest_ray = math.floor(math.atan2(y, x) * (ray_count / (2.0 * math.pi)) + 0.5) % ray_count
    return bool(x * x + y * y > wall_distances[nearest_ray] ** 2)


@kernel
def is_path_clear(x: float, y: float, dx: float, dy: float, wall_distances: FloatArray) -> bool:
    """Return whether a straight path stays in front of the walls that the robot sees.

    The start and the end of the path are not tested.

    Parameters
    ----------
    x, y : float, m
        Start of the path, in view of the robot and relative to it.
    dx, dy : float, m
        Displacement from the start to the end of the path.
    wall_distances : (rays,) array, m
        As for `is_behind_wall`.

    Returns
    -------
    bool
    """
    for k in range(1, _PATH_INTERVALS):
        if is_behind_wall(x + dx * k / _PATH_INTERVALS, y + dy * k / _PATH_INTERVALS, wall_distances):
            return False
    return True
