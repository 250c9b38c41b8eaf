"""The k-median problem on a table of distances: choose k sources so that each target is close to one of them.

A table is an array of shape (m, c), C-contiguous and finite. It contains the distances, weighted or not, from
m targets to c possible sources. *Sources* are k columns of the table, and their *cost* is the sum, over all
targets, of the distance to the nearest source.

The swaps are those of Teitz and Bart. As in the methods of Whitaker (1983) and of Schubert and Rousseeuw
(FastPAM, 2019), one pass over the table computes the cost after every possible swap.
"""

from collections.abc import Callable
from itertools import combinations
from typing import NamedTuple, TypeAlias

import numpy as np

from robocov.compiled import kernel
from robocov.typing import BoolArray, FloatArray, IntArray

Heartbeat: TypeAlias = Callable[[], None]
"""Function without parameters that is called once per iteration. It may raise an exception to stop."""

_MIN_SAVING = 1e-9
"""Fraction of the cost that an iteration must save. It is far larger than rounding errors, so that every
search ends."""
_MAX_ROUNDS = 60
"""Maximum number of rounds of `improve_sources`; usually a few are enough."""
_MIN_ROUND_SAVING = 1e-4
"""Fraction of the cost that a round of `improve_sources` must save."""
_REMOVAL_SIZES = (2, 3)
"""Numbers of sources that `rebuild_sources` removes at the same time."""
_MAX_IMPROVED_CANDIDATES = 4
"""Number of sets of sources, those of the lowest costs, to which `rebuild_sources` applies Lloyd's
iteration."""


class _NearestSources(NamedTuple):
    """The nearest source of each of m targets."""

    owners: IntArray
    """(m,) Index of the nearest source among the sources, from 0 to k - 1; it is not a column of the
    table."""
    distances: FloatArray
    """(m,) Distance to the nearest source."""
    second_distances: FloatArray
    """(m,) Distance to the second-nearest source; inf if there is only one source."""


class _Swap(NamedTuple):
    """The best replacement of one source by another column."""

    cost: float
    """Cost before the swap."""
    swapped_cost: float
    """Cost after the swap; infinite if no swap is possible."""
    sources: IntArray
    """(k,) The sources after the swap."""


def seed_sources(table: FloatArray, source_count: int, rng: np.random.Generator) -> IntArray:
    """Choose sources at random, so that they tend to be far apart.

    Parameters
    ----------
    table : (m, c) array
        Distances from targets to possible sources.
    source_count : int
        Number of sources k, at most c.
    rng : numpy.random.Generator
        Random number generator.

    Returns
    -------
    (k,) int array
        The sources.

    Notes
    -----
    This is the seeding of k-means++ (Arthur and Vassilvitskii 2007) for the k-median problem: with distances
    in place of squared distances.
    """
    sources: list[int] = []
    distances = np.ones(len(table))
    is_chosen = np.zeros(table.shape[1], dtype=bool)
    for _ in range(source_count):
        # Draw a target with a probability proportional to its distance from the sources so far. The first
        # target is drawn uniformly, because `distances` is 1 everywhere. The nearest column becomes a source.
        # If all distances are zero, the last target is as good as any other.
        cumulative = np.cumsum(distances)
        target = int(np.searchsorted(cumulative, rng.random() * cumulative[-1], side="right"))
        target = min(target, len(distances) - 1)
        source = int(np.where(is_chosen, np.inf, table[target]).argmin())
        distances = np.minimum(distances, table[:, source]) if sources else table[:, source].copy()
        is_chosen[source] = True
        sources.append(source)
    return np.array(sources, dtype=np.intp)


def choose_greedily(table: FloatArray, source_count: int) -> IntArray:
    """Choose sources one after another, each so that the cost becomes as low as possible.

    Parameters
    ----------
    table : (m, c) array
        Distances from targets to possible sources.
    source_count : int
        Number of sources k, at most c.

    Returns
    -------
    (k,) int array
        The sources, in the order in which they were chosen.

    Notes
    -----
    Let the saving of sources be the difference between their cost and that of a single source far away from
    all targets. The saving of these sources is at least 1 - 1/e of that of the best k sources (Nemhauser,
    Wolsey and Fisher 1978).
    """
    # All sources are replaced, so that their initial values do not matter.
    sources = np.zeros(source_count, dtype=np.intp)
    _, chosen = _replace_sources(table, sources, np.arange(source_count), unchanged_count=0)
    return chosen


def run_lloyd(
    table: FloatArray,
    sources: IntArray,
    is_fixed: BoolArray | None = None,
    heartbeat: Heartbeat = lambda: None,
) -> IntArray:
    """Improve sources by Lloyd's iteration.

    In each step, every source is replaced by the column that is best for the targets nearest to the source.

    Parameters
    ----------
    table : (m, c) array
        Distances from targets to possible sources.
    sources : (k,) int array
        The sources to start with.
    is_fixed : (k,) bool array or None
        Whether each source must not change. By default all may change.
    heartbeat : callable
        Called before each step; see `Heartbeat`.

    Returns
    -------
    (k,) int array
        The sources after the last step that saves at least a small fraction of the cost.
    """
    if is_fixed is None:
        is_fixed = np.zeros(len(sources), dtype=bool)
    best = sources
    best_cost = np.inf
    while True:
        heartbeat()
        cost, next_sources = _apply_lloyd_step(table, sources, is_fixed)
        if not cost < best_cost * (1.0 - _MIN_SAVING):
            return best
        best = sources
        best_cost = cost
        sources = next_sources


def apply_best_swap(table: FloatArray, sources: IntArray, is_fixed: BoolArray, threshold: float) -> IntArray:
    """Replace one source by another column, so that the cost becomes as low as possible.

    Parameters
    ----------
    table : (m, c) array
        Distances from targets to possible sources.
    sources : (k,) int array
        The sources before the swap.
    is_fixed : (k,) bool array
        Whether each source must not change.
    threshold : float
        Fraction of the cost that the swap must save.

    Returns
    -------
    (k,) int array
        The sources after the swap; the same array as `sources` if no swap saves enough.
    """
    swap = _find_best_swap(table, sources, is_fixed)
    return swap.sources if swap.swapped_cost < swap.cost * (1.0 - threshold) else sources


def apply_best_swaps(table: FloatArray, sources: IntArray, heartbeat: Heartbeat = lambda: None) -> IntArray:
    """Apply the best swap again and again, as long as it lowers the cost.

    Parameters
    ----------
    table : (m, c) array
        Distances from targets to possible sources.
    sources : (k,) int array
        The sources to start with.
    heartbeat : callable
        Called before each swap; see `Heartbeat`.

    Returns
    -------
    (k,) int array
        Sources whose cost no single swap can lower.
    """
    is_fixed = np.zeros(len(sources), dtype=bool)
    while True:
        heartbeat()
        swapped = apply_best_swap(table, sources, is_fixed, _MIN_SAVING)
        if swapped is sources:
            return sources
        sources = swapped


def improve_sources(
    table: FloatArray, sources: IntArray, is_fixed: BoolArray, threshold: float, *, removals: bool = True
) -> IntArray:
    """Improve sources by Lloyd's iteration, alternating with larger changes.

    After a first Lloyd's iteration, each round consists of a larger change and another Lloyd's iteration. The
    larger change is the best swap or, if no swap saves enough, a change by `rebuild_sources`.

    Parameters
    ----------
    table : (m, c) array
        Distances from targets to possible sources.
    sources : (k,) int array
        The sources to start with.
    is_fixed : (k,) bool array
        Whether each source must not change.
    threshold : float
        Fraction of the cost after the first Lloyd's iteration that all rounds together must save.
    removals : bool
        Whether `rebuild_sources` is used.

    Returns
    -------
    (k,) int array
        The improved sources; those after the first Lloyd's iteration if the rounds do not save enough.
    """
    after_lloyd = run_lloyd(table, sources, is_fixed)
    if not threshold < 1.0:
        # Nothing can save the whole cost.
        return after_lloyd
    best = after_lloyd
    for _ in range(_MAX_ROUNDS):
        changed = apply_best_swap(table, best, is_fixed, _MIN_ROUND_SAVING)
        if changed is best and removals:
            changed = rebuild_sources(table, best, is_fixed, _MIN_ROUND_SAVING)
        if changed is best:
            break
        best = run_lloyd(table, changed, is_fixed)
    max_cost = (1.0 - threshold) * _compute_cost(table, after_lloyd)
    return best if _compute_cost(table, best) < max_cost else after_lloyd


def move_first_source(
    table: FloatArray, sources: IntArray, is_allowed: BoolArray, threshold: float
) -> IntArray:
    """Replace the first source by the best allowed column; the other sources do not change.

    Unlike Lloyd's iteration, this takes into account that the nearest source of a target may change.

    Parameters
    ----------
    table : (m, c) array
        Distances from targets to possible sources.
    sources : (k,) int array
        The sources before the move.
    is_allowed : (c,) bool array
        Whether each column may become the first source.
    threshold : float
        Fraction of the cost that the move must save.

    Returns
    -------
    (k,) int array
        The sources after the move; the same array as `sources` if no column saves enough.
    """
    other_distances = table[:, sources[1:]].min(axis=1, initial=np.inf)
    costs = np.minimum(table, other_distances[:, None]).sum(axis=0)
    best = int(np.where(is_allowed, costs, np.inf).argmin())
    if not (is_allowed[best] and costs[best] < costs[sources[0]] * (1.0 - threshold)):
        return sources
    return np.concatenate([[best], sources[1:]])


@kernel
def compute_costs_with_column(table: FloatArray, distances: FloatArray) -> FloatArray:
    """Compute the cost of given sources and one more column, for every column of the table.

    Parameters
    ----------
    table : (m, c) array
        Distances from targets to possible sources.
    distances : (m,) array
        Distance from each target to the nearest of the given sources; inf if there are none.

    Returns
    -------
    (c,) array
    """
    costs = np.zeros(table.shape[1])
    for t in range(len(table)):
        for column in range(table.shape[1]):
            costs[column] += min(table[t, column], distances[t])
    return costs


def rebuild_sources(table: FloatArray, sources: IntArray, is_fixed: BoolArray, threshold: float) -> IntArray:
    """Replace two or three sources at the same time.

    Every pair and every triple of sources that are not fixed is removed and then replaced greedily, one
    source after another. Lloyd's iteration improves the few sets of sources with the lowest costs.

    Parameters
    ----------
    table : (m, c) array
        Distances from targets to possible sources.
    sources : (k,) int array
        The sources before the change.
    is_fixed : (k,) bool array
        Whether each source must not change.
    threshold : float
        Fraction of the cost that the change must save.

    Returns
    -------
    (k,) int array
        The sources after the best change; the same array as `sources` if no change saves enough.
    """
    replaceable = np.flatnonzero(~is_fixed).tolist()
    candidates = []
    for size in _REMOVAL_SIZES:
        for removed in combinations(replaceable, size):
            # The removed sources come last in the order, and are replaced.
            order = np.append(np.delete(np.arange(len(sources)), removed), removed)
            cost, rebuilt = _replace_sources(table, sources, order, unchanged_count=len(sources) - size)
            candidates.append((cost, rebuilt))
    candidates.sort(key=lambda candidate: candidate[0])
    best = sources
    cost_to_beat = _compute_cost(table, sources) * (1.0 - threshold)
    for _, candidate in candidates[:_MAX_IMPROVED_CANDIDATES]:
        improved = run_lloyd(table, candidate, is_fixed)
        cost = _compute_cost(table, improved)
        if cost < cost_to_beat:
            best = improved
            cost_to_beat = cost
    return best


def _compute_cost(table: FloatArray, sources: IntArray) -> float:
    """Return the cost of sources: the sum of the distances of all targets to their nearest source."""
    return float(table[:, sources].min(axis=1).sum())


@kernel
def _find_nearest_sources(table: FloatArray, sources: IntArray) -> _NearestSources:
    """Return the nearest source of each target, and the distances to the two nearest sources."""
    target_count = len(table)
    owners = np.zeros(target_count, dtype=np.intp)
    distances = np.full(target_count, np.inf)
    second_distances = np.full(target_count, np.inf)
    for t in range(target_count):
        for k in range(len(sources)):
            distance = table[t, sources[k]]
            if distance < distances[t]:
                second_distances[t] = distances[t]
                distances[t] = distance
                owners[t] = k
            elif distance < second_distances[t]:
                second_distances[t] = distance
    return _NearestSources(owners, distances, second_distances)


@kernel
def _apply_lloyd_step(table: FloatArray, sources: IntArray, is_fixed: BoolArray) -> tuple[float, IntArray]:
    """Return the cost of the sources and, for each of them, the best column for its targets.

    Targets are rows of the table, sources are columns. Each target belongs to its nearest source.
    """
    nearest = _find_nearest_sources(table, sources)
    cost = 0.0
    has_targets = np.zeros(len(sources), dtype=np.bool_)
    # Row k contains, for each column, the sum of the distances of the targets of source k to the column.
    sums = np.zeros((len(sources), table.shape[1]))
    for t in range(len(table)):
        k = nearest.owners[t]
        cost += nearest.distances[t]
        has_targets[k] = True
        for column in range(table.shape[1]):
            sums[k, column] += table[t, column]
    # Sources that are fixed or have no targets keep their columns. No two sources may get the same column.
    is_taken = np.zeros(table.shape[1], dtype=np.bool_)
    for k in range(len(sources)):
        is_taken[sources[k]] |= is_fixed[k] or not has_targets[k]
    next_sources = sources.copy()
    for k in range(len(sources)):
        if has_targets[k] and not is_fixed[k]:
            next_sources[k] = _find_smallest(sums[k], is_taken)
            is_taken[next_sources[k]] = True
    return cost, next_sources


@kernel
def _find_smallest(sums: FloatArray, is_taken: BoolArray) -> int:
    """Return the column with the smallest sum among those that are not taken; -1 if all are taken."""
    best = -1
    min_sum = np.inf
    for column in range(len(sums)):
        if not is_taken[column] and (best < 0 or sums[column] < min_sum):
            best = column
            min_sum = sums[column]
    return best


@kernel
def _find_best_swap(table: FloatArray, sources: IntArray, is_fixed: BoolArray) -> _Swap:
    """Return the replacement of one source by another column that leads to the lowest cost.

    The cost after a swap is the sum of two terms. The first is the cost of all sources and the new column.
    The second is the increase due to the targets of the removed source, whose nearest source is then the new
    column or the source that was second-nearest before. One pass over the table computes both for all swaps.
    """
    nearest = _find_nearest_sources(table, sources)
    costs_with_column = np.zeros(table.shape[1])
    increases = np.zeros((len(sources), table.shape[1]))
    cost = 0.0
    for t in range(len(table)):
        k = nearest.owners[t]
        own_distance = nearest.distances[t]
        second_distance = nearest.second_distances[t]
        cost += own_distance
        for column in range(table.shape[1]):
            distance = table[t, column]
            distance_with_column = min(distance, own_distance)
            costs_with_column[column] += distance_with_column
            increases[k, column] += min(distance, second_distance) - distance_with_column
    is_source = np.zeros(table.shape[1], dtype=np.bool_)
    for k in range(len(sources)):
        is_source[sources[k]] = True
    best_cost = np.inf
    best_k = -1
    best_column = -1
    for column in range(table.shape[1]):
        for k in range(len(sources)):
            swapped_cost = costs_with_column[column] + increases[k, column]
            if swapped_cost < best_cost and not is_source[column] and not is_fixed[k]:
                best_cost = swapped_cost
                best_k = k
                best_column = column
    swapped_sources = sources.copy()
    if best_k >= 0:
        swapped_sources[best_k] = best_column
    return _Swap(cost=cost, swapped_cost=best_cost, sources=swapped_sources)


@kernel
def _replace_sources(
    table: FloatArray, sources: IntArray, order: IntArray, unchanged_count: int
) -> tuple[float, IntArray]:
    """Replace sources greedily, one after another, in a given order; return the cost and the new sources.

    `order` contains the indices of all sources. The first `unchanged_count` of them keep their columns. Each
    of the others is replaced by the column that leads to the lowest cost of the sources so far.
    """
    replaced = sources.copy()
    distances = np.full(len(table), np.inf)
    is_taken = np.zeros(table.shape[1], dtype=np.bool_)
    for position in range(len(order)):
        k = order[position]
        if position >= unchanged_count:
            sums = np.zeros(table.shape[1])
            for t in range(len(table)):
                for column in range(table.shape[1]):
                    sums[column] += min(table[t, column], distances[t])
            replaced[k] = _find_smallest(sums, is_taken)
        is_taken[replaced[k]] = True
        for t in range(len(table)):
            distances[t] = min(distances[t], table[t, replaced[k]])
    return distances.sum(), replaced
