"""Cost curves: samples at ascending times, bounded, and interpolated."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov_app.viewer.session.past import curves as module
from robocov_app.viewer.session.past.curves import MAX_CURVE_SAMPLES, Curve


def build_curve(*samples: tuple[float, float]) -> Curve:
    curve = Curve()
    for time, value in samples:
        curve.add(time, value)
    return curve


def test_samples_are_returned_in_order():
    curve = build_curve((0.0, 3.0), (0.5, 2.0), (1.0, 1.5))
    assert len(curve) == 3
    assert curve.times.tolist() == [0.0, 0.5, 1.0]
    assert curve.values.tolist() == [3.0, 2.0, 1.5]
    assert curve.last_time == 1.0


def test_a_curve_may_be_empty():
    curve = Curve()
    assert len(curve) == 0
    assert curve.last_time == -math.inf
    assert math.isnan(curve.interpolate(1.0))
    assert curve.times.shape == curve.values.shape == (0,)
    assert len(curve.extract(0.0, 1.0)) == 0


def test_a_sample_can_be_inserted():
    """The cost of an earlier step is computed when users display it."""
    curve = build_curve((0.0, 3.0), (1.0, 2.0), (0.5, 2.6))
    assert curve.times.tolist() == [0.0, 0.5, 1.0]
    assert curve.interpolate(0.5) == 2.6


def test_a_sample_replaces_one_of_the_same_time():
    """While the run is paused, robots that are dragged have another cost at the same time."""
    curve = build_curve((0.0, 3.0), (1.0, 2.0), (1.0, 1.8), (1.0 + 1e-12, 1.7))
    assert curve.times.tolist() == [0.0, 1.0]
    assert curve.interpolate(1.0) == 1.7


@pytest.mark.parametrize(("time", "value"), [(1.0, math.nan), (1.0, math.inf), (math.nan, 1.0)])
def test_samples_that_are_not_finite_are_ignored(time, value):
    curve = build_curve((0.0, 3.0), (time, value))
    assert len(curve) == 1
    assert curve.last_time == 0.0


def test_values_are_interpolated_linearly():
    curve = build_curve((1.0, 3.0), (2.0, 1.0))
    assert curve.interpolate(1.5) == 2.0
    assert curve.interpolate(1.0) == 3.0
    assert curve.interpolate(99.0) == 1.0
    assert math.isnan(curve.interpolate(0.5))


def test_samples_of_a_long_run_are_spread_evenly_over_its_time():
    curve = build_curve(*((float(k), float(-k)) for k in range(10 * MAX_CURVE_SAMPLES)))
    assert MAX_CURVE_SAMPLES // 3 < len(curve) <= MAX_CURVE_SAMPLES
    assert curve.times[0] == 0.0
    assert curve.last_time == 10 * MAX_CURVE_SAMPLES - 1
    assert np.diff(curve.times).max() < 0.005 * curve.last_time


def test_gaps_are_listed_from_the_longest_to_the_shortest():
    curve = build_curve((0.0, 3.0), (1.0, 2.0), (1.2, 2.0), (4.0, 1.0))
    assert curve.list_gaps(0.5) == [(1.2, 4.0), (0.0, 1.0)]
    assert build_curve().list_gaps(0.5) == []


@given(st.lists(st.floats(-1.0, 3.0), max_size=200), st.integers(4, 40))
@settings(max_examples=count_examples(150))
def test_times_ascend_and_samples_are_bounded(intervals, max_samples):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MAX_CURVE_SAMPLES", max_samples)
        curve = Curve()
        time = 0.0
        for interval in intervals:
            time += interval
            curve.add(time, time)
            assert len(curve) <= max_samples
        assert (np.diff(curve.times) > 0).all()
        # Samples that are closer than this replace each other.
        assert curve.values == pytest.approx(curve.times, abs=2e-9)


@given(st.integers(0, 100), st.integers(1, 40))
def test_samples_for_a_file_are_few_and_end_with_the_newest(count, maximum):
    curve = build_curve(*((0.1 * k, 1.0 / (k + 1)) for k in range(count)))
    times, values = curve.sample(maximum)
    assert len(times) == len(values) <= maximum
    if count:
        assert times[-1] == pytest.approx(curve.last_time, abs=1e-3)
