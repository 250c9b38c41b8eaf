from dataclasses import replace

import numpy as np
import pytest
from drawn_pixels import SIZE, TWO, list_legend_texts, list_pixels, render_layers
from drawn_run import HALL, ROOMS, SQUARE, build_row_scene, build_scene, record_walk

from robocov.voronoi import partition
from robocov_app.look.theme import LIGHT
from robocov_app.render.annotations.captions import fit_status
from robocov_app.render.fonts import measure_text, render_text
from robocov_app.render.layer_catalog import build_pane_layers, build_standard_layers
from robocov_app.render.painter import Painter


@pytest.mark.parametrize("environment", [ROOMS, HALL, SQUARE], ids=lambda map_: map_.name)
@pytest.mark.parametrize("size", [(640, 480), (1920, 1080)])
def test_the_scale_bar_has_the_length_of_its_label(environment, size):
    from robocov_app.look.lengths import round_down

    pixels, painter = list_pixels(build_row_scene(record_walk(environment, 2)), "scale_bar", size=size)
    rows, counts = np.unique(pixels[:, 1], return_counts=True)
    bar = pixels[pixels[:, 1] == rows[counts.argmax()]]
    run = np.split(np.sort(bar[:, 0]), np.nonzero(np.diff(np.sort(bar[:, 0])) > 1)[0] + 1)[0]
    meters = (len(run) - 1) / painter.camera.zoom
    assert meters == pytest.approx(round_down(meters * 1.02), rel=0.03)


def test_the_status_line_contains_the_cost():
    record = record_walk(SQUARE, 3)
    frames = [
        render_layers(build_row_scene(record, cost=cost), "status")[0]
        for cost in ("mean 1.23 m", "mean 1.24 m")
    ]
    rows, columns = np.nonzero((frames[0] != frames[1]).any(axis=2))
    assert len(rows) > 3
    assert rows.min() > SIZE[1] - 34
    assert np.ptp(columns) < 12  # one digit


def test_a_narrow_status_omits_the_least_important_facts():
    scene = build_row_scene(record_walk(SQUARE, 3), cost="mean distance 1.234 m")
    size = 14
    found = []
    for room in range(600, 0, -5):
        text = fit_status(scene, size, room)
        assert measure_text(text, size) <= room
        if not found or found[-1] != text:
            found.append(text)
    lead = "   ·   "
    assert found[0] == lead + lead.join(["t = 3.9 s", "mean distance 1.234 m", "square"])
    assert found[1] == lead + lead.join(["t = 3.9 s", "mean distance 1.234 m"])
    assert found[2] == lead + "t = 3.9 s"


def test_measured_texts_have_the_width_of_rendered_ones():
    for text in ("", "RAPF", "mean distance 1.234 m · Museum", "…"):
        for bold in (False, True):
            assert measure_text(text, 17, bold) == render_text(text, 17, (0, 0, 0), bold).get_width()


def test_a_caption_contains_the_facts_that_the_status_omits():
    """In a pane, controller and cost stand above the arena, and nothing of them below it."""
    record = record_walk(SQUARE, 3)
    frames = []
    for cost, label_ in (("1.23 m", "RAPF"), ("9.87 m", "RAPF"), ("1.23 m", "RPF")):
        scene = replace(build_row_scene(record, cost=cost), label=label_)
        frames.append(render_layers(scene, "caption", "status", layers=build_pane_layers())[0])
    for frame, side in ((frames[1], slice(SIZE[0] // 2, None)), (frames[2], slice(0, SIZE[0] // 2))):
        rows, columns = np.nonzero((frame != frames[0]).any(axis=2))
        assert len(rows) > 5 and rows.max() < 34
        assert set(columns.tolist()) <= set(range(SIZE[0])[side])


def test_a_long_status_ends_before_the_scale_bar():
    scene = build_row_scene(record_walk(SQUARE, 3), cost="word " * 60)
    pixels, _ = list_pixels(scene, "status", "scale_bar")
    alone, _ = list_pixels(scene, "scale_bar")
    assert pixels[:, 0].max() < SIZE[0]
    status = np.array(sorted({tuple(p) for p in pixels.tolist()} - {tuple(p) for p in alone.tolist()}))
    assert status[:, 0].min() > alone[:, 0].max() + 8


def test_the_legend_lists_the_visible_elements():
    scene = build_scene(
        TWO,
        forces=np.ones((2, 2)),
        goals=partition(TWO, SQUARE.region).centroids,
        obstacle_points=TWO - 1,
        communication_range=5.0,
    )
    painter = Painter(SQUARE, SIZE)
    words = {
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
    for name, word in words.items():
        painter.show_only({name})
        assert list_legend_texts(painter, scene) == [word]
    painter.show_only({layer.name for layer in build_standard_layers()})
    # The scene has no obstacles, starts or trail.
    assert sorted(list_legend_texts(painter, scene)) == sorted(words.values())
    painter.show_only({"obstacles", "starts", "trajectories"})
    rooms = build_row_scene(record_walk(ROOMS, 2))
    assert list_legend_texts(painter, rooms) == ["obstacle (unknown to robots)", "trajectory", "start"]


def test_the_legend_is_above_the_arena_in_enough_rows():
    scene = build_row_scene(record_walk(ROOMS, 6))
    names = [layer.name for layer in build_standard_layers()]
    for size in (SIZE, (1920, 1080)):
        painter = Painter(ROOMS, size)
        painter.show_only(names)
        painter.render_frame(scene)
        top = painter.camera.to_pixels(ROOMS.region.vertices)[:, 1].min()
        frame = painter.render_frame(scene).astype(int)
        strip = (frame[: int(top) - 4] != np.array(LIGHT.background)).any(axis=2)
        assert strip.any()
        assert not strip[:, -3:].any()  # nothing is cut at the right
