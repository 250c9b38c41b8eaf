import json
from dataclasses import replace
from itertools import count

import numpy as np
import pytest

from robocov_app.replication.design.plan import QUICK
from robocov_app.replication.results import controller_speed as steps
from robocov_app.replication.results.controller_speed import StepTimes, measure_step_times


@pytest.fixture(autouse=True)
def short_blocks(monkeypatch):
    monkeypatch.setattr(steps, "STEPS_PER_BLOCK", 2)


def measure(folder, sizes=None, **other):
    plan = replace(QUICK, beyond=replace(QUICK.beyond, warm_up=1, blocks=other.pop("blocks", 3)))
    return measure_step_times(folder, sizes or {3: ("rpf", "lloyd")}, plan, **other)


def test_controllers_are_timed_in_turn_with_rapf(tmp_path):
    ticks = count()
    found = measure(tmp_path, clock=lambda: float(next(ticks)))
    assert list(found) == [3]
    # every block lasts one tick of that clock
    assert found[3].seconds == dict.fromkeys(("rapf", "rpf", "lloyd"), (0.5, 0.5, 0.5))
    assert found[3].compute_ratio("rpf").estimate == 1.0


def test_stored_times_are_not_measured_again_but_those_of_other_gains_are(tmp_path, monkeypatch):
    first = measure(tmp_path)

    def fail() -> float:
        raise AssertionError

    assert measure(tmp_path, clock=fail)[3].seconds == first[3].seconds
    with pytest.raises(AssertionError):
        measure(tmp_path, {3: ("rpf",)}, clock=fail)
    with pytest.raises(AssertionError):
        measure(tmp_path, blocks=4, clock=fail)


@pytest.mark.parametrize("content", ["", "[]", '{"format": "robocov-steps", "robots": {"3": {}}}', "{"])
def test_an_unreadable_file_is_replaced(tmp_path, content):
    (tmp_path / steps.STEP_TIMES_FILE).write_text(content)
    found = measure(tmp_path)
    kept = json.loads((tmp_path / steps.STEP_TIMES_FILE).read_text())
    assert kept["robots"]["3"]["seconds_per_step"]["rpf"] == list(found[3].seconds["rpf"])


def test_an_interruption_leaves_complete_measurements(tmp_path):
    asked = count()
    found = measure(tmp_path, {3: ("rpf",), 4: ("rpf",)}, is_stopped=lambda: next(asked) > 6)
    assert list(found) == [3]
    assert list(measure(tmp_path, {3: ("rpf",), 4: ("rpf",)})) == [3, 4]


def test_ratios_are_medians_of_blocks_timed_together():
    times = StepTimes(6, 0.02, {"rapf": (1.0, 2.0, 4.0), "mine": (3.0, 4.0, 20.0)})
    interval = times.compute_ratio("mine")
    assert (interval.low, interval.estimate, interval.high) == (2.0, 3.0, 5.0)
    assert times.compute_real_time_factor("mine").estimate == 200.0
    assert np.isnan(times.compute_ratio("other").estimate)
