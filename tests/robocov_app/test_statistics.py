"""Confidence intervals and p-values."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from scipy.stats import binomtest

from robocov_app.figures.statistics import (
    Interval,
    adjust_p_values,
    bootstrap,
    bootstrap_statistic,
    compute_coefficient_of_variation,
    estimate_fraction,
    estimate_mean,
    estimate_median_time,
)

numbers = st.floats(-1e6, 1e6, allow_nan=False)


def test_the_bootstrap_interval_of_a_mean_is_close_to_the_normal_one() -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(3.0, 2.0, 400)
    interval = bootstrap(values, "mean")
    half_width = 1.96 * values.std(ddof=1) / np.sqrt(400)
    assert interval.estimate == pytest.approx(values.mean())
    assert interval.low == pytest.approx(values.mean() - half_width, abs=0.1 * half_width)
    assert interval.high == pytest.approx(values.mean() + half_width, abs=0.1 * half_width)


def test_similar_values_of_a_cluster_do_not_narrow_the_interval() -> None:
    """Thirty similar runs on each map are no more evidence than one."""
    rng = np.random.default_rng(3)
    cluster_means = rng.normal(size=20)
    clusters = np.repeat(np.arange(20), 30)
    values = cluster_means[clusters] + 0.01 * rng.normal(size=600)
    unclustered = bootstrap(values, "mean")
    clustered = bootstrap(values, "mean", clusters.tolist())
    ratio = (clustered.high - clustered.low) / (unclustered.high - unclustered.low)
    assert ratio == pytest.approx(np.sqrt(30), rel=0.2)


@pytest.mark.parametrize(("statistic", "compute"), [("median", np.median), ("mean", np.mean)])
def test_intervals_of_clusters_agree_with_a_plain_loop(statistic, compute) -> None:
    rng = np.random.default_rng(4)
    values = rng.gamma(2.0, size=200)
    clusters = rng.integers(0, 25, 200)
    interval = bootstrap(values, statistic, clusters.tolist())
    parts = [values[clusters == k] for k in range(25)]
    resampled_values = []
    for _ in range(4000):
        sample = np.concatenate([parts[k] for k in rng.integers(0, 25, 25)])
        resampled_values.append(compute(sample))
    expected_limits = np.quantile(resampled_values, [0.025, 0.975])
    assert interval.estimate == compute(values)
    assert [interval.low, interval.high] == pytest.approx(expected_limits, rel=0.02)


@given(st.lists(numbers, min_size=2, max_size=30))
@settings(max_examples=count_examples(20))
def test_intervals_are_within_the_sample(values: list[float]) -> None:
    interval = bootstrap(values, resamples=200)
    assert min(values) <= interval.low <= interval.high <= max(values)


@given(st.lists(numbers, min_size=2, max_size=30))
@settings(max_examples=count_examples(20))
def test_intervals_are_reproducible(values: list[float]) -> None:
    assert bootstrap(values, resamples=200) == bootstrap(values, resamples=200)


def test_a_t_interval_of_four_values_has_its_coverage() -> None:
    rng = np.random.default_rng(5)
    intervals = [estimate_mean(rng.normal(size=4)) for _ in range(1000)]
    coverage = np.mean([interval.low <= 0.0 <= interval.high for interval in intervals])
    assert 0.93 <= coverage <= 0.97


def test_equal_values_have_no_t_interval() -> None:
    assert np.isnan(estimate_mean([1.0, 1.0, 1.0]).low)


@pytest.mark.parametrize(
    "interval",
    [
        pytest.param(bootstrap([1.0, 2.0], clusters=["a", "a"]), id="one cluster of values"),
        pytest.param(bootstrap_statistic(len, ["a", "a"]), id="one cluster of rows"),
        pytest.param(bootstrap([1.5]), id="one value"),
    ],
)
def test_a_single_cluster_or_value_has_no_interval(interval: Interval) -> None:
    assert np.isnan(interval.low)
    assert np.isnan(interval.high)


@pytest.mark.filterwarnings("ignore:The BCa confidence interval")
def test_resamples_without_a_value_are_ignored() -> None:
    interval = bootstrap_statistic(lambda rows: float(rows[0]) if rows[0] else float("nan"), ["a", "b", "c"])
    assert (interval.low, interval.high) == (1.0, 2.0)


def test_coefficient_of_variation() -> None:
    assert compute_coefficient_of_variation([1.0, 3.0]) == pytest.approx(np.sqrt(2.0) / 2.0)
    assert compute_coefficient_of_variation([2.0, 2.0, 2.0]) == 0.0


@given(st.data(), st.integers(1, 200), st.integers(1, 3), st.sampled_from([0.2, 0.5, 0.9]))
def test_a_fraction_has_the_exact_interval_of_its_clusters(
    data: st.DataObject, n_maps: int, runs_per_map: int, bound: float
) -> None:
    """All runs of a map have the same value, so that maps are single trials."""
    n_successes = data.draw(st.integers(0, n_maps))
    maps = np.repeat(np.arange(n_maps), runs_per_map)
    interval = estimate_fraction((maps < n_successes).tolist(), maps.tolist())
    # If the fraction is 0 or 1, the interval is one side of a two-sided one with twice the error.
    level = 0.95 if 0 < n_successes < n_maps else 0.9
    exact = binomtest(n_successes, n_maps).proportion_ci(level, "exact")
    assert interval.estimate == pytest.approx(n_successes / n_maps)
    assert (interval.low, interval.high) == pytest.approx((exact.low, exact.high))
    for side, limits in (("greater", (bound, np.inf)), ("less", (-np.inf, bound))):
        expected = binomtest(n_successes, n_maps, bound, side).pvalue
        assert interval.compute_p_value(*limits) == pytest.approx(expected, abs=1e-9)


@given(st.lists(st.integers(1, 20), max_size=12), st.lists(st.integers(1, 20), max_size=12))
def test_the_median_time_is_that_of_the_product_limit(ended: list[int], censored: list[int]) -> None:
    if not ended + censored:
        return
    survival = Fraction(1)
    expected = np.inf
    for time in sorted(set(ended)):
        at_risk = sum(other >= time for other in ended + censored)
        survival *= 1 - Fraction(ended.count(time), at_risk)
        if survival <= Fraction(1, 2):
            expected = time
            break
    median = estimate_median_time(ended, censored)
    # In floats, rounding may miss exactly a half.
    assert median == expected or abs(float(survival) - 0.5) < 1e-9


def test_p_values_are_adjusted_by_the_method_of_holm() -> None:
    # The products are 4 * 0.005, 3 * 0.01, 2 * 0.03 and 0.04, the last of which may not be lower than 0.06.
    adjusted = adjust_p_values({"a": 0.01, "b": 0.04, "c": 0.03, "d": 0.005})
    assert adjusted == pytest.approx({"a": 0.03, "b": 0.06, "c": 0.06, "d": 0.02})


def test_adjusted_p_values_are_at_most_1() -> None:
    assert adjust_p_values({"a": 0.6, "b": 0.5}) == {"a": 1.0, "b": 1.0}


def test_no_p_values_can_be_adjusted() -> None:
    assert adjust_p_values({}) == {}


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
def test_adjusted_p_values_have_the_same_order_and_are_never_lower(p: list[float]) -> None:
    by_name = adjust_p_values({str(k): value for k, value in enumerate(p)})
    adjusted = [by_name[str(k)] for k in range(len(p))]
    assert all(raw <= value <= 1.0 for raw, value in zip(p, adjusted, strict=True))
    assert min(adjusted) == pytest.approx(min(1.0, min(p) * len(p)))
    in_order = [value for _, value in sorted(zip(p, adjusted, strict=True))]
    assert in_order == sorted(adjusted)


def test_a_p_value_is_the_fraction_of_resamples_outside_the_bounds() -> None:
    """The sample itself counts as one more resample, so that no p-value is 0."""
    interval = bootstrap([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "mean", resamples=999)
    resampled_values = interval.resampled_values
    assert resampled_values is not None
    assert len(resampled_values) == 999
    n_above = (resampled_values > 4.0).sum()
    n_below = (resampled_values < 3.0).sum()
    assert interval.compute_p_value(-np.inf, 4.0) == (1 + n_above) / 1000
    assert interval.compute_p_value(3.0, 4.0) == (1 + n_above + n_below) / 1000
    assert interval.compute_p_value(0.0, 9.0) == 0.001


def test_without_resamples_the_p_value_is_1() -> None:
    assert bootstrap([1.5]).compute_p_value(0.0, 9.0) == 1.0
