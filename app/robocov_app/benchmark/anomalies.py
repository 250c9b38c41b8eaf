"""Runs to look into: teams that never move, and teams that end far above RAPF although they usually beat it.

Both are usually caused by a fault of the controller: a plan that cannot be followed, or a phase that never
ends.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from robocov_app.benchmark.ratings import get_run_key

MIN_PATH_LENGTH_M = 0.1
"""A team whose robots move less than this on average was at rest from the start."""
MAX_RAPF_RATIO = 1.2
"""A team ends far above RAPF if the ratio of its final cost to that of RAPF in the same run exceeds this."""

_RunValues: TypeAlias = dict[tuple[str, tuple[str, int]], float]
"""A value for each run, by track and run."""


class Anomaly(NamedTuple):
    """A run to look into."""

    track: str
    map: str
    seed: int
    reason: str


def find_anomalies(result: Mapping[str, Any], rapf: Mapping[str, Any]) -> list[Anomaly]:
    """Find the runs of a result in which the team never moved, or ended far above RAPF.

    Runs far above RAPF are only reported on tracks on which the controller is better than RAPF in the median.

    Parameters
    ----------
    result, rapf : Mapping
        The results of the controller and of RAPF, as returned by `robocov_app.benchmark.results.read_result`.

    Returns
    -------
    list of Anomaly
        In the order of the rows.
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
    """Return the final mean distances, m, of runs that did not fail, without those that are unknown or 0."""
    return {
        (row["track"], get_run_key(row)): row["mean_distance_m"]
        for row in rows
        if "error" not in row and row["mean_distance_m"]
    }


def _find_better_tracks(ratios: _RunValues) -> set[str]:
    """Return the tracks on which the median ratio of the costs to those of RAPF is below 1."""
    ratios_by_track: dict[str, list[float]] = {}
    for (track, _), ratio in ratios.items():
        ratios_by_track.setdefault(track, []).append(ratio)
    return {track for track, values in ratios_by_track.items() if np.median(values) < 1.0}
