from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binomtest

from robocov_app.figures.statistics import (
    adjust_p_values,
    bootstrap,
    bootstrap_statistic,
    compute_coefficient_of_variation,
    estimate_fraction,
    estimate_mean,
    estimate_median_time,
)

numbers = st.floats(-1e6, 1e6, allow_nan=False)


def test_the_interval_of_a_mean_is_about_the_classical_one() -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(3.0, 2.0, 400)
    interval = bootstrap(values, "mean")
    half = 1.96 * values.std(ddof=1) / np.sqrt(400)
    assert interval.estimate == pytest.approx(values.mean())
    assert interval.low == pytest.approx(values.mean() - half, abs=0.1 * half)
    assert interval.high == pytest.approx(values.mean() + half, abs=0.1 * half)


def test_values_of_one_cluster_stay_together() -> None:
    rng = np.random.default_rng(3)
    levels = rng.normal(size=20)
    clusters = np.repeat(np.arange(20), 30)
    values = levels[clusters] + 0.01 * rng.normal(size=600)
    unclustered = bootstrap(values, "mean")
    clustered = bootstrap(values, "mean", clusters.tolist())
    ratio = (clustered.high - clustered.low) / (unclustered.high - unclustered.low)
    # Thirty equal runs on a map are no more evidence than one, so that the interval is that of 20 values.
    assert ratio == pytest.approx(np.sqrt(30), rel=0.2)


@pytest.mark.parametrize(("statistic", "compute"), [("median", np.median), ("mean", np.mean)])
def test_resampled_clusters_agree_with_a_plain_loop(statistic, compute) -> None:
    rng = np.random.default_rng(4)
    values = rng.gamma(2.0, size=200)
    clusters = rng.integers(0, 25, 200)
    interval = bootstrap(values, statistic, clusters.tolist())
    parts = [values[clusters == k] for k in range(25)]
    resampled_values = [
        compute(np.concatenate([parts[k] for k in rng.integers(0, 25, 25)])) for _ in range(4000)
    ]
    assert interval.estimate == compute(values)
    assert [interval.low, interval.high] == pytest.approx(
        np.quantile(resampled_values, [0.025, 0.975]), rel=0.02
    )


@given(st.lists(numbers, min_size=2, max_size=30))
@settings(max_examples=20)
def test_intervals_are_within_the_sample_and_reproducible(values: list[float]) -> None:
    interval = bootstrap(values, resamples=200)
    assert min(values) <= interval.low <= interval.high <= max(values)
    assert interval == bootstrap(values, resamples=200)


def test_a_t_interval_of_four_values_has_its_coverage() -> None:
    rng = np.random.default_rng(5)
    intervals = [estimate_mean(rng.normal(size=4)) for _ in range(1000)]
    assert 0.93 <= np.mean([interval.low <= 0.0 <= interval.high for interval in intervals]) <= 0.97
    assert np.isnan(estimate_mean([1.0, 1.0, 1.0]).low)


def test_one_cluster_has_no_interval() -> None:
    for interval in (
        bootstrap([1.0, 2.0], clusters=["a", "a"]),
        bootstrap_statistic(len, ["a", "a"]),
        bootstrap([1.5]),
    ):
        assert np.isnan(interval.low)
        assert np.isnan(interval.high)


@pytest.mark.filterwarnings("ignore:The BCa confidence interval")
def test_resamples_without_a_value_do_not_count() -> None:
    interval = bootstrap_statistic(lambda rows: float(rows[0]) if rows[0] else float("nan"), ["a", "b", "c"])
    assert (interval.low, interval.high) == (1.0, 2.0)


def test_coefficient_of_variation() -> None:
    assert compute_coefficient_of_variation([1.0, 3.0]) == pytest.approx(np.sqrt(2.0) / 2.0)
    assert compute_coefficient_of_variation([2.0, 2.0, 2.0]) == 0.0


@given(st.data(), st.integers(1, 200), st.integers(1, 3), st.sampled_from([0.2, 0.5, 0.9]))
def test_a_fraction_has_the_exact_interval_of_its_clusters(
    data: st.DataObject, maps: int, runs: int, bound: float
) -> None:
    """All runs of a map have the same value, so that maps are single trials."""
    count = data.draw(st.integers(0, maps))
    interval = estimate_fraction(
        [k // runs < count for k in range(maps * runs)], [k // runs for k in range(maps * runs)]
    )
    # If the fraction is 0 or 1, the interval is one side of a two-sided one with twice the error.
    level = 0.95 if 0 < count < maps else 0.9
    exact = binomtest(count, maps).proportion_ci(level, "exact")
    assert (interval.estimate, interval.low, interval.high) == pytest.approx(
        (count / maps, exact.low, exact.high)
    )
    for side, limits in (("greater", (bound, np.inf)), ("less", (-np.inf, bound))):
        assert interval.compute_p_value(*limits) == pytest.approx(
            binomtest(count, maps, bound, side).pvalue, abs=1e-9
        )


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
    assert adjust_p_values({"a": 0.6, "b": 0.5}) == {"a": 1.0, "b": 1.0}
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
    values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    interval = bootstrap(values, "mean", resamples=999)
    resampled_values = interval.resampled_values
    assert resampled_values is not None
    assert len(resampled_values) == 999
    assert interval.compute_p_value(-np.inf, 4.0) == (1 + (resampled_values > 4.0).sum()) / 1000
    assert (
        interval.compute_p_value(3.0, 4.0)
        == (1 + (resampled_values > 4.0).sum() + (resampled_values < 3.0).sum()) / 1000
    )
    assert interval.compute_p_value(0.0, 9.0) == 0.001
    assert bootstrap([1.5]).compute_p_value(0.0, 9.0) == 1.0
