"""Selection of the runs that a page shows as pictures and in the replay."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robocov_app.figures.statistics import group_by
from robocov_app.report.analysis.groups import RunGroup, list_variants
from robocov_app.report.analysis.scaling import Scales, compute_medians, scale_distance
from robocov_app.report.analysis.tuning import choose_compared_groups
from robocov_app.report.results.result import ReportedResult, ReportedRun

MAX_SHOWN_RUNS = 50
"""Maximum number of runs of a result that a page shows."""
_CRITERIA = (
    "the best and the worst run of each controller by its final mean distance, with any gains, and the most "
    "typical case (start and seed) of all controllers, with the gains of the comparison in pairs"
)


class RunSelection(NamedTuple):
    """Runs to show.

    Attributes
    ----------
    runs : tuple of ReportedRun
        Selected runs, in the order of the result.
    note : str
        Description of how they were selected.
    panes : tuple of int
        Indices in `runs` of those that are shown side by side at first.
    """

    runs: tuple[ReportedRun, ...]
    note: str
    panes: tuple[int, ...]


def select_runs(result: ReportedResult, max_runs: int = MAX_SHOWN_RUNS, max_panes: int = 4) -> RunSelection:
    """Select the runs to show.

    If there are few runs, all are selected. Otherwise, they are the best, worst and middle runs of each map;
    if these are still too many, they are those of all maps together.

    Parameters
    ----------
    result : ReportedResult
    max_runs : int
    max_panes : int
        Maximum number of runs side by side.

    Returns
    -------
    RunSelection
        The panes show as many different controllers as possible, from the same start if possible.
    """
    runs = result.completed_runs
    note = "All runs."
    if len(runs) > max_runs:
        runs, note = _select_extremes(result, max_runs)
    groups = list_variants(result)
    if len(groups) > max_panes:
        groups = choose_compared_groups(result).groups
    middle_runs = _find_middle_case(groups, runs, compute_medians(result)) or runs[:1]
    panes = tuple(runs.index(run) for run in middle_runs[:max_panes])
    return RunSelection(runs, note, panes)


def _select_extremes(result: ReportedResult, max_runs: int) -> tuple[tuple[ReportedRun, ...], str]:
    """Return the best, worst and middle runs, and a note on how they were selected."""
    all_runs = result.completed_runs
    selected: set[ReportedRun] = set()
    for map_runs in group_by(all_runs, lambda run: run.map).values():
        selected |= _find_extremes(result, map_runs)
    criteria = f"on each map {_CRITERIA}."
    if len(selected) > max_runs:
        selected = _find_extremes(result, all_runs)
        criteria = f"over all maps {_CRITERIA}; distances are divided by the median of the same map and team."
    if not selected:
        note = f"The first {max_runs} of {len(all_runs)} runs: none has a final cost."
        return all_runs[:max_runs], note
    runs = tuple(run for run in all_runs if run in selected)[:max_runs]
    return runs, f"{len(runs)} of {len(all_runs)} runs: {criteria}"


def _find_extremes(result: ReportedResult, runs: Sequence[ReportedRun]) -> set[ReportedRun]:
    """Return the best and the worst run of each controller, and the runs of the middle case."""
    scales = compute_medians(result)
    groups = choose_compared_groups(result).groups
    extremes = set(_find_middle_case(groups, runs, scales))
    known_runs = [run for run in runs if np.isfinite(scale_distance(run, scales))]
    for controller_runs in group_by(known_runs, lambda run: run.controller).values():
        distances = [scale_distance(run, scales) for run in controller_runs]
        extremes.add(controller_runs[int(np.argmin(distances))])
        extremes.add(controller_runs[int(np.argmax(distances))])
    return extremes


def _find_middle_case(
    groups: Sequence[RunGroup], runs: Sequence[ReportedRun], scales: Scales
) -> tuple[ReportedRun, ...]:
    """Return those of the given runs whose case is the most typical one for all groups.

    It is a case that the largest number of groups have. Among these, it is the one whose ranks, by distance,
    are nearest to the middle of each group.
    """
    candidates = set(runs)
    offsets: dict[ReportedRun, float] = {}
    for group in groups:
        group_runs = [run for run in group.runs if run in candidates]
        known_runs = [run for run in group_runs if np.isfinite(scale_distance(run, scales))]
        ranked_runs = sorted(known_runs, key=lambda run: scale_distance(run, scales))
        middle_rank = (len(ranked_runs) - 1) / 2
        for rank, run in enumerate(ranked_runs):
            offsets[run] = abs(rank - middle_rank) / len(ranked_runs)

    def build_sort_key(case_runs: Sequence[ReportedRun]) -> tuple[int, float]:
        """Return a key that puts the cases with the most runs first, then those nearest to the middle."""
        return -len(case_runs), sum(offsets[run] for run in case_runs)

    if not offsets:
        return ()
    cases = group_by(offsets, lambda run: run.case).values()
    middle_case = min(cases, key=build_sort_key)
    return tuple(middle_case)
