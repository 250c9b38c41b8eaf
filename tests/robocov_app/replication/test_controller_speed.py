"""Timing of the controllers in the replication of the paper."""

import json
from dataclasses import replace
from itertools import count

import numpy as np
import pytest

from robocov_app.replication.design.plan import QUICK
from robocov_app.replication.results import controller_speed
from robocov_app.replication.results.controller_speed import (
    STEP_TIMES_FILE,
    StepTimes,
    measure_step_times,
)


@pytest.fixture(autouse=True)
def short_blocks(monkeypatch):
    monkeypatch.setattr(controller_speed, "STEPS_PER_BLOCK", 2)


def measure(folder, controllers_by_size=None, *, blocks=3, **options):
    """Measure the step times of RPF and Lloyd's algorithm with three robots by default."""
    plan = replace(QUICK, beyond=replace(QUICK.beyond, warm_up=1, blocks=blocks))
    return measure_step_times(folder, controllers_by_size or {3: ("rpf", "lloyd")}, plan, **options)


class ClockReadError(Exception):
    """The clock was read, so steps are measured."""


def raise_clock_error() -> float:
    raise ClockReadError


def test_rapf_is_timed_with_the_other_controllers(tmp_path):
    ticks = count()
    times = measure(tmp_path, clock=lambda: float(next(ticks)))
    assert list(times) == [3]
    # Each block of two steps lasts one tick of this clock.
    assert times[3].seconds == dict.fromkeys(("rapf", "rpf", "lloyd"), (0.5, 0.5, 0.5))
    assert times[3].compute_ratio("rpf").estimate == 1.0


def test_stored_times_are_reused(tmp_path):
    first = measure(tmp_path)
    assert measure(tmp_path, clock=raise_clock_error)[3].seconds == first[3].seconds


def test_other_controllers_are_measured_again(tmp_path):
    measure(tmp_path)
    with pytest.raises(ClockReadError):
        measure(tmp_path, {3: ("rpf",)}, clock=raise_clock_error)


def test_other_numbers_of_blocks_are_measured_again(tmp_path):
    measure(tmp_path)
    with pytest.raises(ClockReadError):
        measure(tmp_path, blocks=4, clock=raise_clock_error)


@pytest.mark.parametrize("content", ["", "[]", '{"format": "robocov-steps", "robots": {"3": {}}}', "{"])
def test_an_unreadable_file_is_replaced(tmp_path, content):
    (tmp_path / STEP_TIMES_FILE).write_text(content)
    times = measure(tmp_path)
    stored = json.loads((tmp_path / STEP_TIMES_FILE).read_text())
    assert stored["robots"]["3"]["seconds_per_step"]["rpf"] == list(times[3].seconds["rpf"])


def test_interrupted_measurements_are_resumed_after_the_last_complete_one(tmp_path):
    controllers_by_size = {3: ("rpf",), 4: ("rpf",)}
    checks = count()
    times = measure(tmp_path, controllers_by_size, is_stopped=lambda: next(checks) > 6)
    assert list(times) == [3]
    assert list(measure(tmp_path, controllers_by_size)) == [3, 4]


def test_ratios_are_medians_of_blocks_timed_together():
    times = StepTimes(6, 0.02, {"rapf": (1.0, 2.0, 4.0), "mine": (3.0, 4.0, 20.0)})
    interval = times.compute_ratio("mine")
    assert (interval.low, interval.estimate, interval.high) == (2.0, 3.0, 5.0)
    assert times.compute_real_time_factor("mine").estimate == 200.0
    assert np.isnan(times.compute_ratio("other").estimate)
