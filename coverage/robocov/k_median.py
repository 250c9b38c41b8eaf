"""The k-median problem on a table of distances: k sources such that each target is near to one of them.

A table is (m, c), C-contiguous and finite: distances, weighted or not, from m targets to c possible sources.
Teitz and Bart's interchange, with the bookkeeping of Whitaker (1983) and of Schubert and Rousseeuw's FastPAM
(2019): one pass over the table gives the cost after every possible swap.
"""

from collections.abc import Callable
from itertools import combinations
from typing import TypeAlias

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel

Beat: TypeAlias = Callable[[], None]
"""Called once a pass; it may raise, to give up."""

_FALL = 1e-9  # part of the cost by which a step must lower it, far more than rounding: none is undone
_PASSES = 60  # rounds of `improve_sources`; a few are usual
_HARDLY = 1e-4  # part of the sum that a round of `improve_sources` must save
_REMOVED = (2, 3)  # so many sources are taken away at once
_TRIED = 4  # so many ways to put them back are tried to the end


def seed_sources(table: Array, count: int, rng: np.random.Generator) -> IntArray:
    """Return (count,) sources by k-means++ (Arthur and Vassilvitskii 2007), with distances for squares."""
    chosen: list[int] = []
    nearest = np.ones(len(table))
    taken = np.zeros(table.shape[1], dtype=bool)
    for _ in range(count):
        chances = np.cumsum(nearest)
        # where the sources hold all targets already, any other is as good
        target = int(np.searchsorted(chances, rng.random() * chances[-1], side="right"))
        target = min(target, len(nearest) - 1)
        source = int(np.where(taken, np.inf, table[target]).argmin())
        nearest = np.minimum(nearest, table[:, source]) if chosen else table[:, source].copy()
        taken[source] = True
        chosen.append(source)
    return np.array(chosen, dtype=np.intp)


def choose_greedily(table: Array, count: int) -> IntArray:
    """Return (count,) sources: one after another that which lowers the sum the most.

    What k sources save, against one that is far from everything, is at least 1 - 1/e of what the best k save
    (Nemhauser, Wolsey and Fisher 1978).
    """
    order = np.arange(count)
    return _put_back(table, np.zeros(count, dtype=np.intp), order, 0)[1]


def run_lloyd(
    table: Array, sources: IntArray, fixed: BoolArray | None = None, beat: Beat = lambda: None
) -> IntArray:
    """Return (k,) sources after Lloyd's iteration; those that are `fixed` stay."""
    stay = np.zeros(len(sources), dtype=bool) if fixed is None else fixed
    former, total = sources, np.inf
    while True:
        beat()
        lower, after = _lloyd_step(table, sources, stay)
        if not lower < total * (1.0 - _FALL):
            return former
        former, total, sources = sources, lower, after


@kernel
def _nearest_two(table: Array, sources: IntArray) -> tuple[IntArray, Array, Array]:
    """Return which source is nearest to each target, how far, and how far the second nearest is."""
    owner = np.zeros(len(table), dtype=np.intp)
    nearest, second = np.full(len(table), np.inf), np.full(len(table), np.inf)
    for t in range(len(table)):
        for k in range(len(sources)):
            distance = table[t, sources[k]]
            if distance < nearest[t]:
                owner[t], nearest[t], second[t] = k, distance, nearest[t]
            elif distance < second[t]:
                second[t] = distance
    return owner, nearest, second


@kernel
def _lloyd_step(table: Array, sources: IntArray, fixed: BoolArray) -> tuple[float, IntArray]:
    """Return the sum for the sources, and the best sources for the targets of each."""
    owner, nearest, _ = _nearest_two(table, sources)
    total, holds = 0.0, np.zeros(len(sources), dtype=np.bool_)
    sums = np.zeros((len(sources), table.shape[1]))
    for t in range(len(table)):
        total += nearest[t]
        holds[owner[t]] = True
        for s in range(table.shape[1]):
            sums[owner[t], s] += table[t, s]
    # a source that holds no target stays, and no two may become the same
    taken = np.zeros(table.shape[1], dtype=np.bool_)
    for k in range(len(sources)):
        taken[sources[k]] |= fixed[k] or not holds[k]
    after = sources.copy()
    for k in range(len(sources)):
        if holds[k] and not fixed[k]:
            after[k] = _least(sums[k], taken)
            taken[after[k]] = True
    return total, after


@kernel
def _least(sums: Array, taken: BoolArray) -> int:
    """Return where the least of the sums is that are not taken."""
    best, least = -1, np.inf
    for s in range(len(sums)):
        if not taken[s] and (best < 0 or sums[s] < least):
            best, least = s, sums[s]
    return best


def apply_best_swap(table: Array, sources: IntArray, fixed: BoolArray, threshold: float) -> IntArray:
    """Return the sources after the best swap; the same array where none lowers the sum by the threshold."""
    before, after, swapped = _best_swap(table, sources, fixed)
    return swapped if after < before * (1.0 - threshold) else sources


@kernel
def _best_swap(table: Array, sources: IntArray, fixed: BoolArray) -> tuple[float, float, IntArray]:
    """Return the sum, that after the best swap, and the sources then."""
    owner, nearest, second = _nearest_two(table, sources)
    with_new = np.zeros(table.shape[1])
    # without their own source targets go to the new one, or to their second nearest
    without_own = np.zeros((len(sources), table.shape[1]))
    total = 0.0
    for t in range(len(table)):
        k, near, next_near = owner[t], nearest[t], second[t]
        total += near
        for s in range(table.shape[1]):
            distance = table[t, s]
            kept = min(distance, near)
            with_new[s] += kept
            without_own[k, s] += min(distance, next_near) - kept
    taken = np.zeros(table.shape[1], dtype=np.bool_)
    for k in range(len(sources)):
        taken[sources[k]] = True
    least, place, source = np.inf, -1, -1
    for s in range(table.shape[1]):
        for k in range(len(sources)):
            after = with_new[s] + without_own[k, s]
            if after < least and not taken[s] and not fixed[k]:
                least, place, source = after, k, s
    swapped = sources.copy()
    if place >= 0:
        swapped[place] = source
    return total, least, swapped


def apply_best_swaps(table: Array, sources: IntArray, beat: Beat = lambda: None) -> IntArray:
    """Return the sources after the best swaps, as long as these lower the cost."""
    fixed, former = np.zeros(len(sources), dtype=bool), None
    while sources is not former:
        beat()
        former, sources = sources, apply_best_swap(table, sources, fixed, _FALL)
    return sources


def improve_sources(
    table: Array, sources: IntArray, fixed: BoolArray, threshold: float, *, removals: bool = True
) -> IntArray:
    """Return (k,) sources for which the sum over the targets of the distances to the nearest is low.

    Lloyd's iteration in turn with the best swap of one source for another, and, with `removals`, where no
    swap helps, with taking away two or three and putting them back where each helps most. Those that are
    `fixed` stay. What all this saves must be more than the part `threshold` of the sum after Lloyd's
    iteration alone; that one is returned else.
    """
    near = best = run_lloyd(table, sources, fixed)
    if not threshold < 1.0:
        return near
    for _ in range(_PASSES):
        after = apply_best_swap(table, best, fixed, _HARDLY)
        if after is best and removals:
            after = rebuild_sources(table, best, fixed, _HARDLY)
        if after is best:
            break
        best = run_lloyd(table, after, fixed)
    return best if _total(table, best) < (1.0 - threshold) * _total(table, near) else near


def move_first_source(table: Array, sources: IntArray, among: BoolArray, threshold: float) -> IntArray:
    """Return the sources with the best one of some, (c,), in the place of the first, the others staying.

    What this saves must be more than `threshold` of the sum; the same array is returned else. Unlike Lloyd's
    iteration, it does not take the clusters for given.
    """
    near = table[:, sources[1:]].min(axis=1, initial=np.inf)
    sums = np.minimum(table, near[:, None]).sum(axis=0)
    best = int(np.where(among, sums, np.inf).argmin())
    if not (among[best] and sums[best] < sums[sources[0]] * (1.0 - threshold)):
        return sources
    return np.concatenate([[best], sources[1:]])


def rebuild_sources(table: Array, sources: IntArray, fixed: BoolArray, threshold: float) -> IntArray:
    """Return the sources after some were taken away at once, and put back one by one where each helps most.

    Of all pairs and triples the most promising few are tried to the end, with Lloyd's iteration. The same
    array is returned where none lowers the sum by the threshold.
    """
    free = np.flatnonzero(~fixed).tolist()
    found = []
    for away in (each for size in _REMOVED for each in combinations(free, size)):
        order = np.append(np.delete(np.arange(len(sources)), away), away)
        found.append(_put_back(table, sources, order, len(sources) - len(away)))
    found.sort(key=lambda each: each[0])
    least, chosen = _total(table, sources) * (1.0 - threshold), sources
    for _, after in found[:_TRIED]:
        after = run_lloyd(table, after, fixed)
        total = _total(table, after)
        if total < least:
            least, chosen = total, after
    return chosen


@kernel
def _put_back(table: Array, sources: IntArray, order: IntArray, stay: int) -> tuple[float, IntArray]:
    """Return the sum, and the sources, after all but the first `stay` in this order were put back."""
    after, near = sources.copy(), np.full(len(table), np.inf)
    taken = np.zeros(table.shape[1], dtype=np.bool_)
    for number in range(len(order)):
        k = order[number]
        if number >= stay:
            sums = np.zeros(table.shape[1])
            for t in range(len(table)):
                for s in range(table.shape[1]):
                    sums[s] += min(table[t, s], near[t])
            after[k] = _least(sums, taken)
        taken[after[k]] = True
        for t in range(len(table)):
            near[t] = min(near[t], table[t, after[k]])
    return near.sum(), after


def _total(table: Array, sources: IntArray) -> float:
    return float(table[:, sources].min(axis=1).sum())
