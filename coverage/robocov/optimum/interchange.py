"""The k-median problem on a table of distances: k sources such that the targets are near to one of them.

Teitz and Bart's interchange, with the bookkeeping of Whitaker (1983) and of Schubert and Rousseeuw's
FastPAM (2019): one pass over the table gives the cost after every possible swap.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays.grouping import beginnings

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.arrays import Array, IntArray

_FALL = 1e-9
"""Part of the cost by which a swap must lower it, far more than rounding: no swap is undone by the next."""


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


def alternated(distance: Array, sources: IntArray, beat: Callable[[], None] | None = None) -> IntArray:
    """Return the sources after Lloyd's iteration: targets go to the nearest, sources to the best for theirs.

    Parameters
    ----------
    distance : (c, m)
    sources : (k,)
    beat : callable
        Called once a pass. It may raise, to give up.
    """
    former, total = sources, np.inf
    while True:
        if beat is not None:
            beat()
        owner, nearest, _ = _nearest_two(distance, sources)
        lower = float(nearest.sum())
        if not lower < total * (1.0 - _FALL):
            return former
        former, total = sources, lower
        order, begin, holder = _clusters(owner)
        sums = np.add.reduceat(distance[:, order], begin, axis=1)
        # a source that holds no target stays, and no two may become the same
        sources = sources.copy()
        idle = np.setdiff1d(np.arange(len(sources)), holder)
        sums[sources[idle]] = np.inf
        for place, column in zip(holder.tolist(), sums.T, strict=True):
            sources[place] = column.argmin()
            sums[sources[place]] = np.inf


def interchanged(distance: Array, sources: IntArray, beat: Callable[[], None] | None = None) -> IntArray:
    """Return the sources after the best swaps of one for another, as long as these lower the cost.

    Parameters
    ----------
    distance : (c, m)
    sources : (k,)
    beat : callable
        Called once a pass. It may raise, to give up.
    """
    sources = sources.copy()
    while True:
        if beat is not None:
            beat()
        owner, nearest, second = _nearest_two(distance, sources)
        order, begin, holder = _clusters(owner)
        away = distance[:, order]
        kept = np.minimum(away, nearest[order])
        after = np.repeat(kept.sum(axis=1)[:, None], len(sources), axis=1)
        # without their own source targets go to the new one, or to their second nearest
        after[:, holder] += np.add.reduceat(np.minimum(away, second[order]) - kept, begin, axis=1)
        source, place = divmod(int(after.argmin()), len(sources))
        if not after[source, place] < float(nearest.sum()) * (1.0 - _FALL):
            return sources
        sources[place] = source


def _nearest_two(distance: Array, sources: IntArray) -> tuple[IntArray, Array, Array]:
    """Return which of the sources is nearest to each target, how far, and how far the second nearest is."""
    away = distance[sources]
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
