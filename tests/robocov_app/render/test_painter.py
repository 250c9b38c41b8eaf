"""Frames of a painter: their size, their view, and what is cached between them."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pygame
import pytest
from drawn_run import CORRIDOR, HALL, ROOMS, SHAFT, SQUARE, build_row_scene, build_scene, record_walk
from hypothesis import example, given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.errors import ParameterError
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render import fonts
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.render.painter import Painter, choose_scale


@pytest.mark.parametrize("size", [(640, 480), (641, 399), (1920, 1080)])
def test_a_frame_has_the_requested_size(size):
    frame = Painter(ROOMS, size).render_frame(build_row_scene(record_walk(ROOMS, 6)))
    assert frame.shape == (size[1], size[0], 3)
    assert frame.dtype == np.uint8


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_the_same_scene_gives_the_same_bytes(theme):
    scene = build_row_scene(record_walk(ROOMS, 12))
    painter = Painter(ROOMS, (800, 600), theme)
    other_painter = Painter(ROOMS, (800, 600), theme)
    frame = painter.render_frame(scene).tobytes()
    assert other_painter.render_frame(scene).tobytes() == frame
    assert painter.render_frame(scene).tobytes() == frame


def test_a_frame_is_not_overwritten_by_the_next():
    record = record_walk(SQUARE, 4)
    painter = Painter(SQUARE, (320, 240))
    first_frame = painter.render_frame(build_row_scene(record, 5))
    copy_of_first_frame = first_frame.copy()
    second_frame = painter.render_frame(build_row_scene(record, 30))
    assert (first_frame == copy_of_first_frame).all()
    assert (first_frame != second_frame).any()


@pytest.mark.parametrize(
    "environment", [ROOMS, HALL, CORRIDOR, SHAFT], ids=lambda environment: environment.name
)
@pytest.mark.parametrize("size", [(480, 360), (1280, 720), (400, 900)])
def test_the_whole_region_is_visible(environment, size):
    painter = Painter(environment, size)
    painter.render_frame(build_row_scene(record_walk(environment, 3)))
    x, y = painter.camera.to_pixels(environment.region.vertices).T
    left, top, width, height = painter.camera.view
    assert x.min() >= left + 1
    assert x.max() <= left + width - 1
    assert y.min() >= top + 1
    assert y.max() <= top + height - 1


def test_a_zoomed_map_does_not_cover_the_legend():
    scene = build_row_scene(record_walk(ROOMS, 6))
    painter = Painter(ROOMS, (640, 480))
    frame = painter.render_frame(scene)
    view_top = int(painter.camera.view[1])
    painter.camera = painter.camera.zoom_at(5.0, (300, 250)).pan(37, -12)
    zoomed_frame = painter.render_frame(scene)
    assert (zoomed_frame != frame).any()
    assert (zoomed_frame[:view_top] == frame[:view_top]).all()


def test_fit_undoes_zoom_and_pan():
    scene = build_row_scene(record_walk(ROOMS, 6))
    painter = Painter(ROOMS, (640, 480))
    frame = painter.render_frame(scene)
    painter.camera = painter.camera.zoom_at(5.0, (300, 250)).pan(37, -12)
    painter.render_frame(scene)
    painter.fit()
    assert (painter.render_frame(scene) == frame).all()


@settings(deadline=None, max_examples=count_examples(40))
@given(
    factor=st.floats(-12, 14).map(lambda power: 2.0**power),
    pan_px=st.tuples(st.floats(-3000, 3000), st.floats(-3000, 3000)),
    pixel=st.tuples(st.floats(0, 320), st.floats(0, 240)),
)
@example(factor=2.0**40, pan_px=(0.0, 0.0), pixel=(100.0, 100.0))
def test_all_layers_can_be_drawn_at_any_zoom(factor, pan_px, pixel):
    positions = np.array([[2.0, 2.0], [6.0, 6.0]])
    starts = np.ones((2, 2))
    scene = build_scene(
        positions,
        forces=np.ones((2, 2)),
        velocities=np.ones((2, 2)),
        goals=np.array([[1.0, 7.0], [7.0, 1.0]]),
        obstacle_points=np.zeros((2, 2)),
        communication_range=9.0,
    )
    scene = replace(scene, starts=starts, trail=np.linspace(starts, positions, 9))
    painter = Painter(SQUARE, (320, 240))
    painter.show_only({layer.name for layer in painter.layers})
    painter.render_frame(scene)
    painter.camera = painter.camera.zoom_at(factor, pixel).pan(*pan_px)
    assert painter.render_frame(scene).shape == (240, 320, 3)


@settings(deadline=None, max_examples=count_examples(15))
@given(st.floats(20, 5000), st.floats(0.5, 7.5), st.floats(0.5, 7.5))
def test_cells_are_exact_at_high_zoom(factor, x, y):
    """Clipping edges that end far outside the view must not turn them."""
    positions = np.array([[1.0, 2.0], [6.0, 7.0], [5.0, 1.0]])
    scene = build_scene(positions)
    painter = Painter(SQUARE, (320, 240))
    painter.show_only({"cells"})
    painter.render_frame(scene)
    painter.camera = replace(painter.camera, center=(x, y)).zoom_at(factor, painter.camera.middle)
    frame = painter.render_frame(scene)
    columns, rows = np.meshgrid(np.arange(4, 320, 13), np.arange(16, 225, 13))
    pixels = np.column_stack([columns.ravel(), rows.ravel()])
    points = painter.camera.to_world(pixels + 0.5)
    distances = np.linalg.norm(points[:, None] - positions, axis=2)
    nearest, second_nearest, _ = np.sort(distances, axis=1).T
    is_far_from_edges = (second_nearest - nearest) * painter.camera.zoom > 6
    is_inside = (points > 0).all(axis=1) & (points < 8).all(axis=1)
    is_clear = is_far_from_edges & is_inside
    owners = distances.argmin(axis=1)
    for (column, row), robot in zip(pixels[is_clear], owners[is_clear], strict=True):
        assert tuple(frame[row, column]) == LIGHT.get_cell_color(robot)


def test_the_legend_has_the_colors_of_the_trajectories():
    scene = build_row_scene(record_walk(ROOMS, 6))
    legends = []
    for colors in ("robots", "paper"):
        painter = Painter(ROOMS, (640, 480), layers=build_standard_layers(colors))
        painter.show_only({"legend", "trajectories"})
        legends.append(painter.render_frame(scene)[:20])
    assert (legends[0] != legends[1]).any()


def test_drawing_on_a_part_of_a_window_does_not_change_the_rest():
    background = (1, 2, 3)
    scene = build_row_scene(record_walk(ROOMS, 6))
    window = pygame.Surface((900, 600), 0, 32)
    window.fill(background)
    painter = Painter(ROOMS, (640, 480))
    painter.draw(window.subsurface((100, 50, 640, 480)), scene)
    pixels = pygame.surfarray.array3d(window).swapaxes(0, 1)
    assert (pixels[50:530, 100:740] == painter.render_frame(scene)).all()
    is_outside = np.ones((600, 900), dtype=bool)
    is_outside[50:530, 100:740] = False
    assert (pixels[is_outside] == background).all()


def test_a_painter_takes_the_size_of_the_surface():
    painter = Painter(ROOMS, (640, 480))
    scene = build_row_scene(record_walk(ROOMS, 6))
    painter.render_frame(scene)
    painter.draw(pygame.Surface((800, 500), 0, 32), scene)
    assert painter.size == (800, 500)
    assert painter.render_frame(scene).shape == (500, 800, 3)


def test_static_layers_are_drawn_once_per_camera():
    layers = build_standard_layers()
    index = [layer.name for layer in layers].index("obstacles")
    draw_obstacles = Mock(wraps=layers[index].draw)
    layers[index] = replace(layers[index], draw=draw_obstacles)
    record = record_walk(ROOMS, 6)
    painter = Painter(ROOMS, (640, 480), layers=layers)
    for row in range(10):
        painter.render_frame(build_row_scene(record, row))
    assert draw_obstacles.call_count == 1
    painter.camera = painter.camera.pan(3, 0)
    painter.render_frame(build_row_scene(record, 10))
    assert draw_obstacles.call_count == 2


def test_cached_pages_depend_on_the_visible_layers():
    scene = build_row_scene(record_walk(ROOMS, 6))
    painter = Painter(ROOMS, (640, 480))
    frame_with_grid = painter.render_frame(scene)
    painter.visible -= {"grid"}
    assert (painter.render_frame(scene) != frame_with_grid).any()
    painter.visible |= {"grid"}
    assert (painter.render_frame(scene) == frame_with_grid).all()


def test_an_unknown_layer_is_rejected_with_a_suggestion():
    with pytest.raises(ParameterError, match="did you mean 'cells'"):
        Painter(ROOMS, (640, 480)).show_only(["cell"])


def test_the_scale_grows_with_the_frame():
    assert choose_scale((1280, 720)) == 1.25
    assert choose_scale((2560, 1440)) == 2.5
    assert 0.8 <= choose_scale((320, 240)) < 1.0


def render_label():
    """Return the bytes of a label that is not in the cache."""
    fonts.render_text.cache_clear()
    return pygame.image.tobytes(fonts.render_text("robots 12", 14, (10, 20, 30)), "RGBA")


def test_labels_can_be_rendered_after_the_font_module_was_closed():
    expected = render_label()
    pygame.font.quit()
    assert render_label() == expected


def test_labels_can_be_rendered_after_the_font_module_was_restarted():
    expected = render_label()
    pygame.font.quit()
    pygame.font.init()
    assert render_label() == expected


@pytest.mark.parametrize("is_bold", [False, True])
def test_font_files_exist(is_bold):
    path = fonts.find_font_file(bold=is_bold)
    assert path is not None
    assert path.is_file()


def test_a_text_that_fits_is_not_shortened():
    text = "a rather long name of a map"
    assert fonts.shorten_to_width(text, 12, 1000) == text


def test_a_long_text_is_shortened_to_a_width():
    shortened = fonts.shorten_to_width("a rather long name of a map", 12, 90)
    assert shortened.endswith("…")
    assert fonts.measure_text(shortened, 12) <= 90


def test_a_text_is_not_shortened_more_than_needed():
    shortened = fonts.shorten_to_width("a rather long name of a map", 12, 91)
    longer = shortened.removesuffix("…") + "xxx…"
    assert fonts.measure_text(longer, 12) > 90


def test_without_space_a_text_vanishes():
    shortened = fonts.shorten_to_width("a rather long name of a map", 12, 1)
    assert shortened in ("", "…")


_HEADLESS = """
import os, sys
os.environ["SDL_VIDEODRIVER"] = "no such driver"
sys.path.insert(0, sys.argv[1])
from drawn_run import ROOMS, record_walk, build_row_scene
for module in ("pygame", "matplotlib"):
    assert module not in sys.modules, module
import robocov_app.look.theme, robocov_app.render.camera, robocov_app.runs.encoding
assert "pygame" not in sys.modules and "matplotlib" not in sys.modules
from robocov_app.render.painter import Painter
frame = Painter(ROOMS, (320, 240)).render_frame(build_row_scene(record_walk(ROOMS, 3)))
assert frame.std() > 10
import pygame
assert not pygame.display.get_init()
assert "matplotlib" not in sys.modules
"""


@pytest.mark.slow
def test_frames_need_no_display_and_no_matplotlib():
    """Standard output must be empty, too: pygame's greeting would mix with that of a command."""
    process = subprocess.run(
        [sys.executable, "-c", _HEADLESS, str(Path(__file__).parents[1])],
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    assert process.stdout == ""


def test_the_map_does_not_jump_when_the_legend_becomes_shorter() -> None:
    scene = build_row_scene(record_walk(ROOMS, 6))
    scene_with_long_legend = replace(scene, path=np.array([[1.0, 4.5], [2.0, 4.5]]), failed={9: (3.0, 4.0)})
    painter = Painter(ROOMS, (420, 320))
    painter.visible |= {"path", "links", "velocities"}
    painter.render_frame(scene)
    first_camera = painter.camera
    painter.render_frame(scene_with_long_legend)
    camera = painter.camera
    assert camera.view[1] > first_camera.view[1]
    painter.render_frame(scene)
    assert painter.camera == camera


def test_the_map_uses_the_space_of_hidden_layers_in_the_legend() -> None:
    scene = build_row_scene(record_walk(ROOMS, 6))
    scene = replace(scene, path=np.array([[1.0, 4.5], [2.0, 4.5]]), failed={9: (3.0, 4.0)})
    painter = Painter(ROOMS, (420, 320))
    painter.visible |= {"path", "links", "velocities"}
    painter.render_frame(scene)
    view_top = painter.camera.view[1]
    painter.visible -= {"links"}
    painter.render_frame(replace(scene, path=None, failed={}))
    assert painter.camera.view[1] < view_top
