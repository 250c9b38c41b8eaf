"""The interactive window, used for some seconds with its live cost, without a display."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter

import pygame

from robocov.defaults import DEFAULT_LATTICE
from robocov.mapfile import load_map
from robocov_app.bench.measure import Call, Case, Row, in_turn
from robocov_app.bench.render import SIZE, cleared
from robocov_app.render.picture import standard_layers
from robocov_app.toolkit.display import collect_garbage_rarely, open_display
from robocov_app.toolkit.window import FPS
from robocov_app.viewer.costs import Costs
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.scenario import ControllerChoice, Scenario, TeamSpec
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.window import Window

DRAWING_GOAL, FRAME_GOALS = {50: 4e-3}, {6: 1 / 60, 50: 1 / 60, 200: 1 / 30, 1000: 1 / 30}
"""Wanted seconds for the drawing of a frame and for everything that it takes, by number of robots."""
LONGEST = 50e-3  # seconds that no frame may exceed
_CROWD = 100  # from so many robots on they are smaller, so that there is room for them


def cases(*, quick: bool = False) -> list[Case]:
    return [partial(_used, n, 4.0 if quick else 15.0) for n in (6, 50, 200, 1000)]


def _used(n: int, seconds: float) -> Iterator[Row]:
    limits = TeamSpec(radius=0.05) if n >= _CROWD else TeamSpec()
    start = "uniform" if n > 10 else None
    session = Session(Scenario(load_map("rooms"), (ControllerChoice("rapf"),), n, start, limits=limits))
    with open_display(headless=True):
        shown = {layer.name for layer in standard_layers() if layer.default}
        viewer = Presenter(session, Costs(DEFAULT_LATTICE), shown, Path(), "rooms")
        window = Window(viewer, SIZE, 1.0)
        try:
            with collect_garbage_rarely():
                frames, drawing, answers = _played(window, seconds)
        finally:
            viewer.costs.close()
        clear_and_flip: list[Call] = [cleared(pygame.display.get_surface()), pygame.display.flip]
        bare = in_turn({"bare": lambda: [call() for call in clear_and_flip]}, len(frames))["bare"]
    for name, took, goal, note in (
        ("all of a frame", median(frames), FRAME_GOALS[n], f"{answers / seconds:.0f} costs a second"),
        ("drawing", median(drawing), DRAWING_GOAL.get(n), ""),
        ("the longest", max(frames), LONGEST, f"of {len(frames)} frames"),
    ):
        yield Row("window", name, {"robots": n}, took, "clear and flip", bare, goal_seconds=goal, note=note)


def _played(window: Window, seconds: float) -> tuple[list[float], list[float], int]:
    """Return what each frame took, what its drawing took, and how many costs were answered."""
    clock = pygame.time.Clock()
    frames: list[float] = []
    drawing: list[float] = []
    # the first moments prepare the map's cost and draw all that is kept afterwards
    for _ in range(FPS):
        window.frame(clock.tick(FPS) / 1000.0)
    curve = window.viewer.pane.curve
    known = len(curve)
    began = before = perf_counter()
    while perf_counter() - began < seconds:
        now = perf_counter()
        window.advance(now - before)
        before, drawn = now, perf_counter()
        window.draw()
        done = perf_counter()
        frames.append(done - now)
        drawing.append(done - drawn)
        clock.tick(FPS)
    return frames, drawing, len(curve) - known
