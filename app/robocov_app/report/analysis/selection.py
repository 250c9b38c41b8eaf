"""Selection of the runs that a page shows as pictures and in the replay."""

from collections.abc import Mapping, Sequence
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
    "the best and the worst run of each controller by final mean distance, with any of its gains, and the "
    "runs of a typical start and seed, with the gains that are compared in pairs"
)


class _ShownRuns(NamedTuple):
    """Runs to show, how they were selected, and why each was selected; see `RunSelection`."""

    runs: tuple[ReportedRun, ...]
    note: str
    roles: Mapping[ReportedRun, str]


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
    roles : mapping of ReportedRun to str
        Why runs were selected: "best", "worst" or "typical"; empty if all runs are shown.
    """

    runs: tuple[ReportedRun, ...]
    note: str
    panes: tuple[int, ...]
    roles: Mapping[ReportedRun, str]


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
    shown = _ShownRuns(result.completed_runs, "All runs.", roles={})
    if len(result.completed_runs) > max_runs:
        shown = _select_extremes(result, max_runs)
    groups = list_variants(result)
    if len(groups) > max_panes:
        groups = choose_compared_groups(result).groups
    middle_runs = _find_middle_case(groups, shown.runs, compute_medians(result)) or shown.runs[:1]
    panes = tuple(shown.runs.index(run) for run in middle_runs[:max_panes])
    return RunSelection(shown.runs, shown.note, panes, shown.roles)


def _select_extremes(result: ReportedResult, max_runs: int) -> _ShownRuns:
    """Select the best, worst and middle runs."""
    all_runs = result.completed_runs
    roles: dict[ReportedRun, str] = {}
    for map_runs in group_by(all_runs, lambda run: run.map).values():
        roles |= _find_extremes(result, map_runs)
    criteria = f"for each map, {_CRITERIA}."
    if len(roles) > max_runs:
        roles = _find_extremes(result, all_runs)
        criteria = (
            f"over all maps, {_CRITERIA}. Distances are divided by the median of the same map and team."
        )
    if not roles:
        note = f"The first {max_runs} of {len(all_runs)} runs: none has a final cost."
        return _ShownRuns(all_runs[:max_runs], note, roles={})
    runs = tuple(run for run in all_runs if run in roles)[:max_runs]
    return _ShownRuns(runs, f"{len(runs)} of {len(all_runs)} runs: {criteria}", roles)


def _find_extremes(result: ReportedResult, runs: Sequence[ReportedRun]) -> dict[ReportedRun, str]:
    """Return the best and worst runs of each controller, and the runs of the middle case, with roles."""
    scales = compute_medians(result)
    groups = choose_compared_groups(result).groups
    extremes = dict.fromkeys(_find_middle_case(groups, runs, scales), "typical")
    known_runs = [run for run in runs if np.isfinite(scale_distance(run, scales))]
    for controller_runs in group_by(known_runs, lambda run: run.controller).values():
        distances = [scale_distance(run, scales) for run in controller_runs]
        extremes[controller_runs[int(np.argmax(distances))]] = "worst"
        extremes[controller_runs[int(np.argmin(distances))]] = "best"
    return extremes


def _find_middle_case(
    groups: Sequence[RunGroup], runs: Sequence[ReportedRun], scales: Scales
) -> tuple[ReportedRun, ...]:
    """Return the runs of the most typical case among the given runs.

    It is a case that as many groups as possible have. Among these cases, it is the one whose runs are nearest
    to the middle of their groups when the groups are ranked by distance.
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
