"""Advice on runs with unsuitable parameters, based on their records."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array, IntArray, compute_point_distances
from robocov.errors import format_count, summarize_names
from robocov.metrics.clearance import MAX_CONTACT_GAP_M
from robocov.record import Record

TREMBLE_WINDOW_S = 5.0
"""Length of the period at the end of a run that is checked for trembling."""
MIN_TREMBLE_STEP_M = 0.05
"""Minimum mean displacement of a trembling robot per control step; a robot at rest moves less in 4 s."""
MIN_TREMBLE_TURN = np.pi / 6.0
"""Minimum mean turn of a trembling robot per control step, rad: an oscillation takes at most 12 steps."""
MIN_TREMBLE_DETOUR = 5.0
"""Minimum ratio of path length to net displacement of a trembling robot."""

MAX_ZIGZAG_PERIOD_S = 3.0
"""Maximum time between contacts with opposite walls that count as one zigzag."""
MAX_OPPOSITE_COSINE = -0.5
"""Walls are opposite if the cosine of the angle between the directions away from them is below this: the
angle is more than 120 degrees."""
MIN_ZIGZAGS = 5
"""Minimum number of zigzags of a robot that are reported."""

_MIN_DISTANCE_M = 1e-12
"""Lower limit of distances in divisions."""


def advise(record: Record, clearances: Array) -> list[str]:
    """Find signs that the control period or the maximum acceleration is unsuitable.

    Parameters
    ----------
    record : Record
    clearances : (T, n) array, m
        Gap between each robot and the nearest wall, from `clearance.compute_clearances`.

    Returns
    -------
    list of str
        One or two sentences for each finding; empty if there is none.

    Notes
    -----
    Forces are constant during a control step of length dt. A robot of mass m and viscosity nu that is held
    by a stiffness K, such as the slope of the repulsion at its position, is stable under sampling only while
    K is below about 2 nu / dt: at longer periods it reacts too late, and swings with a period of a few
    steps. Such robots stay in one place, although they move by centimeters in every step and turn sharply
    between steps. This does not happen if the control period is short enough.

    In a passage, the same happens if a robot cannot accelerate enough: a swing of amplitude A across it
    requires the acceleration A K / m. If the limit is lower, the robot reaches the opposite wall before it
    has stopped. Contacts with opposite walls within a short time are therefore counted; sliding along a wall
    or bumping into the same wall again and again is not.

    Examples
    --------
    >>> import robocov as rc
    >>> from robocov.metrics import compute_clearances
    >>> rooms = rc.load_map("rooms")
    >>> record = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(6), dt=0.25).run(30.0)
    >>> advise(record, compute_clearances(record))  # doctest: +ELLIPSIS
    ['The team trembles: ... the control period of 0.25 s is too long ...']
    """
    trembling = find_trembling(record)
    if len(trembling):
        return [_describe_trembling(record, trembling)]
    zigzags = count_zigzags(record, clearances)
    if zigzags.max(initial=0) >= MIN_ZIGZAGS:
        return [_describe_zigzags(record, zigzags)]
    return []


def find_trembling(record: Record) -> IntArray:
    """Find the robots that tremble at the end of a run.

    Parameters
    ----------
    record : Record
        Must contain every control step; otherwise, no robots are found.

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
    net_displacement = compute_point_distances(positions[-1], positions[0])
    turning_angles = _compute_turning_angles(displacements)
    is_trembling = step_lengths.mean(axis=0) >= MIN_TREMBLE_STEP_M
    is_trembling &= turning_angles.mean(axis=0) >= MIN_TREMBLE_TURN
    is_trembling &= step_lengths.sum(axis=0) >= MIN_TREMBLE_DETOUR * net_displacement
    is_trembling &= record.traveled[-step_count:].all(axis=0) & record.working[-step_count:].all(axis=0)
    return np.flatnonzero(is_trembling)


def _compute_turning_angles(displacements: Array) -> Array:
    """Return the magnitudes of the angles between consecutive displacements, (k - 1, n) rad."""
    incoming = displacements[:-1]
    outgoing = displacements[1:]
    cross = incoming[..., 0] * outgoing[..., 1] - incoming[..., 1] * outgoing[..., 0]
    return np.asarray(np.abs(np.arctan2(cross, (incoming * outgoing).sum(axis=-1))))


def count_zigzags(record: Record, clearances: Array) -> IntArray:
    """Count how many times each robot went from contact with a wall to contact with the opposite one.

    Parameters
    ----------
    record : Record
    clearances : (T, n) array, m
        Returned by `clearance.compute_clearances`.

    Returns
    -------
    (n,) int array
    """
    is_touching = clearances <= MAX_CONTACT_GAP_M
    is_new_contact = is_touching.copy()
    is_new_contact[1:] &= ~is_touching[:-1]
    counts = np.zeros(len(record.team), dtype=np.intp)
    for robot in np.flatnonzero(is_new_contact.any(axis=0)).tolist():
        steps = np.flatnonzero(is_new_contact[:, robot])
        normals = record.positions[steps, robot] - record.obstacle_points[steps, robot]
        normals /= np.maximum(compute_point_distances(normals, np.zeros(2)), _MIN_DISTANCE_M)[:, None]
        # The cosine is nan, and the walls are not opposite, if a robot sensed nothing.
        is_opposite = (normals[:-1] * normals[1:]).sum(axis=1) < MAX_OPPOSITE_COSINE
        is_soon = np.diff(record.time[steps]) <= MAX_ZIGZAG_PERIOD_S
        counts[robot] = int((is_opposite & is_soon).sum())
    return counts


def _describe_trembling(record: Record, robots: IntArray) -> str:
    """Return the advice for a control period that is too long."""
    step_count = round(TREMBLE_WINDOW_S / record.dt)
    positions = record.positions[-step_count - 1 :, robots]
    step_lengths_cm = 100.0 * compute_point_distances(positions[1:], positions[:-1]).mean(axis=0)
    extent = f"{_format_robots(record, robots)} by up to {float(step_lengths_cm.max()):.0f} cm a step"
    cause = f"the control period of {record.dt:.3g} s is too long for the forces of {record.label}"
    return f"The team trembles: {extent}; {cause}. Try a shorter one (--dt), such as 1/60 s."


def _describe_zigzags(record: Record, zigzags: IntArray) -> str:
    """Return the advice for an acceleration limit that is too low."""
    robots = np.flatnonzero(zigzags >= MIN_ZIGZAGS)
    limit = float(record.team.max_acceleration[robots].min())
    crossings = int(zigzags.sum())
    return (
        f"Zigzag in a narrow passage: {_format_robots(record, robots)} went {crossings} times from one wall "
        f"to the opposite one. Try a higher maximum acceleration than {limit:g} m/s² (--max-acceleration), "
        "or a lower maximum speed (--max-speed)."
    )


def _format_robots(record: Record, robots: IntArray) -> str:
    """Return a phrase that names robots, such as "robots 2 and 5" or "all 6 robots"."""
    if len(robots) == len(record.team) > 1:
        return f"all {format_count(len(robots), 'robot')}"
    names = [str(record.robot_numbers[robot]) for robot in robots.tolist()]
    return f"robot{'s' if len(names) > 1 else ''} {summarize_names(names)}"
