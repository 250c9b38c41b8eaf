"""Videos of single runs, and of several runs side by side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import zip_longest
from pathlib import Path

import numpy as np

from robocov.cost import CoverageCost, TimeVaryingCost
from robocov.files.result_names import COMPARISON_VIDEO_FILE, FRAMES_FOLDER, RUN_VIDEO_FILE
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov_app.render.distance_map.colors import choose_color_limit
from robocov_app.render.distance_map.pixel_distances import DistanceFields
from robocov_app.render.layer_catalog import build_pane_layers
from robocov_app.runs.cost import MIN_VIDEO_LATTICE, build_cost, refine_cost_for_figures
from robocov_app.runs.encoding import Frame, save_frames_and_video
from robocov_app.runs.execution import Run
from robocov_app.runs.frames import draw_frames, select_frame_rows
from robocov_app.runs.pane_layout import PaneLayout, build_pane_layout
from robocov_app.runs.settings import VideoSettings
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.progress import show_progress

VIDEO_HOLD_S = 1.0
"""Duration for which a video shows its last step."""
_COLOR_SCALE_FACTOR = 1.3
"""Upper end of the color scale of a video, divided by the largest distance at the end of the runs."""


def get_video_name(runs: int) -> str:
    """Return the file name of a video that shows a given number of runs."""
    return COMPARISON_VIDEO_FILE if runs > 1 else RUN_VIDEO_FILE


def draw_comparison_frames(
    records: Sequence[Record],
    costs: Sequence[CostHistory],
    layout: PaneLayout,
    settings: VideoSettings,
    *,
    hold: float = 0.0,
    fields: DistanceFields | None = None,
) -> Iterator[Frame]:
    """Draw the frames of several runs side by side.

    Parameters
    ----------
    records : sequence of Record
        The record of each pane. A pane whose run is shorter stays at its last step.
    costs : sequence of CostHistory
        The coverage cost over each run.
    layout : PaneLayout
        Layout of the panes.
    settings : VideoSettings
        Settings of the video.
    hold : float, s
        Duration for which the last step is shown.
    fields : DistanceFields or None
        Distances to the nearest robot, if a layer shows them.

    Yields
    ------
    Frame
    """
    pane_videos = [
        draw_frames(
            record,
            settings,
            # Layers cache drawings, so each pane needs layers of its own.
            layers=build_pane_layers(settings.colors),
            cost=cost,
            rows=select_frame_rows(record.time, settings.fps, settings.speed, hold),
            size=layout.pane,
            scale=layout.scale,
            fields=fields,
        )
        for record, cost in zip(records, costs, strict=True)
    ]
    current_frames: dict[int, Frame] = {}
    for new_frames in zip_longest(*pane_videos):
        # None stands for a video that has ended; its pane keeps the last frame.
        current_frames |= {pane: frame for pane, frame in enumerate(new_frames) if frame is not None}
        yield layout.compose_page(list(current_frames.values()), settings.color_theme)


def save_videos(
    runs: Sequence[Run],
    cost: CoverageCost | None,
    folder: Path,
    settings: VideoSettings,
    interruption: Interruption,
    *,
    quiet: bool,
    runs_on_one_map: Sequence[Run] | None = None,
) -> None:
    """Write frames and a video of runs to a folder, as requested by the settings.

    Parameters
    ----------
    runs : sequence of Run
        Runs to show; several runs are shown side by side.
    cost : CoverageCost or None
        Cost of the runs' map, if it has been computed already.
    folder : Path
        Folder of the files.
    settings : VideoSettings
        Settings of the video.
    interruption : Interruption
        Writing ends early if an interruption is requested.
    quiet : bool
        Whether to hide progress.
    runs_on_one_map : sequence of Run or None
        The same runs on the map without failed robots, which are obstacles in the maps of `runs`. If given,
        distances are computed on the map without them.

    Raises
    ------
    OutputError
        If a file cannot be written, or there is no encoder.
    """
    fields = _build_fields(runs_on_one_map or runs, cost, settings, quiet=quiet)
    records = [run.record for run in runs]
    costs = [run.history for run in runs]
    longest = max(records, key=len)
    rows = select_frame_rows(longest.time, settings.fps, settings.speed, VIDEO_HOLD_S)
    if len(runs) == 1:
        frames = draw_frames(
            records[0], settings, size=settings.video_size, cost=costs[0], rows=rows, fields=fields
        )
    else:
        layout = build_pane_layout(records, settings, settings.size, fields)
        frames = draw_comparison_frames(records, costs, layout, settings, hold=VIDEO_HOLD_S, fields=fields)
    path = folder / get_video_name(len(runs))
    write_frames_and_video(frames, len(rows), path, settings, interruption, quiet=quiet)


def _build_fields(
    runs: Sequence[Run], cost: CoverageCost | None, settings: VideoSettings, *, quiet: bool
) -> DistanceFields | None:
    """Prepare the distances that videos show, with a common color scale; None if no layer shows distances."""
    if not settings.shown_layers & {"distances", "geodesic_cells"}:
        return None
    environment = runs[0].record.environment
    if cost is None:
        min_radius = min(run.record.team.min_radius for run in runs)
        cost = build_cost(environment, MIN_VIDEO_LATTICE, radius=min_radius, quiet=quiet)
    cost = refine_cost_for_figures(environment, cost, MIN_VIDEO_LATTICE)
    varying_cost = TimeVaryingCost(cost)
    largest_distance = 0.0
    for run in runs:
        record = run.record
        result = varying_cost(float(record.time[-1]), record.positions[-1], record.is_working[-1])
        if result is not None:
            finite_distances = result.distances[np.isfinite(result.distances)]
            largest_distance = max(largest_distance, float(finite_distances.max(initial=0.0)))
    return DistanceFields(cost, choose_color_limit(_COLOR_SCALE_FACTOR * largest_distance))


def write_frames_and_video(
    frames: Iterator[Frame],
    total: int,
    path: Path,
    settings: VideoSettings,
    interruption: Interruption,
    *,
    quiet: bool,
) -> None:
    """Write frames as a video, and as PNG files in the folder ``frames`` next to it.

    Parameters
    ----------
    frames : iterator of Frame
        The frames.
    total : int
        Expected number of frames, for progress.
    path : Path
        File of the video.
    settings : VideoSettings
        Settings of the video, which determine which files are written.
    interruption : Interruption
        Writing ends early if an interruption is requested.
    quiet : bool
        Whether to hide progress.

    Raises
    ------
    OutputError
        If a file cannot be written, or there is no encoder.
    """
    with show_progress("video" if settings.video else "frames", total, quiet=quiet) as update:

        def report_frames() -> Iterator[Frame]:
            for count, frame in enumerate(frames, start=1):
                yield frame
                update(count)
                if interruption.requested:
                    return

        frame_folder = path.parent / FRAMES_FOLDER if settings.frames else None
        video_path = path if settings.video else None
        save_frames_and_video(report_frames(), frame_folder, video_path, settings.fps)
