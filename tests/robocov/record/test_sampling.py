"""Times at which a record is sampled."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.errors import ParameterError
from robocov.record import select_nearest_steps

UNIFORM_INTERVALS = st.builds(lambda dt, count: [dt] * count, st.floats(1e-3, 0.5), st.integers(0, 300))
IRREGULAR_INTERVALS = st.lists(st.floats(1e-3, 0.5), max_size=100)


@given(UNIFORM_INTERVALS | IRREGULAR_INTERVALS, st.floats(0.0, 60.0), st.sampled_from([0.0, 12.5]))
def test_the_step_nearest_to_each_multiple_is_selected(intervals, rate, start) -> None:
    """Each multiple selects its nearest step; it is not each step that selects its nearest multiple."""
    time = start + np.cumsum([0.0, *intervals])
    selected = select_nearest_steps(time, rate)
    assert selected[0] == 0
    assert selected[-1] == len(time) - 1
    assert (np.diff(selected) > 0).all()
    if min(intervals, default=np.inf) * rate >= 1.0 + 1e-9:
        assert len(selected) == len(time)
    multiple_count = int((time[-1] - start) * rate + 1e-9) + 1
    multiples = start + np.arange(multiple_count) / max(rate, 1e-9)
    distances = np.abs(time[:, None] - multiples)
    expected = pytest.approx(distances.min(axis=0), abs=1e-6 / max(rate, 1e-3))
    assert distances[selected].min(axis=0) == expected
    # No other steps are selected, except the first and the last.
    assert len(selected) <= multiple_count + 1


def test_a_record_that_was_thinned_before_is_thinned_correctly() -> None:
    """The intervals of its steps differ, and its last step may be close to the one before."""
    time = np.arange(1811) / 60.0
    time = time[select_nearest_steps(time, 7.0)]
    assert np.diff(time)[-1] < 0.1 < np.diff(time)[:-1].min()
    assert len(select_nearest_steps(time, 10.0)) == len(time)


@pytest.mark.parametrize("rate", [-1.0, np.nan, np.inf, "fast", None])
def test_rates_that_are_negative_or_not_finite_are_rejected(rate: object) -> None:
    with pytest.raises(ParameterError, match="rate: expected a finite number of at least 0 Hz, got"):
        select_nearest_steps(np.arange(3.0), rate)  # type: ignore[arg-type]


def test_of_two_equally_near_steps_the_earlier_is_selected() -> None:
    time = np.arange(26) * 0.04  # 0.1 s lies between 0.08 and 0.12 s
    assert select_nearest_steps(time, 10.0).tolist() == [0, 2, 5, 7, 10, 12, 15, 17, 20, 22, 25]
    # however the sums of steps are rounded
    long = np.arange(199) * (1 / 30)
    assert select_nearest_steps(long, 20.0).tolist() == [3 * k // 2 for k in range(133)]
