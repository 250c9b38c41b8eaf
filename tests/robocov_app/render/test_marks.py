from dataclasses import replace

import numpy as np
import pytest
from drawn_pixels import (
    ONE,
    SIZE,
    TWO,
    find_layer,
    list_legend_texts,
    list_pixels,
    measure_error,
    measure_least_error,
    render_layers,
)
from drawn_run import SQUARE, build_scene
from rendered_text import check_legend_symbol, find_text, render_legend_symbols

from robocov.team import Team
from robocov_app.look.colors import compute_contrast, mix
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.painter import Painter

THEMES = pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])


def build_failed_scene(failed, positions=TWO, **more):
    return replace(build_scene(positions), failed=failed, **more)


def find_numbers(frame, painter, text, theme=LIGHT):
    return find_text(frame, text, round(theme.small_text * painter.scale), theme, theme.ink)


def extract_pixels_around(frame, painter, place, radius):
    """Return the pixels within so many px at scale 1 of a place."""
    rows, columns = np.indices(frame.shape[:2])
    x, y = painter.camera.to_pixels(np.array(place))
    return frame[np.hypot(columns - x, rows - y) <= radius * painter.scale]


class TestFailed:
    @THEMES
    def test_a_failed_robot_is_gray_and_crossed_out(self, theme):
        frame, painter = render_layers(build_failed_scene({3: (4.0, 5.0)}), "failed", theme=theme)
        center = painter.camera.to_pixels(np.array([4.0, 5.0]))
        assert measure_error(frame, center, theme.ink) < 8
        for side in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            assert measure_least_error(frame, center + 3.0 * painter.scale * np.array(side), theme.ink) < 40
        for side in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            at = center + 5.0 * painter.scale * np.array(side)
            assert measure_least_error(frame, at, mix(theme.background, theme.ink, 0.3)) < 12

    @THEMES
    def test_a_failed_robot_differs_from_a_working_one(self, theme):
        frame, painter = render_layers(build_failed_scene({3: (4.0, 5.0)}), "failed", theme=theme)
        disc = extract_pixels_around(frame, painter, (4.0, 5.0), 9)
        assert np.ptp(disc, axis=1).max() < 32  # no hue
        for robot in theme.robots:
            assert np.abs(disc - np.array(robot)).max(axis=1).min() > 20
        assert compute_contrast(mix(theme.background, theme.ink, 0.3), theme.ink) > 4

    @THEMES
    def test_a_failed_robot_has_its_number_next_to_it(self, theme):
        failed = {12: (2.0, 6.0), 3: (6.0, 2.0)}
        frame, painter = render_layers(build_failed_scene(failed), "failed", theme=theme)
        for number, place in failed.items():
            found = find_numbers(frame, painter, str(number), theme)
            assert len(found) == 1
            right, down = found[0] - painter.camera.to_pixels(np.array(place))
            assert 8 * painter.scale < right < 30 * painter.scale
            assert abs(down) < 4 * painter.scale
        assert len(find_numbers(frame, painter, "7", theme)) == 0

    @pytest.mark.parametrize(
        ("robots", "side"),
        [
            ([], (1, 0)),
            ([(1, 0)], (-1, 0)),
            ([(1, 0), (-1, 0)], (0, -1)),
            ([(1, 0), (-1, 0), (0, 1)], (0, 1)),
        ],
    )
    def test_the_number_of_a_failed_robot_covers_no_robot(self, robots, side):
        """Robots at the right, left and above (y up) push it left, above and below (y down)."""
        near = 4.0 + 0.4 * np.array(robots).reshape(-1, 2)
        positions = np.vstack([near, [[1.0, 1.0]]])
        frame, painter = render_layers(build_failed_scene({8: (4.0, 4.0)}, positions), "failed", "robots")
        found = find_numbers(frame, painter, "8")
        assert len(found) == 1
        away = found[0] - painter.camera.to_pixels(np.array([4.0, 4.0]))
        assert away @ np.array(side) / np.linalg.norm(away) > 0.9

    def test_numbers_of_two_that_failed_side_by_side_can_both_be_read(self):
        scene = build_failed_scene({4: (4.0, 4.0), 5: (4.3, 4.0)})
        frame, painter = render_layers(scene, "failed")
        assert len(find_numbers(frame, painter, "4")) == 1
        assert len(find_numbers(frame, painter, "5")) == 1

    def test_in_a_crowd_it_is_no_larger_than_there_is_room(self):
        sizes = []
        for apart in (0.15, 2.0):
            scene = build_failed_scene({4: (4.0, 4.0)}, np.array([[4.0 + apart, 4.0], [1.0, 1.0]]))
            scene = replace(scene, team=Team.homogeneous(2, radius=0.02))
            pixels, painter = list_pixels(scene, "failed")
            away = painter.camera.to_pixels(np.array([4.0, 4.0])) - pixels
            sizes.append(away[:, 1].max() / painter.scale)
        assert sizes[0] < 6 < 7 < sizes[1] < 10

    def test_a_large_one_is_drawn_in_true_size(self):
        scene = replace(build_failed_scene({4: (4.0, 4.0)}), team=Team.homogeneous(2, radius=1.0))
        frame, painter = render_layers(scene, "failed")
        center = painter.camera.to_pixels(np.array([4.0, 4.0]))
        fill = mix(LIGHT.background, LIGHT.ink, 0.3)
        assert measure_error(frame, center + np.array([0.9 * painter.camera.zoom, 0.0]), fill) == 0
        assert (
            measure_least_error(frame, center + np.array([0.0, 1.2 * painter.camera.zoom]), LIGHT.background)
            == 0
        )

    def test_working_robots_are_above_it(self):
        scene = build_failed_scene({3: (4.05, 4.0)}, ONE)
        frame, painter = render_layers(scene, "failed", "robots")
        alone, _ = render_layers(build_scene(ONE), "robots")
        disc = (
            extract_pixels_around(alone, painter, (4.0, 4.0), 7),
            extract_pixels_around(frame, painter, (4.0, 4.0), 7),
        )
        assert (disc[0] == disc[1]).all()

    def test_without_failed_robots_nothing_is_drawn(self):
        pixels, painter = list_pixels(build_failed_scene({}), "failed")
        assert len(pixels) == 0
        assert list_legend_texts(painter, build_failed_scene({})) == []
        assert list_legend_texts(painter, build_failed_scene({3: (4.0, 5.0)})) == ["failed robot"]

    def test_failed_robots_are_drawn_before_the_first_step(self):
        frame, painter = render_layers(replace(build_failed_scene({3: (4.0, 5.0)}), snapshot=None), "failed")
        assert len(find_numbers(frame, painter, "3")) == 1

    @THEMES
    def test_its_glyph_in_the_legend(self, theme):
        (picture,) = render_legend_symbols(find_layer("failed"), build_failed_scene({3: (4.0, 5.0)}), theme)
        check_legend_symbol(picture, theme, theme.ink)
        check_legend_symbol(picture, theme, mix(theme.background, theme.ink, 0.3))


class TestSelection:
    @THEMES
    @pytest.mark.parametrize("selected", [0, 1])
    def test_is_a_ring_around_the_robot_and_no_other(self, theme, selected):
        scene = replace(build_scene(TWO), selected=selected)
        frame, painter = render_layers(scene, "selection", theme=theme)
        rows, columns = np.nonzero((frame != np.array(theme.background)).any(axis=2))
        away = np.hypot(*(np.column_stack([columns, rows]) - painter.camera.to_pixels(TWO[selected])).T)
        away /= painter.scale
        assert len(away) > 60
        assert 10.5 < away.min() < away.max() < 16  # discs have a radius of 9 and a hair line
        for angle in np.arange(12) * np.pi / 6:
            at = painter.camera.to_pixels(TWO[selected])
            at = at + 13 * painter.scale * np.array([np.cos(angle), np.sin(angle)])
            assert measure_least_error(frame, at, theme.ink) < 30

    def test_leaves_the_robot_and_its_number_as_they_are(self):
        frame, painter = render_layers(replace(build_scene(TWO), selected=1), "selection", "robots")
        alone, _ = render_layers(build_scene(TWO), "robots")
        assert (
            extract_pixels_around(frame, painter, TWO[1], 9)
            == extract_pixels_around(alone, painter, TWO[1], 9)
        ).all()
        assert (
            extract_pixels_around(frame, painter, TWO[0], 20)
            == extract_pixels_around(alone, painter, TWO[0], 20)
        ).all()
        assert (
            extract_pixels_around(frame, painter, TWO[1], 15)
            != extract_pixels_around(alone, painter, TWO[1], 15)
        ).any()

    def test_fits_a_large_robot(self):
        team = Team.homogeneous(2)
        scene = replace(build_scene(TWO), selected=1, team=replace(team, radius=np.array([0.1, 1.0])))
        pixels, painter = list_pixels(scene, "selection")
        away = np.hypot(*(pixels - painter.camera.to_pixels(TWO[1])).T)
        assert painter.camera.zoom < away.min() < away.max() < 1.15 * painter.camera.zoom

    def test_without_a_selected_robot_nothing_is_drawn(self):
        assert len(list_pixels(build_scene(TWO), "selection")[0]) == 0
        assert len(list_pixels(replace(build_scene(TWO), selected=0, snapshot=None), "selection")[0]) == 0


def test_marks_stay_inside_the_picture_of_the_map():
    """What is out of sight below is not drawn over the status line."""
    scene = replace(build_failed_scene({3: (1.0, 0.0)}, np.array([[4.0, 0.0], [1.0, 1.0]])), selected=0)
    painter = Painter(SQUARE, SIZE)
    painter.show_only({"failed", "selection", "status"})
    painter.camera = painter.camera.pan(0, 4)
    frame = painter.render_frame(scene).astype(int)
    alone, _ = render_layers(build_scene(TWO), "status")
    strip = int(painter.camera.view[1] + painter.camera.view[3]) + 1
    assert SIZE[1] - strip > 20
    assert (frame[strip:] == alone[strip:]).all()
    assert (frame[:strip] != alone[:strip]).any()


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_unicycles_have_a_nose_in_their_heading(theme):
    plain = build_scene(TWO)
    team = replace(plain.team, track_width=np.array([0.0, 0.16]))
    painter = Painter(SQUARE, SIZE, theme)
    without = painter.render_frame(plain).astype(int)
    middle = painter.camera.to_pixels(TWO)[1]
    for heading in (0.0, 0.5 * np.pi, -2.0):
        seen = replace(plain.now.seen, steering=np.array([[heading, 0.0]] * 2))
        turned = replace(plain, team=team, snapshot=replace(plain.now, seen=seen))
        rows, columns = np.nonzero(np.abs(painter.render_frame(turned) - without).sum(axis=2) > 60)
        nose = np.array([columns.mean(), rows.mean()]) - middle  # the point robot has none
        assert 9.0 < np.hypot(*nose) < 18.0
        assert nose @ [np.cos(heading), -np.sin(heading)] > 0.97 * np.hypot(*nose)
