"""Metrics of a whole run: cost, rest, contacts, clearance, paths."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.cost import CoverageCost, TimeVaryingCost
from robocov.drawing import Drawable
from robocov.errors import format_count, require_type
from robocov.metrics.advice import advise
from robocov.record import Record, nearest_moments
from robocov.sensor import RangeSensor
from robocov.world.obstacle_pieces import build_movers, build_solid_pieces

SETTLED_WINDOW, SETTLED_DISTANCE = 4.0, 0.05
"""Seconds over which a robot at rest must not get anywhere, and metres that it may get in these."""

TOUCHING = 1e-3
"""Gap in metres below which two bodies are in contact."""

MOVING_RATE = 1.0
"""Samples of the coverage cost per simulated second, at most, where obstacles move."""

_STUCK_WINDOW, _STUCK_DISTANCE, _STUCK_AWAY = 5.0, 0.05, 0.5
"""Seconds over which a stuck robot gets nowhere; metres that it may get in these, and that it is away from
its goal, at least."""


@dataclass(frozen=True, eq=False)
class CostHistory(Drawable):
    """The coverage cost (22) along a run, at K of its moments."""

    _drawn_as = "history"

    time: Array
    """(K,) s"""
    mean_distance: Array
    """(K,) m"""
    cost: Array
    """(K,) m³"""
    uncovered_area: Array
    """(K,) m²"""
    mean_time: Array | None = None
    """(K,) s until the first robot is at a place, each at its own largest speed; None where all are equally
    fast."""

    def __repr__(self) -> str:
        first, last = self.mean_distance[[0, -1]].tolist()
        moments = format_count(len(self.time), "moment")
        return f"<CostHistory {moments}, {self.time[-1]:.1f} s, mean distance {first:.3f} to {last:.3f} m>"


def cost_history(
    record: Record, cost: CoverageCost, rate: float = 10.0, on_sample: Callable[[], None] | None = None
) -> CostHistory:
    """Evaluate the coverage cost, of the record's environment, along a record.

    Robots count while they work, and obstacles that move stand where they are at each moment. `rate` is in
    samples per simulated second, see `sample_moments`; `on_sample` is called after every evaluation.
    """
    require_type("record", record, Record, 'a Record, as Simulation.run and Record.load("run") return,')
    require_type("cost", cost, CoverageCost, "a CoverageCost")
    moments = sample_moments(record, rate)
    rows = np.empty((len(moments), 3))
    speeds = record.team.max_speed if record.team.has_mixed_speeds else None
    times = None if speeds is None else np.full(len(moments), np.nan)
    momentary = TimeVaryingCost(cost)
    for row, k in enumerate(moments):
        working = None if record.conditions is None else record.working[k]
        now = float(record.time[k]), record.positions[k], working
        rows[row] = momentary.compute_figures(*now)
        if times is not None and (first := momentary(*now, speeds)) is not None:
            times[row] = first.mean_time
        if on_sample is not None:
            on_sample()
    return CostHistory(record.time[moments], rows[:, 0], rows[:, 1], rows[:, 2], times)


def sample_moments(record: Record, rate: float) -> list[int]:
    """Return the numbers of the moments nearest to multiples of 1/rate seconds, and of the last.

    Where obstacles move, the rate is `MOVING_RATE` at most: each moment then has a map of its own.
    """
    rate = min(rate, MOVING_RATE) if record.environment.has_moving_obstacles else rate
    return [int(k) for k in nearest_moments(record.time, rate)]


def settled_at(
    time: Array, positions: Array, window: float = SETTLED_WINDOW, distance: float = SETTLED_DISTANCE
) -> float | None:
    """Return when the team came to rest, in seconds; None when it had not by the end.

    That is the first moment from which on no robot's net displacement over any `window` seconds
    reaches `distance` metres. Speed is no test: a robot may tremble in one place for ever.

    Positions are (T, n, 2) m, at times (T,) s.
    """
    dt = float(time[1] - time[0]) if len(time) > 1 else 0.0
    span = round(window / dt) if dt > 0 else 0
    if span == 0 or len(time) <= span:
        return None
    moved = positions[span:] - positions[:-span]
    far = (np.sqrt((moved**2).sum(axis=-1)) >= distance).any(axis=1)
    first = int(np.flatnonzero(far).max(initial=-1)) + 1
    return float(time[first]) if first < len(far) else None


def path_lengths(positions: Array, travelled: BoolArray | None = None) -> Array:
    """Compute how far each robot travelled.

    Parameters
    ----------
    positions : (T, n, 2) array, m
    travelled : (T - 1, n) bool array, optional
        Mask of the displacements that count, as `Record.travelled`; by default all do.

    Returns
    -------
    (n,) array, m
    """
    moved = np.sqrt((np.diff(positions, axis=0) ** 2).sum(axis=-1))
    if travelled is not None:
        moved = np.where(travelled, moved, 0.0)
    return np.asarray(moved.sum(axis=0))


def mean_over_run(time: Array, values: Array) -> float:
    """Return the mean over time, ascending (K,) s, of what was sampled along a run, by the trapezoidal rule.

    >>> mean_over_run(np.array([0.0, 1.0, 3.0]), np.array([4.0, 2.0, 2.0]))
    2.3333333333333335
    """
    duration = float(time[-1] - time[0])
    return float(np.trapezoid(values, time)) / duration if duration else float(values[-1])


def stuck_robots(time: Array, positions: Array, goals: Array) -> int | None:
    """Return how many robots are stuck at the end: far from their goals, and no longer on the way there.

    A robot is stuck when it is more than 0.5 m from its goal and its net displacement over the last 5 s is
    below 0.05 m. None where no robot has a goal, or the run is shorter than that. Positions and goals are
    (T, n, 2) m, at times (T,) s; a goal is nan where there is none.
    """
    before = float(time[-1]) - _STUCK_WINDOW
    # half a microsecond forgives the rounding of sums of steps
    if np.isnan(goals[-1]).any(axis=1).all() or before < float(time[0]) - 5e-7:
        return None
    k = int(np.searchsorted(time, before + 5e-7, side="right")) - 1
    moved = np.sqrt(((positions[-1] - positions[k]) ** 2).sum(axis=-1))
    left = np.sqrt(((goals[-1] - positions[-1]) ** 2).sum(axis=-1))
    return int(((moved < _STUCK_DISTANCE) & (left > _STUCK_AWAY)).sum())


def clearances(record: Record) -> Array:
    """Return the gap between each robot's rim and the nearest wall at each moment, (T, n) m.

    What the robots sensed is used where they sensed something, and that was right; the rest is asked for
    here. Of robots that do not work there is none: inf.
    """
    if record.conditions is not None or record.environment.has_moving_obstacles:
        return _clearances_asked_for(record)
    positions = record.positions.reshape(-1, 2)
    nearest = record.obstacle_points.reshape(-1, 2).copy()
    left = np.flatnonzero(np.isnan(nearest[:, 0]))
    if len(left):
        sensor = RangeSensor(build_solid_pieces(record.environment))
        reach = 1.0  # a query costs the more the farther it reaches
        while len(left):
            nearest[left] = sensor.find_nearest_points(positions[left], np.full(len(left), reach))
            left = left[np.isnan(nearest[left, 0])]
            reach *= 4.0
    gap = np.sqrt(((positions - nearest) ** 2).sum(axis=1)).reshape(record.positions.shape[:2])
    return np.asarray(gap - record.team.radius)


def _clearances_asked_for(record: Record) -> Array:
    """Return the same where the robots sensed what was not there, or what is there changes."""
    environment, working, radius = record.environment, record.working, record.team.radius
    sensor = RangeSensor(build_solid_pieces(environment), build_movers(environment))
    failed = record.present & ~working
    reach = np.full(len(radius), float(np.hypot(*np.ptp(environment.region.vertices, axis=0))))
    gap = np.full(working.shape, np.inf)
    for k, places in enumerate(record.positions):
        sensor.set_time(float(record.time[k]), np.column_stack([places, radius])[failed[k]])
        rows = np.flatnonzero(working[k])
        nearest = sensor.find_nearest_points(places[rows], reach[rows])
        gap[k, rows] = np.sqrt(((places[rows] - nearest) ** 2).sum(axis=1)) - radius[rows]
    return gap


def contacts(record: Record, clearance: Array) -> int:
    """Return how many times a robot began to touch a wall or another robot.

    `clearance` is what `clearances` returns, (T, n) m. A robot that has failed is a wall.
    """
    touching = clearance <= TOUCHING
    walls = int(touching[0].sum() + (touching[1:] & ~touching[:-1]).sum())
    return walls + robot_gaps(record)[1]


def robot_gaps(record: Record) -> tuple[Array, int]:
    """Return the smallest gap between two working robots' rims, and how many times two began to touch.

    The gap is that of each moment, (T,) m, inf where there are no two robots.
    """
    places = np.where(record.working[:, :, None], record.positions, np.nan)
    closest = np.full(len(places), np.inf)
    began = _look_at_gaps(places, np.array(record.team.radius), places[:, :, 0].argsort(axis=1), closest)
    return closest, began


@kernel
def _look_at_gaps(places: Array, radius: Array, order: IntArray, closest: Array) -> int:
    """Do so for robots in the order of x at each moment, (T, n); those without a place, nan, come last."""
    reach = 0.0
    for i in range(len(radius)):
        reach = max(reach, 2.0 * radius[i])
    began = 0
    for t in range(len(places)):
        for a in range(len(radius)):
            for b in range(a + 1, len(radius)):
                i, j = order[t, a], order[t, b]
                # nobody further along is nearer; nor is who has no place
                if not places[t, j, 0] - places[t, i, 0] - reach <= max(closest[t], TOUCHING):
                    break
                both = radius[i] + radius[j]
                apart = _distance(places, t, i, j)
                closest[t] = min(closest[t], apart - both)
                if apart <= both + TOUCHING and not (
                    t > 0 and _distance(places, t - 1, i, j) <= both + TOUCHING
                ):
                    began += 1
    return began


@kernel
def _distance(places: Array, t: int, i: int, j: int) -> float:
    return math.sqrt((places[t, i, 0] - places[t, j, 0]) ** 2 + (places[t, i, 1] - places[t, j, 1]) ** 2)


def summarise(record: Record, history: CostHistory) -> dict[str, Any]:
    """Return the summary that ``run.json`` holds; units are in the key names."""
    clearance = clearances(record)
    notes = [*_describe_moved_joins(record), *advise(record, clearance)]
    return {
        "mean_distance_m": float(history.mean_distance[-1]),
        "mean_distance_over_run_m": mean_over_run(history.time, history.mean_distance),
        **({} if history.mean_time is None else {"mean_time_s": float(history.mean_time[-1])}),
        "cost_m3": float(history.cost[-1]),
        "uncovered_area_m2": float(history.uncovered_area[-1]),
        "settled_at_s": settled_at(record.time, record.positions),
        "contacts": contacts(record, clearance),
        "min_clearance_m": float(clearance.min()),
        "path_length_m": [float(x) for x in path_lengths(record.positions, record.travelled)],
        "stuck_robots": stuck_robots(record.time, record.positions, record.goals),
        **({"notes": notes} if notes else {}),
    }


def _describe_moved_joins(record: Record) -> list[str]:
    """Return a sentence for each robot that joined elsewhere than it was to."""
    notes = []
    for joined in record.joined:
        if joined.offset >= 5e-4:
            place, requested = (f"[{x:.4g}, {y:.4g}]" for x, y in (joined.place, joined.requested))
            moved = f"{joined.offset:.2g} m from {requested}, which is too near to a wall or another robot"
            notes.append(f"Robot {joined.robot} joined at {joined.time:.4g} s at {place}, {moved}.")
    return notes
