"""What many runs say together: bootstrap intervals, clustered by map, and paired comparisons.

Runs on one map are alike: resampling them one by one would make the intervals too narrow. Where
`clusters` are given, whole clusters are drawn (Field and Welsh, 2007; the percentile interval of Efron).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.errors import ParameterError, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike

Statistic: TypeAlias = Literal["median", "mean"]

LEVEL = 0.95
"""Of the intervals, where nothing else is said."""

RESAMPLES = 4000
"""Bootstrap samples: the ends of a 95 % interval then vary by about a fortieth of its width."""

_AT_ONCE = 2_000_000
"""Weights that are held at a time."""


@dataclass(frozen=True)
class Interval:
    """An estimate and where it may lie.

    Attributes
    ----------
    estimate, low, high : float
        `low` and `high` are nan where there are fewer than two clusters to draw from.
    """

    estimate: float
    low: float
    high: float

    def __str__(self) -> str:
        if np.isnan(self.low):
            return f"{self.estimate:.3g}"
        return f"{self.estimate:.3g} ({self.low:.3g} to {self.high:.3g})"


@dataclass(frozen=True)
class Paired:
    """How `a` compares with `b`, pair by pair.

    Attributes
    ----------
    ratio : Interval
        Median of a/b.
    difference : Interval
        Median of a - b.
    wins : Interval
        Share of pairs in which a is below b; ties count half.
    pairs : int
    """

    ratio: Interval
    difference: Interval
    wins: Interval
    pairs: int


def bootstrap(
    values: ArrayLike,
    statistic: Statistic = "median",
    clusters: Sequence[object] | None = None,
    *,
    level: float = LEVEL,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Interval:
    """Return a statistic of a sample with its percentile bootstrap interval.

    Parameters
    ----------
    values : (m,)
        At least one, all finite.
    statistic : {"median", "mean"}
    clusters : sequence of m labels, or None
        Values of one label stay together; None draws them one by one.
    level : float
        Probability with which the interval is to hold the truth.
    resamples : int
    seed : int
        The same seed gives the same interval.

    Raises
    ------
    ParameterError
        When there is no value, or one that is not finite, or not one label for each.
    """
    sample = _checked("values", values)
    groups, sizes = _groups(sample, clusters)
    order = np.argsort(sample, kind="stable")
    ranked, groups = sample[order], groups[order]
    weigh = {"median": _weighted_medians, "mean": _weighted_means}[statistic]
    estimate = float(weigh(ranked, np.ones((1, len(ranked))))[0])
    if len(sizes) < 2:
        return Interval(estimate, float("nan"), float("nan"))
    counts = _drawn(len(sizes), resamples, seed)
    found = np.empty(resamples)
    step = max(_AT_ONCE // len(ranked), 1)
    for begin in range(0, resamples, step):
        part = slice(begin, begin + step)
        found[part] = weigh(ranked, counts[part][:, groups])
    return _interval(estimate, found, level)


def bootstrap_by(
    statistic: Callable[[list[int]], float],
    clusters: Sequence[object],
    *,
    level: float = LEVEL,
    resamples: int = 1000,
    seed: int = 0,
) -> Interval:
    """Return any statistic of rows with its percentile bootstrap interval, drawing whole clusters.

    Parameters
    ----------
    statistic : callable
        Takes the numbers of the rows that were drawn, some of them several times.
    clusters : sequence of m labels
        One for each row.
    level, resamples, seed
        As for `bootstrap`.

    Raises
    ------
    ParameterError
        When there is no row.
    """
    if not len(clusters):
        raise ParameterError("clusters: none, but at least one was wanted")
    labels = {label: number for number, label in enumerate(dict.fromkeys(clusters))}
    members: list[list[int]] = [[] for _ in labels]
    for row, label in enumerate(clusters):
        members[labels[label]].append(row)
    estimate = float(statistic(list(range(len(clusters)))))
    if len(members) < 2:
        return Interval(estimate, float("nan"), float("nan"))
    found = np.empty(resamples)
    for k, counts in enumerate(_drawn(len(members), resamples, seed)):
        found[k] = statistic(
            [row for rows, count in zip(members, counts, strict=True) for row in rows * count]
        )
    return _interval(estimate, found[np.isfinite(found)], level)


def paired(
    a: ArrayLike,
    b: ArrayLike,
    clusters: Sequence[object] | None = None,
    *,
    level: float = LEVEL,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Paired:
    """Compare two samples pair by pair: row k of both was got under the same circumstances.

    Parameters
    ----------
    a, b : (m,)
        All finite, and all of `b` above 0.
    clusters, level, resamples, seed
        As for `bootstrap`.

    Raises
    ------
    ParameterError
        When the samples have not the same length, or hold what they must not.
    """
    first, second = _checked("a", a), _checked("b", b)
    if len(first) != len(second):
        raise ParameterError(f"pairs: {len(first)} and {len(second)} values, but as many of both were wanted")
    if (second <= 0.0).any():
        raise ParameterError(f"b: {second.min():g}, but values above 0 were wanted")
    won = np.where(first < second, 1.0, np.where(first == second, 0.5, 0.0))

    def interval(values: Array, statistic: Statistic) -> Interval:
        return bootstrap(values, statistic, clusters, level=level, resamples=resamples, seed=seed)

    return Paired(
        ratio=interval(first / second, "median"),
        difference=interval(first - second, "median"),
        wins=interval(won, "mean"),
        pairs=len(first),
    )


def spread(values: ArrayLike) -> float:
    """Return the coefficient of variation: the standard deviation (of a sample) by the mean.

    Raises
    ------
    ParameterError
        When there are fewer than two values, or their mean is not above 0.
    """
    sample = _checked("values", values)
    if len(sample) < 2:
        raise ParameterError(f"values: {len(sample)}, but at least two were wanted")
    mean = float(sample.mean())
    if mean <= 0.0:
        raise ParameterError(f"values: their mean is {mean:g}, but one above 0 was wanted")
    return float(sample.std(ddof=1)) / mean


def _checked(name: str, values: ArrayLike) -> Array:
    sample = np.asarray(values, dtype=float)
    if sample.ndim != 1 or len(sample) == 0:
        raise ParameterError(f"{name}: shape {sample.shape}, but a row of at least one number was wanted")
    finite: BoolArray = np.isfinite(sample)
    if not finite.all():
        k = int(np.argmin(finite))
        raise ParameterError(f"{name}[{k}]: {shown(float(sample[k]))}, but a finite number was wanted")
    return sample


def _groups(sample: Array, clusters: Sequence[object] | None) -> tuple[np.ndarray, list[int]]:
    """Return the number of each value's cluster, and how many values each cluster has."""
    if clusters is None:
        return np.arange(len(sample)), [1] * len(sample)
    if len(clusters) != len(sample):
        raise ParameterError(
            f"clusters: {len(clusters)} labels of {len(sample)} values, but one for each was wanted"
        )
    labels = {label: number for number, label in enumerate(dict.fromkeys(clusters))}
    groups = np.array([labels[label] for label in clusters])
    return groups, np.bincount(groups).tolist()


def _drawn(clusters: int, resamples: int, seed: int) -> np.ndarray:
    """Return how often each cluster is in each bootstrap sample, (resamples, clusters)."""
    rng = np.random.default_rng(seed)
    return rng.multinomial(clusters, np.full(clusters, 1.0 / clusters), size=resamples)


def _weighted_means(ranked: Array, weights: np.ndarray) -> Array:
    return np.asarray(weights @ ranked / weights.sum(axis=1))


def _weighted_medians(ranked: Array, weights: np.ndarray) -> Array:
    """Return the medians of the sorted values, each repeated by its (whole) weight; one for each row."""
    below = np.cumsum(weights, axis=1)
    half = below[:, -1:] / 2.0
    # as numpy has it: between two values when exactly half of all is up to the lower one
    lower = (below >= half).argmax(axis=1)
    upper = (below > half).argmax(axis=1)
    return np.asarray((ranked[lower] + ranked[upper]) / 2.0)


def _interval(estimate: float, found: Array, level: float) -> Interval:
    if len(found) == 0:
        return Interval(estimate, float("nan"), float("nan"))
    tail = (1.0 - level) / 2.0
    low, high = np.quantile(found, [tail, 1.0 - tail])
    return Interval(estimate, float(low), float(high))
