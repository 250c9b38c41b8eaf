"""Comparison of two groups by pairs of runs: ratios of final mean distances, with 95% intervals."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from robocov.typing import FloatArray
from robocov_app.figures.statistics import (
    MIN_BOOTSTRAP_MAPS,
    Interval,
    bootstrap,
    estimate_mean,
    group_by,
)
from robocov_app.report.analysis.groups import RunGroup
from robocov_app.report.results.result import ReportedRun

MAX_COMPARED_GROUPS = 4
"""Up to this number of groups, all are compared with each other; otherwise, all with the first."""
NEGLIGIBLE_DIFFERENCE = 0.001
"""Smaller relative differences of a cost do not count as better or worse."""

PairVerdict: TypeAlias = Literal["better", "worse", "undecided"]
_VERDICTS: tuple[PairVerdict, ...] = ("better", "worse", "undecided")


class MapPairs(NamedTuple):
    """The pairs of runs of two groups on one map.

    Attributes
    ----------
    map_name : str
    first_distances, second_distances : (m,) array, m
        Final mean distances of the runs in each pair.
    ratio : Interval
        Geometric mean of the ratios first / second, over starts and seeds.
    """

    map_name: str
    first_distances: FloatArray
    second_distances: FloatArray
    ratio: Interval

    @property
    def verdict(self) -> PairVerdict:
        """Whether the first group is better: "undecided" if the interval includes negligible differences."""
        if self.ratio.high < 1.0 - NEGLIGIBLE_DIFFERENCE:
            return "better"
        if self.ratio.low > 1.0 + NEGLIGIBLE_DIFFERENCE:
            return "worse"
        return "undecided"

    @property
    def pair_count(self) -> int:
        """Number of pairs."""
        return len(self.first_distances)

    @property
    def lower_count(self) -> int:
        """Number of pairs in which the first group has the lower distance."""
        return int((self.first_distances < self.second_distances).sum())


@dataclass(frozen=True, eq=False)
class GroupComparison:
    """A comparison of two groups on the cases that both have.

    Attributes
    ----------
    first, second : RunGroup
    maps : tuple of MapPairs
    ratio : Interval
        Ratio of the first group to the second: a mean over maps, or over seeds if there is only one map. It
        has no limits if there are several maps, but fewer than `MIN_BOOTSTRAP_MAPS`.
    unpaired_count : int
        Number of cases that only one of the groups has.
    """

    first: RunGroup
    second: RunGroup
    maps: tuple[MapPairs, ...]
    ratio: Interval
    unpaired_count: int

    @property
    def label(self) -> str:
        """Labels of both groups."""
        return f"{self.first.label} / {self.second.label}"

    @property
    def pair_count(self) -> int:
        """Number of pairs on all maps."""
        return sum(pairs.pair_count for pairs in self.maps)

    def format_verdicts(self) -> str:
        """Describe on how many maps the first group is better, worse or neither."""
        counts = Counter(pairs.verdict for pairs in self.maps)
        map_count = len(self.maps)
        if len(counts) == 1:
            maps = {1: "the map", 2: "both maps"}.get(map_count, f"all {map_count} maps")
            return f"{self.maps[0].verdict} on {maps}"
        texts = [f"{verdict} on {counts[verdict]}" for verdict in _VERDICTS if counts[verdict]]
        return ", ".join([f"{texts[0]} of {map_count} maps", *texts[1:]])

    def format_headline(self) -> str:
        """Return the outcome as one sentence."""
        names = f"{self.first.label} against {self.second.label}"
        map_count = len(self.maps)
        if map_count > 1:
            if map_count < MIN_BOOTSTRAP_MAPS:
                ratio = f"{self.ratio.estimate:.3f} ({map_count} maps, too few for an interval)"
            else:
                ratio = f"{format_ratio(self.ratio)} over {map_count} maps"
            return f"{names}: {self.format_verdicts()}; ratio {ratio}."
        ratio = format_ratio(self.ratio)
        if self.pair_count == 1:
            return f"{names}: ratio {ratio} in the only pair."
        return f"{names}: {self.maps[0].verdict}, ratio {ratio} over {self.pair_count} pairs."


def format_ratio(ratio: Interval) -> str:
    """Format a ratio, followed by its interval if there is one."""
    text = f"{ratio.estimate:.3f}"
    if np.isfinite(ratio.low):
        text += f" ({ratio.low:.3f} to {ratio.high:.3f})"
    return text


def compare_groups(groups: Sequence[RunGroup]) -> list[GroupComparison]:
    """Compare groups that have cases in common.

    Parameters
    ----------
    groups : sequence of RunGroup

    Returns
    -------
    list of GroupComparison
        Comparisons of all pairs of groups; if there are many groups, of the first one with all others.
    """
    first_groups = groups
    if len(groups) > MAX_COMPARED_GROUPS:
        first_groups = groups[:1]
    comparisons = []
    for number, first in enumerate(first_groups):
        for second in groups[number + 1 :]:
            comparison = compare_pair(first, second)
            if comparison is not None:
                comparisons.append(comparison)
    return comparisons


def compare_pair(first: RunGroup, second: RunGroup) -> GroupComparison | None:
    """Compare two groups; return None if they have no case in common."""
    first_runs = _index_by_case(first)
    second_runs = _index_by_case(second)
    paired_runs = [run for case, run in first_runs.items() if case in second_runs]
    if not paired_runs:
        return None
    maps = []
    for map_name, runs in group_by(paired_runs, lambda run: run.map).items():
        first_distances = np.array([run.final_distance for run in runs])
        second_distances = np.array([second_runs[run.case].final_distance for run in runs])
        ratio = _estimate_ratio(runs, first_distances / second_distances)
        maps.append(MapPairs(map_name, first_distances, second_distances, ratio))
    ratio = maps[0].ratio
    if len(maps) > 1:
        log_ratios = [float(np.log(pairs.ratio.estimate)) for pairs in maps]
        ratio = _estimate_ratio_over_maps(log_ratios)
    # The symmetric difference contains the cases of only one group.
    unpaired_cases = first_runs.keys() ^ second_runs.keys()
    return GroupComparison(first, second, tuple(maps), ratio, len(unpaired_cases))


def _index_by_case(group: RunGroup) -> dict[tuple[object, ...], ReportedRun]:
    """Return the runs of a group with positive, finite distances, keyed by their cases."""
    return {run.case: run for run in group.runs if 0.0 < run.final_distance < np.inf}


def _estimate_ratio(runs: Sequence[ReportedRun], ratios: FloatArray) -> Interval:
    """Estimate the geometric mean of the ratios of runs on one map.

    Runs of different teams with the same start and seed are averaged first, because they are not independent.
    """
    effects: dict[tuple[str | None, int | None], list[float]] = {}
    for run, effect in zip(runs, np.log(ratios).tolist(), strict=True):
        effects.setdefault((run.start, run.seed), []).append(effect)
    means = [float(np.mean(values)) for values in effects.values()]
    return _exponentiate(estimate_mean(means))


def _estimate_ratio_over_maps(log_ratios: Sequence[float]) -> Interval:
    """Estimate the geometric mean of the ratios on several maps.

    With fewer than `MIN_BOOTSTRAP_MAPS` maps there is no interval: it would be misleadingly narrow if they
    happened to agree.
    """
    if len(log_ratios) < MIN_BOOTSTRAP_MAPS:
        return _exponentiate(Interval(float(np.mean(log_ratios)), float("nan"), float("nan")))
    return _exponentiate(bootstrap(log_ratios, "mean"))


def _exponentiate(effect: Interval) -> Interval:
    """Convert an interval of log ratios to an interval of ratios."""
    # A limit may be infinite.
    with np.errstate(over="ignore"):
        estimate, low, high = np.exp([effect.estimate, effect.low, effect.high]).tolist()
    return Interval(estimate, low, high)
