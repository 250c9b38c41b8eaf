"""Advice on runs with unsuitable parameters, based on their records."""

from __future__ import annotations

import numpy as np

from robocov.arrays import compute_point_distances
from robocov.errors import format_count, summarize_names
from robocov.metrics.clearance import MAX_CONTACT_GAP_M
from robocov.record import Record
from robocov.typing import FloatArray, IntArray

TREMBLE_WINDOW_S = 5.0
"""Duration of the period at the end of a run that is checked for trembling."""
MIN_TREMBLE_STEP_M = 0.05
"""Minimum mean displacement of a trembling robot per control step. A robot at rest moves less in 4 s."""
MIN_TREMBLE_TURN_RAD = np.pi / 6.0
"""Minimum mean turn of a trembling robot per control step. An oscillation thus takes at most 12 steps."""
MIN_TREMBLE_DETOUR = 5.0
"""Minimum ratio of path length to net displacement of a trembling robot."""

MAX_ZIGZAG_PERIOD_S = 3.0
"""Maximum time between contacts with opposite walls that count as one zigzag."""
MAX_OPPOSITE_COSINE = -0.5
"""Cosine of the smallest angle, 120 degrees, between the normals of walls that count as opposite."""
MIN_ZIGZAGS = 5
"""Minimum number of zigzags of a robot that are reported."""

_MIN_DISTANCE_M = 1e-12
"""Minimum divisor; prevents division by zero."""


def advise(record: Record, clearances: FloatArray) -> list[str]:
    """Find signs that the control period or the maximum acceleration is unsuitable.

    Parameters
    ----------
    record : Record
        The run.
    clearances : (T, n) array, m
        Gap between each robot and the nearest wall, as returned by `clearance.compute_clearances`.

    Returns
    -------
    list of str
        One or two sentences for each finding; empty if there is no finding.

    Notes
    -----
    Forces are constant during a control step of duration dt. Consider a robot of mass m and viscosity nu, and
    let K be the stiffness of the force on it, such as the slope of the repulsion at its position. Its motion
    is stable only if K is below about 2 nu / dt. If dt is longer, the robot reacts too late, and oscillates
    with a period of a few steps: it trembles. Such a robot stays in one place, although it moves by
    centimeters in every step and turns sharply between steps. A shorter control period prevents this.

    In a passage, a robot also oscillates if it cannot accelerate enough. An oscillation of amplitude A
    between the walls requires the acceleration A K / m. If the maximum acceleration is lower, the robot
    reaches the opposite wall before it stops. The robot therefore zigzags if contacts with opposite walls
    follow each other within a short time. Sliding along a wall does not count, nor does bumping into the same
    wall repeatedly.

    Examples
    --------
    >>> import robocov as rc
    >>> from robocov.metrics import compute_clearances
    >>> rooms = rc.load_map("rooms")
    >>> record = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(6), dt=0.25).run(30.0)
    >>> advise(record, compute_clearances(record))  # doctest: +ELLIPSIS
    ['The team trembles: ... the control period of 0.25 s is too long ...']
    """
    trembling_robots = find_trembling_robots(record)
    if len(trembling_robots) > 0:
        return [_describe_trembling(record, trembling_robots)]
    zigzag_counts = count_zigzags(record, clearances)
    if zigzag_counts.max(initial=0) >= MIN_ZIGZAGS:
        return [_describe_zigzags(record, zigzag_counts)]
    return []


def find_trembling_robots(record: Record) -> IntArray:
    """Find the robots that tremble at the end of a run.

    Parameters
    ----------
    record : Record
        The run. No robots are found unless the record contains every control step.

    Returns
    -------
    (k,) int array
        Indices of the robots, ascending.
    """
    step_count = round(TREMBLE_WINDOW_S / record.dt)
    if step_count < 2 or len(record) <= step_count:
        return np.zeros(0, dtype=np.intp)
    if not np.allclose(np.diff(record.time[-step_count - 1 :]), record.dt, rtol=0.01, atol=0.0):
        return np.zeros(0, dtype=np.intp)
    positions = record.positions[-step_count - 1 :]
    displacements = np.diff(positions, axis=0)
    step_lengths = compute_point_distances(positions[1:], positions[:-1])
    net_displacements = compute_point_distances(positions[-1], positions[0])
    turning_angles = _compute_turning_angles(displacements)
    is_trembling = step_lengths.mean(axis=0) >= MIN_TREMBLE_STEP_M
    is_trembling &= turning_angles.mean(axis=0) >= MIN_TREMBLE_TURN_RAD
    is_trembling &= step_lengths.sum(axis=0) >= MIN_TREMBLE_DETOUR * net_displacements
    is_trembling &= record.traveled[-step_count:].all(axis=0) & record.is_working[-step_count:].all(axis=0)
    return np.flatnonzero(is_trembling)


def _compute_turning_angles(displacements: FloatArray) -> FloatArray:
    """Return the magnitudes of the angles between consecutive displacements, (k - 1, n) rad."""
    incoming = displacements[:-1]
    outgoing = displacements[1:]
    cross_products = incoming[..., 0] * outgoing[..., 1] - incoming[..., 1] * outgoing[..., 0]
    dot_products = (incoming * outgoing).sum(axis=-1)
    return np.asarray(np.abs(np.arctan2(cross_products, dot_products)))


def count_zigzags(record: Record, clearances: FloatArray) -> IntArray:
    """Count how many times each robot moved quickly from one wall to the opposite wall, touching both.

    Parameters
    ----------
    record : Record
        The run.
    clearances : (T, n) array, m
        Gap between each robot and the nearest wall, as returned by `clearance.compute_clearances`.

    Returns
    -------
    (n,) int array
        Number of zigzags of each robot.
    """
    is_touching = clearances <= MAX_CONTACT_GAP_M
    is_new_contact = is_touching.copy()
    is_new_contact[1:] &= ~is_touching[:-1]
    counts = np.zeros(len(record.team), dtype=np.intp)
    for robot in np.flatnonzero(is_new_contact.any(axis=0)).tolist():
        steps = np.flatnonzero(is_new_contact[:, robot])
        # Unit vectors from the walls to the robot.
        normals = record.positions[steps, robot] - record.obstacle_points[steps, robot]
        normals /= np.maximum(compute_point_distances(normals, np.zeros(2)), _MIN_DISTANCE_M)[:, None]
        # If a robot sensed nothing, the cosine is nan, and the comparison is false.
        is_opposite = (normals[:-1] * normals[1:]).sum(axis=1) < MAX_OPPOSITE_COSINE
        is_soon = np.diff(record.time[steps]) <= MAX_ZIGZAG_PERIOD_S
        counts[robot] = int((is_opposite & is_soon).sum())
    return counts


def _describe_trembling(record: Record, robots: IntArray) -> str:
    """Build the advice for a control period that is too long."""
    step_count = round(TREMBLE_WINDOW_S / record.dt)
    positions = record.positions[-step_count - 1 :, robots]
    step_lengths_cm = 100.0 * compute_point_distances(positions[1:], positions[:-1]).mean(axis=0)
    extent = f"{_format_robots(record, robots)} by up to {float(step_lengths_cm.max()):.0f} cm a step"
    cause = f"the control period of {record.dt:.3g} s is too long for the forces of {record.label}"
    return f"The team trembles: {extent}; {cause}. Try a shorter one (--dt), such as 1/60 s."


def _describe_zigzags(record: Record, zigzag_counts: IntArray) -> str:
    """Build the advice for a maximum acceleration that is too low."""
    robots = np.flatnonzero(zigzag_counts >= MIN_ZIGZAGS)
    max_acceleration = float(record.team.max_acceleration[robots].min())
    total = int(zigzag_counts.sum())
    return (
        f"Zigzag in a narrow passage: {_format_robots(record, robots)} went {total} times from one wall "
        f"to the opposite one. Try a higher maximum acceleration than {max_acceleration:g} m/s² "
        "(--max-acceleration), or a lower maximum speed (--max-speed)."
    )


def _format_robots(record: Record, robots: IntArray) -> str:
    """Return a phrase that names robots, such as "robots 2 and 5" or "all 6 robots"."""
    if len(robots) == len(record.team) > 1:
        return f"all {format_count(len(robots), 'robot')}"
    names = [str(record.robot_numbers[robot]) for robot in robots.tolist()]
    return f"robot{'s' if len(names) > 1 else ''} {summarize_names(names)}"
