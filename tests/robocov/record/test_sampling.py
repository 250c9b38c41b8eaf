"""Times at which a record is sampled."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.errors import ParameterError
from robocov.record import select_nearest_steps


@given(st.integers(1, 300), st.floats(1e-3, 0.5), st.floats(0.0, 60.0), st.sampled_from([0.0, 12.5]))
def test_the_nearest_to_every_multiple_stays(count, dt, rate, begin) -> None:
    """Each multiple selects its nearest step; it is not each step that selects its nearest multiple."""
    time = begin + np.arange(count) * dt
    kept = select_nearest_steps(time, rate)
    assert kept[0] == 0 and kept[-1] == count - 1
    assert (np.diff(kept) > 0).all()
    if dt * rate >= 1.0:
        assert len(kept) == count
    multiples = begin + np.arange(np.floor((count - 1) * dt * rate + 1e-9) + 1) / max(rate, 1e-9)
    away = np.abs(time[:, None] - multiples[None])
    assert np.abs(time[kept][:, None] - multiples[None]).min(axis=0) == pytest.approx(
        away.min(axis=0), abs=1e-6 / max(rate, 1e-3)
    )
    # and no more than those
    assert len(kept) <= len(multiples) + 1


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
