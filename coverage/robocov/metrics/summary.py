"""The summary of a run in ``run.json``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from robocov.errors import format_position
from robocov.metrics.advice import advise
from robocov.metrics.clearance import compute_clearances, count_contacts
from robocov.metrics.communication import compute_sent_rate
from robocov.metrics.cost_history import CostHistory, compute_mean_over_run
from robocov.metrics.motion import compute_path_lengths, count_stuck_robots
from robocov.metrics.settling import find_settling_time
from robocov.record import Record

MIN_REPORTED_OFFSET_M = 5e-4
"""Minimum distance between the requested and the actual position of a robot that joined, if it is
reported."""


def summarize(record: Record, history: CostHistory) -> dict[str, Any]:
    """Summarize a run for ``run.json``.

    Parameters
    ----------
    record : Record
        The run.
    history : CostHistory
        The coverage cost over the run.

    Returns
    -------
    dict
        Results by name; the names end in the units. The handbook's page on metrics explains them. If there
        are remarks on the run, ``notes`` is a list of them. ``sent_bytes_per_s`` is included only if robots
        send messages.

    See Also
    --------
    compute_cost_history : The coverage cost over a run.
    compute_run_metrics : Areas, energy, path lengths and clearances over a run.

    Examples
    --------
    >>> import robocov as rc
    >>> rooms = rc.load_map("rooms")
    >>> record = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(6, seed=0)).run(1.0)
    >>> history = rc.compute_cost_history(record, rc.CoverageCost(rooms, lattice=16))
    >>> rc.summarize(record, history)["contacts"]
    0
    """
    clearances = compute_clearances(record)
    summary: dict[str, Any] = {
        "mean_distance_m": float(history.mean_distance[-1]),
        "mean_distance_over_run_m": compute_mean_over_run(history.time, history.mean_distance),
    }
    if history.mean_time is not None:
        summary["mean_time_s"] = float(history.mean_time[-1])
    path_lengths = compute_path_lengths(record.positions, record.traveled)
    summary |= {
        "cost_m3": float(history.cost[-1]),
        "uncovered_area_m2": float(history.uncovered_area[-1]),
        "settled_at_s": find_settling_time(record.time, record.positions),
        "contacts": count_contacts(record, clearances),
        "min_clearance_m": float(clearances.min()),
        "path_length_m": path_lengths.tolist(),
        "stuck_robots": count_stuck_robots(record.time, record.positions, record.goals),
    }
    if record.sent_bytes is not None:
        summary["sent_bytes_per_s"] = compute_sent_rate(record)
    notes = [*_describe_moved_joins(record), *advise(record, clearances)]
    if notes:
        summary["notes"] = notes
    return summary


def compute_relative_excess(values: Sequence[float]) -> list[float]:
    """Compute by how much each value exceeds the lowest one, relative to the lowest one.

    Parameters
    ----------
    values : sequence of float
        Values of at least 0; nan if unknown.

    Returns
    -------
    list of float
        0 for the lowest value, and nan for unknown values. If the lowest value is 0, the excess of all higher
        ones is infinite.

    Examples
    --------
    >>> compute_relative_excess([3.0, 2.0, float("nan")])
    [0.5, 0.0, nan]
    >>> compute_relative_excess([3.0, 0.0, float("nan")])
    [inf, 0.0, nan]
    """
    lowest = min((value for value in values if not math.isnan(value)), default=math.nan)
    excess = []
    for value in values:
        if math.isnan(value):
            excess.append(math.nan)
        elif value == lowest:
            excess.append(0.0)
        elif lowest == 0.0:
            excess.append(math.inf)
        else:
            excess.append(value / lowest - 1.0)
    return excess


def _describe_moved_joins(record: Record) -> list[str]:
    """Return a sentence for each robot that did not join at the requested position."""
    notes = []
    for joined in record.joined:
        if joined.offset >= MIN_REPORTED_OFFSET_M:
            position = format_position(*joined.position)
            requested = format_position(*joined.requested_position)
            notes.append(
                f"Robot {joined.robot} joined at {joined.time:g} s at {position}, "
                f"{joined.offset:.2g} m from {requested}, which is too close to a wall or another robot."
            )
    return notes
