"""The k-median problem on a table, some sources given; `robocov.optimum.interchange` has the plain one."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.arrays.grouping import beginnings

_MOST = 60
"""Passes; a few are usual."""


def improved(table: Array, sources: IntArray, given: BoolArray, threshold: float) -> IntArray:
    """Return sources for which the sum over the targets of the nearest one's entries is low.

    Lloyd's iteration in turn with the best swap of one source for another, as long as it lowers the sum by
    more than `threshold` of it.

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
    for _ in range(_MOST):
        sources = settled(table, sources, given)
        after = swapped(table, sources, given, threshold)
        if after is sources:
            break
        sources = after
    return sources


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
