"""What a report says of a result in words: what was run, what came of it, what went wrong."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.errors import counted
from robocov_app.render.density import density_words
from robocov_app.report.groups import MOST_SAID, gain_text, setting_label, variants
from robocov_app.sweep.study import UNITS, parameter_text

if TYPE_CHECKING:
    from robocov_app.report.groups import Comparison
    from robocov_app.report.results import Entry, Result


def title_of(result: Result) -> str:
    """Return what a result is called."""
    labels = list(dict.fromkeys(entry.label for entry in result.entries))
    maps = list(result.maps)
    if result.kind == "sweep":
        from robocov_app.report.results import printable

        return f"Sweep {printable(result.folder.resolve().name)}"
    return f"{_listed(labels)} on {_listed(maps)}"


def lede(result: Result, comparisons: Sequence[Comparison]) -> list[str]:
    """Return what came of it, in a few sentences."""
    fine = [entry for entry in result.fine if np.isfinite(entry.final)]
    if not fine:
        return ["No run has a result."]
    if result.kind == "sweep":
        pairs = [each for each in comparisons if each.pairs > 1]
        words = [each.headline() for each in pairs[:MOST_SAID]]
        if len(pairs) > MOST_SAID:
            words.append(f"{counted(len(pairs) - MOST_SAID, 'more comparison')} below.")
        return words or [f"{counted(len(fine), 'run')}, median final distance {_median(fine):.3f} m."]
    if len(fine) == 1:
        entry = fine[0]
        at = entry.figures.get("settled_at_s")
        rest = "not settled by the end" if at is None else f"settled after {at:.1f} s"
        above = _above(result, entry)
        return [f"At the end the nearest robot is {entry.final:.3f} m away on average{above}; {rest}."]
    lowest = min(entry.final for entry in fine)
    labels = {entry: group.label for group in variants(result) for entry in group.entries}
    parts = []
    for entry in sorted(fine, key=lambda each: each.final):
        above = f" (+{100 * (entry.final / lowest - 1):.0f} %)" if entry.final > lowest > 0 else ""
        parts.append(f"{labels[entry]} {entry.final:.3f} m{above}")
    weighed = ", weighed by φ" if weighed_text(result) else ""
    return [f"Final mean distance to the nearest robot{weighed}: {', '.join(parts)}."]


def facts(result: Result) -> list[tuple[str, str]]:
    """Return what was run, as terms and descriptions."""
    known = result.facts
    entries = result.entries
    starts = list(dict.fromkeys(entry.start for entry in entries))
    seeds = sorted({entry.seed for entry in entries if entry.seed is not None})
    sizes = sorted({entry.robots for entry in entries})
    rows = [
        ("Runs", _runs_text(result)),
        ("Maps", ", ".join(result.maps)),
        ("Weighed by", weighed_text(result)),
        ("Robots", ", ".join(map(str, sizes))),
        ("Team", _team_text(result)),
        ("Starts", ", ".join("given positions" if start is None else start for start in starts)),
        ("Seeds", _seeds_text(seeds)),
        ("Duration", _number(known.get("duration_s"), " s")),
        ("Control period", _milliseconds(known.get("dt_s"))),
        ("Cost evaluated on", _lattice(known.get("lattice"))),
        ("Versions", _versions_text(known.get("versions"))),
    ]
    return [(term, text) for term, text in rows if text]


def meanings(result: Result) -> list[tuple[str, str]]:
    """Return the gains of the controllers that were run, and what they are."""
    used = {name for entry in result.entries for name, _ in entry.gains}
    return [(name, text) for name, text in result.meanings.items() if name in used and text]


def weighed_text(result: Result) -> str:
    """Return by which densities the places of which maps count, empty where all places count the same."""
    words = {name: density_words(environment) for name, environment in result.maps.items()}
    some = {name: each for name, each in words.items() if each}
    if len(result.maps) == 1:
        return "".join(some.values())
    return "; ".join(f"{name}: {each}" for name, each in some.items())


def gaps(result: Result) -> list[str]:
    """Return sentences on runs that failed, cannot be read, or are missing: the first that is told."""
    words = []
    if result.failed:
        total = Counter(entry.label for entry in result.entries)
        failed = Counter(entry.label for entry in result.failed)
        whose = ", ".join(f"{label} {count} of {total[label]}" for label, count in failed.most_common())
        words.append(
            f"{len(result.failed)} of {counted(len(result.entries), 'run')} failed ({whose}): "
            f"{_firsts([entry.error or '' for entry in result.failed])}"
        )
    if result.damaged:
        reasons = [f"{each.folder} ({each.reason})" for each in result.damaged]
        be = "is" if len(reasons) == 1 else "are"
        words.append(f"{counted(len(reasons), 'run')} cannot be read and {be} left out: {_firsts(reasons)}")
    if result.missing:
        verb = "is" if result.missing == 1 else "are"
        words.append(f"Not finished: {result.missing} of {counted(result.wanted, 'run')} {verb} missing.")
    return words


def _firsts(texts: Sequence[str], most: int = 3) -> str:
    """Return the first different texts as a sentence, and how many more there are."""
    different = list(dict.fromkeys(texts))
    more = f"; and {len(different) - most} more" if len(different) > most else ""
    return f"{'; '.join(different[:most])}{more}."


def troubles(result: Result) -> list[str]:
    """Return sentences on what did not go well in runs: contacts, robots that got stuck, no rest."""
    fine = len(result.fine)
    words: list[str] = []
    unsettled = sum(_known(e, "mean_distance_m") and not _known(e, "settled_at_s") for e in result.fine)
    for count, what in (
        (
            sum((e.figures.get("contacts") or 0) > 0 for e in result.fine),
            "a robot touched a wall or another one",
        ),
        (sum((e.figures.get("stuck_robots") or 0) > 0 for e in result.fine), "a robot was stuck at the end"),
        (unsettled, "the team had not settled by the end"),
    ):
        if fine == 1:
            words += [f"{what[0].upper()}{what[1:]}."] if count else []
        elif count:
            words.append(f"In {count} of {fine} runs {what}.")
    return words


def run_title(result: Result, entry: Entry, label: str) -> str:
    """Return what a run is called in lists: what tells it from the others, and its controller."""
    parts = [label]
    if len({each.setting for each in result.entries}) > 1 or result.kind == "run":
        parts.append(setting_label(result, entry.setting))
    starts = {(each.map, each.start) for each in result.entries}
    if entry.start and len(starts) > len(result.maps):
        parts.append(entry.start)
    if entry.seed is not None and len({each.seed for each in result.entries}) > 1:
        parts.append(f"seed\u00a0{entry.seed}")
    return " · ".join(parts)


def run_facts(result: Result, entry: Entry) -> str:
    """Return the figures of a run as a sentence."""
    figures = entry.figures
    words = [f"Gains: {gain_text(entry.gains, result.units)}"] if entry.gains else []
    if _known(entry, "mean_time_s"):
        words.append(f"mean time {figures['mean_time_s']:.3f} s")
    at = figures.get("settled_at_s")
    words.append("not settled" if at is None else f"settled at {at:.1f} s")
    contacts = figures.get("contacts")
    if contacts is not None:
        words.append(counted(int(contacts), "contact"))
    path = figures.get("path_length_m")
    if path is not None:
        words.append(f"{path:.2f} m of path per robot")
    return f"{'; '.join(words)}."


def _listed(names: Sequence[str], most: int = 4) -> str:
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


def _median(entries: Sequence[Entry]) -> float:
    return float(np.median([entry.final for entry in entries]))


def _above(result: Result, entry: Entry) -> str:
    gap = result.gap(entry)
    return f", {100 * gap:.1f} % above the best placement known" if np.isfinite(gap) else ""


def _known(entry: Entry, name: str) -> bool:
    value = entry.figures.get(name)
    return value is not None and bool(np.isfinite(value))


def _number(value: Any, unit: str) -> str:
    return "" if value is None else f"{value:.6g}{unit}"


def _milliseconds(value: Any) -> str:
    return "" if value is None else f"{1000 * value:.4g} ms"


def _lattice(value: Any) -> str:
    return "" if value is None else f"a lattice of {value} × {value} sites"


def _runs_text(result: Result) -> str:
    done = len(result.fine)
    words = [str(done) if done == result.wanted else f"{done} done"]
    if result.failed:
        words.append(f"{len(result.failed)} failed")
    if result.damaged:
        words.append(f"{len(result.damaged)} unreadable")
    if result.missing:
        words.append(f"{result.missing} of {result.wanted} missing")
    return ", ".join(words)


def _seeds_text(seeds: Sequence[int]) -> str:
    if len(seeds) > 2 and seeds[-1] - seeds[0] == len(seeds) - 1:
        return f"{seeds[0]} to {seeds[-1]}"
    shown = ", ".join(map(str, seeds[:12]))
    return shown if len(seeds) <= 12 else f"{shown}, … ({len(seeds)})"


def _versions_text(versions: Any) -> str:
    if not isinstance(versions, dict):
        return ""
    return ", ".join(f"{name} {version}" for name, version in versions.items())


def _team_text(result: Result) -> str:
    """Return limits and ranges of the team, and which of them vary."""
    team = result.facts.get("team")
    parts = []
    if isinstance(team, dict):
        parts = [_parameter(str(key), value) for key, value in team.items()]
    for name, _ in result.entries[0].team if result.entries else ():
        values = list(dict.fromkeys(dict(entry.team)[name] for entry in result.entries))
        several = ", ".join(parameter_text(name, value) for value in values)
        parts.append(f"{name.replace('_', ' ')} {several}")
    return ", ".join(part for part in parts if part)


def _parameter(key: str, value: Any) -> str:
    """Return a parameter of a team as words: of a sweep's study, or of a run with the unit in the name."""
    if isinstance(value, list):
        same = all(each == value[0] for each in value)
        value = value[0] if value and same else value
    for name, unit in UNITS.items():
        if key == name or key.startswith(f"{name}_"):
            if isinstance(value, str):
                return f"{name.replace('_', ' ')} {parameter_text(name, value)}"
            if value is None:
                return f"{name.replace('_', ' ')} without limit"
            if isinstance(value, int | float):
                return f"{name.replace('_', ' ')} {value:.4g} {unit}"
            if isinstance(value, list) and all(isinstance(each, int | float) for each in value):
                return f"{name.replace('_', ' ')} {min(value):.4g} to {max(value):.4g} {unit}"
    return ""
