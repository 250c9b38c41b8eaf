from __future__ import annotations

import numpy as np
import pytest

from robocov.conditions import Conditions
from robocov.environment import Environment
from robocov.errors import ParameterError, StartError
from robocov.team import Team
from robocov_app.runs.options import RunOptions
from robocov_app.runs.spec import RunSpec

ROOM = Environment("room", ((0, 0), (6, 0), (6, 4), (0, 4)))


def test_a_run_is_the_same_however_it_is_begun() -> None:
    spec = RunSpec(ROOM, "lloyd", {"k_prop": 2.0}, team=Team.homogeneous(3), seed=4, duration=0.5)
    record = spec.record()
    assert (record.start, record.seed, record.controller, len(record)) == ("uniform", 4, "lloyd", 31)
    options = RunOptions(robots=3, seed=4, duration=0.5)
    np.testing.assert_array_equal(
        options.spec(ROOM, "lloyd", {"k_prop": 2.0}).record().positions, record.positions
    )
    given = RunSpec(
        ROOM, "lloyd", {"k_prop": 2.0}, team=spec.team, positions=spec.starts, seed=None, duration=0.5
    )
    again = given.record()
    assert (again.start, again.seed) == (None, None)
    np.testing.assert_array_equal(again.positions, record.positions)
    simulation = spec.simulation()
    for _ in range(10):
        simulation.step()
    later = RunSpec(
        ROOM, "lloyd", {"k_prop": 2.0}, team=spec.team, positions=simulation.positions,
        velocities=simulation.velocities, duration=0.5 - simulation.time,
    )  # fmt: skip
    rest = later.record(later.simulation(steps=10, resumed=True))
    np.testing.assert_array_equal(rest.time, record.time[10:])
    np.testing.assert_array_equal(rest.positions, record.positions[10:])


def test_of_a_record_some_moments_are_kept_and_it_can_be_ended() -> None:
    spec, steps = RunSpec(ROOM, team=Team.homogeneous(2), duration=0.5), []
    record = spec.record(every=7, watch=lambda step: steps.append(step) or step == 16)
    assert steps == list(range(17))
    assert record.time.tolist() == pytest.approx([0.0, 7 / 60, 14 / 60, 16 / 60])
    assert len(spec.record(every=7)) == 6


def test_what_cannot_be_is_told_before() -> None:
    for changes, error in (
        ({"controller": "lloid"}, ParameterError),
        ({"gains": {"k": 1.0}}, ParameterError),
        ({"start": "corner"}, StartError),
        ({"team": Team.homogeneous(900)}, StartError),
    ):
        with pytest.raises(error):
            RunSpec(ROOM, **changes).check()  # type: ignore[arg-type]
    RunSpec(ROOM, conditions=Conditions(loss=0.5)).check()
