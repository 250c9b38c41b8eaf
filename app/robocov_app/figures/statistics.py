"""Estimates with intervals over runs, which are clustered by map.

Runs on the same map are correlated: if they were resampled one by one, intervals would be too narrow.
Therefore whole clusters are resampled (Field and Welsh, 2007). The limits of intervals are percentiles.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Literal, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from robocov.typing import FloatArray, IntArray

CONFIDENCE_LEVEL = 0.95
"""Confidence level of all intervals."""
RESAMPLES = 4000
"""Number of bootstrap samples, for which interval limits vary by about a fortieth of the interval width."""
MIN_BOOTSTRAP_MAPS = 5
"""Minimum number of maps: five have 126 different resamples, which are enough for a 95% interval."""
_MAX_BATCH_VALUES = 1_000_000
"""Maximum number of values that are resampled at once, which limits memory."""

_Item = TypeVar("_Item")
_Key = TypeVar("_Key")
_BatchStatistic: TypeAlias = Callable[[IntArray], ArrayLike]
"""Returns the values of a statistic, (r,), for samples given as row numbers, (r, m)."""


@dataclass(frozen=True)
class Interval:
    """An estimate with its 95% interval.

    Attributes
    ----------
    estimate : float
    low, high : float
        Limits of the interval; nan if there is none.
    resampled_values : (r,) array or None
        Values of the statistic in the resamples of a bootstrap.
    trials : int
        Number of independent trials of a fraction; 0 for other estimates.
    """

    estimate: float
    low: float
    high: float
    resampled_values: FloatArray | None = field(default=None, compare=False, repr=False)
    trials: int = field(default=0, compare=False, repr=False)

    def compute_p_value(self, low: float, high: float) -> float:
        """Compute the p-value of the hypothesis that the true value is outside given bounds.

        Parameters
        ----------
        low, high : float
            The bounds; may be infinite.

        Returns
        -------
        float
            For a fraction, from binomial tests; otherwise the fraction of resamples that are outside the
            bounds, to which one outside is added. 1 if there is no interval.
        """
        if self.trials:
            return self._compute_binomial_p_value(low, high)
        if self.resampled_values is None:
            return 1.0
        is_outside = ~((low <= self.resampled_values) & (self.resampled_values <= high))
        # One resample outside the bounds is added, so that a p-value is never 0.
        return float(1 + np.count_nonzero(is_outside)) / (1 + self.resampled_values.size)

    def _compute_binomial_p_value(self, low: float, high: float) -> float:
        """Return the larger p-value of the one-sided binomial tests against the bounds."""
        from scipy.special import betainc

        successes = self.estimate * self.trials
        failures = self.trials - successes
        # The regularized incomplete beta function is the tail of the binomial distribution.
        if successes and low > 0.0:
            p_below = float(betainc(successes, failures + 1.0, low))
        else:
            p_below = float(low > 0.0)
        if failures and high < 1.0:
            p_above = float(betainc(failures, successes + 1.0, 1.0 - high))
        else:
            p_above = float(high < 1.0)
        return max(p_below, p_above)


def bootstrap(
    values: ArrayLike,
    statistic: Literal["median", "mean"] = "median",
    clusters: Sequence[object] | None = None,
    *,
    resamples: int = RESAMPLES,
) -> Interval:
    """Estimate the median or the mean of values with a bootstrap interval.

    Parameters
    ----------
    values : (m,) array_like
        Finite values.
    statistic : {"median", "mean"}
    clusters : sequence of object, optional
        Cluster of each value; by default each value is a cluster.
    resamples : int

    Returns
    -------
    Interval
        Without limits if there are fewer than two clusters. Deterministic: random numbers have a fixed seed.
    """
    sample = np.asarray(values, dtype=float)
    if clusters is None:
        clusters = range(len(sample))
    if statistic == "median":
        return _bootstrap(lambda rows: np.median(sample[rows], axis=1), clusters, resamples)
    return _bootstrap(lambda rows: np.mean(sample[rows], axis=1), clusters, resamples)


def bootstrap_statistic(
    statistic: Callable[[IntArray], float], clusters: Sequence[object], *, resamples: int = 1000
) -> Interval:
    """Estimate any statistic of rows of data with a bootstrap interval.

    Parameters
    ----------
    statistic : callable
        Takes row numbers, which may be repeated, and returns a value; nan if there is none.
    clusters : sequence of object
        Cluster of each row.
    resamples : int

    Returns
    -------
    Interval
        Without limits if there are fewer than two clusters.
    """
    return _bootstrap(lambda samples: [statistic(rows) for rows in samples], clusters, resamples)


def _bootstrap(statistic: _BatchStatistic, clusters: Sequence[object], resamples: int) -> Interval:
    """Return a statistic of all rows, with its percentiles over resampled clusters as limits."""
    cluster_rows: dict[object, list[int]] = {}
    for row, cluster in enumerate(clusters):
        cluster_rows.setdefault(cluster, []).append(row)
    rows_by_cluster = [np.array(rows) for rows in cluster_rows.values()]
    all_rows = np.arange(len(clusters))
    estimate = float(np.asarray(statistic(all_rows[None]))[0])
    if len(rows_by_cluster) < 2:
        return Interval(estimate, float("nan"), float("nan"))
    values = _resample(statistic, rows_by_cluster, resamples)
    # Resamples without a value are ignored.
    low, high = _compute_limits(values[~np.isnan(values)])
    return Interval(estimate, low, high, values)


def _resample(statistic: _BatchStatistic, rows_by_cluster: Sequence[IntArray], resamples: int) -> FloatArray:
    """Return the values of a statistic for samples of whole clusters, (resamples,).

    Parameters
    ----------
    statistic : callable
    rows_by_cluster : sequence of int array
        Row numbers of each cluster.
    resamples : int
    """
    count = len(rows_by_cluster)
    choices = np.random.default_rng(0).integers(0, count, (resamples, count))
    sizes = {len(rows) for rows in rows_by_cluster}
    # Clusters of equal size fit into a table, so that many samples can be evaluated at once.
    if len(sizes) == 1:
        table = np.array(rows_by_cluster)
        batches = np.array_split(choices, 1 + table.size * resamples // _MAX_BATCH_VALUES)
        values = [statistic(table[batch].reshape(len(batch), -1)) for batch in batches]
    else:
        samples = [np.concatenate([rows_by_cluster[cluster] for cluster in choice]) for choice in choices]
        values = [statistic(rows[None]) for rows in samples]
    return np.concatenate([np.asarray(batch_values) for batch_values in values])


def _compute_limits(values: FloatArray) -> tuple[float, float]:
    """Return the percentiles of values that are the limits of an interval; nan if there are no values."""
    if not len(values):
        return np.nan, np.nan
    tail = (1.0 - CONFIDENCE_LEVEL) / 2.0
    method: Literal["linear", "inverted_cdf"] = "linear"
    if not np.isfinite(values).all():
        # Interpolating between a number and infinity is impossible.
        method = "inverted_cdf"
    low, high = np.quantile(values, [tail, 1.0 - tail], method=method).tolist()
    return low, high


def estimate_fraction(values: ArrayLike, clusters: Sequence[object]) -> Interval:
    """Estimate a fraction, such as that of runs in which an event occurs.

    Parameters
    ----------
    values : (m,) array_like
        From 0 to 1.
    clusters : sequence of object
        Cluster of each value.

    Returns
    -------
    Interval
        The mean with the exact interval of Clopper and Pearson (1934). Each cluster counts as one trial,
        since the runs of a cluster are correlated. The interval is one-sided if the fraction is 0 or 1: if
        the event occurs on none of 33 maps, the fraction is at most 8.7%.
    """
    from scipy.special import betaincinv

    estimate = float(np.asarray(values, dtype=float).mean())
    trials = len(set(clusters))
    successes = estimate * trials
    failures = (1.0 - estimate) * trials
    sides = 2.0 if successes and failures else 1.0
    tail = (1.0 - CONFIDENCE_LEVEL) / sides
    low = 0.0
    high = 1.0
    if successes:
        low = float(betaincinv(successes, failures + 1.0, tail))
    if failures:
        high = float(betaincinv(successes + 1.0, failures, 1.0 - tail))
    return Interval(estimate, low, high, trials=trials)


def adjust_p_values(p_values: Mapping[str, float]) -> dict[str, float]:
    """Adjust p-values for multiple testing by the method of Holm (1979).

    Parameters
    ----------
    p_values : mapping of str to float

    Returns
    -------
    dict of str to float
        Adjusted p-values, sorted in ascending order.

    Examples
    --------
    >>> adjust_p_values({"a": 0.04, "b": 0.01})
    {'b': 0.02, 'a': 0.04}
    """
    names = sorted(p_values, key=p_values.__getitem__)
    products = [p_values[name] * (len(names) - rank) for rank, name in enumerate(names)]
    return {name: min(p, 1.0) for name, p in zip(names, accumulate(products, max), strict=True)}


def estimate_median_time(
    ended: Sequence[float] | FloatArray, censored: Sequence[float] | FloatArray
) -> float:
    """Compute the median time to an event by the estimator of Kaplan and Meier (1958).

    Parameters
    ----------
    ended : sequence of float, s
        Times of the events, one for each run that has an event.
    censored : sequence of float, s
        Durations of the runs without an event.

    Returns
    -------
    float, s
        Infinite if the event occurs in fewer than half of the runs.
    """
    from scipy.stats import CensoredData, ecdf

    survival = ecdf(CensoredData(uncensored=ended, right=censored)).sf
    below_half = np.flatnonzero(survival.probabilities <= 0.5)
    if not len(below_half):
        return np.inf
    return float(survival.quantiles[below_half[0]])


def estimate_mean(values: ArrayLike) -> Interval:
    """Estimate the mean of values with Student's t interval.

    Parameters
    ----------
    values : (m,) array_like

    Returns
    -------
    Interval
        Without limits if all values are equal, as they may be copies of one value.
    """
    sample = np.asarray(values, dtype=float)
    mean = float(sample.mean())
    if len(np.unique(sample)) < 2:
        return Interval(mean, float("nan"), float("nan"))
    from scipy.special import stdtrit

    error = float(sample.std(ddof=1)) / np.sqrt(len(sample))
    half_width = float(stdtrit(len(sample) - 1, 0.5 + CONFIDENCE_LEVEL / 2) * error)
    return Interval(mean, mean - half_width, mean + half_width)


def compute_coefficient_of_variation(values: ArrayLike) -> float:
    """Compute the coefficient of variation: the standard deviation of a sample divided by its mean."""
    sample = np.asarray(values, dtype=float)
    return float(sample.std(ddof=1)) / float(sample.mean())


def group_by(items: Iterable[_Item], key: Callable[[_Item], _Key]) -> dict[_Key, list[_Item]]:
    """Group items by a key. Unlike in `itertools.groupby`, items of a group need not be adjacent.

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
