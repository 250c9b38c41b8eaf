"""Frames of several runs next to each other."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_run import CORRIDOR, ROOMS, SHAFT, record_walk

from robocov.metrics import CostHistory
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.layer_catalog import build_pane_layers
from robocov_app.runs.frames import draw_frames, select_frame_rows
from robocov_app.runs.pane_layout import build_pane_layout, tile_frames
from robocov_app.runs.settings import VideoSettings
from robocov_app.runs.video import draw_comparison_frames


def build_history(record):
    """Return a history of the cost with one value at the first row."""
    value = np.array([1.0])
    return CostHistory(record.time[:1], value, value, value)


def draw_comparison(records, theme="light", colors="robots", size=None, speed=4.0):
    """Return the layout of a comparison, and an iterator of its frames."""
    video_settings = VideoSettings(theme=theme, colors=colors, fps=5, speed=speed)
    layout = build_pane_layout(records, video_settings, size)
    costs = [build_history(record) for record in records]
    return layout, draw_comparison_frames(records, costs, layout, video_settings)


def build_header(records):
    """Return the header of a comparison with its legend, (height, width, 3)."""
    return build_pane_layout(records, VideoSettings()).header


def count_pixels(image, color, max_error):
    """Return the number of pixels that differ from a color by less than an error."""
    errors = np.abs(image.astype(int) - np.array(color)).max(axis=2)
    return int((errors < max_error).sum())


def test_panes_are_tiled_in_rows_with_lines_between_them():
    line_color = (99, 98, 97)
    background = (1, 2, 3)
    panes = [np.full((48, 64, 3), 20 * k, dtype=np.uint8) for k in range(1, 6)]
    frame = tile_frames(panes, 3, gap=2, line=line_color, background=background)
    assert frame.shape == (2 * 48 + 2, 3 * 64 + 2 * 2, 3)
    for k, pane in enumerate(panes):
        row, column = divmod(k, 3)
        assert (frame[row * 50 : row * 50 + 48, column * 66 : column * 66 + 64] == pane).all()
    assert (frame[48:50] == line_color).all()
    assert (frame[50:, 64:66] == line_color).all()
    assert (frame[50:, 130:] == background).all()


class TestLayout:
    @pytest.mark.parametrize(
        ("environment", "n_runs", "n_columns"),
        [(ROOMS, 1, 1), (ROOMS, 2, 2), (ROOMS, 3, 3), (ROOMS, 4, 2), (CORRIDOR, 3, 1), (SHAFT, 4, 4)],
    )
    def test_the_number_of_columns_depends_on_the_shape_of_the_map(self, environment, n_runs, n_columns):
        layout = build_pane_layout([record_walk(environment, 3)] * n_runs, VideoSettings())
        width, height = layout.size
        assert layout.columns == n_columns
        assert width <= 1920
        assert height <= 1090
        assert width % 2 == 0
        assert height % 2 == 0

    def test_a_wide_map_is_nearly_as_wide_as_the_video(self):
        layout, frames = draw_comparison([record_walk(CORRIDOR, 3)] * 3)
        assert layout.pane[0] == 1920
        is_boundary = (next(frames) == np.array(LIGHT.boundary)).all(axis=2)
        n_columns_with_boundary = is_boundary.any(axis=0).sum()
        assert n_columns_with_boundary > 1800

    @pytest.mark.parametrize("size", [(1281, 719), (320, 240)])
    @pytest.mark.parametrize("n_runs", [1, 5])
    def test_frames_have_the_requested_size(self, size, n_runs):
        _, frames = draw_comparison([record_walk(ROOMS, 3)] * n_runs, size=size)
        assert next(frames).shape == (size[1], size[0], 3)

    @pytest.mark.parametrize("n_runs", [1, 3, 5])
    @pytest.mark.parametrize(
        "environment", [ROOMS, CORRIDOR, SHAFT], ids=lambda environment: environment.name
    )
    def test_frames_have_the_size_of_the_layout_by_default(self, environment, n_runs):
        layout, frames = draw_comparison([record_walk(environment, 2)] * n_runs, theme="dark")
        frame = next(frames)
        width, height = layout.size
        n_rows = -(-n_runs // layout.columns)
        assert frame.shape == (height, width, 3)
        assert len(layout.header) + n_rows * layout.pane[1] <= height
        assert (frame[-1, 0] == DARK.background).all()


class TestFrames:
    def test_a_comparison_lasts_as_long_as_the_longest_run(self):
        short_run = record_walk(ROOMS, 2, steps=11)
        long_run = record_walk(ROOMS, 2, steps=41)
        _, frames = draw_comparison([short_run, long_run], size=(640, 300), speed=1.0)
        assert len(list(frames)) == len(select_frame_rows(long_run.time, 5))

    @pytest.mark.parametrize("is_swapped", [False, True])
    def test_the_right_pane_is_the_video_of_the_second_run(self, is_swapped):
        first = record_walk(ROOMS, 3, steps=21)
        second = replace(first, positions=first.positions[:, ::-1] + 0.4)
        records = [second, first] if is_swapped else [first, second]
        layout, frames = draw_comparison(records, size=(1280, 640))
        expected_frames = draw_frames(
            records[1],
            VideoSettings(fps=5),
            layers=build_pane_layers("robots"),
            cost=build_history(records[1]),
            size=layout.pane,
            scale=layout.scale,
        )
        top = len(layout.header)
        width, height = layout.pane
        for frame, expected in zip(frames, expected_frames, strict=True):
            assert (frame[top : top + height, -width:] == expected).all()

    def test_one_legend_contains_the_entries_of_all_panes(self):
        without_goals = record_walk(ROOMS, 3, controller="rpf")
        with_goals = replace(without_goals, goals=without_goals.positions + 0.1)
        header_without_goals = build_header([without_goals, without_goals])
        header = build_header([without_goals, with_goals])
        assert header.shape == header_without_goals.shape
        n_drawn = (header != 255).any(axis=2).sum()
        n_drawn_without_goals = (header_without_goals != 255).any(axis=2).sum()
        assert n_drawn > n_drawn_without_goals + 100
        assert (build_header([with_goals, with_goals]) == header).all()

    @pytest.mark.slow
    def test_only_trajectories_in_the_colors_of_the_paper_are_red(self):
        record = record_walk(ROOMS, 4)
        red_pixels = {}
        for colors in ("paper", "robots"):
            _, frames = draw_comparison([record, record], colors=colors, size=(1280, 640))
            *_, last_frame = frames
            red_pixels[colors] = count_pixels(last_frame[100:], LIGHT.trajectory, max_error=12)
        assert red_pixels["paper"] > 500
        assert red_pixels["robots"] < 20
