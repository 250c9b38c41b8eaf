"""Benchmark of the interactive window, which runs for some seconds with its live cost, without a display."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter

import pygame

from robocov.defaults import DEFAULT_LATTICE
from robocov.mapfile import load_map
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.speed_benchmarks.measure import Case, Row, measure_interleaved
from robocov_app.speed_benchmarks.render import FRAME_BASELINE, SIZE_PX, build_clearing_call
from robocov_app.toolkit.window.display import collect_garbage_rarely, open_display
from robocov_app.toolkit.window.window import FPS
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import SessionScenario
from robocov_app.viewer.window.window import ViewerWindow

TEAM_SIZES = (6, 50, 200, 1000)
"""Numbers of robots."""
DRAWING_GOALS_S = {50: 4e-3}
"""Maximum time to draw a frame, by number of robots."""
FRAME_GOALS_S = {6: 1 / 60, 50: 1 / 60, 200: 1 / 30, 1000: 1 / 30}
"""Maximum total time of a frame (simulation, cost and drawing), by number of robots."""
MAX_FRAME_S = 50e-3
"""Maximum time of the slowest frame."""
_QUICK_DURATION_S = 4.0
_FULL_DURATION_S = 15.0
_MIN_CROWD = 100
"""Minimum number of robots for which smaller robots are used, so that all of them fit on the map."""
_CROWD_RADIUS_M = 0.05
"""Radius of the smaller robots."""
_MAX_FIRST_START = 10
"""Maximum number of robots that fit into the first start of the map."""


@dataclass
class _Measurements:
    """Times of the measured frames, and the number of costs computed while they were shown."""

    frames: list[float] = field(default_factory=list)
    """Time of each frame, s."""
    drawing: list[float] = field(default_factory=list)
    """Time to draw each frame, s."""
    costs: int = 0
    """Number of costs that were computed."""


def list_cases(*, quick: bool = False) -> list[Case]:
    """Return the benchmark cases of the window, one for each team size."""
    seconds = _QUICK_DURATION_S if quick else _FULL_DURATION_S
    return [partial(_measure_window, robots, seconds) for robots in TEAM_SIZES]


def _measure_window(robots: int, seconds: float) -> Iterator[Row]:
    """Use the window for some seconds; yield the median frame time, drawing time and slowest frame."""
    session = _build_session(robots)
    with open_display(headless=True):
        layers = {layer.name for layer in build_standard_layers() if layer.is_default}
        presenter = Presenter(session, Costs(DEFAULT_LATTICE), layers, Path(), "rooms")
        window = ViewerWindow(presenter, SIZE_PX, 1.0)
        try:
            with collect_garbage_rarely():
                measured = _use_window(window, seconds)
        finally:
            presenter.costs.close()
        clear = build_clearing_call(pygame.display.get_surface())

        def clear_and_flip() -> None:
            clear()
            pygame.display.flip()

        bare = measure_interleaved({"bare": clear_and_flip}, len(measured.frames))["bare"]
    results = (
        (
            "whole frame",
            median(measured.frames),
            FRAME_GOALS_S[robots],
            f"{measured.costs / seconds:.0f} costs per second",
        ),
        ("drawing", median(measured.drawing), DRAWING_GOALS_S.get(robots), ""),
        ("longest frame", max(measured.frames), MAX_FRAME_S, f"of {len(measured.frames)} frames"),
    )
    for name, time, max_seconds, note in results:
        yield Row(
            "window",
            name,
            {"robots": robots},
            time,
            baseline=FRAME_BASELINE,
            baseline_seconds=bare,
            max_seconds=max_seconds,
            note=note,
        )


def _build_session(robots: int) -> Session:
    """Build a session on the map "rooms", with smaller robots and another start for large teams."""
    properties = RobotProperties()
    if robots >= _MIN_CROWD:
        properties = RobotProperties(radius=_CROWD_RADIUS_M)
    start = None
    if robots > _MAX_FIRST_START:
        start = "uniform"
    scenario = SessionScenario(
        load_map("rooms"), (ControllerChoice("rapf"),), robots, start, properties=properties
    )
    return Session(scenario)


def _use_window(window: ViewerWindow, seconds: float) -> _Measurements:
    """Advance and draw the window for some seconds, and measure each frame."""
    clock = pygame.time.Clock()
    # Warm-up: the first second prepares the cost of the map and fills the caches of the drawing.
    for _ in range(FPS):
        window.run_frame(clock.tick(FPS) / 1000.0)
    curve = window.viewer.pane.distance_curve
    known_costs = len(curve)
    measured = _Measurements()
    start = perf_counter()
    previous = start
    while perf_counter() - start < seconds:
        now = perf_counter()
        window.advance(now - previous)
        previous = now
        drawing_start = perf_counter()
        window.draw()
        end = perf_counter()
        measured.frames.append(end - now)
        measured.drawing.append(end - drawing_start)
        clock.tick(FPS)
    measured.costs = len(curve) - known_costs
    return measured
