from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov_app.viewer.session import curves as module
from robocov_app.viewer.session.curves import MAX_CURVE_SAMPLES, Curve, GhostCurve, SessionEvent


def drawn(*samples: tuple[float, float]) -> Curve:
    curve = Curve()
    for time, value in samples:
        curve.add(time, value)
    return curve


def test_samples_come_back():
    curve = drawn((0.0, 3.0), (0.5, 2.0), (1.0, 1.5))
    assert len(curve) == 3
    assert curve.times.tolist() == [0.0, 0.5, 1.0]
    assert curve.values.tolist() == [3.0, 2.0, 1.5]
    assert curve.last_time == 1.0


def test_an_empty_curve():
    curve = Curve()
    assert len(curve) == 0
    assert curve.last_time == -math.inf
    assert math.isnan(curve.interpolate(1.0))
    assert curve.times.shape == curve.values.shape == (0,)
    assert len(curve.extract(0.0, 1.0)) == 0


def test_what_comes_late_finds_its_place():
    """Whoever looks back asks for the cost of a moment that was passed over."""
    curve = drawn((0.0, 3.0), (1.0, 2.0), (0.5, 2.6))
    assert curve.times.tolist() == [0.0, 0.5, 1.0] and curve.interpolate(0.5) == 2.6


def test_the_newest_of_one_time_counts():
    """While the run is paused, robots that are dragged have another cost at the same time."""
    curve = drawn((0.0, 3.0), (1.0, 2.0), (1.0, 1.8), (1.0 + 1e-12, 1.7))
    assert curve.times.tolist() == [0.0, 1.0]
    assert curve.interpolate(1.0) == 1.7


@pytest.mark.parametrize(("time", "value"), [(1.0, math.nan), (1.0, math.inf), (math.nan, 1.0)])
def test_what_is_no_number_is_left_out(time, value):
    curve = drawn((0.0, 3.0), (time, value))
    assert len(curve) == 1
    assert curve.last_time == 0.0


def test_between_samples_it_is_straight():
    curve = drawn((1.0, 3.0), (2.0, 1.0))
    assert curve.interpolate(1.5) == 2.0
    assert curve.interpolate(1.0) == 3.0
    assert curve.interpolate(99.0) == 1.0
    assert math.isnan(curve.interpolate(0.5))


def test_of_the_older_half_every_second_sample_goes():
    curve = drawn(*((float(k), float(-k)) for k in range(MAX_CURVE_SAMPLES + 1)))
    assert len(curve) == MAX_CURVE_SAMPLES - MAX_CURVE_SAMPLES // 4 + 1
    assert curve.times[:3].tolist() == [0.0, 2.0, 4.0]
    assert (np.diff(curve.times[MAX_CURVE_SAMPLES // 4 :]) == 1.0).all()


@given(st.lists(st.floats(-1.0, 3.0), max_size=200), st.integers(4, 40))
@settings(max_examples=150)
def test_whatever_is_added_it_ascends_and_is_bounded(steps, most):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MAX_CURVE_SAMPLES", most)
        curve, time = Curve(), 0.0
        for step in steps:
            time += step
            curve.add(time, time)
            assert len(curve) <= most
        assert (np.diff(curve.times) > 0).all()
        assert curve.values == pytest.approx(curve.times, abs=2e-9)  # as close as samples that are one


def test_events_and_ghosts_say_what_they_are():
    assert SessionEvent(1.0, "law", "Lloyd takes over") == SessionEvent(1.0, "law", "Lloyd takes over")
    ghost = GhostCurve("rapf", "RAPF", np.zeros(2), np.ones(2))
    assert (ghost.controller, ghost.description, len(ghost.times)) == ("rapf", "RAPF", 2)
