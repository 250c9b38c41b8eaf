"""Scale bar, status line, caption and legend."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_pixels import SIZE, TWO, list_legend_texts, list_pixels, render_layers
from drawn_run import HALL, ROOMS, SQUARE, build_row_scene, build_scene, record_walk

from robocov.voronoi import partition
from robocov_app.look.lengths import round_down
from robocov_app.look.theme import LIGHT
from robocov_app.render.annotations.captions import fit_status
from robocov_app.render.fonts import measure_text, render_text
from robocov_app.render.layer_catalog import build_pane_layers, build_standard_layers
from robocov_app.render.painter import Painter

LEGEND_TEXTS = {
    "cells": "Voronoi cell",
    "centroids": "cell centroid",
    "robots": "robot",
    "goals": "goal",
    "velocities": "velocity",
    "links": "neighbors",
    "sensing": "sensing range",
    "communication": "communication range",
    "obstacle_points": "nearest obstacle point",
    "force_attraction": "attraction",
    "force_repulsion_robots": "robot repulsion",
    "force_repulsion_obstacle": "obstacle repulsion",
    "force_viscosity": "viscosity",
    "force_resultant": "resultant force",
}
"""Legend texts of layers that a scene without obstacles, starts and trail can have."""


def build_full_scene():
    """Return a scene with all observations and terms, but without obstacles, starts and trail."""
    return build_scene(
        TWO,
        forces=np.ones((2, 2)),
        goals=partition(TWO, SQUARE.region).centroids,
        obstacle_points=TWO - 1,
        communication_range=5.0,
    )


def measure_first_run(values):
    """Return the number of consecutive integers that begin with the smallest one."""
    ordered = np.sort(values)
    gaps = np.flatnonzero(np.diff(ordered) > 1)
    return int(gaps[0]) + 1 if len(gaps) else len(ordered)


@pytest.mark.parametrize("environment", [ROOMS, HALL, SQUARE], ids=lambda environment: environment.name)
@pytest.mark.parametrize("size", [(640, 480), (1920, 1080)])
def test_the_scale_bar_has_a_round_length(environment, size):
    scene = build_row_scene(record_walk(environment, 2))
    pixels, painter = list_pixels(scene, "scale_bar", size=size)
    rows, counts = np.unique(pixels[:, 1], return_counts=True)
    bar_row = rows[counts.argmax()]
    bar_columns = pixels[pixels[:, 1] == bar_row, 0]
    length_m = (measure_first_run(bar_columns) - 1) / painter.camera.zoom
    assert length_m == pytest.approx(round_down(length_m * 1.02), rel=0.03)


def test_the_status_line_contains_the_cost():
    record = record_walk(SQUARE, 3)
    frame, _ = render_layers(build_row_scene(record, cost="mean 1.23 m"), "status")
    other_frame, _ = render_layers(build_row_scene(record, cost="mean 1.24 m"), "status")
    rows, columns = np.nonzero((frame != other_frame).any(axis=2))
    assert len(rows) > 3
    assert rows.min() > SIZE[1] - 34
    width_of_digit_px = 12
    assert np.ptp(columns) < width_of_digit_px


def test_a_narrow_status_omits_the_least_important_facts():
    scene = build_row_scene(record_walk(SQUARE, 3), cost="mean distance 1.234 m")
    font_size = 14
    texts = []
    for width in range(600, 0, -5):
        text = fit_status(scene, font_size, width)
        assert measure_text(text, font_size) <= width
        if text not in texts:
            texts.append(text)
    separator = "   ·   "
    assert texts[0] == separator + separator.join(["t = 3.9 s", "mean distance 1.234 m", "square"])
    assert texts[1] == separator + separator.join(["t = 3.9 s", "mean distance 1.234 m"])
    assert texts[2] == separator + "t = 3.9 s"


@pytest.mark.parametrize("text", ["", "RAPF", "mean distance 1.234 m · Museum", "…"])
@pytest.mark.parametrize("is_bold", [False, True])
def test_measured_widths_are_those_of_rendered_texts(text, is_bold):
    surface = render_text(text, 17, (0, 0, 0), bold=is_bold)
    assert measure_text(text, 17, bold=is_bold) == surface.get_width()


@pytest.mark.parametrize(
    ("changes", "is_in_left_half"),
    [
        pytest.param({"cost": "9.87 m"}, False, id="cost"),
        pytest.param({"label": "RPF"}, True, id="controller"),
    ],
)
def test_controller_and_cost_of_a_pane_are_in_its_caption_only(changes, is_in_left_half):
    scene = replace(build_row_scene(record_walk(SQUARE, 3), cost="1.23 m"), label="RAPF")
    frame, _ = render_layers(scene, "caption", "status", layers=build_pane_layers())
    changed_scene = replace(scene, **changes)
    changed_frame, _ = render_layers(changed_scene, "caption", "status", layers=build_pane_layers())
    rows, columns = np.nonzero((changed_frame != frame).any(axis=2))
    assert len(rows) > 5
    assert rows.max() < 34
    middle = SIZE[0] // 2
    assert ((columns < middle) == is_in_left_half).all()


def test_a_long_status_ends_before_the_scale_bar():
    scene = build_row_scene(record_walk(SQUARE, 3), cost="word " * 60)
    pixels, _ = list_pixels(scene, "status", "scale_bar")
    scale_bar_pixels, _ = list_pixels(scene, "scale_bar")
    scale_bar_set = {tuple(pixel) for pixel in scale_bar_pixels.tolist()}
    status = np.array([pixel for pixel in pixels.tolist() if tuple(pixel) not in scale_bar_set])
    assert pixels[:, 0].max() < SIZE[0]
    assert status[:, 0].min() > scale_bar_pixels[:, 0].max() + 8


@pytest.mark.parametrize("layer", list(LEGEND_TEXTS))
def test_the_legend_lists_a_visible_layer(layer):
    painter = Painter(SQUARE, SIZE)
    painter.show_only({layer})
    assert list_legend_texts(painter, build_full_scene()) == [LEGEND_TEXTS[layer]]


def test_the_legend_lists_only_what_the_scene_has():
    painter = Painter(SQUARE, SIZE)
    painter.show_only({layer.name for layer in build_standard_layers()})
    texts = list_legend_texts(painter, build_full_scene())
    assert sorted(texts) == sorted(LEGEND_TEXTS.values())


def test_the_legend_lists_obstacles_trajectories_and_starts():
    painter = Painter(ROOMS, SIZE)
    painter.show_only({"obstacles", "starts", "trajectories"})
    texts = list_legend_texts(painter, build_row_scene(record_walk(ROOMS, 2)))
    assert texts == ["obstacle (unknown to robots)", "trajectory", "start"]


@pytest.mark.parametrize("size", [SIZE, (1920, 1080)])
def test_a_long_legend_is_above_the_map_and_not_cut_at_the_right(size):
    scene = build_row_scene(record_walk(ROOMS, 6))
    painter = Painter(ROOMS, size)
    painter.show_only([layer.name for layer in build_standard_layers()])
    frame = painter.render_frame(scene).astype(int)
    map_top = int(painter.camera.to_pixels(ROOMS.region.vertices)[:, 1].min())
    is_drawn = (frame[: map_top - 4] != np.array(LIGHT.background)).any(axis=2)
    assert is_drawn.any()
    assert not is_drawn[:, -3:].any()
