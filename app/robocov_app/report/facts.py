"""Facts of a result in words: what was run, what came of it, what went wrong."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from robocov.errors import format_count
from robocov_app.render.density import density_label
from robocov_app.report.groups import MOST_SAID, Comparison, gain_text, labels, setting_label
from robocov_app.report.results import Entry, Result, printable
from robocov_app.sweep.parameters import UNITS, format_parameter


def title_of(result: Result) -> str:
    if result.kind == "sweep":
        return f"Sweep {printable(result.folder.resolve().name)}"
    controllers = list(dict.fromkeys(entry.label for entry in result.entries))
    title = f"{_listed(controllers)} on {_listed(list(result.maps))}"
    return f"{title} · {result.part}" if result.part else title


def lede(result: Result, comparisons: Sequence[Comparison]) -> list[str]:
    fine = [entry for entry in result.fine if np.isfinite(entry.final)]
    if not fine:
        return ["No run has a result."]
    if result.kind == "sweep":
        pairs = [each for each in comparisons if each.pairs > 1]
        words = [each.headline() for each in pairs[:MOST_SAID]]
        if len(pairs) > MOST_SAID:
            words.append(f"{format_count(len(pairs) - MOST_SAID, 'more comparison')} below.")
        median = np.median([entry.final for entry in fine])
        return words or [f"{format_count(len(fine), 'run')}, median final distance {median:.3f} m."]
    if len(fine) == 1:
        (entry,) = fine
        at, gap = entry.figures.get("settled_at_s"), result.gap(entry)
        rest = "not settled by the end" if at is None else f"settled after {at:.1f} s"
        above = f", {100 * gap:.1f} % above the best placement known" if np.isfinite(gap) else ""
        return [f"At the end the nearest robot is {entry.final:.3f} m away on average{above}; {rest}."]
    lowest, names = min(entry.final for entry in fine), labels(result)
    parts = []
    for entry in sorted(fine, key=lambda each: each.final):
        above = f" (+{100 * (entry.final / lowest - 1):.0f} %)" if entry.final > lowest > 0 else ""
        parts.append(f"{names[entry]} {entry.final:.3f} m{above}")
    weighed = ", weighed by φ" if weighed_text(result) else ""
    return [f"Final mean distance to the nearest robot{weighed}: {', '.join(parts)}."]


def facts(result: Result) -> list[tuple[str, str]]:
    starts = dict.fromkeys(entry.start for entry in result.entries)
    sizes = sorted({entry.robots for entry in result.entries})
    done = len(result.fine)
    runs = [str(done) if done == result.wanted else f"{done} done"]
    runs += [f"{len(result.failed)} failed"] * bool(result.failed)
    runs += [f"{len(result.damaged)} unreadable"] * bool(result.damaged)
    runs += [f"{result.missing} of {result.wanted} missing"] * bool(result.missing)
    seeds = sorted({entry.seed for entry in result.entries if entry.seed is not None})
    drawn = ", ".join(map(str, seeds[:12])) + (f", … ({len(seeds)})" if len(seeds) > 12 else "")
    if len(seeds) > 2 and seeds[-1] - seeds[0] == len(seeds) - 1:
        drawn = f"{seeds[0]} to {seeds[-1]}"
    team = result.facts.get("team")
    parts = [_parameter(str(key), value) for key, value in team.items()] if isinstance(team, dict) else []
    for name, _ in result.entries[0].team if result.entries else ():
        values = dict.fromkeys(format_parameter(name, dict(entry.team)[name]) for entry in result.entries)
        parts.append(f"{name.replace('_', ' ')} {', '.join(values)}")
    versions = result.facts.get("versions")
    versions = versions if isinstance(versions, dict) else {}

    def known(form: str, name: str, factor: int = 1) -> str:
        value = result.facts.get(name)
        return "" if value is None else form.format(factor * value)

    rows = [
        ("Runs", ", ".join(runs)),
        ("Maps", ", ".join(result.maps)),
        ("Weighed by", weighed_text(result)),
        ("Robots", ", ".join(map(str, sizes))),
        ("Team", ", ".join(filter(None, parts))),
        ("Starts", ", ".join("given positions" if start is None else start for start in starts)),
        ("Seeds", drawn),
        ("Duration", known("{:.6g} s", "duration_s")),
        ("Control period", known("{:.4g} ms", "dt_s", 1000)),
        ("Cost evaluated on", known("a lattice of {0} × {0} sites", "lattice")),
        ("Versions", ", ".join(f"{name} {number}" for name, number in versions.items())),
    ]
    return [(term, text) for term, text in rows if text]


def meanings(result: Result) -> list[tuple[str, str]]:
    used = {name for entry in result.entries for name, _ in entry.gains}
    return [(name, text) for name, text in result.meanings.items() if name in used and text]


def weighed_text(result: Result) -> str:
    """Return by which densities the places of which maps count, empty where all places count the same."""
    words = {name: density_label(environment) for name, environment in result.maps.items()}
    return "; ".join(each if len(words) == 1 else f"{name}: {each}" for name, each in words.items() if each)


def gaps(result: Result) -> list[str]:
    words = []
    if result.failed:
        total = Counter(entry.label for entry in result.entries)
        failed = Counter(entry.label for entry in result.failed)
        whose = ", ".join(f"{label} {count} of {total[label]}" for label, count in failed.most_common())
        why = _firsts([entry.error or "" for entry in result.failed])
        words.append(
            f"{len(result.failed)} of {format_count(len(result.entries), 'run')} failed ({whose}): {why}"
        )
    if result.damaged:
        reasons = [f"{each.folder} ({each.reason})" for each in result.damaged]
        be = "is" if len(reasons) == 1 else "are"
        words.append(
            f"{format_count(len(reasons), 'run')} cannot be read and {be} left out: {_firsts(reasons)}"
        )
    if result.missing:
        verb = "is" if result.missing == 1 else "are"
        words.append(
            f"Not finished: {result.missing} of {format_count(result.wanted, 'run')} {verb} missing."
        )
    return words


def _firsts(texts: Sequence[str]) -> str:
    different = list(dict.fromkeys(texts))
    more = f"; and {len(different) - 3} more" if len(different) > 3 else ""
    return f"{'; '.join(different[:3])}{more}."


def troubles(result: Result) -> list[str]:
    fine = result.fine
    moving = [e.has("mean_distance_m") and not e.has("settled_at_s") for e in fine]
    found = {
        "a robot touched a wall or another one": [(e.figures.get("contacts") or 0) > 0 for e in fine],
        "a robot was stuck at the end": [(e.figures.get("stuck_robots") or 0) > 0 for e in fine],
        "the team had not settled by the end": moving,
    }
    if len(fine) == 1:
        return [f"{what[0].upper()}{what[1:]}." for what, (here,) in found.items() if here]
    return [f"In {sum(where)} of {len(fine)} runs {what}." for what, where in found.items() if any(where)]


def run_title(result: Result, entry: Entry, label: str) -> str:
    parts = [label]
    if len({each.setting for each in result.entries}) > 1 or result.kind == "run":
        parts.append(setting_label(result, entry.setting))
    if entry.start and len({(each.map, each.start) for each in result.entries}) > len(result.maps):
        parts.append(entry.start)
    if entry.seed is not None and len({each.seed for each in result.entries}) > 1:
        parts.append(f"seed\u00a0{entry.seed}")
    return " · ".join(parts)


def run_facts(result: Result, entry: Entry) -> str:
    figures = entry.figures
    words = [f"Gains: {gain_text(entry.gains, result.units)}"] if entry.gains else []
    if entry.has("mean_time_s"):
        words.append(f"mean time {figures['mean_time_s']:.3f} s")
    at = figures.get("settled_at_s")
    words.append("not settled" if at is None else f"settled at {at:.1f} s")
    if (contacts := figures.get("contacts")) is not None:
        words.append(format_count(int(contacts), "contact"))
    if (path := figures.get("path_length_m")) is not None:
        words.append(f"{path:.2f} m of path per robot")
    return f"{'; '.join(words)}."


def _listed(names: Sequence[str], most: int = 4) -> str:
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


def _parameter(key: str, value: Any) -> str:
    """Return a parameter of a team as words: of a sweep's study, or of a run with the unit in the name."""
    name = next((name for name in UNITS if key == name or key.startswith(f"{name}_")), None)
    if name is None:
        return ""
    words, unit = name.replace("_", " "), UNITS[name]
    values = value if isinstance(value, list) else [value]
    if isinstance(value, str):
        return f"{words} {format_parameter(name, value)}"
    if values and all(isinstance(each, int | float) for each in values):
        low, high = min(values), max(values)
        return f"{words} {low:.4g} {unit}" if low == high else f"{words} {low:.4g} to {high:.4g} {unit}"
    return f"{words} without limit" if values and all(each is None for each in values) else ""
