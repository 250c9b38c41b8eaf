"""The k-median problem on a table of distances: k sources such that the targets are near to one of them.

Teitz and Bart's interchange, with the bookkeeping of Whitaker (1983) and of Schubert and Rousseeuw's
FastPAM (2019): one pass over the table gives the cost after every possible swap.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.arrays.grouping import beginnings

_FALL = 1e-9
"""Part of the cost by which a step must lower it, far more than rounding: none is undone by the next."""

_PASSES = 60
"""Rounds of `improved`; a few are usual."""

_HARDLY = 1e-4
"""Part of the sum that a round of `improved` must save."""

_TAKEN = (2, 3)
"""So many sources are taken away at once."""

_TRIED = 4
"""So many ways to put them back are tried to the end."""


def seeded(distance: Array, count: int, rng: np.random.Generator) -> IntArray:
    """Return sources drawn as k-means++ does (Arthur and Vassilvitskii 2007), with distances for squares.

    A target is drawn with a chance in proportion to its distance from the sources so far, and the source
    nearest to it is taken.

    Parameters
    ----------
    distance : (c, m)
        From every source to every target, finite.
    count : int
        How many, at most c.

    Returns
    -------
    (count,)
    """
    chosen: list[int] = []
    nearest = np.ones(distance.shape[1])
    taken = np.zeros(len(distance), dtype=bool)
    for _ in range(count):
        chances = np.cumsum(nearest)
        # where the sources hold all targets already, any other is as good
        target = int(np.searchsorted(chances, rng.random() * chances[-1], side="right"))
        target = min(target, len(nearest) - 1)
        source = int(np.where(taken, np.inf, distance[:, target]).argmin())
        nearest = np.minimum(nearest, distance[source]) if chosen else distance[source].copy()
        taken[source] = True
        chosen.append(source)
    return np.array(chosen, dtype=np.intp)


def lloyd_iterations(
    table: Array, sources: IntArray, given: BoolArray | None = None, beat: Callable[[], None] | None = None
) -> IntArray:
    """Return the sources after Lloyd's iteration: targets go to the nearest, sources to the best for theirs.

    Parameters
    ----------
    table : (c, m)
        Distances, weighted or not, from every possible source to every target, finite.
    sources : (k,)
    given : (k,) or None
        Which of these stay as they are; None for none.
    beat : callable
        Called once a pass. It may raise, to give up.
    """
    former, total = sources, np.inf
    while True:
        if beat is not None:
            beat()
        owner, nearest, _ = _nearest_two(table, sources)
        lower = float(nearest.sum())
        if not lower < total * (1.0 - _FALL):
            return former
        former, total = sources, lower
        order, begin, holder = _clusters(owner)
        sums = np.add.reduceat(table[:, order], begin, axis=1)
        # a source that holds no target stays, and no two may become the same
        stays = np.ones(len(sources), dtype=bool)
        stays[holder] = False
        if given is not None:
            stays |= given
        sums[sources[stays]] = np.inf
        sources = sources.copy()
        for place, column in zip(holder.tolist(), sums.T, strict=True):
            if not stays[place]:
                sources[place] = column.argmin()
                sums[sources[place]] = np.inf


def best_swap(table: Array, sources: IntArray, given: BoolArray | None, threshold: float) -> IntArray:
    """Return the sources after the best swap; the same array where none lowers the sum by the threshold."""
    owner, nearest, second = _nearest_two(table, sources)
    order, begin, holder = _clusters(owner)
    away = table[:, order]
    kept = np.minimum(away, nearest[order])
    after = np.repeat(kept.sum(axis=1)[:, None], len(sources), axis=1)
    # without their own source targets go to the new one, or to their second nearest
    after[:, holder] += np.add.reduceat(np.minimum(away, second[order]) - kept, begin, axis=1)
    after[sources] = np.inf
    if given is not None:
        after[:, given] = np.inf
    source, place = divmod(int(after.argmin()), len(sources))
    if not after[source, place] < float(nearest.sum()) * (1.0 - threshold):
        return sources
    sources = sources.copy()
    sources[place] = source
    return sources


def best_swaps(table: Array, sources: IntArray, beat: Callable[[], None] | None = None) -> IntArray:
    """Return the sources after the best swaps, as long as these lower the cost; see `lloyd_iterations`."""
    while True:
        if beat is not None:
            beat()
        after = best_swap(table, sources, None, _FALL)
        if after is sources:
            return sources
        sources = after


def improved(table: Array, sources: IntArray, given: BoolArray, threshold: float) -> IntArray:
    """Return sources for which the sum over the targets of the nearest one's entries is low.

    Lloyd's iteration in turn with the best swap of one source for another, and, where no swap helps, with
    taking away two or three and putting them back where each helps most. What all this saves must be more
    than `threshold` of the sum after Lloyd's iteration alone; that one is returned else.

    Parameters
    ----------
    table : (c, m)
        Weighted distances from every possible source to every target, finite.
    sources : (k,)
        To begin with, all different.
    given : (k,)
        Which of these stay as they are.
    threshold : float
    """
    near = best = lloyd_iterations(table, sources, given)
    if not threshold < 1.0:
        return near
    for _ in range(_PASSES):
        after = best_swap(table, best, given, _HARDLY)
        if after is best:
            after = rebuilt(table, best, given, _HARDLY)
        if after is best:
            break
        best = lloyd_iterations(table, after, given)
    return best if _total(table, best) < (1.0 - threshold) * _total(table, near) else near


def moved(table: Array, sources: IntArray, among: BoolArray, threshold: float) -> IntArray:
    """Return the sources with the best one of some, (c,), in the place of the first, the others staying.

    What this saves must be more than `threshold` of the sum; the same array is returned else. Unlike Lloyd's
    iteration, it does not take the clusters for given.
    """
    near = table[sources[1:]].min(axis=0, initial=np.inf)
    sums = np.minimum(table, near).sum(axis=1)
    before = sums[sources[0]]
    sums[~among] = np.inf
    best = int(sums.argmin())
    if not sums[best] < before * (1.0 - threshold):
        return sources
    sources = sources.copy()
    sources[0] = best
    return sources


def rebuilt(table: Array, sources: IntArray, given: BoolArray, threshold: float) -> IntArray:
    """Return the sources after some were taken away at once, and put back one by one where each helps most.

    Of all pairs and triples the most promising few are tried to the end, with Lloyd's iteration. The same
    array is returned where none lowers the sum by the threshold.
    """
    free = (~given).nonzero()[0].tolist()
    far = 10.0 * float(table[sources].max())
    found: list[tuple[float, IntArray]] = []
    for away in (each for size in _TAKEN for each in combinations(free, size)):
        kept = np.delete(sources, away)
        near = table[kept].min(axis=0) if len(kept) else np.full(table.shape[1], far)
        after = sources.copy()
        put = kept
        for place in away:
            sums = np.minimum(table, near).sum(axis=1)
            sums[put] = np.inf
            after[place] = sums.argmin()
            put = np.append(put, after[place])
            near = np.minimum(near, table[after[place]])
        found.append((float(near.sum()), after))
    found.sort(key=lambda each: each[0])
    least, chosen = _total(table, sources) * (1.0 - threshold), sources
    for _, after in found[:_TRIED]:
        after = lloyd_iterations(table, after, given)
        total = _total(table, after)
        if total < least:
            least, chosen = total, after
    return chosen


def _total(table: Array, sources: IntArray) -> float:
    return float(table[sources].min(axis=0).sum())


def _nearest_two(table: Array, sources: IntArray) -> tuple[IntArray, Array, Array]:
    """Return which of the sources is nearest to each target, how far, and how far the second nearest is."""
    away = table[sources]
    owner = away.argmin(axis=0)
    column = np.arange(away.shape[1])
    nearest = away[owner, column]
    away[owner, column] = np.inf
    return owner, nearest, np.asarray(away.min(axis=0))


def _clusters(owner: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return the targets ordered by owner, where each owner's begin, and these owners."""
    order = np.argsort(owner, kind="stable")
    begin = beginnings(owner[order])
    return order, begin, owner[order[begin]]
