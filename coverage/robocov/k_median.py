"""The k-median problem on a table of distances: choose k sources so that each target is close to one.

A table is an array of shape (m, c), C-contiguous and finite: distances, weighted or not, from m targets to c
possible sources. *Sources* are columns of the table, and their *cost* is the sum over the targets of the
distance to the nearest one.

The swaps are those of Teitz and Bart, with the bookkeeping of Whitaker (1983) and of Schubert and
Rousseeuw's FastPAM (2019): one pass over the table computes the cost after every possible swap.
"""

from collections.abc import Callable
from itertools import combinations
from typing import NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel

Heartbeat: TypeAlias = Callable[[], None]
"""Called once per iteration. It may raise, to cancel the computation."""

_MIN_SAVING = 1e-9
"""Fraction of the cost that an iteration must save: far more than rounding, so that iterations end."""
_MAX_ROUNDS = 60
"""Maximum number of rounds of `improve_sources`; usually a few are enough."""
_MIN_SAVING_OF_ROUND = 1e-4
"""Fraction of the cost that a round of `improve_sources` must save."""
_REMOVAL_SIZES = (2, 3)
"""Numbers of sources that `rebuild_sources` removes at once."""
_MAX_REBUILT = 4
"""Number of the most promising removals that `rebuild_sources` completes with Lloyd's iteration."""


class _NearestSources(NamedTuple):
    """The sources nearest to each target, (m,) each.

    `owner` is the index of the nearest source among the sources, not its column.
    """

    owner: IntArray
    distance: Array
    second_distance: Array


class _Swap(NamedTuple):
    """The best replacement of one source."""

    cost: float
    """Cost before the swap."""
    swapped_cost: float
    """Cost after the swap; infinite if no swap is possible."""
    sources: IntArray
    """(k,) The sources after the swap."""


def seed_sources(table: Array, count: int, rng: np.random.Generator) -> IntArray:
    """Choose random sources that are far from each other.

    Parameters
    ----------
    table : (m, c) array
    count : int
        Number of sources k, at most c.
    rng : numpy.random.Generator

    Returns
    -------
    (k,) int array

    Notes
    -----
    This is k-means++ (Arthur and Vassilvitskii 2007), with distances in place of squared distances.
    """
    sources: list[int] = []
    distance = np.ones(len(table))
    is_chosen = np.zeros(table.shape[1], dtype=bool)
    for _ in range(count):
        # Draw a target with a probability proportional to its distance from the sources so far; the nearest
        # column becomes a source. If all distances are zero, the last target is as good as any other.
        cumulative = np.cumsum(distance)
        target = int(np.searchsorted(cumulative, rng.random() * cumulative[-1], side="right"))
        target = min(target, len(distance) - 1)
        source = int(np.where(is_chosen, np.inf, table[target]).argmin())
        distance = np.minimum(distance, table[:, source]) if sources else table[:, source].copy()
        is_chosen[source] = True
        sources.append(source)
    return np.array(sources, dtype=np.intp)


def choose_greedily(table: Array, count: int) -> IntArray:
    """Choose sources one after another, each so that the cost becomes as low as possible.

    Parameters
    ----------
    table : (m, c) array
    count : int
        Number of sources k, at most c.

    Returns
    -------
    (k,) int array

    Notes
    -----
    Compared with a single source far from everything, these sources save at least 1 - 1/e of what the best k
    sources save (Nemhauser, Wolsey and Fisher 1978).
    """
    # All sources are replaced, so that their initial values do not matter.
    sources = np.zeros(count, dtype=np.intp)
    _, chosen = _replace_sources(table, sources, np.arange(count), unchanged_count=0)
    return chosen


def run_lloyd(
    table: Array, sources: IntArray, fixed: BoolArray | None = None, heartbeat: Heartbeat = lambda: None
) -> IntArray:
    """Improve sources by Lloyd's iteration: each moves to the best source for the targets nearest to it.

    Parameters
    ----------
    table : (m, c) array
    sources : (k,) int array
    fixed : (k,) bool array or None
        Sources that do not change. By default all may change.
    heartbeat : callable
        See `Heartbeat`.

    Returns
    -------
    (k,) int array
    """
    if fixed is None:
        fixed = np.zeros(len(sources), dtype=bool)
    best = sources
    best_cost = np.inf
    while True:
        heartbeat()
        cost, next_sources = _apply_lloyd_step(table, sources, fixed)
        if not cost < best_cost * (1.0 - _MIN_SAVING):
            return best
        best = sources
        best_cost = cost
        sources = next_sources


def apply_best_swap(table: Array, sources: IntArray, fixed: BoolArray, threshold: float) -> IntArray:
    """Replace one source by another column, so that the cost becomes as low as possible.

    Parameters
    ----------
    table : (m, c) array
    sources : (k,) int array
    fixed : (k,) bool array
        Sources that do not change.
    threshold : float
        Fraction of the cost that the swap must save.

    Returns
    -------
    (k,) int array
        The same array, if no swap saves enough.
    """
    swap = _find_best_swap(table, sources, fixed)
    return swap.sources if swap.swapped_cost < swap.cost * (1.0 - threshold) else sources


def apply_best_swaps(table: Array, sources: IntArray, heartbeat: Heartbeat = lambda: None) -> IntArray:
    """Apply best swaps as long as they lower the cost.

    Parameters
    ----------
    table : (m, c) array
    sources : (k,) int array
    heartbeat : callable
        See `Heartbeat`.

    Returns
    -------
    (k,) int array
    """
    fixed = np.zeros(len(sources), dtype=bool)
    while True:
        heartbeat()
        swapped = apply_best_swap(table, sources, fixed, _MIN_SAVING)
        if swapped is sources:
            return sources
        sources = swapped


def improve_sources(
    table: Array, sources: IntArray, fixed: BoolArray, threshold: float, *, removals: bool = True
) -> IntArray:
    """Improve sources by swaps, or removals where no swap helps, alternating with Lloyd's iteration.

    Parameters
    ----------
    table : (m, c) array
    sources : (k,) int array
    fixed : (k,) bool array
        Sources that do not change.
    threshold : float
        Fraction of the cost after Lloyd's iteration alone that everything else must save together.
    removals : bool
        Whether `rebuild_sources` is used.

    Returns
    -------
    (k,) int array
        The sources after Lloyd's iteration alone, if the rest does not save enough.
    """
    after_lloyd = run_lloyd(table, sources, fixed)
    if not threshold < 1.0:
        # Nothing can save the whole cost.
        return after_lloyd
    best = after_lloyd
    for _ in range(_MAX_ROUNDS):
        changed = apply_best_swap(table, best, fixed, _MIN_SAVING_OF_ROUND)
        if changed is best and removals:
            changed = rebuild_sources(table, best, fixed, _MIN_SAVING_OF_ROUND)
        if changed is best:
            break
        best = run_lloyd(table, changed, fixed)
    max_cost = (1.0 - threshold) * _compute_cost(table, after_lloyd)
    return best if _compute_cost(table, best) < max_cost else after_lloyd


def move_first_source(table: Array, sources: IntArray, is_allowed: BoolArray, threshold: float) -> IntArray:
    """Replace the first source by the best allowed column; the others do not change.

    Unlike Lloyd's iteration, this takes into account that targets change their nearest source.

    Parameters
    ----------
    table : (m, c) array
    sources : (k,) int array
    is_allowed : (c,) bool array
    threshold : float
        Fraction of the cost that the move must save.

    Returns
    -------
    (k,) int array
        The same array, if no column saves enough.
    """
    other_distance = table[:, sources[1:]].min(axis=1, initial=np.inf)
    costs = np.minimum(table, other_distance[:, None]).sum(axis=0)
    best = int(np.where(is_allowed, costs, np.inf).argmin())
    if not (is_allowed[best] and costs[best] < costs[sources[0]] * (1.0 - threshold)):
        return sources
    return np.concatenate([[best], sources[1:]])


def rebuild_sources(table: Array, sources: IntArray, fixed: BoolArray, threshold: float) -> IntArray:
    """Remove two or three sources at once, and replace them one by one where each helps most.

    All pairs and triples are tried; the most promising few are completed with Lloyd's iteration.

    Parameters
    ----------
    table : (m, c) array
    sources : (k,) int array
    fixed : (k,) bool array
        Sources that do not change.
    threshold : float
        Fraction of the cost that the change must save.

    Returns
    -------
    (k,) int array
        The same array, if nothing saves enough.
    """
    free = np.flatnonzero(~fixed).tolist()
    candidates = []
    for size in _REMOVAL_SIZES:
        for removed in combinations(free, size):
            # The removed sources come last, and are replaced.
            order = np.append(np.delete(np.arange(len(sources)), removed), removed)
            cost, rebuilt = _replace_sources(table, sources, order, unchanged_count=len(sources) - size)
            candidates.append((cost, rebuilt))
    candidates.sort(key=lambda candidate: candidate[0])
    best = sources
    best_cost = _compute_cost(table, sources) * (1.0 - threshold)
    for _, candidate in candidates[:_MAX_REBUILT]:
        improved = run_lloyd(table, candidate, fixed)
        cost = _compute_cost(table, improved)
        if cost < best_cost:
            best = improved
            best_cost = cost
    return best


def _compute_cost(table: Array, sources: IntArray) -> float:
    """Return the cost of sources."""
    return float(table[:, sources].min(axis=1).sum())


@kernel
def _find_nearest_sources(table: Array, sources: IntArray) -> _NearestSources:
    """Return the nearest source of each target, and the distances of the nearest two."""
    target_count = len(table)
    owner = np.zeros(target_count, dtype=np.intp)
    nearest_distance = np.full(target_count, np.inf)
    second_distance = np.full(target_count, np.inf)
    for t in range(target_count):
        for k in range(len(sources)):
            distance = table[t, sources[k]]
            if distance < nearest_distance[t]:
                second_distance[t] = nearest_distance[t]
                nearest_distance[t] = distance
                owner[t] = k
            elif distance < second_distance[t]:
                second_distance[t] = distance
    return _NearestSources(owner, nearest_distance, second_distance)


@kernel
def _apply_lloyd_step(table: Array, sources: IntArray, fixed: BoolArray) -> tuple[float, IntArray]:
    """Return the cost of the sources and, for each of them, the best column for its targets.

    Targets are rows of the table, sources are columns. Each target belongs to its nearest source.
    """
    nearest = _find_nearest_sources(table, sources)
    cost = 0.0
    has_targets = np.zeros(len(sources), dtype=np.bool_)
    sums = np.zeros((len(sources), table.shape[1]))
    for t in range(len(table)):
        k = nearest.owner[t]
        cost += nearest.distance[t]
        has_targets[k] = True
        for column in range(table.shape[1]):
            sums[k, column] += table[t, column]
    # Sources that are fixed or have no targets keep their columns. No two sources may get the same column.
    is_taken = np.zeros(table.shape[1], dtype=np.bool_)
    for k in range(len(sources)):
        is_taken[sources[k]] |= fixed[k] or not has_targets[k]
    next_sources = sources.copy()
    for k in range(len(sources)):
        if has_targets[k] and not fixed[k]:
            next_sources[k] = _find_smallest(sums[k], is_taken)
            is_taken[next_sources[k]] = True
    return cost, next_sources


@kernel
def _find_smallest(sums: Array, is_taken: BoolArray) -> int:
    """Return the index of the smallest sum that is not taken."""
    best = -1
    smallest = np.inf
    for column in range(len(sums)):
        if not is_taken[column] and (best < 0 or sums[column] < smallest):
            best = column
            smallest = sums[column]
    return best


@kernel
def _find_best_swap(table: Array, sources: IntArray, fixed: BoolArray) -> _Swap:
    """Return the replacement of one source by another column that leads to the lowest cost.

    The cost after a swap is the cost with the new column added to all sources, plus the increase for the
    targets of the removed source: they go to the new column or to their second nearest source. One pass over
    the table computes both for all swaps.
    """
    nearest = _find_nearest_sources(table, sources)
    cost_with_column = np.zeros(table.shape[1])
    increase = np.zeros((len(sources), table.shape[1]))
    cost = 0.0
    for t in range(len(table)):
        k = nearest.owner[t]
        own_distance = nearest.distance[t]
        second_distance = nearest.second_distance[t]
        cost += own_distance
        for column in range(table.shape[1]):
            distance = table[t, column]
            distance_with_column = min(distance, own_distance)
            cost_with_column[column] += distance_with_column
            increase[k, column] += min(distance, second_distance) - distance_with_column
    is_source = np.zeros(table.shape[1], dtype=np.bool_)
    for k in range(len(sources)):
        is_source[sources[k]] = True
    best_cost = np.inf
    best_k = -1
    best_column = -1
    for column in range(table.shape[1]):
        for k in range(len(sources)):
            swapped_cost = cost_with_column[column] + increase[k, column]
            if swapped_cost < best_cost and not is_source[column] and not fixed[k]:
                best_cost = swapped_cost
                best_k = k
                best_column = column
    swapped_sources = sources.copy()
    if best_k >= 0:
        swapped_sources[best_k] = best_column
    return _Swap(cost=cost, swapped_cost=best_cost, sources=swapped_sources)


@kernel
def _replace_sources(
    table: Array, sources: IntArray, order: IntArray, unchanged_count: int
) -> tuple[float, IntArray]:
    """Replace all but the first sources of an order greedily, one after another.

    `order` lists the indices of all sources; the first `unchanged_count` of them keep their columns. Return
    the cost and the sources.
    """
    replaced = sources.copy()
    distance = np.full(len(table), np.inf)
    is_taken = np.zeros(table.shape[1], dtype=np.bool_)
    for position in range(len(order)):
        k = order[position]
        if position >= unchanged_count:
            sums = np.zeros(table.shape[1])
            for t in range(len(table)):
                for column in range(table.shape[1]):
                    sums[column] += min(table[t, column], distance[t])
            replaced[k] = _find_smallest(sums, is_taken)
        is_taken[replaced[k]] = True
        for t in range(len(table)):
            distance[t] = min(distance[t], table[t, replaced[k]])
    return distance.sum(), replaced
