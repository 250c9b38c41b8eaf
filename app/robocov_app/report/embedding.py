"""Runs and maps as compact JSON in a page, read by ``data.js``.

Positions and costs are sampled at equal time steps and quantized. Coordinates of maps are rounded.
"""

import base64
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike

from robocov.environment import Environment
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov.text import escape_controls
from robocov.typing import BoolArray, FloatArray
from robocov_app.look import axes
from robocov_app.look.curve_styles import MARKER_PATHS, CurveStyle
from robocov_app.report.descriptions import list_lifetimes
from robocov_app.report.embedded_hues import embed_hues
from robocov_app.report.pictures import build_density_image, extract_rings, has_path
from robocov_app.runs.saved_runs import build_roster

MAX_RATE_HZ = 5.0
"""Maximum number of frames of a run per simulated second."""
MAX_BYTES = 1_500_000
"""Maximum total size of the runs in a page. If they are larger, they are embedded at a lower rate."""
NO_NUMBER = 65535
"""Code of a missing number among quantized numbers, which have 16 bits."""
_SIMPLIFICATION_STEPS = 2000
"""Simplified obstacles move by at most the extent of the map divided by this number."""
MAX_OBSTACLE_VERTICES = 4000
"""Maximum number of vertices of all obstacles of a map. If there are more, the obstacles are simplified."""
_RATES_HZ = (MAX_RATE_HZ, 4.0, 2.5, 2.0, 1.25, 1.0)
_MIN_RATE_HZ = 0.05
_TIME_TOLERANCE_S = 1e-9
_FRACTION_TOLERANCE = 1e-9
"""Tolerance in comparisons of fractions of a step between two times."""


@dataclass(frozen=True, eq=False)
class ReplayRun:
    """A run that can be replayed.

    Attributes
    ----------
    record : Record
    history : CostHistory or None
    title : str
        Title above the pane of the run.
    facts : str
        Text below the title.
    label : str
        Label of the run's curve. By default, that of the record.
    style : CurveStyle or None
        Style of the run's curve. By default, one that differs from those of other controllers.
    """

    record: Record
    history: CostHistory | None
    title: str
    facts: str = ""
    label: str = ""
    style: CurveStyle | None = None


def embed_replay(
    runs: Sequence[ReplayRun],
    styles: Sequence[CurveStyle],
    panes: Sequence[int],
    max_bytes: int = MAX_BYTES,
) -> dict[str, Any]:
    """Build the data of a replay as JSON content.

    Parameters
    ----------
    runs : sequence of ReplayRun
    styles : sequence of CurveStyle
        Style of the curve of each run.
    panes : sequence of int
        Indices of the runs that are shown at first.
    max_bytes : int
        Maximum size of the runs. It determines the frame rate, and whether goals are included.

    Returns
    -------
    dict
    """
    rate, include_goals = _choose_detail(runs, max_bytes)
    environments = [build_roster(run.record).environment for run in runs]
    maps = list(dict.fromkeys(environments))
    embedded_runs = []
    for run, style, environment in zip(runs, styles, environments, strict=True):
        map_number = maps.index(environment)
        embedded_runs.append(embed_run(run, map_number, style, rate, include_goals=include_goals))
    return {
        "version": 1,
        "rate": rate,
        "axes": embed_axis_rules(),
        "maps": [embed_map(environment) for environment in maps],
        "runs": embedded_runs,
        "panes": list(panes),
    }


def embed_axis_rules() -> dict[str, Any]:
    """Build the rules for axes as JSON content; the axes themselves depend on the runs that are shown."""
    return {
        "maxLowFraction": axes.MAX_LOW_FRACTION,
        "margin": axes.VALUE_MARGIN,
        "tickFactors": list(axes.TICK_FACTORS),
    }


def embed_map(environment: Environment) -> dict[str, Any]:
    """Build a map as JSON content.

    Parameters
    ----------
    environment : Environment

    Returns
    -------
    dict
        ``region``: a ring. ``blocked``: polygons, each a list of rings. ``density``, if it is not uniform:
        the data URL of an image. ``movingObstacles``, if obstacles move: for each of them its rings, the line
        of one round trip, and its speed, m/s. Rings and lines are flat lists x, y, x, y, ... of integer
        multiples of ``unit``, a length in meters: a millimeter or, for tiny maps, less.
    """
    low_x, low_y, high_x, high_y = environment.region.bounds
    extent = max(high_x - low_x, high_y - low_y)
    unit = 10.0 ** min(-3, math.floor(math.log10(extent)) - 3)
    blocked = environment.static.blocked
    if shapely.get_num_coordinates(blocked) > MAX_OBSTACLE_VERTICES:
        blocked = shapely.simplify(blocked, extent / _SIMPLIFICATION_STEPS)
    content: dict[str, Any] = {
        "name": environment.name,
        "unit": unit,
        "bounds": _round_points([[low_x, low_y], [high_x, high_y]], unit),
        "region": _round_points(environment.region.vertices, unit),
    }
    density_image = build_density_image(environment)
    if density_image:
        content["density"] = density_image
    content["blocked"] = [_round_rings(extract_rings(part), unit) for part in shapely.get_parts(blocked)]
    moving_obstacles = _embed_moving_obstacles(environment, unit)
    if moving_obstacles:
        content["movingObstacles"] = moving_obstacles
    return content


def _embed_moving_obstacles(environment: Environment, unit: float) -> list[dict[str, Any]]:
    """Build the moving obstacles as JSON content."""
    moving_obstacles = []
    for obstacle in environment.obstacles:
        path = obstacle.path
        if path is None:
            continue
        if path.repeat == "loop":
            return_points = path.points[:1]
        else:
            return_points = path.points[-2::-1]  # back from the second to last point to the first
        content = {
            "rings": _round_rings(extract_rings(obstacle.polygon), unit),
            "line": _round_points([*path.points, *return_points], unit),
            "speed": path.speed,
        }
        moving_obstacles.append(content)
    return moving_obstacles


def _round_points(points: ArrayLike, unit: float) -> list[int]:
    """Convert points, m, to a flat list of integer multiples of a unit, m."""
    return [int(value) for value in np.rint(np.asarray(points) / unit).ravel()]


def _round_rings(rings: Iterable[FloatArray], unit: float) -> list[list[int]]:
    """Convert each ring, m, to a flat list of integer multiples of a unit, m."""
    return [_round_points(ring, unit) for ring in rings]


def embed_run(
    run: ReplayRun, map_number: int, style: CurveStyle, rate: float, *, include_goals: bool
) -> dict[str, Any]:
    """Build a run as JSON content.

    Parameters
    ----------
    run : ReplayRun
    map_number : int
        Index of the run's map.
    style : CurveStyle
        Style of the run's curve.
    rate : float
        Frames per simulated second.
    include_goals : bool
        Whether to include the goals of the robots.

    Returns
    -------
    dict
    """
    record = run.record
    start = float(record.time[0])
    duration = float(record.time[-1]) - start
    is_path_known = has_path(record)
    if is_path_known:
        times = list_even_times(duration, rate)
        step = 1.0 / rate
    else:
        # Only the first and the last frame are embedded. Even if they are the same, the step is positive.
        times = np.unique([0.0, duration])
        step = max(duration, _TIME_TOLERANCE_S)
    positions = _interpolate_points(record, record.positions, times + start)
    content: dict[str, Any] = {
        "title": run.title,
        "facts": run.facts,
        "label": run.label or record.label,
        "style": style.name,
        "dashes": style.list_dash_lengths(),
        "mark": MARKER_PATHS[style.mark],
        "map": map_number,
        **_embed_team(record),
        "path": is_path_known,
        "step": step,
        "end": duration,
        "count": len(times),
        "hues": embed_hues(record, positions, _find_working(record, times)),
        "positions": _quantize_points(record, positions),
        "goals": None,
        "cost": _embed_cost(run.history, start, list_even_times(duration, rate), 1.0 / rate),
    }
    if include_goals and np.isfinite(record.goals).any():
        goals = _interpolate_points(record, record.goals, times + start)
        content["goals"] = _quantize_points(record, goals)
    if record.steering is not None:
        content["headings"] = _embed_headings(record, record.steering, times + start)
    return content


def _embed_team(record: Record) -> dict[str, Any]:
    """Build the properties of the robots of a run as JSON content."""
    radii = record.team.radius.tolist()
    start = float(record.time[0])
    content: dict[str, Any] = {
        "radius": radii[0] if len(set(radii)) == 1 else radii,
        "numbers": list(build_roster(record).numbers),
    }
    if record.has_travel_time_cells:
        content["speeds"] = record.team.max_speed.tolist()
    # The embedded times start at 0, but the positions of moving obstacles depend on the simulation time.
    if start and record.environment.has_moving_obstacles:
        content["begin"] = start
    if record.conditions is not None:
        lifetimes = list_lifetimes(record)
        if any(lifetime != (0.0, None) for lifetime in lifetimes):
            content["lifetimes"] = lifetimes
    return content


def _find_working(record: Record, times: FloatArray) -> BoolArray:
    """Return a mask, (T, n), of the robots that work at given times, s since the start."""
    is_working = np.ones((len(times), len(record.team)), dtype=bool)
    if record.conditions is None:
        return is_working
    for robot, (joins, fails) in enumerate(list_lifetimes(record)):
        is_working[:, robot] = times >= joins - _TIME_TOLERANCE_S
        if fails is not None:
            is_working[times >= fails - _TIME_TOLERANCE_S, robot] = False
    return is_working


def _embed_headings(record: Record, steering: FloatArray, times: FloatArray) -> str:
    """Return the headings of unicycles at given times as quantized unit vectors.

    Unit vectors are used because angles cannot be interpolated across a full turn.
    """
    angles = np.where(record.team.is_unicycle, steering[:, :, 0], np.nan)
    vectors = np.stack([np.cos(angles), np.sin(angles)], axis=2).reshape(len(record), -1)
    return quantize(_interpolate_rows(record.time, vectors, times), -1.0, 1.0)


def _embed_cost(
    history: CostHistory | None, start: float, times: FloatArray, step: float
) -> dict[str, Any] | None:
    """Build the mean distances at given times, s since the start, as JSON content; None if unknown."""
    if history is None:
        return None
    values = _interpolate_rows(history.time - start, history.mean_distance[:, None], times)[:, 0]
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    low = float(finite.min())
    high = float(finite.max())
    last = float(history.mean_distance[-1])
    return {
        "step": step,
        "count": len(times),
        "low": low,
        "high": high,
        "values": quantize(values, low, high),
        "last": last if np.isfinite(last) else None,
    }


def list_even_times(end: float, rate: float) -> FloatArray:
    """Return the multiples of ``1 / rate`` seconds from 0 to `end`, and `end` itself, s."""
    times = np.arange(math.floor(end * rate + _FRACTION_TOLERANCE) + 1) / rate
    if end - times[-1] > _TIME_TOLERANCE_S:
        return np.append(times, end)
    return times


def quantize(values: FloatArray, low: float, high: float) -> str:
    """Encode numbers as text, with 16 bits each.

    Parameters
    ----------
    values : array
        Numbers. Those that are not finite are encoded as missing.
    low, high : float
        Range of the numbers. Numbers outside are clipped.

    Returns
    -------
    str
        Base64 of little-endian 16-bit integers: 0 for `low`, 65534 for `high`, `NO_NUMBER` for missing.
    """
    span = high - low if high > low else 1.0
    with np.errstate(invalid="ignore"):
        steps = np.rint(np.clip((values - low) / span, 0.0, 1.0) * (NO_NUMBER - 1))
    words = np.where(np.isfinite(values), steps, NO_NUMBER).astype("<u2")
    return base64.b64encode(words.tobytes()).decode("ascii")


def _quantize_points(record: Record, points: FloatArray) -> str:
    """Quantize points, (T, n, 2) m, relative to the bounding box of the region."""
    low, high = np.array(record.environment.region.bounds).reshape(2, 2)
    return quantize((points - low) / (high - low), 0.0, 1.0)


def _interpolate_points(record: Record, points: FloatArray, times: FloatArray) -> FloatArray:
    """Interpolate points of a record, (k, n, 2) m, at other times, s; the result is (T, n, 2) m."""
    rows = _interpolate_rows(record.time, points.reshape(len(record), -1), times)
    return rows.reshape(len(times), -1, 2)


def _interpolate_rows(time: FloatArray, rows: FloatArray, times: FloatArray) -> FloatArray:
    """Interpolate (k, m) rows linearly at other times; the (T, m) result is nan if a neighboring row is."""
    if len(time) == 1:
        return np.asarray(np.repeat(rows, len(times), axis=0))
    after = np.clip(np.searchsorted(time, times), 1, len(time) - 1)
    before = after - 1
    fraction = ((times - time[before]) / (time[after] - time[before]))[:, None]
    mixed = (1.0 - fraction) * rows[before] + fraction * rows[after]
    # At a time of the record, only the row at that time is used, because the other one may be nan.
    mixed = np.where(fraction >= 1.0 - _FRACTION_TOLERANCE, rows[after], mixed)
    return np.where(fraction <= _FRACTION_TOLERANCE, rows[before], mixed)


def _choose_detail(runs: Sequence[ReplayRun], max_bytes: int) -> tuple[float, bool]:
    """Choose the frame rate, Hz, and whether to include goals, so that the runs fit in `max_bytes`."""
    for include_goals, rate in product((True, False), _RATES_HZ):
        if _estimate_bytes(runs, rate, include_goals=include_goals) <= max_bytes:
            return rate, include_goals
    rate = max_bytes / _estimate_bytes(runs, 1.0, include_goals=False)
    return max(min(rate, 1.0), _MIN_RATE_HZ), False


def _estimate_bytes(runs: Sequence[ReplayRun], rate: float, *, include_goals: bool) -> float:
    """Estimate the size of runs in the page, in bytes, at a frame rate, Hz."""
    total = 0.0
    for run in runs:
        record = run.record
        frames = 2.0
        if has_path(record):
            frames += float(record.time[-1] - record.time[0]) * rate
        points_per_robot = 1
        if include_goals and np.isfinite(record.goals).any():
            points_per_robot = 2
        # Two 16-bit numbers for each point, and one for the cost.
        bytes_per_frame = 4 * len(record.team) * points_per_robot + 2
        # Base64 writes 3 bytes as 4 characters.
        total += frames * bytes_per_frame * 4 / 3
    return total


def format_script_json(content: Any) -> str:
    """Format content as JSON that is safe inside a script element, even if names contain markup."""
    # The JSON is ASCII, so it does not contain U+2028, which ends a line in older scripts.
    text = json.dumps(_escape_texts(content), separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _escape_texts(content: Any) -> Any:
    """Escape the control characters in all strings of JSON content; see `escape_controls`."""
    if isinstance(content, str):
        return escape_controls(content)
    if isinstance(content, dict):
        return {key: _escape_texts(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_escape_texts(value) for value in content]
    return content
