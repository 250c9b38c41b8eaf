"""Runs and maps as small JSON for the browser: quantised positions and costs at even times, maps rounded."""

from __future__ import annotations

import base64
import io
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from PIL import Image

from robocov.arrays import Array
from robocov.environment import Environment, Obstacle
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov_app.figures.styles import MARKS, CurveStyle
from robocov_app.render.density import dots, shading
from robocov_app.render.theme import DARK, LIGHT, mix
from robocov_app.runs.saved import roster_of

_DOTS = 80  # dots along the longer side of a map


def density_picture(environment: Environment) -> str:
    """Return a ``data:image/png`` of the density over the region's box, clear outside; empty without one."""
    if environment.density is None or environment.density.uniform:
        return ""
    picture = shading(environment, _DOTS, LIGHT)
    # one colour for light and dark: it is between the two
    picture[..., :3] = mix(LIGHT.density, DARK.density, 0.5)
    x, y = np.meshgrid(*dots(environment, _DOTS))
    places = np.column_stack([x.ravel(), y.ravel()])
    picture[~environment.region.contains(places).reshape(x.shape), 3] = 0
    file = io.BytesIO()
    Image.fromarray(picture[::-1]).save(file, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"


RATE = 5.0  # moments of a run per simulated second, where there is room
BUDGET = 1_500_000  # bytes that runs of one page take together; beyond, they are embedded at a lower rate
NONE = 65535  # stands for a number that is not there
# seconds between the first moment and the last, if there are no others, above which they tell no path
SPARSE = 1.5
_VERTICES = 4000  # vertices of a map's obstacles above which they are simplified


@dataclass(frozen=True, eq=False)
class ReplayRun:
    """A run to be replayed with its words and look; by default the record's label and an own style."""

    record: Record
    history: CostHistory | None
    title: str
    facts: str = ""
    label: str = ""
    style: CurveStyle | None = None


def even_times(end: float, rate: float) -> Array:
    """Return multiples of 1/rate seconds up to `end`, s, and `end` itself.

    >>> even_times(1.0, 2.5).tolist()
    [0.0, 0.4, 0.8, 1.0]
    """
    count = math.floor(end * rate + 1e-9)
    times = np.arange(count + 1) / rate
    if end - times[-1] > 1e-9:
        times = np.append(times, end)
    return np.asarray(times)


def quantised(values: Array, low: float, high: float) -> str:
    """Return numbers as base64 of 16 bits, 0 at `low`, 65534 at `high`, `NONE` if not finite."""
    span = high - low if high > low else 1.0
    with np.errstate(invalid="ignore"):
        steps = np.rint(np.clip((values - low) / span, 0.0, 1.0) * (NONE - 1))
    words = np.where(np.isfinite(values), steps, NONE).astype("<u2")
    return base64.b64encode(words.tobytes()).decode("ascii")


def has_path(record: Record) -> bool:
    """Return whether there is more than the first moment and the last, to tell where the robots went."""
    return len(record) > 2 or (len(record) == 2 and float(record.time[1] - record.time[0]) <= SPARSE)


def embedded_map(environment: Environment) -> dict[str, Any]:
    """Return a map: ``region`` ring, ``blocked`` list of polygons (lists of rings), flat rings of x, y.

    Where not every place counts the same there is also the address of a picture of the ``density``. Obstacles
    that move are apart, in ``movers``: each with its rings, the line of one turn and its speed in m/s.

    Coordinates are whole numbers of ``unit`` metres, a millimetre or, for tiny maps, less.
    """
    low_x, low_y, high_x, high_y = environment.region.bounds
    extent = max(high_x - low_x, high_y - low_y)
    unit = 10.0 ** min(-3, math.floor(math.log10(extent)) - 3)
    blocked = environment.static.blocked
    if shapely.get_num_coordinates(blocked) > _VERTICES:
        blocked = shapely.simplify(blocked, extent / 2000)
    parts = [part for part in shapely.get_parts(blocked) if not part.is_empty]
    movers = [_mover(shape, unit) for shape in environment.obstacles if shape.path is not None]
    return {
        "name": environment.name,
        "unit": unit,
        "bounds": _whole(np.array([[low_x, low_y], [high_x, high_y]]), unit),
        "region": _whole(environment.region.vertices, unit),
        **({"density": picture} if (picture := density_picture(environment)) else {}),
        "blocked": [
            [_whole(np.asarray(ring.coords)[:-1], unit) for ring in (part.exterior, *part.interiors)]
            for part in parts
        ],
        **({"movers": movers} if movers else {}),
    }


def _mover(shape: Obstacle, unit: float) -> dict[str, Any]:
    path, outline = shape.path, shape.polygon
    assert path is not None
    back = path.points[:1] if path.repeat == "loop" else path.points[-2::-1]
    return {
        "rings": [
            _whole(np.asarray(ring.coords)[:-1], unit)
            for part in shapely.get_parts(outline)
            for ring in (part.exterior, *part.interiors)
        ],
        "line": _whole(np.array([*path.points, *back]), unit),
        "speed": path.speed,
    }


def lives(record: Record) -> list[tuple[float, float | None]]:
    """Return when each robot is first there (never: after the end) and fails (never: None), s."""
    since = record.time - record.time[0]
    found: list[tuple[float, float | None]] = []
    for present, working in zip(record.present.T, record.working.T, strict=True):
        begins, failed = np.flatnonzero(present), np.flatnonzero(present & ~working)
        begin = float(since[begins[0]]) if len(begins) else float(since[-1]) + 1.0
        found.append((begin, float(since[failed[0]]) if len(failed) else None))
    return found


def embedded_run(
    run: ReplayRun, place: int, style: CurveStyle, rate: float, *, goals: bool
) -> dict[str, Any]:
    """Return one run: `place` is the number of its map, `rate` in Hz, `goals` whether those come along."""
    record = run.record
    begin, end = float(record.time[0]), float(record.time[-1])
    times = even_times(end - begin, rate) if has_path(record) else np.unique([0.0, end - begin])
    wanted = goals and bool(np.isfinite(record.goals).any())
    radius = record.team.radius.tolist()
    life = lives(record) if record.conditions is not None else []
    return {
        "title": run.title,
        "facts": run.facts,
        "label": run.label or record.label,
        "style": style.name,
        "dashes": [] if isinstance(style.dashes, str) else list(style.dashes[1]),
        "mark": MARKS[style.mark],
        "map": place,
        "radius": radius[0] if len(set(radius)) == 1 else radius,
        **({"speeds": record.team.max_speed.tolist()} if record.by_time else {}),
        "numbers": list(roster_of(record).numbers),
        **({"begin": begin} if begin and record.environment.moves else {}),
        **({"lives": life} if any(each != (0.0, None) for each in life) else {}),
        "path": has_path(record),
        "step": 1.0 / rate if has_path(record) else max(end - begin, 1e-9),
        "end": end - begin,
        "count": len(times),
        "positions": _places(record, record.positions, times + begin),
        "goals": _places(record, record.goals, times + begin) if wanted else None,
        "cost": _cost(run.history, begin, even_times(end - begin, rate), 1.0 / rate),
    }


def embedded(
    runs: Sequence[ReplayRun], styles: Sequence[CurveStyle], panes: Sequence[int], budget: int = BUDGET
) -> dict[str, Any]:
    """Return all that a replay needs, at the rate up to `RATE`, and with goals, that fits the `budget`."""
    rate, goals = _affordable(runs, budget)
    maps: list[dict[str, Any]] = []
    places: dict[Environment, int] = {}
    found = []
    for run, style in zip(runs, styles, strict=True):
        environment = roster_of(run.record).environment
        if environment not in places:
            places[environment] = len(maps)
            maps.append(embedded_map(environment))
        found.append(embedded_run(run, places[environment], style, rate, goals=goals))
    return {"version": 1, "rate": rate, "maps": maps, "runs": found, "panes": list(panes)}


def script_json(content: Any) -> str:
    """Return JSON that may stand in a script element, whatever names are in it.

    >>> script_json("</script>")
    '"\\\\u003c/script\\\\u003e"'
    """
    text = json.dumps(content, separators=(",", ":"), allow_nan=False)  # ASCII: no U+2028 is left
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _affordable(runs: Sequence[ReplayRun], budget: int) -> tuple[float, bool]:
    """Return the rate, and whether goals may come along."""

    def bytes_at(rate: float, goals: bool) -> float:
        total = 0.0
        for run in runs:
            record = run.record
            span = float(record.time[-1] - record.time[0])
            moments = span * rate + 2 if has_path(record) else 2
            pairs = 2 if goals and np.isfinite(record.goals).any() else 1
            total += moments * (4 * len(record.team) * pairs + 2) * 4 / 3
        return total

    for goals in (True, False):
        for rate in (RATE, 4.0, 2.5, 2.0, 1.25, 1.0):
            if bytes_at(rate, goals) <= budget:
                return rate, goals
    return max(min(budget / bytes_at(1.0, False), 1.0), 0.05), False


def _whole(ring: Array, unit: float) -> list[int]:
    return [int(value) for value in np.rint(ring / unit).ravel()]


def _places(record: Record, values: Array, times: Array) -> str:
    """Return places (T, n, 2) m at other times, quantised between the corners of the region."""
    low_x, low_y, high_x, high_y = record.environment.region.bounds
    flat = _between(record.time, values.reshape(len(record), -1), times).reshape(len(times), -1, 2)
    low, high = np.array([low_x, low_y]), np.array([high_x, high_y])
    return quantised((flat - low) / (high - low), 0.0, 1.0)


def _between(time: Array, rows: Array, times: Array) -> Array:
    """Return (T, m) rows at other times, linear in between; nan where either neighbour is."""
    after = np.clip(np.searchsorted(time, times), 1, max(len(time) - 1, 1))
    if len(time) == 1:
        return np.asarray(np.repeat(rows, len(times), axis=0))
    before = after - 1
    part = ((times - time[before]) / (time[after] - time[before]))[:, None]
    # at a moment of the record that moment counts alone: beside it there may be nothing
    mixed = np.where(part >= 1.0 - 1e-9, rows[after], (1.0 - part) * rows[before] + part * rows[after])
    return np.where(part <= 1e-9, rows[before], mixed)


def _cost(history: CostHistory | None, begin: float, times: Array, step: float) -> dict[str, Any] | None:
    """Return the mean distance at even times from the run's begin."""
    if history is None or not np.isfinite(history.mean_distance).any():
        return None
    values = _between(history.time - begin, history.mean_distance[:, None], times)[:, 0]
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    low, high = float(finite.min()), float(finite.max())
    last = history.mean_distance[-1]
    return {
        "step": step,
        "count": len(times),
        "low": low,
        "high": high,
        "values": quantised(values, low, high),
        "last": float(last) if np.isfinite(last) else None,
    }
