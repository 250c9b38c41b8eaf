"""Suspicious runs: teams that never move, and teams whose final cost is far above that of RAPF.

Both are usually caused by a fault of the controller, such as a plan that cannot be followed, or a phase that
never ends. A high cost is suspicious only for controllers that are usually better than RAPF, either on the
same track or by far over all tracks.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from robocov_app.benchmark.ratings import RunKey, get_run_key

MIN_PATH_LENGTH_M = 0.1
"""Minimum mean path length of a team that did not stay at rest."""
MAX_RAPF_RATIO = 1.2
"""Maximum ratio of the final cost to that of RAPF in the same run for a run that is not suspicious."""
CLEARLY_BETTER_RATIO = 0.9
"""A controller whose median ratio over all runs is below this is expected to beat RAPF on every track."""

_RunValues: TypeAlias = dict[tuple[str, RunKey], float]
"""A value for each run, by track and by map and seed."""


class Anomaly(NamedTuple):
    """A suspicious run."""

    track: str
    map: str
    seed: int
    reason: str


def find_anomalies(result: Mapping[str, Any], rapf: Mapping[str, Any]) -> list[Anomaly]:
    """Find the runs of a result in which the team never moved, or in which the final cost was far too high.

    Costs far above that of RAPF are only reported on tracks on which the controller is expected to beat RAPF:
    those on which its median ratio of costs is below 1, or all tracks if the median ratio over all runs is
    below `CLEARLY_BETTER_RATIO`.

    Parameters
    ----------
    result, rapf : Mapping
        The results of the controller and of RAPF, as returned by `robocov_app.benchmark.results.read_result`.

    Returns
    -------
    list of Anomaly
        The suspicious runs, in the order of the rows.
    """
    rapf_costs = _collect_costs(rapf["rows"])
    ratios = {
        key: cost / rapf_costs[key]
        for key, cost in _collect_costs(result["rows"]).items()
        if key in rapf_costs
    }
    better_tracks = _find_better_tracks(ratios)
    anomalies = []
    for row in result["rows"]:
        if "error" in row:
            continue
        track = row["track"]
        ratio = ratios.get((track, get_run_key(row)), 0.0)
        if row["path_length_m"] < MIN_PATH_LENGTH_M:
            reason = "at rest from the start"
        elif ratio > MAX_RAPF_RATIO and track in better_tracks:
            reason = f"cost more than {MAX_RAPF_RATIO:g} times that of RAPF"
        else:
            continue
        anomalies.append(Anomaly(track, row["map"], row["seed"], reason))
    return anomalies


def _collect_costs(rows: Sequence[Mapping[str, Any]]) -> _RunValues:
    """Return the final mean distance of each run, m, without failed runs and values that are unknown or 0."""
    return {
        (row["track"], get_run_key(row)): row["mean_distance_m"]
        for row in rows
        if "error" not in row and row["mean_distance_m"]
    }


def _find_better_tracks(ratios: _RunValues) -> set[str]:
    """Return the tracks on which a controller with these ratios of costs is expected to beat RAPF."""
    ratios_by_track: dict[str, list[float]] = {}
    for (track, _), ratio in ratios.items():
        ratios_by_track.setdefault(track, []).append(ratio)
    if ratios and np.median(list(ratios.values())) < CLEARLY_BETTER_RATIO:
        return set(ratios_by_track)
    return {track for track, values in ratios_by_track.items() if np.median(values) < 1.0}
