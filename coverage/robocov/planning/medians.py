"""The k-median problem on a table, some sources given; `robocov.optimum.interchange` has the plain one."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.arrays.grouping import beginnings

_MOST = 60
"""Passes; a few are usual."""

_HARDLY = 1e-4
"""Part of the sum that a step must save: more than rounding."""

_TAKEN = (2, 3)
"""So many sources are taken away at once."""

_TRIED = 4
"""So many ways to put them back are tried to the end."""


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
    near = best = settled(table, sources, given)
    if not threshold < 1.0:
        return near
    for _ in range(_MOST):
        after = swapped(table, best, given, _HARDLY)
        if after is best:
            after = rebuilt(table, best, given, _HARDLY)
        if after is best:
            break
        best = settled(table, after, given)
    return best if _total(table, best) < (1.0 - threshold) * _total(table, near) else near


def settled(table: Array, sources: IntArray, given: BoolArray) -> IntArray:
    """Return the sources after Lloyd's iteration: every source becomes the best one for its targets."""
    total = np.inf
    former = sources
    for _ in range(_MOST):
        away = table[sources]
        owner = away.argmin(axis=0)
        lower = float(away.min(axis=0).sum())
        if not lower < total * (1.0 - 1e-9):
            return former
        former, total = sources, lower
        order, begin, holder = _clusters(owner)
        sums = np.add.reduceat(table[:, order], begin, axis=1)
        sources = sources.copy()
        # no two may become the same
        sums[sources[given]] = np.inf
        sums[sources[np.setdiff1d(np.arange(len(sources)), holder)]] = np.inf
        for place, column in zip(holder.tolist(), sums.T, strict=True):
            if not given[place]:
                sources[place] = column.argmin()
                sums[sources[place]] = np.inf
    return former


def swapped(table: Array, sources: IntArray, given: BoolArray, threshold: float) -> IntArray:
    """Return the sources after the best swap; the same array where none lowers the sum by the threshold."""
    before, after = _after_swaps(table, sources)
    after[:, given] = np.inf
    source, place = divmod(int(after.argmin()), len(sources))
    if not after[source, place] < before * (1.0 - threshold):
        return sources
    sources = sources.copy()
    sources[place] = source
    return sources


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
        after = settled(table, after, given)
        total = _total(table, after)
        if total < least:
            least, chosen = total, after
    return chosen


def _total(table: Array, sources: IntArray) -> float:
    return float(table[sources].min(axis=0).sum())


def _after_swaps(table: Array, sources: IntArray) -> tuple[float, Array]:
    """Return the sum, and that after each swap, (c, k), infinite for what is a source already."""
    away = table[sources]
    owner = away.argmin(axis=0)
    column = np.arange(away.shape[1])
    nearest = away[owner, column].copy()
    away[owner, column] = np.inf
    second = away.min(axis=0) if len(sources) > 1 else np.full(len(column), 10.0 * nearest.max(initial=0.0))
    order, begin, holder = _clusters(owner)
    kept = np.minimum(table[:, order], nearest[order])
    after = np.repeat(kept.sum(axis=1)[:, None], len(sources), axis=1)
    after[:, holder] += np.add.reduceat(np.minimum(table[:, order], second[order]) - kept, begin, axis=1)
    after[sources] = np.inf
    return float(nearest.sum()), after


def _clusters(owner: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    order = np.argsort(owner, kind="stable")
    begin = beginnings(owner[order])
    return order, begin, owner[order[begin]]
