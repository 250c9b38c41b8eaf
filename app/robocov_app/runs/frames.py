"""Frames of recorded runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

import numpy as np

from robocov.metrics import CostHistory
from robocov.record import Record
from robocov.typing import FloatArray, IntArray
from robocov_app.render.density_text import format_cost, get_cost_name
from robocov_app.render.distance_map.pixel_distances import DistanceFields
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.render.layers.layer import Layer
from robocov_app.render.painter import Painter
from robocov_app.render.record_scene import build_record_scene
from robocov_app.runs.encoding import Frame
from robocov_app.runs.settings import VideoSettings

_TIME_TOLERANCE_S = 5e-7
"""Maximum rounding error of a time, which is a sum of control periods."""
_FRAME_COUNT_TOLERANCE = 1e-9
"""Maximum rounding error of a number of frames."""


def select_frame_rows(time: FloatArray, fps: float, speed: float = 1.0, hold: float = 0.0) -> IntArray:
    """Select the recorded step that each frame of a video shows.

    Parameters
    ----------
    time : (T,) array, s
        Ascending times of the recorded steps.
    fps : float
        Frames per second of the video.
    speed : float
        Simulated seconds per second of the video.
    hold : float, s
        Duration for which the video shows the last step.

    Returns
    -------
    (k,) int array
        Index of the recorded step in each frame.
    """
    duration = float(time[-1] - time[0])
    moving_count = int(np.ceil(duration / speed * fps - _FRAME_COUNT_TOLERANCE)) + 1
    frame_times = time[0] + np.arange(moving_count + round(hold * fps)) * (speed / fps)
    rows = np.searchsorted(time, frame_times + _TIME_TOLERANCE_S, side="right") - 1
    return np.asarray(np.clip(rows, 0, len(time) - 1), dtype=np.intp)


def draw_frames(
    record: Record,
    settings: VideoSettings,
    *,
    size: tuple[int, int] = (1280, 720),
    layers: Sequence[Layer] | None = None,
    scale: float | None = None,
    cost: CostHistory | None = None,
    rows: IntArray | None = None,
    fields: DistanceFields | None = None,
) -> Iterator[Frame]:
    """Draw the frames of a recorded run.

    Parameters
    ----------
    record : Record
        The run.
    settings : VideoSettings
        Settings of the video.
    size : (width, height), px
        Size of the frames.
    layers : sequence of Layer or None
        Layers to draw. By default, the standard layers.
    scale : float or None
        Scale of text and lines. By default, one that suits the size.
    cost : CostHistory or None
        The coverage cost over the run. Each frame shows its latest value.
    rows : (k,) int array or None
        Indices of the recorded steps that the frames show. By default, the result of `select_frame_rows`.
    fields : DistanceFields or None
        Distances to the nearest robot, if a layer shows them.

    Yields
    ------
    Frame
    """
    painter = build_painter(record, settings, size, layers or build_standard_layers(settings.colors), scale)
    if rows is None:
        rows = select_frame_rows(record.time, settings.fps, settings.speed)
    for row, repetitions in groupby(rows.tolist()):
        scene = build_record_scene(
            record,
            row,
            cost=_describe_cost(record, cost, float(record.time[row])),
            fields=fields if painter.needs_field else None,
        )
        frame = painter.render_frame(scene)
        for _ in repetitions:
            yield frame


def build_painter(
    record: Record,
    settings: VideoSettings,
    size: tuple[int, int],
    layers: Sequence[Layer],
    scale: float | None,
) -> Painter:
    """Build the painter of a record's map.

    Parameters
    ----------
    record : Record
        The run.
    settings : VideoSettings
        Settings of the video.
    size : (width, height), px
        Size of the frames.
    layers : sequence of Layer
        Layers to draw.
    scale : float or None
        Scale of text and lines; by default one that suits the size.

    Returns
    -------
    Painter
    """
    painter = Painter(record.environment, size, settings.color_theme, layers, scale)
    painter.change_visible(settings.shown_layers, settings.hidden_layers)
    return painter


def _describe_cost(record: Record, cost: CostHistory | None, time: float) -> str:
    """Format the latest cost that is known at a given time, s; empty if there is none."""
    if cost is None:
        return ""
    known_count = int(np.searchsorted(cost.time, time + _TIME_TOLERANCE_S, side="right"))
    if known_count == 0:
        return ""
    latest = known_count - 1
    mean_time = None if cost.mean_time is None else cost.mean_time[latest]
    return format_cost(get_cost_name(record.environment), cost.mean_distance[latest], mean_time)
