"""Clearances of robots from walls, gaps between robots, and contacts.

The clearance of a robot is the gap between its rim and the nearest wall. Both a clearance and a gap are
negative if the bodies overlap.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from robocov.arrays import compute_point_distances
from robocov.compiled import kernel
from robocov.record import Record
from robocov.sensor import RangeSensor
from robocov.typing import FloatArray, IntArray
from robocov.world.obstacle_pieces import build_moving_obstacles, build_solid_pieces

MAX_CONTACT_GAP_M = 1e-3
"""Maximum gap at which two bodies count as in contact."""

_FIRST_RANGE_M = 1.0
"""Range of the first query for a nearest wall. A query with a larger range takes longer."""
_RANGE_FACTOR = 4.0
"""Factor between the ranges of successive queries."""


class RobotGaps(NamedTuple):
    """Gaps between the rims of robots over a run."""

    min_gaps: FloatArray
    """(T,) m, the smallest gap between two working robots at each time step; inf if fewer than two work."""
    contact_count: int
    """Number of times that two robots came into contact."""


def compute_clearances(record: Record) -> FloatArray:
    """Compute the gap between each robot's rim and the nearest wall, at each time step.

    Parameters
    ----------
    record : Record
        The run.

    Returns
    -------
    (T, n) array, m
        Clearances; inf for robots that do not work. Moving obstacles and robots that have failed count as
        walls.
    """
    if record.conditions is not None or record.environment.has_moving_obstacles:
        return _compute_clearances_by_queries(record)
    return _compute_clearances_from_sensed_points(record)


def _compute_clearances_from_sensed_points(record: Record) -> FloatArray:
    """Compute the clearances from the obstacle points that the robots sensed.

    This is valid only if walls do not change and sensing is exact. A robot that sensed no obstacle is farther
    from all walls than its sensing range.
    """
    positions = record.positions.reshape(-1, 2)
    nearest_points = record.obstacle_points.reshape(-1, 2).copy()
    has_sensed_nothing = np.isnan(nearest_points[:, 0])
    if has_sensed_nothing.any():
        nearest_points[has_sensed_nothing] = _find_distant_points(record, positions[has_sensed_nothing])
    distances = compute_point_distances(positions, nearest_points).reshape(record.positions.shape[:2])
    return np.asarray(distances - record.team.radius)


def _find_distant_points(record: Record, positions: FloatArray) -> FloatArray:
    """Find the wall points nearest to positions at any distance, (k, 2) m, by queries of growing range."""
    sensor = RangeSensor(build_solid_pieces(record.environment))
    nearest_points = np.full(positions.shape, np.nan)
    missing_rows = np.arange(len(positions))
    query_range = _FIRST_RANGE_M
    while len(missing_rows) > 0:
        ranges = np.full(len(missing_rows), query_range)
        nearest_points[missing_rows] = sensor.find_nearest_points(positions[missing_rows], ranges)
        missing_rows = missing_rows[np.isnan(nearest_points[missing_rows, 0])]
        query_range *= _RANGE_FACTOR
    return nearest_points


def _compute_clearances_by_queries(record: Record) -> FloatArray:
    """Compute the clearances by a query for the nearest wall of each robot at each time step.

    Unlike the sensed points, queries are also valid for noisy sensing, moving obstacles and failed robots.
    """
    environment = record.environment
    is_working = record.is_working
    radius = record.team.radius
    sensor = RangeSensor(build_solid_pieces(environment), build_moving_obstacles(environment))
    has_failed = record.is_present & ~is_working
    # No wall is farther away than the diagonal of the region.
    width, height = np.ptp(environment.region.vertices, axis=0)
    ranges = np.full(len(radius), float(np.hypot(width, height)))
    clearances = np.full(is_working.shape, np.inf)
    for step, positions in enumerate(record.positions):
        failed_robots = np.column_stack([positions, radius])[has_failed[step]]
        sensor.set_time(float(record.time[step]), failed_robots)
        rows = np.flatnonzero(is_working[step])
        nearest_points = sensor.find_nearest_points(positions[rows], ranges[rows])
        distances = compute_point_distances(positions[rows], nearest_points)
        clearances[step, rows] = distances - radius[rows]
    return clearances


def count_contacts(record: Record, clearances: FloatArray) -> int:
    """Count the contacts of robots with walls and with each other.

    Parameters
    ----------
    record : Record
        The run.
    clearances : (T, n) array, m
        Gaps between robots and walls, as returned by `compute_clearances`.

    Returns
    -------
    int
        Number of contacts. A contact that lasts counts once.
    """
    is_touching = clearances <= MAX_CONTACT_GAP_M
    is_new_contact = is_touching[1:] & ~is_touching[:-1]
    wall_contact_count = int(is_touching[0].sum() + is_new_contact.sum())
    return wall_contact_count + measure_robot_gaps(record).contact_count


def measure_robot_gaps(record: Record) -> RobotGaps:
    """Measure the gaps between the rims of working robots, and count their contacts.

    Parameters
    ----------
    record : Record
        The run.

    Returns
    -------
    RobotGaps
        Minimum gaps and number of contacts.
    """
    positions = np.where(record.is_working[:, :, None], record.positions, np.nan)
    min_gaps = np.full(len(positions), np.inf)
    contact_count = _measure_gaps(
        positions=positions,
        radius=np.array(record.team.radius),
        order=positions[:, :, 0].argsort(axis=1),
        min_gaps=min_gaps,
    )
    return RobotGaps(min_gaps, contact_count)


@kernel
def _measure_gaps(positions: FloatArray, radius: FloatArray, order: IntArray, min_gaps: FloatArray) -> int:
    """Write the smallest gap of each time step to `min_gaps`, (T,) m; return the number of contacts.

    `order`, (T, n), contains the indices of the robots, sorted by x at each time step. The positions of
    robots that do not work are nan, and come last. Each robot is compared with the following ones, until they
    are too far away in x. A contact counts at the time step at which it starts.
    """
    max_diameter = 0.0
    for i in range(len(radius)):
        max_diameter = max(max_diameter, 2.0 * radius[i])
    contact_count = 0
    for t in range(len(positions)):
        for first in range(len(radius)):
            i = order[t, first]
            for second in range(first + 1, len(radius)):
                j = order[t, second]
                # This is a lower bound on the gap, from x alone. It grows with each following robot, so that
                # the loop can end at the first bound above the limit. For a robot that does not work, the
                # bound is nan, which ends the loop too.
                gap_bound = positions[t, j, 0] - positions[t, i, 0] - max_diameter
                if not gap_bound <= max(min_gaps[t], MAX_CONTACT_GAP_M):
                    break
                radius_sum = radius[i] + radius[j]
                contact_distance = radius_sum + MAX_CONTACT_GAP_M
                distance = _compute_distance(positions, t, i, j)
                min_gaps[t] = min(min_gaps[t], distance - radius_sum)
                is_in_contact = distance <= contact_distance
                was_in_contact = t > 0 and _compute_distance(positions, t - 1, i, j) <= contact_distance
                if is_in_contact and not was_in_contact:
                    contact_count += 1
    return contact_count


@kernel
def _compute_distance(positions: FloatArray, t: int, i: int, j: int) -> float:
    """Return the distance between the centers of robots i and j at time step t, m."""
    return math.sqrt(
        (positions[t, i, 0] - positions[t, j, 0]) ** 2 + (positions[t, i, 1] - positions[t, j, 1]) ** 2
    )
