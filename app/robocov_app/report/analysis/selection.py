"""Selection of the runs that a page shows as pictures and in the replay."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
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
    "the best and the worst run of each controller by its final mean distance, and the most typical case "
    "(start and seed) of all controllers, with the gains used in the comparison"
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
    groups = _select_groups(result, runs, max_variants=max_panes)
    middle_runs = _find_middle_case(groups, compute_medians(result)) or runs[:1]
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
    extremes = set(_find_middle_case(_select_groups(result, runs), scales))
    known_runs = [run for run in runs if np.isfinite(scale_distance(run, scales))]
    for controller_runs in group_by(known_runs, lambda run: run.controller).values():
        distances = [scale_distance(run, scales) for run in controller_runs]
        extremes.add(controller_runs[int(np.argmin(distances))])
        extremes.add(controller_runs[int(np.argmax(distances))])
    return extremes


def _select_groups(
    result: ReportedResult, runs: Iterable[ReportedRun], max_variants: int = 0
) -> list[RunGroup]:
    """Return all variants, reduced to given runs; if there are many variants, only the compared groups."""
    selected = set(runs)
    groups = list_variants(result)
    if len(groups) > max_variants:
        groups = choose_compared_groups(result).groups
    return [_keep_runs(group, selected) for group in groups]


def _keep_runs(group: RunGroup, runs: Collection[ReportedRun]) -> RunGroup:
    """Return a group reduced to its runs that are in `runs`."""
    return replace(group, runs=tuple(run for run in group.runs if run in runs))


def _find_middle_case(groups: Sequence[RunGroup], scales: Scales) -> tuple[ReportedRun, ...]:
    """Return the runs of the case that is most typical for all groups.

    It is a case that the largest number of groups have. Among these, it is the one whose ranks, by distance,
    are nearest to the middle of each group.
    """
    offsets: list[tuple[float, ReportedRun]] = []
    for group in groups:
        known_runs = [run for run in group.runs if np.isfinite(scale_distance(run, scales))]
        ranked_runs = sorted(known_runs, key=lambda run: scale_distance(run, scales))
        count = len(ranked_runs)
        for rank, run in enumerate(ranked_runs):
            offsets.append((abs(rank - (count - 1) / 2) / count, run))
    cases = group_by(offsets, lambda pair: pair[1].case).values()
    middle_case = min(cases, key=_rate_case, default=[])
    return tuple(run for _, run in middle_case)


def _rate_case(case: Sequence[tuple[float, ReportedRun]]) -> tuple[int, float]:
    """Return a sort key of a case, a list of (distance from the middle rank, run): the most runs first."""
    return -len(case), sum(offset for offset, _ in case)
