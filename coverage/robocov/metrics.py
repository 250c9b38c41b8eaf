"""What is said of a whole run in numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from robocov.arrays import Array
from robocov.cost import CoverageCost
from robocov.neighbours import close_pairs
from robocov.record import Record
from robocov.sensor import RangeSensor
from robocov.solid import solid_pieces

SETTLED_WINDOW = 4.0
"""Seconds over which a robot at rest must not get anywhere."""

SETTLED_DISTANCE = 0.05
"""Metres that a robot at rest may get in `SETTLED_WINDOW`."""

TOUCHING = 1e-3
"""Gap in metres below which two bodies are in contact."""


@dataclass(frozen=True, eq=False)
class CostHistory:
    """The coverage cost (22) along a run.

    Attributes
    ----------
    time : (K,) s
    mean_distance : (K,) m
    cost : (K,) m³
    uncovered_area : (K,) m²
    """

    time: Array
    mean_distance: Array
    cost: Array
    uncovered_area: Array


def cost_history(
    record: Record, cost: CoverageCost, rate: float = 10.0, on_sample: Callable[[], None] | None = None
) -> CostHistory:
    """Evaluate the coverage cost along a record.

    Parameters
    ----------
    record : Record
    cost : CoverageCost
        Of the record's environment.
    rate : float, Hz
        Samples per simulated second; the last moment is always one.
    on_sample : callable
        Called after every evaluation, for progress.
    """
    moments = sample_moments(record, rate)
    rows = np.empty((len(moments), 3))
    for row, k in enumerate(moments):
        result = cost(record.positions[k])
        rows[row] = result.mean_distance, result.value, result.uncovered_area
        if on_sample is not None:
            on_sample()
    return CostHistory(record.time[moments], rows[:, 0], rows[:, 1], rows[:, 2])


def sample_moments(record: Record, rate: float) -> list[int]:
    """Return the numbers of the moments nearest to multiples of 1/rate seconds, and of the last."""
    last = len(record) - 1
    count = int(np.floor(float(record.time[-1]) * rate + 1e-9))
    moments = {min(round(k / rate / record.dt), last) for k in range(count + 1)}
    return sorted(moments | {last})


def settled_at(
    time: Array, positions: Array, window: float = SETTLED_WINDOW, distance: float = SETTLED_DISTANCE
) -> float | None:
    """Return when the team came to rest, in seconds; None when it had not by the end.

    That is the first moment from which on no robot's net displacement over any `window` seconds
    reaches `distance` metres. Speed is no test: a robot may tremble in one place for ever.

    Parameters
    ----------
    time : (T,) s
    positions : (T, n, 2) m
    """
    dt = float(time[1] - time[0]) if len(time) > 1 else 0.0
    span = round(window / dt) if dt > 0 else 0
    if span == 0 or len(time) <= span:
        return None
    moved = positions[span:] - positions[:-span]
    far = (np.sqrt((moved**2).sum(axis=-1)) >= distance).any(axis=1)
    restless = np.flatnonzero(far)
    if len(restless) == 0:
        return float(time[0])
    first = int(restless[-1]) + 1
    return float(time[first]) if first < len(far) else None


def path_lengths(positions: Array) -> Array:
    """Return how far each robot travelled, (n,) m, from its positions, (T, n, 2) m."""
    moved = np.diff(positions, axis=0)
    return np.asarray(np.sqrt((moved**2).sum(axis=-1)).sum(axis=0))


def clearances(record: Record) -> Array:
    """Return the gap between each robot's rim and the nearest wall at each moment, (T, n) m.

    What the robots sensed is used where they sensed something; the rest is asked for here.
    """
    positions = record.positions.reshape(-1, 2)
    nearest = record.obstacle_points.reshape(-1, 2).copy()
    left = np.flatnonzero(np.isnan(nearest[:, 0]))
    if len(left):
        sensor = RangeSensor(solid_pieces(record.environment))
        reach = 1.0  # a query costs the more the farther it reaches
        while len(left):
            nearest[left] = sensor.nearest(positions[left], np.full(len(left), reach))
            left = left[np.isnan(nearest[left, 0])]
            reach *= 4.0
    gap = np.sqrt(((positions - nearest) ** 2).sum(axis=1)).reshape(record.positions.shape[:2])
    return np.asarray(gap - record.team.radius)


def contacts(record: Record, clearance: Array) -> int:
    """Return how many times a robot began to touch a wall or another robot.

    Parameters
    ----------
    record : Record
    clearance : (T, n) m
        What `clearances` returns.
    """
    touching = clearance <= TOUCHING
    began = int(touching[0].sum() + (touching[1:] & ~touching[:-1]).sum())
    radius = record.team.radius
    reach = 2.0 * float(radius.max()) + TOUCHING
    before: set[tuple[int, int]] = set()
    for positions in record.positions:
        first, second, distance = close_pairs(positions, reach)
        near = (first < second) & (distance <= radius[first] + radius[second] + TOUCHING)
        now = set(zip(first[near].tolist(), second[near].tolist(), strict=True))
        began += len(now - before)
        before = now
    return began


def summarise(record: Record, history: CostHistory) -> dict[str, Any]:
    """Return the summary that ``run.json`` holds; units are in the key names."""
    clearance = clearances(record)
    return {
        "mean_distance_m": float(history.mean_distance[-1]),
        "cost_m3": float(history.cost[-1]),
        "uncovered_area_m2": float(history.uncovered_area[-1]),
        "settled_at_s": settled_at(record.time, record.positions),
        "contacts": contacts(record, clearance),
        "min_clearance_m": float(clearance.min()),
        "path_length_m": [float(x) for x in path_lengths(record.positions)],
    }
