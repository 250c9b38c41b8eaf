"""The open square of CoverageControl: its worlds, its track, and its controllers, whose library decides."""

from __future__ import annotations

import importlib.util
import runpy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robocov import Environment, Simulation, Team
from robocov.controllers.base import get_information
from robocov.errors import ParameterError
from robocov.typing import FloatArray
from robocov_app.benchmark import coverage_control_cvt as cvt
from robocov_app.benchmark import suite
from robocov_app.benchmark.maps.worlds import (
    PEAKS,
    PIXELS,
    RASTER_PIXELS,
    ROBOTS,
    SIDE_M,
    TRUNCATION,
    Peak,
    build_open_square,
    build_world,
    compute_density,
    draw_peaks,
    draw_world,
    merge_pixels,
)
from robocov_app.benchmark.rated_controller import COVERAGE_CONTROL_FILES, RatedController, Selection
from robocov_app.benchmark.running import run_benchmark
from robocov_app.benchmark.verification.verification import VerificationOptions, verify_result
from robocov_app.sweep.study.parameters import build_swept_team
from robocov_app.sweep.tasks import generate_tasks
from robocov_app.terminal.interruption import Interruption

TRACK = "open-square"
MAP = "worlds-7001"
CLASSES = (cvt.ClairvoyantCvt, cvt.CentralizedCvt, cvt.DecentralizedCvt)
HAS_LIBRARY = importlib.util.find_spec(cvt.LIBRARY) is not None
NEEDS_LIBRARY = pytest.mark.skipif(not HAS_LIBRARY, reason="needs robocov[coverage-control]")
BENCH_SCRIPT = Path(__file__).parents[2] / "bench/bench_coverage_control.py"
MAX_RELATIVE_DIFFERENCE = 0.04
"""Maximum relative difference between the remaining costs in both simulators."""


def build_team() -> Team:
    """Build a team with the limits of the track."""
    track = suite.TRACKS[TRACK]
    limits = {name: value for name, value in track.changes.items() if name != "conditions"}
    return Team.homogeneous(track.robots, radius=track.radius, **limits)


def add_peaks(environment: Environment, peaks: list[Peak]) -> Environment:
    """Return a map with the peaks that controllers of the library need."""
    return replace(environment, extra={cvt.PEAKS_KEY: [list(peak) for peak in peaks]})


def test_a_world_contains_the_mass_of_its_peaks_within_the_cut() -> None:
    center = SIDE_M / 2
    peak = Peak(x=center, y=center, sigma=40.0, mass=1.0)
    density = compute_density([peak])
    assert density.shape == (PIXELS, PIXELS)
    assert density.max() == 1.0
    assert density[PIXELS // 2, PIXELS // 2 + 81] == 0.0
    # The integral of exp(-r²/(2 sigma²)) up to the cut.
    expected = 2.0 * np.pi * peak.sigma**2 * (1.0 - np.exp(-(TRUNCATION**2) / 2.0))
    assert density.sum() == pytest.approx(expected, rel=1e-3)


def test_a_map_of_a_world_has_the_rounded_density_of_its_peaks() -> None:
    environment = build_world(7001)
    assert environment.name == MAP
    values = merge_pixels(compute_density(draw_peaks(7001)))
    assert values.shape == (RASTER_PIXELS, RASTER_PIXELS)
    assert environment.density is not None
    pixel_side = SIDE_M / RASTER_PIXELS
    # A pixel in a peak, and the one with its row and column exchanged.
    points = np.array([[197.5, 189.5], [189.5, 197.5]]) * pixel_side
    expected = np.array([values[189, 197], values[197, 189]])
    assert expected.min() > 0.1
    assert abs(expected[0] - expected[1]) > 0.01
    np.testing.assert_allclose(environment.density.evaluate(points), expected, atol=0.0005)


def test_worlds_have_the_peaks_of_the_rules() -> None:
    world = draw_world(0)
    assert len(world.peaks) == PEAKS
    assert world.peaks == draw_peaks(0)
    assert world.starts.shape == (ROBOTS, 2)
    for peak in world.peaks:
        assert 0.0 <= peak.x <= SIDE_M
        assert 0.0 <= peak.y <= SIDE_M
        assert 40.0 <= peak.sigma <= 50.0
        assert 6.0 <= peak.mass <= 10.0


def test_robots_of_the_track_have_the_limits_of_the_other_simulator() -> None:
    studies = dict(RatedController("rapf", {}).build_studies(Selection(tracks=(TRACK,), maps=(MAP,))))
    (task,) = generate_tasks(studies[TRACK])
    team = build_swept_team(task.robots, task.team)
    assert len(team) == ROBOTS
    assert set(team.radius) == {1.0}
    assert set(team.max_speed) == {5.0}
    assert set(team.max_acceleration) == {10.0}
    assert set(team.sensing_range) == {32.0}
    assert set(team.communication_range) == {128.0}
    hidden = task.hide_unknown_density().build_environment()
    assert hidden.density is None
    assert cvt.PEAKS_KEY not in hidden.extra


def test_controllers_of_the_library_state_that_they_know_the_map() -> None:
    for controller_class in CLASSES:
        assert get_information(controller_class) == "whole map"
        assert RatedController(controller_class.name, {}).decides_jointly
    assert COVERAGE_CONTROL_FILES.keys() == {controller_class.name for controller_class in CLASSES}


def test_a_missing_library_is_reported_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(cvt.sys.modules, cvt.LIBRARY, raising=False)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ParameterError, match=r"^CoverageControl is not installed: pip install \S+ .*\)$"):
        cvt.ClairvoyantCvt()


class FakeSystem:
    """A system of the library that only records the positions of robots."""

    def __init__(self, _parameters: object, _world: object, starts: list[FloatArray]) -> None:
        self.visited = [np.array(starts)]

    def SetGlobalRobotPositions(self, positions: list[FloatArray]) -> None:  # noqa: N802
        self.visited.append(np.array(positions))


class FakeController:
    """A controller of the library whose velocities are the number of positions that the system received."""

    def __init__(self, _parameters: object, _robots: int, system: FakeSystem) -> None:
        self.system = system

    def ComputeActions(self) -> None:  # noqa: N802
        pass

    def GetActions(self) -> list[FloatArray]:  # noqa: N802
        count = float(len(self.system.visited))
        return [np.array([count, 0.0]) for _ in self.system.visited[0]]

    def GetGoals(self) -> list[FloatArray]:  # noqa: N802
        return list(self.system.visited[-1])


class FakeParameters:
    """Parameters of the library."""

    pTimeStep = 0.1  # noqa: N815


class FakeDensity:
    """A density of the library."""

    def __init__(self, _parameters: object) -> None:
        self.peaks: list[object] = []

    def AddNormalDistribution(self, peak: object) -> None:  # noqa: N802
        self.peaks.append(peak)

    def GenerateMap(self) -> None:  # noqa: N802
        assert len(self.peaks) == PEAKS


class FakeLibrary:
    """The part of the library that controllers use."""

    Parameters = FakeParameters
    WorldIDF = FakeDensity
    CoverageSystem = FakeSystem
    ClairvoyantCVT = FakeController
    PointVector = list

    @staticmethod
    def BivariateNormalDistribution(center: FloatArray, sigma: float, mass: float) -> Any:  # noqa: N802
        return center, sigma, mass


def test_a_rewound_simulation_makes_the_same_decisions_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """The library receives the positions in each of its time steps, and starts again if necessary."""
    monkeypatch.setattr(cvt, "load_library", FakeLibrary)
    peaks = draw_peaks(7001)
    history = np.random.default_rng(0).uniform(0.0, SIDE_M, (4, 3, 2))
    run = cvt.LibraryRun("ClairvoyantCVT", peaks)
    for count in (1, 2, 3, 2, 4, 4):
        velocities, goals = run.decide(history[:count])
        assert velocities[:, 0].tolist() == [count] * 3
        np.testing.assert_array_equal(goals, history[count - 1])
    other_history = history[:2] + 1.0
    velocities, goals = run.decide(other_history)
    assert velocities[:, 0].tolist() == [2.0] * 3
    np.testing.assert_array_equal(goals, other_history[-1])


def test_robots_track_the_velocities_of_the_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cvt, "load_library", FakeLibrary)
    environment = add_peaks(build_world(7001), draw_peaks(7001))
    starts = environment.start(None).sample(ROBOTS, seed=0, radius=1.0)
    simulation = Simulation(environment, cvt.ClairvoyantCvt(), starts, build_team())
    record = simulation.run(0.35)
    # The library decides at 0, 0.1, 0.2 and 0.3 s. The desired velocity is 1 m/s at first, grows by 1 m/s
    # with each decision, and is approached with the response time.
    velocity = 0.0
    for desired_velocity, duration in ((1.0, 0.1), (2.0, 0.1), (3.0, 0.1), (4.0, 0.05)):
        velocity = desired_velocity + (velocity - desired_velocity) * np.exp(-duration / 0.1)
    velocities = record.velocities[-1]
    np.testing.assert_allclose(velocities[:, 0], velocity, rtol=0.1)
    np.testing.assert_allclose(velocities[:, 1], 0.0, atol=1e-9)


def test_controllers_of_the_library_need_a_map_of_the_track(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cvt, "load_library", FakeLibrary)
    environment = build_world(7001)
    starts = environment.start(None).sample(ROBOTS, seed=0, radius=1.0)
    with pytest.raises(ParameterError, match=r"expected a map with the peaks of its density .* adds them"):
        Simulation(environment, cvt.ClairvoyantCvt(), starts, build_team())


@NEEDS_LIBRARY
def test_other_tracks_are_rejected() -> None:
    rated = RatedController("coverage-control-centralized", {})
    with pytest.raises(
        ParameterError, match=r"^--track: expected open-square for .*-centralized, got ideal$"
    ):
        dict(rated.build_studies(Selection(tracks=("ideal",), maps=("rooms",))))


@NEEDS_LIBRARY
def test_the_library_builds_the_same_density() -> None:
    library = cvt.load_library()
    world = draw_world(0)
    density = cvt.build_world_density(library, library.Parameters(), world.peaks)
    # Its maps are indexed by x, then y, and have single precision.
    differences = np.asarray(density.GetWorldMap()).T - world.density
    assert np.abs(differences).mean() < 1e-3


@NEEDS_LIBRARY
def test_controllers_of_the_library_can_be_rated_and_verified(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    track = replace(suite.TRACKS[TRACK], duration=2.5, maps=(MAP,))
    monkeypatch.setitem(suite.TRACKS, TRACK, track)  # type: ignore[arg-type]
    rated = RatedController("coverage-control-decentralized", {})
    options = VerificationOptions(sample=1, robots=1, new_maps=1)
    with Interruption() as stop:
        result = run_benchmark(rated, Selection(tracks=(TRACK,)), tmp_path, stop=stop, workers=1, quiet=True)
        verification = verify_result(tmp_path, options=options, stop=stop, quiet=True)
    assert result is not None
    assert [row["map"] for row in result["rows"]] == [MAP]
    assert verification.differences == []
    assert (verification.runs, verification.teams, verification.robots) == (1, 1, 0)


@NEEDS_LIBRARY
@pytest.mark.slow
@pytest.mark.parametrize("controller_class", CLASSES)
def test_the_final_cost_is_that_of_the_other_simulator(
    controller_class: type[cvt.LibraryController],
) -> None:
    script = runpy.run_path(str(BENCH_SCRIPT))
    world = draw_world(0)
    environment = add_peaks(build_open_square("world", merge_pixels(world.density)), list(world.peaks))
    simulation = Simulation(environment, controller_class(), world.starts, build_team())
    positions = simulation.run(120.0).positions[-1]
    cost = script["compute_cost"](world.density, positions)
    fraction = cost / script["compute_cost"](world.density, world.starts)
    expected = script["run_theirs"](controller_class.algorithm, 0, duration=120.0)
    assert fraction == pytest.approx(expected, rel=MAX_RELATIVE_DIFFERENCE)
