"""Limits and ticks of axes in windows, figures and replays."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from robocov_app.look.axes import (
    MAX_LOW_FRACTION,
    MIN_TIME_LIMIT_S,
    Axis,
    choose_growing_time_limit,
    choose_growing_value_axis,
    choose_tick_step,
    choose_value_limits,
    list_ticks,
    round_down,
)


@pytest.mark.parametrize(
    ("values", "origin", "start"),
    [
        ((1.0, 9.0), 0.0, 0.0),
        ((8.0, 9.0), 0.0, 7.94),
        ((2.0, 2.0), 0.0, 1.8),
        ((-0.1, 0.9), 0.0, -0.16),
        ((1.01, 1.2), 1.0, 1.0),
        ((0.98, 1.2), 1.0, 0.9668),
        ((3.0, 4.0), 1.0, 2.94),
    ],
)
def test_axis_starts_at_its_origin_if_values_come_near_it(values, origin, start) -> None:
    low, high = choose_value_limits(*values, margin=0.06, origin=origin)
    assert low == pytest.approx(start)
    assert low < values[0] + 1e-9
    assert high > values[1]


@given(st.floats(1e-3, 1e3), st.floats(0.0, 1e3))
def test_window_and_figures_start_at_zero_for_the_same_values(low: float, difference: float) -> None:
    high = low + difference
    starts_at_zero = low < MAX_LOW_FRACTION * high
    assert (choose_value_limits(low, high)[0] == 0.0) == starts_at_zero
    if starts_at_zero:
        assert choose_growing_value_axis(low, high, 5).start == 0.0


@example(low=10.71875, difference=6.103515625e-05, max_intervals=1.0)
@given(st.floats(1e-3, 1e3), st.floats(0.0, 1e3), st.floats(1.0, 8.0))
def test_growing_axis_contains_all_values(low: float, difference: float, max_intervals: float) -> None:
    axis = choose_growing_value_axis(low, low + difference, max_intervals)
    assert 0.0 <= axis.start <= low
    assert axis.end >= low + difference
    # The start is rounded down to a tick, which may add an interval.
    assert (axis.end - axis.start) / axis.step <= max_intervals + 1.01
    assert axis.ticks[0] == pytest.approx(axis.start)


def test_first_small_changes_do_not_fill_a_growing_axis() -> None:
    axis = choose_growing_value_axis(6.35, 6.44, 4)
    assert axis.end - axis.start > 10 * (6.44 - 6.35)
    assert axis.start == choose_growing_value_axis(6.3, 6.44, 4).start


@pytest.mark.parametrize("value", [float("nan"), 0.0])
def test_axis_without_values_is_from_zero_to_one(value: float) -> None:
    assert choose_growing_value_axis(value, value, 4) == Axis(0.0, 1.0, 0.5)


@given(st.floats(0.0, 1e5))
def test_growing_time_axis_ends_after_the_present_but_not_much(end: float) -> None:
    limit = choose_growing_time_limit(end)
    assert end < limit <= max(10.0, 2.0 * end)
    assert limit >= MIN_TIME_LIMIT_S


@given(st.floats(1e-6, 1e6), st.floats(1.0, 20.0))
def test_tick_step_gives_few_intervals(span: float, max_intervals: float) -> None:
    step = choose_tick_step(span, max_intervals)
    assert span / step <= max_intervals * 1.002


@given(st.floats(1e-6, 1e6), st.floats(1.0, 20.0))
def test_ticks_are_equidistant_up_to_the_end(span: float, max_intervals: float) -> None:
    step = choose_tick_step(span, max_intervals)
    ticks = list_ticks(0.0, span, step)
    assert len(ticks) == int(span / step + 1e-9) + 1
    assert np.allclose(np.diff(ticks), step)


def test_numbers_are_rounded_down_to_1_2_or_5_times_a_power_of_ten() -> None:
    assert [round_down(number) for number in (0.7, 1.0, 3.9, 49.0)] == [0.5, 1.0, 2.0, 20.0]
