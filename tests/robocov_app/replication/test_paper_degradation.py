import math
from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from robocov.errors import RobocovError
from robocov_app.replication.degradation import AXES, QUICK, Degradation, DegradationPlan, degradations
from robocov_app.sweep.performing import FIGURES, Outcome, failed
from robocov_app.sweep.study import Task

TINY = DegradationPlan(
    maps=("rooms",),
    axes={"loss": (0.0, 0.8), "communication_range": (None, 2.0), "failure_rate": (0.0, 0.5)},
    robots=3,
    seeds=2,
    duration=2.0,
    dt=0.1,
    lattice=8,
)


def outcome(final: float | None) -> Outcome:
    return Outcome({}, {**dict.fromkeys(FIGURES, 1.0), "mean_distance_m": final})


def test_ratios_are_of_the_same_map_and_seed() -> None:
    def made_up(tasks: Sequence[Task]) -> Iterator[Outcome]:
        for task in tasks:
            ideal = 2.0 + task.seed
            bad = 1.5 if task.team.get("loss") == 0.8 else 1.0
            yield outcome(ideal * bad)

    found = degradations(TINY, made_up)
    ratios = {(each.axis, each.value, each.controller): each.ratio.estimate for each in found}
    assert ratios["loss", 0.8, "rapf"] == 1.5
    assert ratios["loss", 0.0, "rapf"] == ratios["communication_range", 2.0, "lloyd"] == 1.0
    assert len(found) == 3 * 2 * 2
    assert {(each.runs, each.lost) for each in found} == {(2, 0)}


def test_runs_without_a_result_are_told() -> None:
    def made_up(tasks: Sequence[Task]) -> Iterator[Outcome]:
        for task in tasks:
            broken = task.team.get("failure_rate") == 0.5
            yield (failed("no room", "") if task.seed else outcome(None)) if broken else outcome(2.0)

    found = {(each.axis, each.value): each for each in degradations(TINY, made_up)}
    assert (found["failure_rate", 0.5].runs, found["failure_rate", 0.5].lost) == (0, 2)
    assert math.isnan(found["failure_rate", 0.5].ratio.estimate)

    with pytest.raises(RobocovError, match="rapf: all 2 runs on each map failed"):
        degradations(TINY, lambda tasks: [outcome(None) for _ in tasks])


def test_every_run_goes_on_what_the_plan_says() -> None:
    jobs = list(TINY.tasks())
    assert len(jobs) == (1 + 3) * 2 * 2
    assert all(task.team["message_rate"] == 2.0 for *_, task in jobs)
    by_axis = {axis: task.team for axis, _, task in jobs}
    assert by_axis["communication_range"]["communication_range"] == 2.0
    assert by_axis[""]["communication_range"] is None
    assert "loss" not in by_axis["failure_rate"]
    assert all(values[0] in (None, 0.0) for values in AXES.values())
    assert len(list(QUICK.tasks())) < 200


def test_a_tiny_study_runs() -> None:
    done: list[tuple[int, int]] = []
    found = degradations(TINY, on_run=lambda now, total: done.append((now, total)))
    assert done[-1] == (16, 16)
    assert all(isinstance(each, Degradation) and np.isfinite(each.ratio.estimate) for each in found)
    worst = [each.ratio.estimate for each in found if each.value == 0.5]
    assert max(worst) > 1.0  # with a mean life of 2 s, after 2 s
    assert found[0].to_json()["ratio"] == {"estimate": 1.0, "low": 1.0, "high": 1.0}
