"""Advice on a run whose parameters do not suit each other, measured on its record."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.errors import format_count, summarize_names
from robocov.record import Record

TREMBLE_WINDOW_S = 5.0
"""Last part of a run in which trembling is looked for."""
MIN_TREMBLE_STEP_M = 0.05
"""Mean displacement in one control step of a robot that trembles: what a robot at rest moves in 4 s."""
MIN_TREMBLE_TURN = np.pi / 6.0
"""Mean turn in one control step, rad: an oscillation has at most 12 steps, and is hardly controlled."""
MIN_TREMBLE_DETOUR = 5.0
"""Path length over net displacement of a robot that gets nowhere."""

CONTACT_GAP_M = 1e-3
"""Gap to a wall below which a robot is in contact with it."""
MAX_ZIGZAG_PERIOD_S = 3.0
"""Time between contacts with opposite walls that belong together."""
MIN_ZIGZAGS = 5
"""Number of times that a robot goes from contact with one wall to contact with the opposite one."""


def advise(record: Record, clearance: Array) -> list[str]:
    """Find signs that the control period or the acceleration does not suit a run.

    Parameters
    ----------
    record : Record
    clearance : (T, n) array, m
        Gap between each robot and the nearest wall, as `robocov.metrics.clearances` returns it.

    Returns
    -------
    list of str
        One sentence or two for each finding; empty for an ordinary run.

    Notes
    -----
    Forces are constant during a control step of length dt. A robot of mass m and viscosity nu that is held
    by a stiffness K, such as the slope of the repulsion at its place, is stable under sampling only while K
    is below about 2 nu / dt: at longer periods it answers too late, and swings with a period of a few steps.
    That is what is looked for: robots that get nowhere, though they move by centimetres in every step and
    turn sharply from one to the next. A control period that is short enough cannot give such a record.

    In a passage the same happens where a robot cannot accelerate enough: a swing of amplitude A across it
    needs the acceleration A K / m. Where the limit is lower, the robot reaches the opposite wall before it
    has stopped. So contacts with opposite walls within a short time are counted. Robots that slide along a
    wall, or bump into one again and again, are not meant.

    Examples
    --------
    >>> import robocov as rc
    >>> from robocov.metrics import clearances
    >>> rooms = rc.load_map("rooms")
    >>> record = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(6), dt=0.25).run(30.0)
    >>> advise(record, clearances(record))  # doctest: +ELLIPSIS
    ['The team trembles: ... the control period of 0.25 s is too long ...']
    """
    trembling = find_trembling(record)
    if len(trembling):
        return [_describe_trembling(record, trembling)]
    zigzags = count_zigzags(record, clearance)
    if zigzags.max(initial=0) >= MIN_ZIGZAGS:
        return [_describe_zigzags(record, zigzags)]
    return []


def find_trembling(record: Record) -> IntArray:
    """Find the robots that tremble at the end of a run, ascending row numbers.

    A record without every control step has none: its displacements are not those of single steps.
    """
    steps = round(TREMBLE_WINDOW_S / record.dt)
    if steps < 2 or len(record) <= steps:
        return np.zeros(0, dtype=np.intp)
    if not np.allclose(np.diff(record.time[-steps - 1 :]), record.dt, rtol=0.01, atol=0.0):
        return np.zeros(0, dtype=np.intp)
    positions = record.positions[-steps - 1 :]
    moved = np.diff(positions, axis=0)
    length = np.sqrt((moved**2).sum(axis=-1))
    net = np.sqrt(((positions[-1] - positions[0]) ** 2).sum(axis=-1))
    before, after = moved[:-1], moved[1:]
    cross = before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0]
    turn = np.abs(np.arctan2(cross, (before * after).sum(axis=-1)))
    trembles = length.mean(axis=0) >= MIN_TREMBLE_STEP_M
    trembles &= turn.mean(axis=0) >= MIN_TREMBLE_TURN
    trembles &= length.sum(axis=0) >= MIN_TREMBLE_DETOUR * net
    trembles &= record.travelled[-steps:].all(axis=0) & record.working[-steps:].all(axis=0)
    return np.flatnonzero(trembles)


def count_zigzags(record: Record, clearance: Array) -> IntArray:
    """Count how many times each robot went from contact with a wall to contact with the opposite one, (n,).

    `clearance` is what `robocov.metrics.clearances` returns, (T, n) m.
    """
    touching = clearance <= CONTACT_GAP_M
    began = touching.copy()
    began[1:] &= ~touching[:-1]
    counts = np.zeros(len(record.team), dtype=np.intp)
    for robot in np.flatnonzero(began.any(axis=0)).tolist():
        moments = np.flatnonzero(began[:, robot])
        away = record.positions[moments, robot] - record.obstacle_points[moments, robot]
        away /= np.maximum(np.sqrt((away**2).sum(axis=1)), 1e-12)[:, None]
        # more than 120 degrees apart; nan, where nothing was sensed, is no opposite
        opposite = (away[:-1] * away[1:]).sum(axis=1) < -0.5
        soon = np.diff(record.time[moments]) <= MAX_ZIGZAG_PERIOD_S
        counts[robot] = int((opposite & soon).sum())
    return counts


def _describe_trembling(record: Record, robots: IntArray) -> str:
    steps = round(TREMBLE_WINDOW_S / record.dt)
    moved = np.diff(record.positions[-steps - 1 :, robots], axis=0)
    length = 100.0 * float(np.sqrt((moved**2).sum(axis=-1)).mean(axis=0).max())
    who = f"{_name(record, robots)} by up to {length:.0f} cm a step"
    cause = f"the control period of {record.dt:.3g} s is too long for the forces of {record.label}"
    return f"The team trembles: {who}; {cause}. Try a shorter one (--dt), such as 1/60 s."


def _describe_zigzags(record: Record, zigzags: IntArray) -> str:
    robots = np.flatnonzero(zigzags >= MIN_ZIGZAGS)
    limit = float(record.team.max_acceleration[robots].min())
    who = f"{_name(record, robots)} went {int(zigzags.sum())} times from one wall to the opposite one"
    remedy = f"Try a higher maximum acceleration than {limit:g} m/s² (--max-acceleration)"
    return f"Zigzag in a narrow passage: {who}. {remedy}, or a lower maximum speed (--max-speed)."


def _name(record: Record, robots: IntArray) -> str:
    numbers = record.session.get("robots") or range(1, len(record.team) + 1)
    if len(robots) == len(record.team) > 1:
        return f"all {format_count(len(robots), 'robot')}"
    names = [str(numbers[robot]) for robot in robots.tolist()]
    return f"robot{'s' if len(names) > 1 else ''} {summarize_names(names)}"
