"""Runs grouped by controller and gains, compared pair by pair, and chosen to be shown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter, itemgetter
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import Array
from robocov.controllers.gains import Value, format_value
from robocov_app.figures.statistics import (
    MIN_BOOTSTRAP_MAPS,
    Interval,
    bootstrap,
    group_by,
    mean_with_t_interval,
)
from robocov_app.look.curve_styles import CurveStyle, choose_controller_styles, choose_curve_styles
from robocov_app.report.results import Entry, Gains, Result, Setting
from robocov_app.sweep.parameters import format_parameter

MOST_GROUPS = 8  # controllers with their gains up to which each is shown apart; of more, by controller
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
TUNED = " (tuned)"  # stands behind a controller's label where its gains were chosen on other runs than these
_DIRECT = 12  # letters that a gain and its value may take in a label
MOST_COMPARED = 4  # groups up to which each is compared with each; of more, each with the first
MOST_SAID = 6  # comparisons that the first words tell
NEGLIGIBLE = 0.001  # part by which a cost has to differ to be called better or worse
MOST_RUNS = 50  # runs of a result that a page shows as pictures

Verdict: TypeAlias = Literal["better", "worse", "undecided"]
Scales: TypeAlias = Mapping[Entry, float]  # what the costs of runs are divided by


@dataclass(frozen=True, eq=False)
class Group:
    """Runs of one controller that did not fail: with the same gains, or with all that were tried (None)."""

    label: str
    controller: str
    gains: Gains | None
    entries: tuple[Entry, ...]

    def at(self, setting: Setting) -> Group:
        return replace(self, entries=tuple(entry for entry in self.entries if entry.setting == setting))


def variants(result: Result) -> list[Group]:
    found = group_by(result.fine, lambda entry: (entry.controller, entry.gains))
    suffixes: dict[tuple[str, Gains], str] = {}
    for sets in group_by(found, itemgetter(0)).values():
        suffixes |= dict(zip(sets, _suffixes([gains for _, gains in sets]), strict=True))
    return [Group(f"{runs[0].label}{suffixes[key]}", *key, tuple(runs)) for key, runs in found.items()]


def labels(result: Result) -> dict[Entry, str]:
    return {entry: group.label for group in variants(result) for entry in group.entries}


def _suffixes(sets: Sequence[Gains]) -> list[str]:
    """Return what tells sets of gains of one controller apart: the one that differs, or A, ..., Z, A2, ..."""
    if len(sets) == 1:
        return [""]
    differing = [own for own in zip(*sets, strict=False) if len(set(own)) > 1]
    if len(differing) == 1 and len({name for name, _ in differing[0]}) == 1:
        named = [f" {name} {format_value(value, digits=4)}" for name, value in differing[0]]
        if len(set(named)) == len(sets) and max(map(len, named)) <= _DIRECT:
            return named
    turns = [divmod(number, len(LETTERS)) for number in range(len(sets))]
    return [f" {LETTERS[place]}{turn + 1 if turn else ''}" for turn, place in turns]


def styles(result: Result) -> dict[str, CurveStyle]:
    """Return the style of each label, the same in all drawings: that of its group or controller."""
    shown = shown_groups(result)
    there = {group.controller for group in shown}
    lost = dict.fromkeys(each.controller for each in result.entries if each.controller not in there)
    names = [*(group.controller for group in shown), *lost]
    own, apart = choose_controller_styles(names), choose_curve_styles(names)
    found = {entry.label + more: own[entry.controller] for entry in result.entries for more in ("", TUNED)}
    found |= {group.label: own[group.controller] for group in variants(result)}
    return found | {group.label: style for group, style in zip(shown, apart, strict=False)}


def by_controller(result: Result) -> list[Group]:
    groups = []
    for controller, entries in group_by(result.fine, lambda entry: entry.controller).items():
        gains = {entry.gains for entry in entries}
        one = gains.pop() if len(gains) == 1 else None
        groups.append(Group(entries[0].label, controller, one, tuple(entries)))
    return groups


def shown_groups(result: Result) -> list[Group]:
    apart = variants(result)
    return apart if len(apart) <= MOST_GROUPS else by_controller(result)


def settings(result: Result) -> list[Setting]:
    return list(dict.fromkeys(entry.setting for entry in result.fine))


def setting_label(result: Result, setting: Setting) -> str:
    """Return what tells a setting from the others of the result: at least its map."""
    name, robots, team = setting
    parts = [name]
    if len({size for _, size, _ in settings(result)}) > 1:
        parts.append(f"{robots} robots")
    parts += [f"{each.replace('_', ' ')} {format_parameter(each, value)}" for each, value in team]
    return ", ".join(parts)


def medians(result: Result, part_of: Callable[[Entry], object] = attrgetter("setting")) -> Scales:
    """Return for each run the median of the final mean distances of all runs in its part of a result, m."""
    found: dict[Entry, float] = {}
    for part in group_by((entry for entry in result.fine if np.isfinite(entry.final)), part_of).values():
        found |= dict.fromkeys(part, float(np.median([entry.final for entry in part])))
    return found


def relative(entries: Iterable[Entry], scales: Scales) -> Array:
    """Return scaled final mean distances, (m,); only the finite ones."""
    costs = np.array([scaled(entry, scales) for entry in entries])
    return np.asarray(costs[np.isfinite(costs)])


def scaled(entry: Entry, scales: Scales) -> float:
    """Return a final mean distance as a multiple of its scale; inf where that is not known."""
    scale = scales.get(entry, 0.0)
    return entry.final / scale if np.isfinite(entry.final) and scale > 0.0 else np.inf


def dependences(result: Result) -> dict[str, list[str]]:
    """Return the gains that take several values, by name, with the controllers that they vary in."""
    every = ((name, entry.controller, value) for entry in result.fine for name, value in entry.gains)
    levels = group_by(every, itemgetter(0, 1)).items()
    varying = group_by((key for key, values in levels if len(set(values)) > 1), itemgetter(0))
    return {name: [controller for _, controller in keys] for name, keys in varying.items()}


def gain_text(gains: Sequence[tuple[str, Value]], units: Mapping[str, str]) -> str:
    """Return gains as a line of text: "k_rep 0.3 N m³, attraction_limit none"."""
    known = [(name, value, "" if value is None else units.get(name, "")) for name, value in gains]
    return ", ".join(f"{name} {format_value(value)} {unit}".rstrip() for name, value, unit in known)


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
    """Two groups, their ratio over maps (of one map: over seeds), and how many cases are of one `alone`."""

    first: Group
    second: Group
    maps: tuple[MapPairs, ...]
    ratio: Interval
    alone: int

    @property
    def label(self) -> str:
        return f"{self.first.label} / {self.second.label}"

    @property
    def pairs(self) -> int:
        return sum(len(each.a) for each in self.maps)

    def tally(self) -> str:
        counts, total = Counter(each.verdict for each in self.maps), len(self.maps)
        if len(counts) == 1:
            where = {1: "the map", 2: "both maps"}.get(total, f"all {total} maps")
            return f"{self.maps[0].verdict} on {where}"
        words = [f"{name} on {counts[name]}" for name in ("better", "worse", "undecided") if counts[name]]
        return ", ".join([f"{words[0]} of {total} maps", *words[1:]])

    def headline(self) -> str:
        names = f"{self.first.label} against {self.second.label}"
        ratio, total = self.ratio, len(self.maps)
        if total > 1:
            # an interval over a few maps would be narrow where those maps happen to agree
            few = f"{ratio.estimate:.3f} over {total} maps only"
            text = few if total < MIN_BOOTSTRAP_MAPS else f"{ratio_text(ratio)} over {total} maps"
            return f"{names}: {self.tally()}; ratio {text}."
        if self.pairs == 1:
            return f"{names}: ratio {ratio_text(ratio)} in the only pair."
        return f"{names}: {self.maps[0].verdict}, ratio {ratio_text(ratio)} over {self.pairs} pairs."


def ratio_text(ratio: Interval) -> str:
    known = f" ({ratio.low:.3f} to {ratio.high:.3f})" if np.isfinite(ratio.low) else ""
    return f"{ratio.estimate:.3f}{known}"


def comparisons(groups: Sequence[Group]) -> list[Comparison]:
    """Return how groups compare on the same cases: each with each, or many with the first."""
    firsts = groups if len(groups) <= MOST_COMPARED else groups[:1]
    found = (compared(one, other) for k, one in enumerate(firsts) for other in groups[k + 1 :])
    return [each for each in found if each is not None]


def compared(first: Group, second: Group) -> Comparison | None:
    both = first.entries, second.entries
    a, b = ({entry.case: entry for entry in own if 0.0 < entry.final < np.inf} for own in both)
    cases = group_by((entry for case, entry in a.items() if case in b), lambda entry: entry.map)
    if not cases:
        return None
    maps = []
    for name, entries in cases.items():
        left = np.array([entry.final for entry in entries])
        right = np.array([b[entry.case].final for entry in entries])
        # runs of other teams from the same start and seed are no further evidence
        effects = zip(entries, np.log(left / right).tolist(), strict=True)
        seeds = group_by(effects, lambda pair: (pair[0].start, pair[0].seed)).values()
        effect = mean_with_t_interval([float(np.mean([each for _, each in pairs])) for pairs in seeds])
        maps.append(MapPairs(name, left, right, _exp(effect)))
    ratio = maps[0].ratio
    if len(maps) > 1:
        ratio = _exp(bootstrap([float(np.log(each.ratio.estimate)) for each in maps], "mean"))
    return Comparison(first, second, tuple(maps), ratio, len(a.keys() ^ b.keys()))


def compared_groups(result: Result) -> tuple[list[Group], str]:
    """Return the groups that are compared, variants of one controller or tuned controllers; and how."""
    apart = variants(result)
    by = group_by(apart, lambda group: group.controller)
    if len(by) < 2 or len(by) == len(apart):
        every = "Every set of gains is compared by itself; none was chosen."
        return apart, every if len(by) < len(apart) else ""
    several_maps = len({entry.map for entry in result.fine}) > 1

    def part_of(entry: Entry) -> object:
        return entry.map if several_maps else (entry.start, entry.seed)

    parts = list(dict.fromkeys(part_of(entry) for entry in result.fine))
    if len(parts) < 2:
        words = "There is one case only, too few to choose gains fairly: the first of each take part."
        return [groups[0] for groups in by.values()], words
    scales, groups, chosen_gains = medians(result), [], []
    tried: dict[object, list[Entry]] = group_by(result.entries, lambda entry: (entry.controller, entry.gains))
    for controller, own in by.items():
        if len(own) == 1:
            groups += own
            continue
        entries, choices = [], []
        for part in parts:
            outside = [
                [scaled(each, scales) for each in tried[controller, group.gains] if part_of(each) != part]
                for group in own
            ]
            standing = [(np.median(values), np.mean(values)) if values else (np.inf,) for values in outside]
            best = own[min(range(len(own)), key=standing.__getitem__)]
            entries += [entry for entry in best.entries if part_of(entry) == part]
            choices.append(best.label)
        groups.append(Group(own[0].entries[0].label + TUNED, controller, None, tuple(entries)))
        counts = Counter(choices).most_common(3)
        chosen_gains.append(", ".join(f"{name} in {count} of {len(parts)}" for name, count in counts))
    part, other = ("map", "on the other maps") if several_maps else ("start and seed", "from the others")
    return groups, (
        f"Tuned: of a controller with several sets of gains, those for a {part} are those with the lowest "
        f"median {other}, so that no run is compared on which its gains were chosen; a failed run counts as "
        f"the worst. Chosen: {'; '.join(chosen_gains)}."
    )


def _exp(effect: Interval) -> Interval:
    with np.errstate(over="ignore"):
        return Interval(*np.exp([effect.estimate, effect.low, effect.high]).tolist())


class Choice(NamedTuple):
    """Runs to be shown, in the result's order; how they were chosen; which stand side by side at first."""

    entries: tuple[Entry, ...]
    words: str
    panes: tuple[int, ...]


def chosen(result: Result, most: int = MOST_RUNS, panes: int = 4) -> Choice:
    """Return at most `most` runs to be shown: all, the telling ones of each map, or those of all maps."""
    entries, words = result.fine, "All runs."
    if len(entries) > most:
        what = (
            "the best and the worst run of each controller by its final mean distance, and the case (start "
            "and seed) that is nearest to the middle for all of them, with the gains that each is compared "
            "with"
        )
        every = f"{len(entries)} runs"
        found: set[Entry] = set()
        for own in group_by(entries, lambda entry: entry.map).values():
            found |= _telling(result, own)
        words = f"on each map {what}."
        if len(found) > most:
            found = _telling(result, entries)
            words = f"over all maps {what}; distances are divided by the median of the same map and team."
        entries = tuple(entry for entry in entries if not found or entry in found)[:most]
        words = f"{len(entries)} of {every}: {words}"
        if not found:
            words = f"The first {most} of {every}: none has a final cost."
    # of as many controllers as there are, from the same starts if possible
    middle = _middle_case(_best_variants(result, entries, panes), medians(result)) or entries[:1]
    return Choice(entries, words, tuple(entries.index(entry) for entry in middle[:panes]))


def _telling(result: Result, entries: Sequence[Entry]) -> set[Entry]:
    scales = medians(result)
    known = (entry for entry in entries if np.isfinite(scaled(entry, scales)))
    found = set(_middle_case(_best_variants(result, entries), scales))
    for own in group_by(known, lambda entry: entry.controller).values():
        costs = [scaled(entry, scales) for entry in own]
        found |= {own[int(np.argmin(costs))], own[int(np.argmax(costs))]}
    return found


def _best_variants(result: Result, entries: Iterable[Entry], few: int = 0) -> list[Group]:
    """Return of each controller the runs with the gains it is compared with, or all variants of few."""
    among, groups = set(entries), variants(result)
    if len(groups) > few:
        groups, _ = compared_groups(result)
    return [replace(group, entries=tuple(e for e in group.entries if e in among)) for group in groups]


def _middle_case(groups: Sequence[Group], scales: Scales) -> tuple[Entry, ...]:
    """Return the runs of the case whose ranks are nearest to the middle, of those that most groups have."""
    ranked: list[tuple[float, Entry]] = []  # distance from the middle of its group
    for group in groups:
        known = [entry for entry in group.entries if np.isfinite(scaled(entry, scales))]
        order = sorted(known, key=lambda entry: scaled(entry, scales))
        ranked += [(abs(k - (len(order) - 1) / 2) / len(order), entry) for k, entry in enumerate(order)]
    cases = group_by(ranked, lambda pair: pair[1].case).values()
    nearest = min(cases, key=lambda case: (-len(case), sum(rank for rank, _ in case)), default=[])
    return tuple(entry for _, entry in nearest)
