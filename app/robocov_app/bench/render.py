"""Drawing a frame against filling and copying an empty one; films and PNGs against drawing their frames."""

import tempfile
from collections.abc import Iterator
from functools import partial
from itertools import cycle
from pathlib import Path

import numpy as np
import pygame

from robocov.controllers import Rapf
from robocov.mapfile import load_map
from robocov.record import Record
from robocov.simulation import Simulation
from robocov_app.bench.measure import Call, Case, Row, in_turn
from robocov_app.render.picture import Painter
from robocov_app.render.scene import record_scene
from robocov_app.runs.encoding import encode_png, save_video
from robocov_app.runs.frames import draw_frames
from robocov_app.runs.settings import VideoSettings

SIZE = (1280, 720)
FRAME_GOALS = {50: 4e-3}  # wanted seconds for a frame, by number of robots


def cases(*, quick: bool = False) -> list[Case]:
    frames = [partial(_frames, name, n, quick) for name, n in (("rooms", 6), ("rooms", 50), ("campus", 200))]
    return [*frames, partial(_films, quick)]


def _frames(name: str, n: int, quick: bool) -> Iterator[Row]:
    record = _travelled(name, n)
    painter = Painter(record.environment, SIZE)
    canvas = pygame.Surface(SIZE)
    scenes = cycle([record_scene(record, k) for k in range(len(record))])
    calls = {"frame": lambda: painter.draw(canvas, next(scenes)), "bare": cleared(canvas)}
    taken = in_turn(calls, 40 if quick else 150)
    frame, bare = taken["frame"], ("clear and flip", taken["bare"])
    goal = FRAME_GOALS.get(n)
    yield Row("render", "one frame", {"robots": n, "map": name}, frame, *bare, goal_seconds=goal)


def cleared(canvas: pygame.Surface | None) -> Call:
    assert canvas is not None
    empty = pygame.Surface(SIZE)
    return lambda: (empty.fill((255, 255, 255)), canvas.blit(empty, (0, 0)))


def _films(quick: bool) -> Iterator[Row]:
    record = _travelled("rooms", 6)
    look = VideoSettings(colours="robots")
    shown = np.linspace(0, len(record) - 1, 60 if quick else 240).astype(np.intp)
    frames = list(draw_frames(record, look, size=SIZE, rows=shown))
    with tempfile.TemporaryDirectory() as folder:
        film = Path(folder) / "film.mp4"
        calls = {
            "draw": lambda: list(draw_frames(record, look, size=SIZE, rows=shown)),
            "film": lambda: save_video(film, frames),
            "png": lambda: [encode_png(frame) for frame in frames],
        }
        taken = in_turn(calls, 1 if quick else 3)
    for name, call in (("film encoded", "film"), ("PNGs encoded", "png")):
        rate, drawn = len(frames) / taken[call], ("drawing the frames", taken["draw"])
        size = {"frames": len(frames)}
        yield Row("render", name, size, taken[call], *drawn, note=f"{rate:.0f} frames a second")


def _travelled(name: str, n: int) -> Record:
    environment = load_map(name)
    return Simulation(environment, Rapf(), environment.start("uniform").sample(n, seed=0)).run(5.0)
