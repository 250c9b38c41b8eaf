"""On the track of an unknown density, no controller gets the density, not even one that cheats."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from local_deciders import run_isolated
from small_studies import HEAD

from robocov.typing import FloatArray
from robocov_app.benchmark import suite
from robocov_app.benchmark.rated_controller import RatedController, Selection
from robocov_app.benchmark.running import run_benchmark
from robocov_app.benchmark.verification.verification import Verification, VerificationOptions, verify_result
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import perform
from robocov_app.terminal.interruption import Interruption

TRACK = "unknown-density"
MAP = "dense-polygons-7001"
IMPORTS = HEAD.partition("@dataclass")[0] + "import gc\nimport numpy as np\nimport robocov as rc\n"
START = """
@dataclass(frozen=True)
class Mine:
    def begin(self, region, team):
        return None

    def decide(self, seen, memory):
"""
END = """
        return rc.Decision(np.column_stack([values, -values]))
"""
# Statements of `decide`, between these two, which compute a value for each robot.

HONEST = """
        assert seen.density is None
        robots = np.arange(len(seen.positions))
        values = seen.measure_density(robots, seen.positions + [0.1, 0.0])
"""

FAR = """
        values = seen.measure_density(np.arange(len(seen.positions)), seen.positions + [30.0, 0.0])
"""
"""Robots measure far beyond their sensing range."""

CLOSURE = """
        values = np.ones(len(seen.positions))
        for cell in seen.density_sensor._measure.__closure__ or ():
            if isinstance(cell.cell_contents, rc.Density):
                values = values * cell.cell_contents.upper_bound
"""
"""Robots look for the density in the variables of their sensor."""

MEMORY = """
        values = np.ones(len(seen.positions))
        for candidate in gc.get_objects():
            if isinstance(candidate, rc.Gaussians):
                values = values * candidate.upper_bound
"""
"""Robots look for the density among all objects of the process."""

OTHERS = """
        robots = np.roll(np.arange(len(seen.positions)), 1)
        values = seen.measure_density(robots, seen.positions[robots])
"""
"""Robots use measurements of others without having received them."""


@pytest.fixture(autouse=True)
def _short_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    track = replace(suite.TRACKS[TRACK], duration=0.5, seeds=(0,), maps=(MAP,))
    monkeypatch.setitem(suite.TRACKS, TRACK, track)  # type: ignore[arg-type]


def build_task(controller: str) -> Task:
    studies = dict(RatedController(controller, {}).build_studies(Selection(tracks=(TRACK,), maps=(MAP,))))
    return next(iter(generate_tasks(studies[TRACK])))


def isolate(controller: str) -> list[str]:
    """Return how the decisions of a robot differ if it gets only its own measurements."""
    outcome, team, _ = run_isolated(build_task(controller), [2])
    assert outcome.error is None
    return team.differences


def record_forces(task: Task) -> list[FloatArray]:
    """Run a task, and return the forces in each step."""
    forces: list[FloatArray] = []
    perform(task, lambda snapshot: forces.append(snapshot.decision.forces))
    return forces


def write_controller(folder: Path, code: str) -> str:
    (folder / "mine.py").write_text(IMPORTS + START + code + END)
    return f"{folder / 'mine.py'}:Mine"


def verify(folder: Path, code: str) -> Verification:
    """Rate a controller, and verify its result in processes of their own."""
    name = write_controller(folder, code)
    selection = Selection(tracks=(TRACK,), maps=(MAP,))
    options = VerificationOptions(sample=1, robots=1, new_maps=0)
    out = folder / "out"
    with Interruption() as stop:
        run_benchmark(RatedController(name, {}), selection, out, stop=stop, workers=1, quiet=True)
        return verify_result(out, controller=name, options=options, stop=stop, quiet=True)


def test_the_track_is_in_no_ranking_and_hides_the_density() -> None:
    track = suite.TRACKS[TRACK]
    assert all(TRACK not in tracks for tracks in suite.RANKED_TRACKS.values())
    assert track.changes["conditions"] == {"density": "sensed"}
    environment = build_task("lloyd").build_environment()
    assert environment.density is not None
    assert not environment.density.is_uniform
    assert build_task("lloyd").hide_unknown_density().build_environment().density is None


@pytest.mark.parametrize("controller", ["lloyd", "local-search", "adaptive", "exploring-lloyd", "gp-ucb"])
def test_robots_decide_by_their_own_measurements(controller: str) -> None:
    assert isolate(controller) == []


@pytest.mark.parametrize("controller", ["lloyd", "rapf", "atlas-shared", "local-search"])
def test_controllers_that_do_not_measure_decide_as_without_a_density(controller: str) -> None:
    task = build_task(controller)
    np.testing.assert_array_equal(record_forces(task), record_forces(task.hide_unknown_density()))


def test_no_process_receives_the_density(tmp_path: Path) -> None:
    task = build_task(write_controller(tmp_path, HONEST))
    _, _, deciders = run_isolated(task, [0])
    for observations in deciders[0].received:
        assert b"Gaussians" not in pickle.dumps(observations)


def test_robots_cannot_measure_beyond_their_sensing_range(tmp_path: Path) -> None:
    outcome, _, _ = run_isolated(build_task(write_controller(tmp_path, FAR)), [])
    assert outcome.error is not None
    assert "expected a point within its sensing range of 3 m, got a point at 30 m" in outcome.error


def test_measurements_of_others_change_the_decisions_of_an_isolated_robot(tmp_path: Path) -> None:
    (difference,) = isolate(write_controller(tmp_path, OTHERS))
    assert "robot 3 decides differently from" in difference


@pytest.mark.parametrize(
    ("code", "is_honest"),
    [(HONEST, True), (MEMORY, False), (CLOSURE, False)],
    ids=["honest", "memory", "closure"],
)
def test_only_controllers_that_measure_are_verified(code: str, is_honest: bool, tmp_path: Path) -> None:
    verification = verify(tmp_path, code)
    assert verification.runs == 1
    if is_honest:
        assert verification.differences == []
    else:
        assert any("path_length_m: expected" in difference for difference in verification.differences)
