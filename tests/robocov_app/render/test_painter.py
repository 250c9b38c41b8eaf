import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pygame
import pytest
from drawn_run import CORRIDOR, HALL, ROOMS, SHAFT, SQUARE, build_row_scene, build_scene, record_walk
from hypothesis import example, given, settings
from hypothesis import strategies as st

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
    first = Painter(ROOMS, (800, 600), theme)
    second = Painter(ROOMS, (800, 600), theme)
    assert (
        first.render_frame(scene).tobytes()
        == second.render_frame(scene).tobytes()
        == first.render_frame(scene).tobytes()
    )


def test_a_frame_is_not_overwritten_by_the_next():
    record = record_walk(SQUARE, 4)
    painter = Painter(SQUARE, (320, 240))
    first = painter.render_frame(build_row_scene(record, 5))
    kept = first.copy()
    second = painter.render_frame(build_row_scene(record, 30))
    assert (first == kept).all()
    assert (first != second).any()


@pytest.mark.parametrize("environment", [ROOMS, HALL, CORRIDOR, SHAFT], ids=lambda map_: map_.name)
@pytest.mark.parametrize("size", [(480, 360), (1280, 720), (400, 900)])
def test_the_whole_region_is_visible(environment, size):
    painter = Painter(environment, size)
    painter.render_frame(build_row_scene(record_walk(environment, 3)))
    corners = painter.camera.to_pixels(environment.region.vertices)
    left, top, width, height = painter.camera.view
    assert (corners[:, 0] >= left + 1).all() and (corners[:, 0] <= left + width - 1).all()
    assert (corners[:, 1] >= top + 1).all() and (corners[:, 1] <= top + height - 1).all()


def test_zoomed_world_stays_in_its_view_and_fit_brings_it_back():
    scene = build_row_scene(record_walk(ROOMS, 6))
    painter = Painter(ROOMS, (640, 480))
    before = painter.render_frame(scene)
    strip = int(painter.camera.view[1])
    painter.camera = painter.camera.zoom_at(5.0, (300, 250)).pan(37, -12)
    zoomed = painter.render_frame(scene)
    assert (zoomed != before).any()
    assert (zoomed[:strip] == before[:strip]).all()  # the legend is not drawn over
    painter.fit()
    assert (painter.render_frame(scene) == before).all()


@settings(deadline=None, max_examples=40)
@given(
    st.floats(-12, 14).map(lambda power: 2.0**power),
    st.tuples(st.floats(-3000, 3000), st.floats(-3000, 3000)),
    st.tuples(st.floats(0, 320), st.floats(0, 240)),
)
@example(2.0**40, (0.0, 0.0), (100.0, 100.0))
def test_any_zoom_can_be_drawn(factor, pan, at):
    scene = build_scene(
        np.array([[2.0, 2.0], [6.0, 6.0]]),
        forces=np.ones((2, 2)),
        velocities=np.ones((2, 2)),
        goals=np.array([[1.0, 7.0], [7.0, 1.0]]),
        obstacle_points=np.zeros((2, 2)),
        communication_range=9.0,
    )
    scene = replace(
        scene, starts=np.ones((2, 2)), trail=np.linspace(np.ones((2, 2)), scene.snapshot.positions, 9)
    )
    painter = Painter(SQUARE, (320, 240))
    painter.show_only({layer.name for layer in painter.layers})
    painter.render_frame(scene)
    painter.camera = painter.camera.zoom_at(factor, at).pan(*pan)
    assert painter.render_frame(scene).shape == (240, 320, 3)


@settings(deadline=None, max_examples=15)
@given(st.floats(20, 5000), st.floats(0.5, 7.5), st.floats(0.5, 7.5))
def test_magnified_pictures_are_exact(factor, x, y):
    """Cells seen through a strong lens: edges that end far outside do not turn."""
    scene = build_scene(np.array([[1.0, 2.0], [6.0, 7.0], [5.0, 1.0]]))
    painter = Painter(SQUARE, (320, 240))
    painter.show_only({"cells"})
    painter.render_frame(scene)
    painter.camera = replace(painter.camera, center=(x, y)).zoom_at(factor, painter.camera.middle)
    frame = painter.render_frame(scene)
    grid = np.stack(np.meshgrid(np.arange(4, 320, 13), np.arange(16, 225, 13)), axis=-1).reshape(-1, 2)
    points = painter.camera.to_world(grid + 0.5)
    distances = np.linalg.norm(points[:, None] - scene.snapshot.positions[None], axis=2)
    two = np.sort(distances, axis=1)
    clear = (
        ((two[:, 1] - two[:, 0]) * painter.camera.zoom > 6)
        & (points > 0).all(axis=1)
        & (points < 8).all(axis=1)
    )
    for (column, row), robot in zip(grid[clear], distances[clear].argmin(axis=1), strict=True):
        assert tuple(frame[row, column]) == LIGHT.get_cell_color(robot)


def test_the_legend_follows_the_colors_of_the_trajectories():
    scene = build_row_scene(record_walk(ROOMS, 6))
    tops = []
    for colors in ("robots", "paper"):
        painter = Painter(ROOMS, (640, 480), layers=build_standard_layers(colors))
        painter.show_only({"legend", "trajectories"})
        tops.append(painter.render_frame(scene)[:20].copy())
    assert (tops[0] != tops[1]).any()


def test_a_picture_in_a_part_of_a_window_leaves_the_rest_alone():
    scene = build_row_scene(record_walk(ROOMS, 6))
    window = pygame.Surface((900, 600), 0, 32)
    window.fill((1, 2, 3))
    painter = Painter(ROOMS, (640, 480))
    painter.draw(window.subsurface((100, 50, 640, 480)), scene)
    pixels = np.frombuffer(pygame.image.tobytes(window, "RGB"), dtype=np.uint8).reshape(600, 900, 3)
    assert (pixels[50:530, 100:740] == painter.render_frame(scene)).all()
    outside = np.ones((600, 900), dtype=bool)
    outside[50:530, 100:740] = False
    assert (pixels[outside] == (1, 2, 3)).all()


def test_a_surface_of_another_size_is_filled():
    painter = Painter(ROOMS, (640, 480))
    scene = build_row_scene(record_walk(ROOMS, 6))
    painter.render_frame(scene)
    painter.draw(pygame.Surface((800, 500), 0, 32), scene)
    assert painter.size == (800, 500)
    assert painter.render_frame(scene).shape == (500, 800, 3)


def test_static_layers_are_drawn_once():
    calls = []
    layers = build_standard_layers()
    at = [layer.name for layer in layers].index("obstacles")
    draw = layers[at].draw
    layers[at] = replace(layers[at], draw=lambda *given: (calls.append(1), draw(*given)))
    record = record_walk(ROOMS, 6)
    painter = Painter(ROOMS, (640, 480), layers=layers)
    for row in range(10):
        painter.render_frame(build_row_scene(record, row))
    assert len(calls) == 1
    painter.camera = painter.camera.pan(3, 0)
    painter.render_frame(build_row_scene(record, 10))
    assert len(calls) == 2


def test_cached_pages_depend_on_the_visible_layers():
    scene = build_row_scene(record_walk(ROOMS, 6))
    painter = Painter(ROOMS, (640, 480))
    with_grid = painter.render_frame(scene)
    painter.visible -= {"grid"}
    without = painter.render_frame(scene)
    assert (with_grid != without).any()
    painter.visible |= {"grid"}
    assert (painter.render_frame(scene) == with_grid).all()


def test_unknown_layers_are_named_with_the_nearest():
    with pytest.raises(ParameterError, match="did you mean 'cells'"):
        Painter(ROOMS, (640, 480)).show_only(["cell"])


def test_the_scale_grows_with_the_picture():
    assert choose_scale((1280, 720)) == 1.25
    assert choose_scale((2560, 1440)) == 2.5
    assert 0.8 <= choose_scale((320, 240)) < 1.0


def test_labels_outlive_a_restart_of_the_font_module():
    before = pygame.image.tobytes(fonts.render_text("robots 12", 14, (10, 20, 30)), "RGBA")
    pygame.font.quit()
    fonts.render_text.cache_clear()
    assert pygame.image.tobytes(fonts.render_text("robots 12", 14, (10, 20, 30)), "RGBA") == before
    pygame.font.quit()
    pygame.font.init()
    fonts.render_text.cache_clear()
    assert pygame.image.tobytes(fonts.render_text("robots 12", 14, (10, 20, 30)), "RGBA") == before


def test_the_fonts_are_there():
    for bold in (False, True):
        path = fonts.find_font_file(bold)
        assert path is not None and path.is_file()


def test_texts_are_shortened_to_a_width():
    text = "a rather long name of a map"
    assert fonts.shorten_to_width(text, 12, 1000) == text
    cut = fonts.shorten_to_width(text, 12, 90)
    assert cut.endswith("…") and fonts.measure_text(cut, 12) <= 90
    assert fonts.measure_text(fonts.shorten_to_width(text, 12, 91)[:-1] + "xxx…", 12) > 90
    assert fonts.shorten_to_width(text, 12, 1) in ("", "…")


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
    done = subprocess.run(
        [sys.executable, "-c", _HEADLESS, str(Path(__file__).parents[1])],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""  # pygame's greeting is for others


def test_the_map_does_not_jump_when_the_legend_changes() -> None:
    scene = build_row_scene(record_walk(ROOMS, 6))
    there = replace(scene, path=np.array([[1.0, 4.5], [2.0, 4.5]]), failed={9: (3.0, 4.0)})
    painter = Painter(ROOMS, (420, 320))
    painter.visible |= {"path", "links", "velocities"}
    painter.render_frame(scene)
    few = painter.camera
    painter.render_frame(there)
    many = painter.camera
    assert many.view[1] > few.view[1]
    painter.render_frame(scene)
    assert painter.camera == many
    painter.visible -= {"links"}
    painter.render_frame(scene)
    assert painter.camera.view[1] < many.view[1]
