from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binomtest

from robocov_app.figures.statistics import (
    bootstrap,
    bootstrap_by,
    holm,
    mean_with_t_interval,
    median_time,
    share,
    spread,
)

numbers = st.floats(-1e6, 1e6, allow_nan=False)


def test_the_interval_of_a_mean_is_about_the_classical_one() -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(3.0, 2.0, 400)
    found = bootstrap(values, "mean")
    half = 1.96 * values.std(ddof=1) / np.sqrt(400)
    assert found.estimate == pytest.approx(values.mean())
    assert found.low == pytest.approx(values.mean() - half, abs=0.1 * half)
    assert found.high == pytest.approx(values.mean() + half, abs=0.1 * half)


def test_values_of_one_cluster_stay_together() -> None:
    rng = np.random.default_rng(3)
    levels = rng.normal(size=20)
    clusters = np.repeat(np.arange(20), 30)
    values = levels[clusters] + 0.01 * rng.normal(size=600)
    alone, together = bootstrap(values, "mean"), bootstrap(values, "mean", clusters.tolist())
    narrow, wide = alone.high - alone.low, together.high - together.low
    # thirty runs on a map say no more than one: the interval is that of twenty values
    assert wide / narrow == pytest.approx(np.sqrt(30), rel=0.2)


@pytest.mark.parametrize(("statistic", "of"), [("median", np.median), ("mean", np.mean)])
def test_drawing_clusters_agrees_with_doing_it_by_hand(statistic, of) -> None:
    rng = np.random.default_rng(4)
    values = rng.gamma(2.0, size=200)
    clusters = rng.integers(0, 25, 200)
    found = bootstrap(values, statistic, clusters.tolist())
    parts = [values[clusters == k] for k in range(25)]
    drawn = [of(np.concatenate([parts[k] for k in rng.integers(0, 25, 25)])) for _ in range(4000)]
    assert found.estimate == of(values)
    assert [found.low, found.high] == pytest.approx(np.quantile(drawn, [0.025, 0.975]), rel=0.02)


@given(st.lists(numbers, min_size=2, max_size=30))
@settings(max_examples=20)
def test_intervals_lie_within_the_sample_and_do_not_depend_on_chance(values: list[float]) -> None:
    found = bootstrap(values, resamples=200)
    assert min(values) <= found.low <= found.high <= max(values)
    assert found == bootstrap(values, resamples=200)


def test_a_t_interval_of_four_values_holds_the_truth_as_often_as_it_says() -> None:
    rng = np.random.default_rng(5)
    found = [mean_with_t_interval(rng.normal(size=4)) for _ in range(1000)]
    assert 0.93 <= np.mean([each.low <= 0.0 <= each.high for each in found]) <= 0.97
    assert np.isnan(mean_with_t_interval([1.0, 1.0, 1.0]).low)  # three times the same is one value


def test_one_cluster_has_no_interval() -> None:
    for found in (
        bootstrap([1.0, 2.0], clusters=["a", "a"]),
        bootstrap_by(len, ["a", "a"]),
        bootstrap([1.5]),
    ):
        assert np.isnan(found.low)
        assert np.isnan(found.high)


@pytest.mark.filterwarnings("ignore:The BCa confidence interval")
def test_resamples_without_a_value_do_not_count() -> None:
    found = bootstrap_by(lambda rows: float(rows[0]) if rows[0] else float("nan"), ["a", "b", "c"])
    assert (found.low, found.high) == (1.0, 2.0)


def test_spread() -> None:
    assert spread([1.0, 3.0]) == pytest.approx(np.sqrt(2.0) / 2.0)
    assert spread([2.0, 2.0, 2.0]) == 0.0


@given(st.data(), st.integers(1, 200), st.integers(1, 3), st.sampled_from([0.2, 0.5, 0.9]))
def test_a_share_is_exact_by_clusters(data: st.DataObject, maps: int, runs: int, bound: float) -> None:
    """As many runs of each map have the same value as there are, so that maps are single trials."""
    count = data.draw(st.integers(0, maps))
    found = share([k // runs < count for k in range(maps * runs)], [k // runs for k in range(maps * runs)])
    level = 0.95 if 0 < count < maps else 0.9  # one of its two sides, where the other one is no bound
    exact = binomtest(count, maps).proportion_ci(level, "exact")
    assert (found.estimate, found.low, found.high) == pytest.approx((count / maps, exact.low, exact.high))
    for side, limits in (("greater", (bound, np.inf)), ("less", (-np.inf, bound))):
        assert found.p_value(*limits) == pytest.approx(binomtest(count, maps, bound, side).pvalue, abs=1e-9)


@given(st.lists(st.integers(1, 20), max_size=12), st.lists(st.integers(1, 20), max_size=12))
def test_the_median_of_times_is_the_product_limit(ended: list[int], censored: list[int]) -> None:
    if not ended + censored:
        return
    left, wanted = Fraction(1), np.inf
    for time in sorted(set(ended)):
        at_risk = sum(each >= time for each in ended + censored)
        left *= 1 - Fraction(ended.count(time), at_risk)
        if left <= Fraction(1, 2):
            wanted = time
            break
    found = median_time(ended, censored)
    assert found == wanted or abs(float(left) - 0.5) < 1e-9  # in floats a half may be missed by rounding


def test_p_values_are_adjusted_as_holm_did_by_hand() -> None:
    # 4 * 0.005, 3 * 0.01, then 2 * 0.03 and 0.04, which may not be below the one before
    found = holm({"a": 0.01, "b": 0.04, "c": 0.03, "d": 0.005})
    assert found == pytest.approx({"a": 0.03, "b": 0.06, "c": 0.06, "d": 0.02})
    assert holm({"a": 0.6, "b": 0.5}) == {"a": 1.0, "b": 1.0}
    assert holm({}) == {}


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
def test_adjusted_p_values_keep_their_order_and_are_never_lower(p: list[float]) -> None:
    found = holm({str(k): each for k, each in enumerate(p)})
    adjusted = [found[str(k)] for k in range(len(p))]
    assert all(one <= other <= 1.0 for one, other in zip(p, adjusted, strict=True))
    assert min(adjusted) == pytest.approx(min(1.0, min(p) * len(p)))
    in_order = [value for _, value in sorted(zip(p, adjusted, strict=True))]
    assert in_order == sorted(adjusted)


def test_a_p_value_is_the_share_of_resamples_beyond_the_bounds() -> None:
    values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    found = bootstrap(values, "mean", resamples=999)
    drawn = found.resampled
    assert drawn is not None and len(drawn) == 999
    assert found.p_value(-np.inf, 4.0) == (1 + (drawn > 4.0).sum()) / 1000
    assert found.p_value(3.0, 4.0) == (1 + (drawn > 4.0).sum() + (drawn < 3.0).sum()) / 1000
    assert found.p_value(0.0, 9.0) == 0.001
    assert bootstrap([1.5]).p_value(0.0, 9.0) == 1.0
