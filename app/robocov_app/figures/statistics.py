"""Bootstrap intervals over runs, clustered by map.

Runs on one map are alike: resampling them one by one would make the intervals too narrow. Where `clusters`
are given, whole clusters are drawn (Field and Welsh, 2007); intervals are percentiles.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from robocov.arrays import Array, IntArray

LEVEL = 0.95  # of all intervals
RESAMPLES = 4000  # bootstrap samples: the ends of a 95 % interval then vary by about a fortieth of its width
MIN_BOOTSTRAP_MAPS = 5
"""Number of maps from which a bootstrap has enough different resamples, 126, for a 95 % interval."""
_AT_ONCE = 1_000_000  # values that are looked at together

_Item = TypeVar("_Item")
_Key = TypeVar("_Key")


@dataclass(frozen=True)
class Interval:
    """An estimate with its 95 % interval; `low` and `high` are nan where there is none."""

    estimate: float
    low: float
    high: float
    resampled: Array | None = field(default=None, compare=False, repr=False)  # its values in the resamples
    counted: int = field(default=0, compare=False, repr=False)  # clusters, of a share

    def p_value(self, low: float, high: float) -> float:
        """Return the p-value of the truth lying outside `low` to `high`; 1 where there is no interval.

        It is the share of resamples outside; that of a share is binomial.
        """
        if self.counted:
            from scipy.special import betainc

            there = self.estimate * self.counted
            below = betainc(there, self.counted - there + 1.0, low) if there and low > 0.0 else low > 0.0
            beside = self.counted - there
            above = betainc(beside, there + 1.0, 1.0 - high) if beside and high < 1.0 else high < 1.0
            return float(max(below, above))
        drawn = np.empty(0) if self.resampled is None else self.resampled
        return float(1 + np.count_nonzero(~((low <= drawn) & (drawn <= high)))) / (1 + drawn.size)


def bootstrap(
    values: ArrayLike,
    statistic: Literal["median", "mean"] = "median",
    clusters: Sequence[object] | None = None,
    *,
    resamples: int = RESAMPLES,
) -> Interval:
    """Return the median or mean of (m,) finite values; those of one of m `clusters` are drawn together."""
    sample = np.asarray(values, dtype=float)
    labels = range(len(sample)) if clusters is None else clusters
    of: Callable[..., Any] = np.median if statistic == "median" else np.mean
    return _interval(lambda rows: of(sample[rows], axis=1), labels, resamples)


def bootstrap_by(
    statistic: Callable[[IntArray], float], clusters: Sequence[object], *, resamples: int = 1000
) -> Interval:
    """Return any statistic of row numbers, some drawn several times, one label of `clusters` a row."""
    return _interval(lambda drawn: [statistic(rows) for rows in drawn], clusters, resamples)


def _interval(of: Callable[[IntArray], ArrayLike], clusters: Sequence[object], resamples: int) -> Interval:
    """Return a statistic of (r, m) row numbers, one for each row, with its percentiles over resamples."""
    rows: dict[object, list[int]] = {}
    for row, label in enumerate(clusters):
        rows.setdefault(label, []).append(row)
    members = [np.array(own) for own in rows.values()]
    estimate = float(np.asarray(of(np.arange(len(clusters))[None]))[0])
    if len(members) < 2:
        return Interval(estimate, float("nan"), float("nan"))
    drawn = np.random.default_rng(0).integers(0, len(members), (resamples, len(members)))
    if len({len(own) for own in members}) == 1:
        together = np.array(members)
        parts = np.array_split(drawn, 1 + len(clusters) * resamples // _AT_ONCE)
        several = [of(together[part].reshape(len(part), -1)) for part in parts]
    else:
        several = [of(np.concatenate([members[k] for k in each])[None]) for each in drawn]
    found = np.concatenate([np.asarray(each) for each in several])
    # a resample may have no value of the statistic: its percentiles are those of the others
    known, tail = found[~np.isnan(found)], (1.0 - LEVEL) / 2.0
    how: Any = "linear" if np.isfinite(known).all() else "inverted_cdf"  # between a number and inf is nothing
    low, high = np.quantile(known, [tail, 1.0 - tail], method=how).tolist() if len(known) else (np.nan,) * 2
    return Interval(estimate, low, high, found)


def share(there: ArrayLike, clusters: Sequence[object]) -> Interval:
    """Return the mean of (m,) values from 0 to 1, such as how often something is so.

    The interval is that of Clopper and Pearson (1934) for as many trials as there are clusters, since runs of
    one may be alike: exact, and one-sided where all are 0 or all are 1. None of 33 maps is at most 8.7 %.
    """
    from scipy.special import betaincinv

    estimate, several = float(np.asarray(there, dtype=float).mean()), len(set(clusters))
    count, beside = estimate * several, (1.0 - estimate) * several
    tail = (1.0 - LEVEL) / (2.0 if count and beside else 1.0)
    low = float(betaincinv(count, beside + 1.0, tail)) if count else 0.0
    high = float(betaincinv(count + 1.0, beside, 1.0 - tail)) if beside else 1.0
    return Interval(estimate, low, high, counted=several)


def holm(p_values: Mapping[str, float]) -> dict[str, float]:
    """Return p-values by name, adjusted for their number by Holm (1979), from the lowest on."""
    ranked = sorted(p_values, key=p_values.__getitem__)
    raised = (p_values[name] * (len(ranked) - k) for k, name in enumerate(ranked))
    return {name: min(p, 1.0) for name, p in zip(ranked, accumulate(raised, max), strict=True)}


def median_time(ended: Sequence[float] | Array, censored: Sequence[float] | Array) -> float:
    """Return the median by Kaplan and Meier (1958) of times to an event; inf where most have not ended.

    Times are in s, of what has `ended` and of what was `censored`: looked at for so long in vain.
    """
    from scipy.stats import CensoredData, ecdf

    curve = ecdf(CensoredData(uncensored=ended, right=censored)).sf
    below = np.flatnonzero(curve.probabilities <= 0.5)
    return float(curve.quantiles[below[0]]) if len(below) else np.inf


def mean_with_t_interval(values: ArrayLike) -> Interval:
    """Return the mean of (m,) values with Student's t interval; equal values say no more than one."""
    sample = np.asarray(values, dtype=float)
    mean = float(sample.mean())
    if len(np.unique(sample)) < 2:
        return Interval(mean, float("nan"), float("nan"))
    from scipy.special import stdtrit

    error = float(sample.std(ddof=1)) / np.sqrt(len(sample))
    half = float(stdtrit(len(sample) - 1, 0.5 + LEVEL / 2) * error)
    return Interval(mean, mean - half, mean + half)


def spread(values: ArrayLike) -> float:
    """Return the coefficient of variation: the deviation (of a sample) by the mean, of two or more values."""
    sample = np.asarray(values, dtype=float)
    return float(sample.std(ddof=1)) / float(sample.mean())


def group_by(items: Iterable[_Item], key: Callable[[_Item], _Key]) -> dict[_Key, list[_Item]]:
    """Group items by a key.

    Unlike `itertools.groupby`, items with the same key need not be adjacent.

    Parameters
    ----------
    items : iterable
    key : callable
        Returns the key of an item.

    Returns
    -------
    dict
        Items by key. Keys and items are in the order of the input.

    Examples
    --------
    >>> group_by(["lloyd", "rapf", "rpf", "atlas"], len)
    {5: ['lloyd', 'atlas'], 4: ['rapf'], 3: ['rpf']}
    """
    groups: dict[_Key, list[_Item]] = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return groups
