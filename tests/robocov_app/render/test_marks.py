"""Marks of failed robots and of the selected robot, and the headings of unicycles."""

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
    measure_min_error,
    render_layers,
)
from drawn_run import SQUARE, build_scene
from rendered_text import check_legend_symbol, find_text, render_legend_symbols

from robocov.team import Team
from robocov_app.look.colors import compute_contrast, mix
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.painter import Painter
from robocov_app.render.scene import Contacts

THEMES = pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])

ROBOT_RADIUS_PX = 9.0
"""Drawn radius of a small robot at scale 1."""
DIAGONAL_DIRECTIONS = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])
AXIS_DIRECTIONS = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])


def build_contact_scene():
    """Return a scene in which the first robot touches a wall to the west of it."""
    scene = build_scene(TWO)
    points = scene.now.positions[:1] - [scene.team.radius[0], 0.0]
    return replace(scene, contacts=Contacts(np.array([0]), points, np.empty((0, 2))))


def build_failed_scene(failed, positions=TWO):
    """Return a scene with failed robots, a dict of positions in m by their numbers."""
    return replace(build_scene(positions), failed=failed)


def get_failed_color(theme):
    """Return the gray of failed robots."""
    return mix(theme.background, theme.ink, 0.3)


def find_numbers(frame, painter, number, theme=LIGHT):
    """Return the centers of all labels with a number, (n, 2) px."""
    size = round(theme.small_text * painter.scale)
    return find_text(frame, str(number), size, theme, theme.ink)


def extract_disc(frame, painter, position, radius_px):
    """Return the pixels within a radius at scale 1 of a position in m, (n, 3)."""
    rows, columns = np.indices(frame.shape[:2])
    x, y = painter.camera.to_pixels(np.array(position))
    distances = np.hypot(columns - x, rows - y)
    return frame[distances <= radius_px * painter.scale]


def measure_distances(pixels, painter, position):
    """Return the distances of pixels from a position in m, (n,) px."""
    center = painter.camera.to_pixels(np.array(position))
    return np.linalg.norm(pixels - center, axis=1)


class TestFailedRobots:
    @THEMES
    def test_a_failed_robot_is_gray_and_crossed_out(self, theme):
        frame, painter = render_layers(build_failed_scene({3: (4.0, 5.0)}), "failed", theme=theme)
        center = painter.camera.to_pixels(np.array([4.0, 5.0]))
        assert measure_error(frame, center, theme.ink) < 8
        for pixel in center + 3.0 * painter.scale * DIAGONAL_DIRECTIONS:
            assert measure_min_error(frame, pixel, theme.ink) < 40
        for pixel in center + 5.0 * painter.scale * AXIS_DIRECTIONS:
            assert measure_min_error(frame, pixel, get_failed_color(theme)) < 12

    @THEMES
    def test_a_failed_robot_has_no_hue(self, theme):
        frame, painter = render_layers(build_failed_scene({3: (4.0, 5.0)}), "failed", theme=theme)
        disc = extract_disc(frame, painter, (4.0, 5.0), ROBOT_RADIUS_PX)
        assert np.ptp(disc, axis=1).max() < 32
        for robot_color in theme.robots:
            assert np.abs(disc - np.array(robot_color)).max(axis=1).min() > 20

    @THEMES
    def test_the_cross_of_a_failed_robot_has_enough_contrast(self, theme):
        assert compute_contrast(get_failed_color(theme), theme.ink) > 4

    @THEMES
    def test_the_number_of_a_failed_robot_is_on_its_right(self, theme):
        failed = {12: (2.0, 6.0), 3: (6.0, 2.0)}
        frame, painter = render_layers(build_failed_scene(failed), "failed", theme=theme)
        for number, position in failed.items():
            labels = find_numbers(frame, painter, number, theme)
            assert len(labels) == 1
            dx, dy = labels[0] - painter.camera.to_pixels(np.array(position))
            assert 8 * painter.scale < dx < 30 * painter.scale
            assert abs(dy) < 4 * painter.scale
        assert len(find_numbers(frame, painter, 7, theme)) == 0

    @pytest.mark.parametrize(
        ("robot_directions", "label_direction"),
        [
            pytest.param([], (1, 0), id="right"),
            pytest.param([(1, 0)], (-1, 0), id="left"),
            pytest.param([(1, 0), (-1, 0)], (0, -1), id="above"),
            pytest.param([(1, 0), (-1, 0), (0, 1)], (0, 1), id="below"),
        ],
    )
    def test_the_number_of_a_failed_robot_avoids_other_robots(self, robot_directions, label_direction):
        """Robots are placed with y up, m. The number is found with y down, px."""
        neighbors = 4.0 + 0.4 * np.array(robot_directions).reshape(-1, 2)
        positions = np.vstack([neighbors, [[1.0, 1.0]]])
        scene = build_failed_scene({8: (4.0, 4.0)}, positions)
        frame, painter = render_layers(scene, "failed", "robots")
        labels = find_numbers(frame, painter, 8)
        assert len(labels) == 1
        offset = labels[0] - painter.camera.to_pixels(np.array([4.0, 4.0]))
        assert offset @ np.array(label_direction) / np.linalg.norm(offset) > 0.9

    def test_the_numbers_of_adjacent_failed_robots_do_not_overlap(self):
        scene = build_failed_scene({4: (4.0, 4.0), 5: (4.3, 4.0)})
        frame, painter = render_layers(scene, "failed")
        assert len(find_numbers(frame, painter, 4)) == 1
        assert len(find_numbers(frame, painter, 5)) == 1

    def test_a_failed_robot_is_smaller_next_to_another_robot(self):
        radii = []
        for distance in (0.15, 2.0):
            positions = np.array([[4.0 + distance, 4.0], [1.0, 1.0]])
            scene = build_failed_scene({4: (4.0, 4.0)}, positions)
            scene = replace(scene, team=Team.homogeneous(2, radius=0.02))
            pixels, painter = list_pixels(scene, "failed")
            _, y = painter.camera.to_pixels(np.array([4.0, 4.0]))
            radii.append((y - pixels[:, 1].min()) / painter.scale)
        crowded_radius, radius = radii
        assert crowded_radius < 6.0
        assert 7.0 < radius < 10.0

    def test_a_failed_robot_is_not_larger_than_small_working_ones(self):
        radii = []
        for spacing in (0.15, 1.0):
            crowd = 1.0 + spacing * np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
            scene = replace(build_failed_scene({9: (6.0, 6.0)}, crowd), team=Team.homogeneous(4, radius=0.02))
            pixels, painter = list_pixels(scene, "failed")
            _, y = painter.camera.to_pixels(np.array([6.0, 6.0]))
            radii.append((y - pixels[:, 1].min()) / painter.scale)
        crowded_radius, radius = radii
        assert crowded_radius < 6.0
        assert 7.0 < radius < 10.0

    def test_a_large_failed_robot_is_drawn_to_scale(self):
        scene = replace(build_failed_scene({4: (4.0, 4.0)}), team=Team.homogeneous(2, radius=1.0))
        frame, painter = render_layers(scene, "failed")
        inside, outside = painter.camera.to_pixels(np.array([[4.9, 4.0], [4.0, 2.8]]))
        assert measure_error(frame, inside, get_failed_color(LIGHT)) == 0
        assert measure_min_error(frame, outside, LIGHT.background) == 0

    def test_working_robots_are_drawn_above_failed_ones(self):
        scene = build_failed_scene({3: (4.05, 4.0)}, ONE)
        frame, painter = render_layers(scene, "failed", "robots")
        frame_without_failed, _ = render_layers(build_scene(ONE), "robots")
        disc = extract_disc(frame, painter, (4.0, 4.0), 7)
        expected = extract_disc(frame_without_failed, painter, (4.0, 4.0), 7)
        assert (disc == expected).all()

    def test_without_failed_robots_nothing_is_drawn(self):
        pixels, _ = list_pixels(build_failed_scene({}), "failed")
        assert len(pixels) == 0

    def test_the_legend_lists_failed_robots_if_there_are_any(self):
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"failed"})
        assert list_legend_texts(painter, build_failed_scene({})) == []
        assert list_legend_texts(painter, build_failed_scene({3: (4.0, 5.0)})) == ["failed robot"]

    def test_failed_robots_are_drawn_before_the_first_step(self):
        scene = replace(build_failed_scene({3: (4.0, 5.0)}), snapshot=None)
        frame, painter = render_layers(scene, "failed")
        assert len(find_numbers(frame, painter, 3)) == 1

    @THEMES
    def test_the_legend_symbol_is_gray_and_crossed_out(self, theme):
        scene = build_failed_scene({3: (4.0, 5.0)})
        (image,) = render_legend_symbols(find_layer("failed"), scene, theme)
        check_legend_symbol(image, theme, theme.ink)
        check_legend_symbol(image, theme, get_failed_color(theme))


class TestSelection:
    @THEMES
    @pytest.mark.parametrize("selected", [0, 1])
    def test_only_the_selected_robot_has_a_ring(self, theme, selected):
        scene = replace(build_scene(TWO), selected=selected)
        frame, painter = render_layers(scene, "selection", theme=theme)
        rows, columns = np.nonzero((frame != np.array(theme.background)).any(axis=2))
        pixels = np.column_stack([columns, rows])
        distances = measure_distances(pixels, painter, TWO[selected]) / painter.scale
        assert len(distances) > 60
        assert distances.min() > ROBOT_RADIUS_PX + 1.5
        assert distances.max() < 16

    @THEMES
    @pytest.mark.parametrize("selected", [0, 1])
    def test_the_ring_is_closed(self, theme, selected):
        scene = replace(build_scene(TWO), selected=selected)
        frame, painter = render_layers(scene, "selection", theme=theme)
        center = painter.camera.to_pixels(TWO[selected])
        for angle in np.arange(12) * np.pi / 6:
            direction = np.array([np.cos(angle), np.sin(angle)])
            pixel = center + 13 * painter.scale * direction
            assert measure_min_error(frame, pixel, theme.ink) < 30

    def test_the_ring_covers_no_robot(self):
        frame, painter = render_layers(replace(build_scene(TWO), selected=1), "selection", "robots")
        frame_without_ring, _ = render_layers(build_scene(TWO), "robots")

        def is_changed_within(radius_px, robot):
            disc = extract_disc(frame, painter, TWO[robot], radius_px)
            expected = extract_disc(frame_without_ring, painter, TWO[robot], radius_px)
            return bool((disc != expected).any())

        assert not is_changed_within(ROBOT_RADIUS_PX, robot=1)
        assert is_changed_within(15, robot=1)
        assert not is_changed_within(20, robot=0)

    def test_the_ring_fits_a_large_robot(self):
        team = replace(Team.homogeneous(2), radius=np.array([0.1, 1.0]))
        scene = replace(build_scene(TWO), selected=1, team=team)
        pixels, painter = list_pixels(scene, "selection")
        distances_m = measure_distances(pixels, painter, TWO[1]) / painter.camera.zoom
        assert distances_m.min() > 1.0
        assert distances_m.max() < 1.15

    def test_without_a_selected_robot_there_is_no_ring(self):
        pixels, _ = list_pixels(build_scene(TWO), "selection")
        assert len(pixels) == 0

    def test_before_the_first_step_there_is_no_ring(self):
        pixels, _ = list_pixels(replace(build_scene(TWO), selected=0, snapshot=None), "selection")
        assert len(pixels) == 0


def test_marks_below_the_view_do_not_cover_the_status_line():
    positions = np.array([[4.0, 0.0], [1.0, 1.0]])
    scene = replace(build_failed_scene({3: (1.0, 0.0)}, positions), selected=0)
    painter = Painter(SQUARE, SIZE)
    painter.show_only({"failed", "selection", "status"})
    painter.camera = painter.camera.pan(0, 4)
    frame = painter.render_frame(scene).astype(int)
    frame_with_status_only, _ = render_layers(build_scene(TWO), "status")
    _, view_top, _, view_height = painter.camera.view
    status_top = int(view_top + view_height) + 1
    assert SIZE[1] - status_top > 20
    assert (frame[status_top:] == frame_with_status_only[status_top:]).all()
    assert (frame[:status_top] != frame_with_status_only[:status_top]).any()


@THEMES
@pytest.mark.parametrize("heading", [0.0, 0.5 * np.pi, -2.0])
def test_unicycles_have_a_nose_in_their_heading(theme, heading):
    scene = build_scene(TWO)
    painter = Painter(SQUARE, SIZE, theme)
    frame_of_point_robots = painter.render_frame(scene).astype(int)
    team = replace(scene.team, track_width=np.array([0.0, 0.16]))  # The first robot is no unicycle.
    observations = replace(scene.now.seen, steering=np.array([[heading, 0.0], [heading, 0.0]]))
    scene = replace(scene, team=team, snapshot=replace(scene.now, seen=observations))
    frame = painter.render_frame(scene)
    rows, columns = np.nonzero(np.abs(frame - frame_of_point_robots).sum(axis=2) > 60)
    nose_center = np.array([columns.mean(), rows.mean()])
    nose = nose_center - painter.camera.to_pixels(TWO[1])
    distance = np.linalg.norm(nose)
    direction = np.array([np.cos(heading), -np.sin(heading)])
    assert 9.0 < distance < 18.0
    assert nose @ direction > 0.97 * distance

    def test_a_disc_that_is_too_small_for_its_number_has_it_next_to_the_ring(self):
        positions = np.array([(3.0, 3.0), (3.1, 3.0), (1.0, 1.0)])
        crowded_scene = replace(build_scene(positions), selected=1)
        frame, painter = render_layers(crowded_scene, "selection", "robots")
        assert len(find_numbers(frame, painter, 2)) == 1
        frame, painter = render_layers(replace(crowded_scene, selected=2), "selection", "robots")
        assert len(find_numbers(frame, painter, 3)) == 0


class TestContacts:
    def test_a_star_is_drawn_next_to_a_robot_that_touches_a_wall(self):
        scene = build_contact_scene()
        pixels, painter = list_pixels(scene, "contacts")
        x, y = painter.camera.to_pixels(scene.now.positions[0])
        assert len(pixels)
        assert abs(pixels[:, 1].mean() - y) < 1.0
        # Its number stays readable.
        assert pixels[:, 0].max() < x - 0.5 * ROBOT_RADIUS_PX * painter.scale

    def test_scenes_without_known_contacts_have_no_legend(self):
        _, painter = render_layers(build_scene(TWO), "contacts")
        assert list_legend_texts(painter, build_scene(TWO)) == []
        assert list_legend_texts(painter, build_contact_scene()) == ["contact"]

    @THEMES
    def test_the_legend_symbol_has_the_color_of_errors(self, theme):
        (image,) = render_legend_symbols(find_layer("contacts"), build_contact_scene(), theme)
        check_legend_symbol(image, theme, theme.error)
