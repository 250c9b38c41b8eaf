"""Benchmark of drawing and encoding frames.

Drawing is compared with filling and copying an empty frame, and encoding is compared with drawing.
"""

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
from robocov_app.render.painter import Painter
from robocov_app.render.record_scene import build_record_scene
from robocov_app.runs.encoding import encode_png, save_video
from robocov_app.runs.frames import draw_frames
from robocov_app.runs.settings import VideoSettings
from robocov_app.speed_benchmarks.measure import Call, Case, Row, measure_interleaved

SIZE_PX = (1280, 720)
FRAME_GOALS_S = {50: 4e-3}
"""Maximum time to draw a frame, by number of robots."""
FRAME_BASELINE = "clear and flip"
"""Name of the baseline of drawing."""
_FRAME_CASES = (("rooms", 6), ("rooms", 50), ("campus", 200))
"""Map and number of robots of each case."""
_QUICK_FRAME_ROUNDS = 40
_FULL_FRAME_ROUNDS = 150
_ENCODED_MAP = "rooms"
_ENCODED_ROBOTS = 6
"""Map and number of robots of the encoded frames."""
_QUICK_ENCODED_FRAMES = 60
_FULL_ENCODED_FRAMES = 240
_QUICK_ENCODING_ROUNDS = 1
_FULL_ENCODING_ROUNDS = 3
_RUN_DURATION_S = 5.0
_WHITE = (255, 255, 255)


def list_cases(*, quick: bool = False) -> list[Case]:
    """Return the benchmark cases of frames, and of videos and PNGs."""
    frames = [partial(_measure_frames, name, robots, quick=quick) for name, robots in _FRAME_CASES]
    return [*frames, partial(_measure_encoding, quick=quick)]


def _measure_frames(name: str, robots: int, *, quick: bool) -> Iterator[Row]:
    """Measure the drawing of the frames of a run, compared with clearing and copying a frame."""
    record = _simulate(name, robots)
    painter = Painter(record.environment, SIZE_PX)
    canvas = pygame.Surface(SIZE_PX)
    scenes = cycle([build_record_scene(record, k) for k in range(len(record))])
    calls = {"frame": lambda: painter.draw(canvas, next(scenes)), "bare": build_clearing_call(canvas)}
    times = measure_interleaved(calls, _QUICK_FRAME_ROUNDS if quick else _FULL_FRAME_ROUNDS)
    yield Row(
        "render",
        "one frame",
        {"robots": robots, "map": name},
        times["frame"],
        baseline=FRAME_BASELINE,
        baseline_seconds=times["bare"],
        max_seconds=FRAME_GOALS_S.get(robots),
    )


def build_clearing_call(canvas: pygame.Surface | None) -> Call:
    """Build the baseline: a call that fills an empty surface and copies it to a canvas."""
    assert canvas is not None
    empty = pygame.Surface(SIZE_PX)
    return lambda: (empty.fill(_WHITE), canvas.blit(empty, (0, 0)))


def _measure_encoding(*, quick: bool) -> Iterator[Row]:
    """Measure the encoding of the frames of a run as a video and as PNGs, compared with drawing them."""
    record = _simulate(_ENCODED_MAP, _ENCODED_ROBOTS)
    settings = VideoSettings(colors="robots")
    frame_count = _QUICK_ENCODED_FRAMES if quick else _FULL_ENCODED_FRAMES
    rows = np.linspace(0, len(record) - 1, frame_count).astype(np.intp)
    frames = list(draw_frames(record, settings, size=SIZE_PX, rows=rows))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "video.mp4"
        calls = {
            "draw": lambda: list(draw_frames(record, settings, size=SIZE_PX, rows=rows)),
            "video": lambda: save_video(path, frames),
            "png": lambda: [encode_png(frame) for frame in frames],
        }
        times = measure_interleaved(calls, _QUICK_ENCODING_ROUNDS if quick else _FULL_ENCODING_ROUNDS)
    for name, call in (("video encoded", "video"), ("PNGs encoded", "png")):
        yield Row(
            "render",
            name,
            {"frames": len(frames)},
            times[call],
            baseline="drawing the frames",
            baseline_seconds=times["draw"],
            note=f"{len(frames) / times[call]:.0f} frames per second",
        )


def _simulate(name: str, robots: int) -> Record:
    """Simulate a short run on a bundled map."""
    environment = load_map(name)
    starts = environment.start("uniform").sample(robots, seed=0)
    return Simulation(environment, Rapf(), starts).run(_RUN_DURATION_S)
