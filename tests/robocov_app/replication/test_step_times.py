import json
from dataclasses import replace
from itertools import count

import numpy as np
import pytest

from robocov_app.replication import step_times as steps
from robocov_app.replication.plan import QUICK
from robocov_app.replication.step_times import StepTimes, step_times


@pytest.fixture(autouse=True)
def short_blocks(monkeypatch):
    monkeypatch.setattr(steps, "BLOCK", 2)


def timed(folder, wanted=None, **other):
    plan = replace(QUICK, beyond=replace(QUICK.beyond, warm_up=1, blocks=other.pop("blocks", 3)))
    return step_times(folder, wanted or {3: ("rpf", "lloyd")}, plan, **other)


def test_controllers_are_timed_in_turn_beside_rapf(tmp_path):
    ticks = count()
    found = timed(tmp_path, clock=lambda: float(next(ticks)))
    assert list(found) == [3]
    # every block lasts one tick of that clock
    assert found[3].seconds == dict.fromkeys(("rapf", "rpf", "lloyd"), (0.5, 0.5, 0.5))
    assert found[3].ratio_interval("rpf").estimate == 1.0


def test_what_is_kept_is_not_timed_again_but_other_gains_are(tmp_path, monkeypatch):
    first = timed(tmp_path)

    def never() -> float:
        raise AssertionError

    assert timed(tmp_path, clock=never)[3].seconds == first[3].seconds
    with pytest.raises(AssertionError):
        timed(tmp_path, {3: ("rpf",)}, clock=never)
    with pytest.raises(AssertionError):
        timed(tmp_path, blocks=4, clock=never)


@pytest.mark.parametrize("content", ["", "[]", '{"format": "robocov-steps", "robots": {"3": {}}}', "{"])
def test_a_file_that_cannot_be_read_is_made_anew(tmp_path, content):
    (tmp_path / steps.FILE).write_text(content)
    found = timed(tmp_path)
    kept = json.loads((tmp_path / steps.FILE).read_text())
    assert kept["robots"]["3"]["seconds_per_step"]["rpf"] == list(found[3].seconds["rpf"])


def test_who_stops_it_gets_what_is_whole(tmp_path):
    asked = count()
    found = timed(tmp_path, {3: ("rpf",), 4: ("rpf",)}, stopped=lambda: next(asked) > 6)
    assert list(found) == [3]
    assert list(timed(tmp_path, {3: ("rpf",), 4: ("rpf",)})) == [3, 4]


def test_ratios_are_medians_of_blocks_timed_together():
    times = StepTimes(6, 0.02, {"rapf": (1.0, 2.0, 4.0), "mine": (3.0, 4.0, 20.0)})
    interval = times.ratio_interval("mine")
    assert (interval.low, interval.estimate, interval.high) == (2.0, 3.0, 5.0)
    assert times.real_time("mine").estimate == 200.0
    assert np.isnan(times.ratio_interval("other").estimate)
