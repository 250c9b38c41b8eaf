"""The interactive replay of runs, as HTML that needs nothing else: in reports and in notebooks.

Runs and maps are in it as small JSON: quantized positions and costs at even times, maps rounded.
"""

import base64
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.resources import files
from itertools import product
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike

from robocov.arrays import Array
from robocov.environment import Environment
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov.text import escape_controls
from robocov_app.look.curve_styles import MARKER_PATHS, CurveStyle, choose_curve_styles
from robocov_app.report.pictures import density_picture, has_path, lives, rings_of, run_picture
from robocov_app.report.theme_css import theme_rules
from robocov_app.runs.saved_runs import build_roster

MOST_PANES = 4  # runs side by side
_SCRIPTS = ("data.js", "arena.js", "chart.js", "replay.js")
RATE = 5.0  # moments of a run per simulated second, where there is room
BUDGET = 1_500_000  # bytes that runs of one page take together; beyond, they are embedded at a lower rate
NONE = 65535  # stands for a number that is not there
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
    """Return multiples of 1/rate seconds up to `end`, s, and `end` itself."""
    times = np.arange(math.floor(end * rate + 1e-9) + 1) / rate
    return np.append(times, end) if end - times[-1] > 1e-9 else times


def quantized(values: Array, low: float, high: float) -> str:
    """Return numbers as base64 of 16 bits, 0 at `low`, 65534 at `high`, `NONE` if not finite."""
    span = high - low if high > low else 1.0
    with np.errstate(invalid="ignore"):
        steps = np.rint(np.clip((values - low) / span, 0.0, 1.0) * (NONE - 1))
    words = np.where(np.isfinite(values), steps, NONE).astype("<u2")
    return base64.b64encode(words.tobytes()).decode("ascii")


def embedded_map(environment: Environment) -> dict[str, Any]:
    """Return a map: ``region`` ring, ``blocked`` list of polygons (lists of rings), flat rings of x, y.

    Where not every place counts the same there is also the address of a picture of the ``density``. Obstacles
    that move are apart, in ``movers``: each with its rings, the line of one turn and its speed in m/s.
    Coordinates are whole numbers of ``unit`` meters, a millimeter or, for tiny maps, less.
    """
    low_x, low_y, high_x, high_y = environment.region.bounds
    extent = max(high_x - low_x, high_y - low_y)
    unit = 10.0 ** min(-3, math.floor(math.log10(extent)) - 3)
    blocked = environment.static.blocked
    if shapely.get_num_coordinates(blocked) > _VERTICES:
        blocked = shapely.simplify(blocked, extent / 2000)

    def whole(points: ArrayLike) -> list[int]:
        return [int(value) for value in np.rint(np.asarray(points) / unit).ravel()]

    movers = []
    for shape in environment.obstacles:
        if (path := shape.path) is not None:
            back = path.points[:1] if path.repeat == "loop" else path.points[-2::-1]
            rings, line = [whole(ring) for ring in rings_of(shape.polygon)], whole([*path.points, *back])
            movers.append({"rings": rings, "line": line, "speed": path.speed})
    return {
        "name": environment.name,
        "unit": unit,
        "bounds": whole([[low_x, low_y], [high_x, high_y]]),
        "region": whole(environment.region.vertices),
        **({"density": picture} if (picture := density_picture(environment)) else {}),
        "blocked": [[whole(ring) for ring in rings_of(part)] for part in shapely.get_parts(blocked)],
        **({"movers": movers} if movers else {}),
    }


def embedded_run(run: ReplayRun, on: int, style: CurveStyle, rate: float, *, goals: bool) -> dict[str, Any]:
    """Return one run: `on` is the number of its map, `rate` in Hz, `goals` whether those come along."""
    record = run.record
    begin, end = float(record.time[0]), float(record.time[-1])
    times = even_times(end - begin, rate) if has_path(record) else np.unique([0.0, end - begin])
    wanted = goals and bool(np.isfinite(record.goals).any())
    radius = record.team.radius.tolist()
    life = lives(record) if record.conditions is not None else []
    headings = {}
    if record.steering is not None:
        angles = np.where(record.team.is_unicycle, record.steering[:, :, 0], np.nan)
        vectors = np.stack([np.cos(angles), np.sin(angles)], axis=2).reshape(len(record), -1)
        headings = {"headings": quantized(_between(record.time, vectors, times + begin), -1.0, 1.0)}
    return {
        "title": run.title,
        "facts": run.facts,
        "label": run.label or record.label,
        "style": style.name,
        "dashes": [] if isinstance(style.dashes, str) else list(style.dashes[1]),
        "mark": MARKER_PATHS[style.mark],
        "map": on,
        "radius": radius[0] if len(set(radius)) == 1 else radius,
        **({"speeds": record.team.max_speed.tolist()} if record.has_travel_time_cells else {}),
        "numbers": list(build_roster(record).numbers),
        **({"begin": begin} if begin and record.environment.has_moving_obstacles else {}),
        **({"lives": life} if any(each != (0.0, None) for each in life) else {}),
        "path": has_path(record),
        "step": 1.0 / rate if has_path(record) else max(end - begin, 1e-9),
        "end": end - begin,
        "count": len(times),
        "positions": _places(record, record.positions, times + begin),
        "goals": _places(record, record.goals, times + begin) if wanted else None,
        **headings,
        "cost": _cost(run.history, begin, even_times(end - begin, rate), 1.0 / rate),
    }


def embedded(
    runs: Sequence[ReplayRun], styles: Sequence[CurveStyle], panes: Sequence[int], budget: int = BUDGET
) -> dict[str, Any]:
    """Return all that a replay needs, at the rate up to `RATE`, and with goals, that fits the `budget`."""
    rate, goals = _affordable(runs, budget)
    on = [build_roster(run.record).environment for run in runs]
    maps = list(dict.fromkeys(on))
    found = [
        embedded_run(run, maps.index(environment), style, rate, goals=goals)
        for run, style, environment in zip(runs, styles, on, strict=True)
    ]
    each = list(map(embedded_map, maps))
    return {"version": 1, "rate": rate, "maps": each, "runs": found, "panes": list(panes)}


def script_json(content: Any) -> str:
    """Return JSON that may stand in a script element, whatever names are in it."""
    # ASCII: no U+2028 is left
    text = json.dumps(_escape_texts(content), separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _escape_texts(content: Any) -> Any:
    """Return JSON content whose texts a page can display as they are, see `escape_controls`."""
    if isinstance(content, str):
        return escape_controls(content)
    if isinstance(content, dict):
        return {key: _escape_texts(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_escape_texts(value) for value in content]
    return content


def _affordable(runs: Sequence[ReplayRun], budget: int) -> tuple[float, bool]:
    def bytes_at(rate: float, goals: bool) -> float:
        total = 0.0
        for record in (run.record for run in runs):
            moments = float(record.time[-1] - record.time[0]) * rate + 2 if has_path(record) else 2
            pairs = 2 if goals and np.isfinite(record.goals).any() else 1
            total += moments * (4 * len(record.team) * pairs + 2) * 4 / 3
        return total

    for goals, rate in product((True, False), (RATE, 4.0, 2.5, 2.0, 1.25, 1.0)):
        if bytes_at(rate, goals) <= budget:
            return rate, goals
    return max(min(budget / bytes_at(1.0, False), 1.0), 0.05), False


def _places(record: Record, values: Array, times: Array) -> str:
    """Return places (T, n, 2) m at other times, quantized between the corners of the region."""
    low, high = np.array(record.environment.region.bounds).reshape(2, 2)
    flat = _between(record.time, values.reshape(len(record), -1), times).reshape(len(times), -1, 2)
    return quantized((flat - low) / (high - low), 0.0, 1.0)


def _between(time: Array, rows: Array, times: Array) -> Array:
    """Return (T, m) rows at other times, linear in between; nan where either neighbor is."""
    after = np.clip(np.searchsorted(time, times), 1, max(len(time) - 1, 1))
    if len(time) == 1:
        return np.asarray(np.repeat(rows, len(times), axis=0))
    before = after - 1
    part = ((times - time[before]) / (time[after] - time[before]))[:, None]
    # at a moment of the record that moment counts alone: beside it there may be nothing
    mixed = np.where(part >= 1.0 - 1e-9, rows[after], (1.0 - part) * rows[before] + part * rows[after])
    return np.where(part <= 1e-9, rows[before], mixed)


def _cost(history: CostHistory | None, begin: float, times: Array, step: float) -> dict[str, Any] | None:
    if history is None:
        return None
    values = _between(history.time - begin, history.mean_distance[:, None], times)[:, 0]
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    low, high, last = float(finite.min()), float(finite.max()), float(history.mean_distance[-1])
    known = {"low": low, "high": high, "values": quantized(values, low, high)}
    return {"step": step, "count": len(times), **known, "last": last if np.isfinite(last) else None}


def replay_html(runs: Sequence[ReplayRun]) -> str:
    """Return runs that can be watched side by side as a fragment of HTML with its own style and script.

    It asks for no network, defines no global name and has no ids: several may stand on one page. Where
    scripts do not run (and on paper) it shows pictures of the last moments.
    """
    style, code = theme_rules(".robocov-replay") + replay_css(), script(replay_js() + "startReplays();")
    return f"<style>{style}</style>{replay_part(runs)}<script>{code}</script>"


def replay_part(runs: Sequence[ReplayRun], panes: Sequence[int] | None = None, budget: int = BUDGET) -> str:
    """Return a replay without style and script, for a page that has `replay_css` and `replay_js` once."""
    shown = list(range(len(runs)))[:MOST_PANES] if panes is None else list(panes)
    # runs of one controller with the same gains look the same
    keys = [(run.record.controller, tuple(run.record.gains.items())) for run in runs]
    order = list(dict.fromkeys(keys))
    own = dict(zip(order, choose_curve_styles([controller for controller, _ in order]), strict=True))
    styles = [run.style or own[key] for run, key in zip(runs, keys, strict=True)]
    data = embedded(runs, styles, shown, budget)
    stills = "".join(
        f"<figure><figcaption><strong>{escape(runs[k].title)}</strong></figcaption>"
        f"{run_picture(runs[k].record, runs[k].history, 560, 460, numbers=True)}</figure>"
        for k in shown
    )
    return (
        f'<div class="robocov-replay"><div class="stills">{stills}</div>'
        f'<script type="application/json">{script_json(data)}</script></div>'
    )


def replay_css() -> str:
    return asset("picture.css") + asset("replay.css")


def replay_js() -> str:
    """Return the definitions of the replay's script, to be run by ``startReplays()``, in a `script`."""
    return "".join(asset(name) for name in _SCRIPTS)


def script(content: str) -> str:
    return f'(() => {{\n"use strict";\n{content}\n}})();'


@cache
def asset(name: str) -> str:
    return files("robocov_app.report").joinpath("assets", name).read_text(encoding="utf-8")
