"""Titles of results and of their runs, and facts about them, as text."""

from collections.abc import Sequence
from typing import Any

from robocov.errors import format_count
from robocov_app.render.density_text import describe_density
from robocov_app.report.analysis.groups import format_gains, format_setting
from robocov_app.report.descriptions import format_seconds
from robocov_app.report.results.result import ReportedResult, ReportedRun, replace_unprintable
from robocov_app.sweep.study.parameters import UNITS, format_parameter

_MAX_LISTED_NAMES = 4
_MAX_LISTED_SEEDS = 12


def format_title(result: ReportedResult) -> str:
    """Return the title of a result: its controllers and maps, or the name of the sweep."""
    if result.kind == "sweep":
        return f"Sweep {replace_unprintable(result.folder.resolve().name)}"
    controllers = list(dict.fromkeys(run.label for run in result.runs))
    title = f"{_list_names(controllers)} on {_list_names(list(result.maps))}"
    if result.description:
        title += f" · {result.description}"
    return title


def _list_names(names: Sequence[str]) -> str:
    """Join names with commas; if there are many, only the first ones, followed by the number of others."""
    text = ", ".join(names[:_MAX_LISTED_NAMES])
    if len(names) > _MAX_LISTED_NAMES:
        text += f" and {len(names) - _MAX_LISTED_NAMES} more"
    return text


def list_facts(result: ReportedResult) -> list[tuple[str, str]]:
    """List the facts about the runs of a result.

    Parameters
    ----------
    result : ReportedResult

    Returns
    -------
    list of (str, str)
        Terms and texts, such as ``("Duration", "60 s")``. Unknown facts are left out.
    """
    starts = dict.fromkeys(run.start for run in result.runs)
    start_names = ["given positions" if start is None else start for start in starts]
    sizes = sorted({run.robots for run in result.runs})
    facts = [
        ("Runs", _format_run_counts(result)),
        ("Maps", ", ".join(result.maps)),
        ("Weighted by", format_densities(result)),
        ("Robots", ", ".join(map(str, sizes))),
        ("Team", _format_team(result)),
        ("Starts", ", ".join(start_names)),
        ("Seeds", _format_seeds(result)),
    ]
    duration = result.facts.get("duration_s")
    if duration is not None:
        facts.append(("Duration", format_seconds(duration)))
    period = result.facts.get("dt_s")
    if period is not None:
        facts.append(("Control period", f"{1000 * period:.4g} ms"))
    lattice = result.facts.get("lattice")
    if lattice is not None:
        facts.append(("Cost evaluated on", f"a lattice of {lattice} × {lattice} sites"))
    versions = result.facts.get("versions")
    if isinstance(versions, dict):
        facts.append(("Versions", ", ".join(f"{name} {number}" for name, number in versions.items())))
    return [(term, text) for term, text in facts if text]


def _format_run_counts(result: ReportedResult) -> str:
    """Describe how many runs are done, failed, unreadable and missing."""
    done = len(result.completed_runs)
    if done == result.expected_count:
        return str(done)
    counts = [f"{done} done"]
    if result.failed_runs:
        counts.append(f"{len(result.failed_runs)} failed")
    if result.damaged_runs:
        counts.append(f"{len(result.damaged_runs)} unreadable")
    if result.missing_count:
        counts.append(f"{result.missing_count} of {result.expected_count} missing")
    return ", ".join(counts)


def _format_seeds(result: ReportedResult) -> str:
    """Format the seeds: as a range if they are consecutive, otherwise as a list."""
    seeds = sorted({run.seed for run in result.runs if run.seed is not None})
    if len(seeds) > 2 and seeds[-1] - seeds[0] == len(seeds) - 1:
        return f"{seeds[0]} to {seeds[-1]}"
    text = ", ".join(map(str, seeds[:_MAX_LISTED_SEEDS]))
    if len(seeds) > _MAX_LISTED_SEEDS:
        text += f", … ({len(seeds)})"
    return text


def _format_team(result: ReportedResult) -> str:
    """Describe the team: parameters that all runs have in common, then those with several values."""
    texts = []
    team = result.facts.get("team")
    if isinstance(team, dict):
        texts += [_format_team_parameter(str(key), value) for key, value in team.items()]
    if result.runs:
        for name, _ in result.runs[0].team:
            values = dict.fromkeys(format_parameter(name, dict(run.team)[name]) for run in result.runs)
            texts.append(f"{name.replace('_', ' ')} {', '.join(values)}")
    return ", ".join(text for text in texts if text)


def _format_team_parameter(key: str, value: Any) -> str:
    """Format a parameter of a team; the result is empty if the parameter is unknown.

    Parameters
    ----------
    key : str
        Name of the parameter. In the file of a run, its unit follows after an underscore.
    value : str, float, None or list of these
        A value for all robots, or a list with one value for each.
    """
    name = next((name for name in UNITS if key == name or key.startswith(f"{name}_")), None)
    if name is None:
        return ""
    label = name.replace("_", " ")
    if isinstance(value, str):
        return f"{label} {format_parameter(name, value)}"
    values = value if isinstance(value, list) else [value]
    if not values:
        return ""
    if all(item is None for item in values):
        return f"unlimited {label}"
    if not all(isinstance(item, int | float) for item in values):
        return ""
    low = min(values)
    high = max(values)
    unit = UNITS[name]
    if low == high:
        return f"{label} {low:.4g} {unit}"
    return f"{label} {low:.4g} to {high:.4g} {unit}"


def list_gain_meanings(result: ReportedResult) -> list[tuple[str, str]]:
    """List the gains of the runs and their meanings, except for gains whose meaning is unknown."""
    used_names = {name for run in result.runs for name, _ in run.gains}
    meanings = result.gain_meanings.items()
    return [(name, meaning) for name, meaning in meanings if name in used_names and meaning]


def format_densities(result: ReportedResult) -> str:
    """Describe the densities by which locations on the maps are weighted; empty if there are none."""
    labels = {name: describe_density(environment) for name, environment in result.maps.items()}
    if len(labels) == 1:
        return "".join(labels.values())
    return "; ".join(f"{name}: {label}" for name, label in labels.items() if label)


def format_run_title(result: ReportedResult, run: ReportedRun, label: str) -> str:
    """Return the title of a run: its label, and what distinguishes it from other runs.

    Parameters
    ----------
    result : ReportedResult
    run : ReportedRun
    label : str
        Label of the run's variant.

    Returns
    -------
    str
    """
    texts = [label]
    has_several_settings = len({other.setting for other in result.runs}) > 1
    if has_several_settings or result.kind == "run":
        texts.append(format_setting(result, run.setting))
    has_several_starts = len({(other.map, other.start) for other in result.runs}) > len(result.maps)
    if run.start and has_several_starts:
        texts.append(run.start)
    has_several_seeds = len({other.seed for other in result.runs}) > 1
    if run.seed is not None and has_several_seeds:
        texts.append(f"seed\u00a0{run.seed}")
    return " · ".join(texts)


def format_run_facts(result: ReportedResult, run: ReportedRun) -> str:
    """Describe the gains and the most important metrics of a run in a sentence."""
    texts = []
    if run.gains:
        texts.append(f"Gains: {format_gains(run.gains, result.gain_units)}")
    if run.has_metric("mean_time_s"):
        texts.append(f"mean time {run.metrics['mean_time_s']:.3f} s")
    settled_at = run.metrics.get("settled_at_s")
    if settled_at is None:
        texts.append("not settled")
    else:
        texts.append(f"settled at {settled_at:.1f} s")
    contacts = run.metrics.get("contacts")
    if contacts is not None:
        texts.append(format_count(int(contacts), "contact"))
    path_length = run.metrics.get("path_length_m")
    if path_length is not None:
        texts.append(f"mean path length {path_length:.2f} m")
    return f"{'; '.join(texts)}."
