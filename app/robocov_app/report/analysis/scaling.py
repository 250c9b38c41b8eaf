"""Final mean distances as multiples of a median, so that runs on different maps can be shown together."""

from collections.abc import Callable, Iterable, Mapping
from operator import attrgetter
from typing import TypeAlias

import numpy as np

from robocov.typing import FloatArray
from robocov_app.figures.statistics import group_by
from robocov_app.report.results.result import ReportedResult, ReportedRun

Scales: TypeAlias = Mapping[ReportedRun, float]
"""Divisor of the final mean distance of each run, m."""


def compute_medians(
    result: ReportedResult, key: Callable[[ReportedRun], object] = attrgetter("setting")
) -> Scales:
    """Compute, for each run, the median final mean distance of all runs with the same key.

    Parameters
    ----------
    result : ReportedResult
    key : callable
        Returns the key of a run. By default, the key is the run's setting.

    Returns
    -------
    mapping of ReportedRun to float, m
        Medians. Runs whose final mean distance is unknown are left out.
    """
    known_runs = [run for run in result.completed_runs if np.isfinite(run.final_distance)]
    medians: dict[ReportedRun, float] = {}
    for runs in group_by(known_runs, key).values():
        median = float(np.median([run.final_distance for run in runs]))
        medians |= dict.fromkeys(runs, median)
    return medians


def scale_distance(run: ReportedRun, scales: Scales) -> float:
    """Return the final mean distance of a run divided by its scale; infinite if either is unknown."""
    scale = scales.get(run, 0.0)
    if not np.isfinite(run.final_distance) or scale <= 0.0:
        return np.inf
    return run.final_distance / scale


def scale_distances(runs: Iterable[ReportedRun], scales: Scales) -> FloatArray:
    """Return the finite scaled distances of runs, (m,); see `scale_distance`."""
    distances = np.array([scale_distance(run, scales) for run in runs])
    return np.asarray(distances[np.isfinite(distances)])
