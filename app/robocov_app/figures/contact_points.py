"""Points at which robots came into contact with walls, or with each other, during a run."""

import numpy as np
import shapely
from scipy.spatial import KDTree

from robocov.metrics import MAX_CONTACT_GAP_M, compute_clearances, measure_robot_gaps
from robocov.record import Record
from robocov.typing import FloatArray
from robocov_app.render.crowding import MAX_MARKED_ROBOTS


def find_contact_points(record: Record) -> FloatArray:
    """Find the points at which the contacts of a run began.

    Contacts are those that summaries count: a contact that lasts counts once. None are returned for teams
    that are too large to mark their robots one by one.

    Parameters
    ----------
    record : Record

    Returns
    -------
    (c, 2) array, m
        Points on walls, moving obstacles and failed robots, then points between two robots.
    """
    if len(record.team) > MAX_MARKED_ROBOTS:
        return np.empty((0, 2))
    points = [*_find_wall_points(record), *_find_points_between_robots(record)]
    return np.array(points).reshape(-1, 2)


def _find_wall_points(record: Record) -> list[FloatArray]:
    """Return the points at which contacts with walls and failed robots began, (2,) m each."""
    is_touching = compute_clearances(record) <= MAX_CONTACT_GAP_M
    is_new = is_touching.copy()
    is_new[1:] &= ~is_touching[:-1]
    return [_find_nearest_point(record, step, robot) for step, robot in np.argwhere(is_new).tolist()]


def _find_nearest_point(record: Record, step: int, robot: int) -> FloatArray:
    """Return the point of a wall or of a failed robot that is nearest to a robot at a step, (2,) m."""
    environment = record.environment.at(float(record.time[step]))
    bodies = [environment.free.boundary]
    for failed in np.flatnonzero(record.is_present[step] & ~record.is_working[step]).tolist():
        disc = shapely.Point(record.positions[step, failed]).buffer(record.team.radius[failed])
        bodies.append(disc.exterior)
    center = shapely.Point(record.positions[step, robot])
    nearest = min(bodies, key=center.distance)
    return np.asarray(shapely.get_coordinates(shapely.shortest_line(nearest, center))[0])


def _find_points_between_robots(record: Record) -> list[FloatArray]:
    """Return the points at which contacts between two working robots began, (2,) m each."""
    points = []
    previous_pairs: set[tuple[int, int]] = set()
    previous_step = -1
    for step in np.flatnonzero(measure_robot_gaps(record).min_gaps <= MAX_CONTACT_GAP_M).tolist():
        if step > previous_step + 1:
            previous_pairs = set()
        pairs = _list_touching_pairs(record, step)
        for first, second in sorted(pairs - previous_pairs):
            points.append(_compute_point_between(record, step, first, second))
        previous_pairs = pairs
        previous_step = step
    return points


def _list_touching_pairs(record: Record, step: int) -> set[tuple[int, int]]:
    """Return the pairs of working robots that are in contact at a step, by their rows in the team."""
    working = np.flatnonzero(record.is_working[step])
    positions = record.positions[step, working]
    radius = record.team.radius[working]
    reach = 2.0 * float(radius.max()) + MAX_CONTACT_GAP_M
    first, second = KDTree(positions).query_pairs(reach, output_type="ndarray").T
    distances = np.hypot(*(positions[second] - positions[first]).T)
    is_contact = distances <= radius[first] + radius[second] + MAX_CONTACT_GAP_M
    return set(zip(working[first[is_contact]].tolist(), working[second[is_contact]].tolist(), strict=True))


def _compute_point_between(record: Record, step: int, first: int, second: int) -> FloatArray:
    """Return the point at which two robots touch at a step, (2,) m."""
    radius = record.team.radius
    fraction = radius[first] / (radius[first] + radius[second])
    start = record.positions[step, first]
    return np.asarray(start + fraction * (record.positions[step, second] - start))
