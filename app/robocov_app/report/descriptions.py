"""Text descriptions of pictures, for readers who cannot see them, and the lifetimes of robots."""

import numpy as np

from robocov.environment import Environment
from robocov.errors import format_area, format_count
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov_app.render.density_text import describe_density
from robocov_app.runs.saved_runs import build_roster


def list_lifetimes(record: Record) -> list[tuple[float, float | None]]:
    """List the times at which each robot joins and fails.

    Parameters
    ----------
    record : Record

    Returns
    -------
    list of (float, float or None)
        Time of joining and of failure of each robot, in seconds since the start of the record. The time of a
        robot that never joins is after the end; None means that a robot never fails.
    """
    times = record.time - record.time[0]
    lifetimes: list[tuple[float, float | None]] = []
    for present, working in zip(record.is_present.T, record.is_working.T, strict=True):
        joins = float(times[-1]) + 1.0
        present_rows = np.flatnonzero(present)
        if len(present_rows):
            joins = float(times[present_rows[0]])
        fails = None
        failed_rows = np.flatnonzero(present & ~working)
        if len(failed_rows):
            fails = float(times[failed_rows[0]])
        lifetimes.append((joins, fails))
    return lifetimes


def format_seconds(seconds: float) -> str:
    """Format a duration with up to two decimals, and without an exponent for long runs.

    Examples
    --------
    >>> format_seconds(60.0), format_seconds(59.98333), format_seconds(20000.0)
    ('60 s', '59.98 s', '20000 s')
    """
    return f"{round(seconds, 2):.10g} s"


def describe_map(environment: Environment) -> str:
    """Describe a map in one sentence."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    blocked = 100.0 * (1.0 - environment.free_area / environment.region.area)
    text = (
        f"Map {environment.name}: {high_x - low_x:.4g} m by {high_y - low_y:.4g} m "
        f"{_describe_obstacles(environment)}, "
        f"{format_area(environment.free_area)} free, {blocked:.0f}% of the known region blocked"
    )
    density = describe_density(environment)
    if density:
        text += f", {density}"
    return f"{text}."


def _describe_obstacles(environment: Environment) -> str:
    """Describe how many obstacles a map has, and how many of them move."""
    count = len(environment.obstacles)
    moving = sum(obstacle.path is not None for obstacle in environment.obstacles)
    text = {0: "without obstacles", 1: "with one obstacle"}.get(count, f"with {count} obstacles")
    if moving:
        text += f" ({moving} moving)"
    return text


def describe_run(record: Record, history: CostHistory | None) -> str:
    """Describe a run in a few sentences: robots, duration, failures, and how the cost changes."""
    robots = format_count(len(record.team), "robot")
    duration = record.time[-1] - record.time[0]
    setup = f"{record.label} on map {record.environment.name}: trajectories of {robots}"
    if record.start:
        setup += f" from start {record.start}"
    sentences = [f"{setup} over {format_seconds(duration)}."]
    events = _list_events(record)
    if events:
        text = ", ".join(event for _, event in sorted(events))
        sentences.append(f"{text[0].upper()}{text[1:]}.")
    if history is not None:
        sentences += _describe_costs(record.environment, history)
    return " ".join(sentences)


def _list_events(record: Record) -> list[tuple[float, str]]:
    """Return the times, s, at which robots join and fail during a run, each with a description."""
    if record.conditions is None:
        return []
    duration = record.time[-1] - record.time[0]
    events = []
    for number, (joins, fails) in zip(build_roster(record).numbers, list_lifetimes(record), strict=True):
        if 0.0 < joins <= duration:
            events.append((joins, f"robot {number} joins at {joins:.1f} s"))
        if fails is not None:
            events.append((fails, f"robot {number} fails at {fails:.1f} s"))
    return events


def _describe_costs(environment: Environment, history: CostHistory) -> list[str]:
    """Return sentences about the first and the final cost; an empty list if they are unknown."""
    first, final = history.mean_distance[[0, -1]]
    if not np.isfinite([first, final]).all():
        return []
    subject = "The mean distance to the nearest robot"
    if describe_density(environment):
        subject += ", weighted by φ,"
    sentences = [f"{subject} {_describe_change(first, final, 'm')}."]
    if history.mean_time is not None and np.isfinite(history.mean_time[[0, -1]]).all():
        first, final = history.mean_time[[0, -1]]
        change = _describe_change(first, final, "s")
        sentences.append(f"The mean travel time of the first robot to arrive {change}.")
    return sentences


def _describe_change(first: float, final: float, unit: str) -> str:
    """Describe a change of a value, rounded to three decimals."""
    first_text = f"{first:.3f} {unit}"
    final_text = f"{final:.3f} {unit}"
    if first_text == final_text:
        return f"stays at {final_text}"
    verb = "falls" if final < first else "rises"
    return f"{verb} from {first_text} to {final_text}"
