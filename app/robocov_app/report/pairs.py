"""Controllers compared pair by pair: runs on the same map, with the same team, start and seed.

The effect on one map is the mean of log(J_first / J_second) over its seeds, with Student's t interval. Over
maps it is the mean of the maps' effects, each map counting the same, with a bootstrap that draws whole maps.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import Array
from robocov.errors import counted
from robocov_app.figures.statistics import Interval, bootstrap, mean_with_t_interval
from robocov_app.report.groups import TUNED, Group, medians, variants

if TYPE_CHECKING:
    from robocov_app.report.gathering import Entry, Result

Verdict: TypeAlias = Literal["better", "worse", "undecided"]

MOST_COMPARED = 4
"""Groups up to which each is compared with each; of more, each with the first."""

MOST_SAID = 6
"""Comparisons that the first words tell."""

FEW_MAPS = 5
"""A bootstrap over fewer maps has too few different samples for a 95 % interval (126 of five)."""

NEGLIGIBLE = 0.001
"""Part by which a cost has to differ to be called better or worse."""


class MapPairs(NamedTuple):
    """The pairs of one map: (m,) m at the end, and the geometric mean of their ratios over seeds."""

    name: str
    a: Array
    b: Array
    ratio: Interval

    @property
    def verdict(self) -> Verdict:
        """Whether the first is better, by an interval that excludes no difference."""
        if self.ratio.high < 1.0 - NEGLIGIBLE:
            return "better"
        return "worse" if self.ratio.low > 1.0 + NEGLIGIBLE else "undecided"


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two groups on the maps that both were run on, and their ratio over maps (of one map over its seeds).

    `alone` counts cases that only one of them has a result of.
    """

    first: Group
    second: Group
    maps: tuple[MapPairs, ...]
    ratio: Interval
    alone: int

    @property
    def label(self) -> str:
        """Name of the ratio: first / second."""
        return f"{self.first.label} / {self.second.label}"

    @property
    def pairs(self) -> int:
        """Number of pairs, on all maps."""
        return sum(len(each.a) for each in self.maps)

    def tally(self) -> str:
        """Return on how many maps the first is better, worse, or neither, in words."""
        counts = Counter(each.verdict for each in self.maps)
        total = len(self.maps)
        if len(counts) == 1:
            return f"{self.maps[0].verdict} on " + (
                {1: "the map", 2: "both maps"}.get(total, f"all {total} maps")
            )
        words: list[str] = []
        for verdict in ("better", "worse", "undecided"):
            if counts[verdict]:
                words.append(f"{verdict} on {counts[verdict]}" + ("" if words else f" of {total} maps"))
        return ", ".join(words)

    def headline(self) -> str:
        """Return what came of it in a sentence that does not hide where maps disagree."""
        names = f"{self.first.label} against {self.second.label}"
        ratio, total = self.ratio, len(self.maps)
        if total > 1:
            # an interval over a few maps would be narrow where those maps happen to agree
            few = total < FEW_MAPS
            told = (
                f"{ratio.estimate:.3f} over {total} maps only"
                if few
                else f"{ratio_text(ratio)} over {total} maps"
            )
            return f"{names}: {self.tally()}; ratio {told}."
        if self.pairs == 1:
            return f"{names}: ratio {ratio_text(ratio)} in the only pair."
        return f"{names}: {self.maps[0].verdict}, ratio {ratio_text(ratio)} over {self.pairs} pairs."


class Contenders(NamedTuple):
    """The groups that are compared, and how their gains were chosen, in words."""

    groups: list[Group]
    words: str


def ratio_text(ratio: Interval) -> str:
    """Return a ratio with its interval, if it has one."""
    known = f" ({ratio.low:.3f} to {ratio.high:.3f})" if np.isfinite(ratio.low) else ""
    return f"{ratio.estimate:.3f}{known}"


def comparisons(groups: Sequence[Group]) -> list[Comparison]:
    """Return how groups compare on the same cases: each with each, or many with the first."""
    firsts = groups if len(groups) <= MOST_COMPARED else groups[:1]
    found = (compared(one, other) for k, one in enumerate(firsts) for other in groups[k + 1 :])
    return [each for each in found if each is not None]


def compared(first: Group, second: Group) -> Comparison | None:
    """Return how two groups compare on the cases that both have, None where they have none."""
    a, b = _by_case(first), _by_case(second)
    cases: dict[str, list[Entry]] = {}
    for case in a:
        if case in b:
            cases.setdefault(a[case].map, []).append(a[case])
    if not cases:
        return None
    maps = []
    for name, entries in cases.items():
        left = np.array([entry.final for entry in entries])
        right = np.array([b[entry.case].final for entry in entries])
        # runs of other teams from the same start and seed are no further evidence
        seeds: dict[object, list[float]] = {}
        for entry, effect in zip(entries, np.log(left / right).tolist(), strict=True):
            seeds.setdefault((entry.start, entry.seed), []).append(effect)
        effect = mean_with_t_interval([float(np.mean(each)) for each in seeds.values()])
        maps.append(MapPairs(name, left, right, _exp(effect)))
    ratio = maps[0].ratio
    if len(maps) > 1:
        ratio = _exp(bootstrap([float(np.log(each.ratio.estimate)) for each in maps], "mean"))
    return Comparison(first, second, tuple(maps), ratio, len(a.keys() ^ b.keys()))


def contenders(result: Result) -> Contenders:
    """Return the groups that are compared: variants of one controller, or controllers with fair gains.

    Where controllers have several sets of gains, those for a map are chosen on the other maps (on one map,
    those for a start and seed on the others): no run is compared that its own gains were chosen on.
    """
    apart = variants(result)
    by: dict[str, list[Group]] = {}
    for group in apart:
        by.setdefault(group.controller, []).append(group)
    if len(by) < 2 or len(by) == len(apart):
        words = "Every set of gains is compared by itself; none was chosen. " if len(by) < len(apart) else ""
        return Contenders(apart, words)
    several_maps = len({entry.map for entry in result.fine}) > 1

    def part_of(entry: Entry) -> object:
        return entry.map if several_maps else (entry.start, entry.seed)

    parts = list(dict.fromkeys(part_of(entry) for entry in result.fine))
    if len(parts) < 2:
        words = "There is one case only, too few to choose gains fairly: the first of each take part. "
        return Contenders([groups[0] for groups in by.values()], words)
    scales, groups, told = medians(result), [], []
    costs: dict[object, list[tuple[object, float]]] = {}
    for entry in result.entries:
        scale = scales.get(entry.setting, 0.0)
        cost = entry.final / scale if np.isfinite(entry.final) and scale > 0.0 else np.inf
        costs.setdefault((entry.controller, entry.gains), []).append((part_of(entry), cost))
    for controller, own in by.items():
        if len(own) == 1:
            groups += own
            continue
        entries, choices = [], []
        for part in parts:
            outside = [[c for at, c in costs[controller, group.gains] if at != part] for group in own]
            standing = [(np.median(values), np.mean(values)) if values else (np.inf,) for values in outside]
            best = own[min(range(len(own)), key=standing.__getitem__)]
            entries += [entry for entry in best.entries if part_of(entry) == part]
            choices.append(best.label)
        label = own[0].entries[0].label + TUNED
        groups.append(Group(label, controller, None, tuple(entries)))
        counts = Counter(choices).most_common(3)
        told.append(", ".join(f"{name} in {count} of {len(parts)}" for name, count in counts))
    where = "map are those with the lowest median on the other maps"
    if not several_maps:
        where = "start and seed are those with the lowest median from the others"
    return Contenders(
        groups,
        f"Tuned: of a controller with several sets of gains, those for a {where}, so that no run is compared "
        f"on which its gains were chosen; a failed run counts as the worst. Chosen: {'; '.join(told)}. ",
    )


def pairs_words(found: Sequence[Comparison], chosen: str) -> str:
    """Return how the pairs were made, how gains were chosen, and what the intervals mean."""
    words = f"A pair is two runs on the same map, with the same team, start and seed. {chosen}"
    if not found or max(each.pairs for each in found) < 2:
        return words + "There is one pair only: nothing can be said of others."
    words += (
        "Ratios of final mean distances below 1 are in favour of the first. Those of a map are geometric "
        "means with 95 % intervals over its seeds (Student's t of the logarithms), and hold for this map; "
        f"better and worse are told where all of the interval is beyond {100 * NEGLIGIBLE:g} % from 1. "
    )
    most = max(len(each.maps) for each in found)
    if most > 1:
        words += (
            "Over maps each map counts the same, and the 95 % interval is a bootstrap that draws whole maps: "
            "it speaks of maps like these"
        )
        few = f", of which {counted(most, 'map')} are too few to say much" if most < FEW_MAPS else ""
        words += f"{few}. "
    if len(found) > 1:
        words += "No interval is corrected for how many comparisons there are. "
    alone = max(each.alone for each in found)
    if alone:
        words += f"Left out of a comparison, at most: {counted(alone, 'run')} without a counterpart. "
    return words.strip()


def _by_case(group: Group) -> dict[tuple[object, ...], Entry]:
    return {entry.case: entry for entry in group.entries if np.isfinite(entry.final) and entry.final > 0.0}


def _exp(effect: Interval) -> Interval:
    """Return ratios for their logarithms."""
    with np.errstate(over="ignore"):
        low, high = np.exp([effect.low, effect.high]).tolist()
    return Interval(float(np.exp(effect.estimate)), low, high)
