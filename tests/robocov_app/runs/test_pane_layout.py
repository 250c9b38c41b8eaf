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
    one = np.array([1.0])
    return CostHistory(record.time[:1], one, one, one)


def film(records, theme="light", colors="robots", size=None, speed=4.0):
    style = VideoSettings(theme=theme, colors=colors, fps=5, speed=speed)
    layout = build_pane_layout(records, style, size)
    costs = [build_history(record) for record in records]
    return layout, draw_comparison_frames(records, costs, layout, style)


def test_frames_stand_in_rows_and_a_place_may_be_free():
    grays = [np.full((48, 64, 3), 20 * k, dtype=np.uint8) for k in range(1, 6)]
    frame = tile_frames(grays, 3, gap=2, line=(99, 98, 97), background=(1, 2, 3))
    assert frame.shape == (2 * 48 + 2, 3 * 64 + 2 * 2, 3)
    for k in range(5):
        row, column = divmod(k, 3)
        pane = frame[row * 50 : row * 50 + 48, column * 66 : column * 66 + 64]
        assert (pane == 20 * (k + 1)).all()
    assert (frame[48:50] == (99, 98, 97)).all() and (frame[50:, 64:66] == (99, 98, 97)).all()
    assert (frame[50:, 130:] == (1, 2, 3)).all()


class TestLayout:
    @pytest.mark.parametrize(
        ("environment", "count", "columns"),
        [(ROOMS, 1, 1), (ROOMS, 2, 2), (ROOMS, 3, 3), (ROOMS, 4, 2), (CORRIDOR, 3, 1), (SHAFT, 4, 4)],
    )
    def test_wide_maps_stand_below_each_other(self, environment, count, columns):
        layout = build_pane_layout([record_walk(environment, 3)] * count, VideoSettings())
        assert layout.columns == columns
        assert layout.size[0] <= 1920 and layout.size[1] <= 1090
        assert layout.size[0] % 2 == layout.size[1] % 2 == 0

    def test_a_wide_map_is_drawn_nearly_as_wide_as_the_film(self):
        layout, frames = film([record_walk(CORRIDOR, 3)] * 3)
        frame = next(frames)
        assert layout.pane[0] == 1920
        obstacles_or_boundary = (frame == np.array(LIGHT.boundary)).all(axis=2)
        assert np.nonzero(obstacles_or_boundary.any(axis=0))[0].size > 1800

    @pytest.mark.parametrize("size", [(1281, 719), (320, 240)])
    @pytest.mark.parametrize("count", [1, 5])
    def test_frames_have_exactly_the_size_asked_for(self, size, count):
        _, frames = film([record_walk(ROOMS, 3)] * count, size=size)
        assert next(frames).shape == (size[1], size[0], 3)

    @pytest.mark.parametrize("count", [1, 3, 5])
    @pytest.mark.parametrize("environment", [ROOMS, CORRIDOR, SHAFT], ids=lambda map_: map_.name)
    def test_without_a_size_it_is_what_the_layout_says(self, environment, count):
        layout, frames = film([record_walk(environment, 2)] * count, theme="dark")
        frame = next(frames)
        assert frame.shape == (layout.size[1], layout.size[0], 3)
        rows = -(-count // layout.columns)
        assert len(layout.header) + rows * layout.pane[1] <= layout.size[1]
        assert (frame[-1, 0] == DARK.background).all()


class TestFrames:
    def test_the_longest_run_ends_it(self):
        short = record_walk(ROOMS, 2, steps=11)
        long = record_walk(ROOMS, 2, steps=41)
        _, frames = film([short, long], size=(640, 300), speed=1.0)
        assert sum(1 for _ in frames) == len(select_frame_rows(long.time, 5))

    def test_each_pane_is_the_film_of_its_own_run(self):
        first = record_walk(ROOMS, 3, steps=21)
        second = replace(first, positions=first.positions[:, ::-1] + 0.4)
        for records in ([first, second], [second, first]):
            layout, frames = film(records, size=(1280, 640))
            style = VideoSettings(fps=5)
            layers = build_pane_layers("robots")
            cost = build_history(records[1])
            alone = draw_frames(
                records[1], style, layers=layers, cost=cost, size=layout.pane, scale=layout.scale
            )
            for frame, wanted in zip(frames, alone, strict=True):
                top = len(layout.header)
                assert (frame[top : top + wanted.shape[0], -wanted.shape[1] :] == wanted).all()

    def test_one_legend_explains_what_any_of_them_shows(self):
        without = record_walk(ROOMS, 3, controller="rpf")
        with_goals = replace(without, goals=without.positions + 0.1)
        plain_header = build_pane_layout([without, without], VideoSettings()).header
        both = build_pane_layout([without, with_goals], VideoSettings()).header
        assert plain_header.shape == both.shape
        ink = [int((header != 255).any(axis=2).sum()) for header in (plain_header, both)]
        assert ink[1] > ink[0] + 100  # the cell centroid
        twice = build_pane_layout([with_goals, with_goals], VideoSettings()).header
        assert (twice == both).all()

    @pytest.mark.slow
    def test_trajectories_have_the_colors_asked_for(self):
        record = record_walk(ROOMS, 4)
        reds = []
        for colors in ("paper", "robots"):
            _, frames = film([record, record], colors=colors, size=(1280, 640))
            last = list(frames)[-1].astype(int)
            body = last[100:]
            reds.append(int((np.abs(body - np.array(LIGHT.trajectory)).max(axis=2) < 12).sum()))
        assert reds[0] > 500 > 20 > reds[1]
