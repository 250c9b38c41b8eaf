"""Layers of the map, of robots, of their cells and trajectories."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pygame
import pytest
import shapely
from drawn_pixels import (
    ONE,
    SIZE,
    TWO,
    list_legend_texts,
    list_pixels,
    measure_error,
    measure_min_error,
    render_layers,
    sample_inside,
)
from drawn_run import HALL, ROOMS, SQUARE, build_row_scene, build_scene, record_walk

from robocov.environment import CircleObstacle, Environment, ObstaclePath, PolygonObstacle, UniformStart
from robocov.observation import Snapshot
from robocov.team import Team
from robocov.voronoi import partition
from robocov_app.look.colors import choose_text_color
from robocov_app.look.hues import choose_robot_hues
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.render.layers.robots import READABLE_RADIUS_PX, compute_drawn_radii
from robocov_app.render.moving_obstacles import list_moving_obstacles
from robocov_app.render.painter import Painter
from robocov_app.render.scene import Scene

THEMES = pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
SEVEN = np.array([[1.0, 0.5], [1.0, 1.5], [1.0, 2.5], [1.0, 3.5], [1.0, 4.5], [1.0, 5.5], [4.0, 4.0]])
"""Positions of seven robots, of which the last one is at the position in `ONE`."""


def find_clear_owners(costs, min_difference):
    """Return which points clearly belong to one robot, (k,) bool, and to which, (k,).

    `costs` has the cost of each robot at each point, (k, n). A point is clear if its two smallest costs
    differ by more than `min_difference`.
    """
    ordered = np.sort(costs, axis=1)
    is_clear = ordered[:, 1] - ordered[:, 0] > min_difference
    return is_clear, costs.argmin(axis=1)


def compute_radii(positions, radius_m):
    """Return the drawn radii of robots in px, (n,), and the painter."""
    scene = replace(build_scene(positions), team=Team.homogeneous(len(positions), radius=radius_m))
    painter = Painter(SQUARE, SIZE)
    painter.render_frame(scene)
    canvas = Canvas(pygame.Surface(SIZE), painter.camera, LIGHT, painter.scale, choose_robot_hues(0))
    return np.array(compute_drawn_radii(canvas, scene)), painter


def extract_patch(frame, pixel, half_size):
    """Return the square of pixels around a pixel, (2 half_size + 1, 2 half_size + 1, 3)."""
    x, y = np.rint(pixel).astype(int)
    return frame[y - half_size : y + half_size + 1, x - half_size : x + half_size + 1]


def count_number_pixels(frame, painter, scene):
    """Return the number of pixels that have the color of the number on each disc, (n,)."""
    counts = []
    for pixel, hue in zip(painter.camera.to_pixels(scene.snapshot.positions), painter._hues, strict=True):
        patch = extract_patch(frame, pixel, 3).reshape(-1, 3)
        color = np.array(choose_text_color(LIGHT.robots[hue]))
        counts.append(int((np.abs(patch - color).max(axis=1) < 70).sum()))
    return counts


def render_numbered_disc(number, shift, fill, scale):
    """Return the middle of a disc with a number as it is drawn for a robot, (9, 9, 3)."""
    sprite = sprites.render_disc(
        round(9.0 * scale * 2) / 2,
        shift,
        fill=fill,
        ring=(255, 255, 255),
        ring_width=1.6 * scale,
        edge=(0, 0, 0),
        text=str(number),
    )
    pixels = pygame.surfarray.array3d(sprite).swapaxes(0, 1).astype(int)
    center = sprite.get_width() // 2
    return extract_patch(pixels, (center, center), 4)


def build_cells_scene(communication_range, cells):
    """Return a scene of two robots whose controller used some cells."""
    scene = build_scene(TWO, communication_range=communication_range)
    decision = replace(scene.snapshot.decision, cells=cells)
    return Scene.from_snapshot(SQUARE, scene.team, Snapshot(scene.snapshot.seen, decision))


def test_every_layer_has_a_unique_name_and_a_title():
    layers = build_standard_layers()
    assert len({layer.name for layer in layers}) == len(layers)
    assert all(layer.title for layer in layers)


def test_without_visible_layers_nothing_is_drawn():
    pixels, _ = list_pixels(build_row_scene(record_walk(ROOMS, 6)))
    assert len(pixels) == 0


class TestCells:
    @THEMES
    @pytest.mark.parametrize("n", [6, 30])
    def test_a_cell_has_the_tint_of_the_nearest_robot(self, n, theme):
        record = record_walk(SQUARE, n)
        frame, painter = render_layers(build_row_scene(record), "cells", theme=theme)
        points = sample_inside(SQUARE.boundary_polygon.buffer(-0.1), 400)
        distances = np.linalg.norm(points[:, None] - record.positions[-1], axis=2)
        is_clear, owners = find_clear_owners(distances, 0.12)
        assert is_clear.sum() > 100
        pixels = painter.camera.to_pixels(points[is_clear])
        for pixel, robot in zip(pixels, owners[is_clear], strict=True):
            assert measure_error(frame, pixel, theme.get_cell_color(painter._hues[robot])) == 0

    @THEMES
    def test_cells_by_travel_time_have_the_tint_of_the_first_to_arrive(self, theme):
        """Cells of slow robots are holes with round borders in the cells of fast robots."""
        speeds = np.array([1.0, 1.0, 0.3, 0.3, 0.3, 0.3])
        record = record_walk(SQUARE, 6)
        team = replace(record.team, max_speed=speeds)
        record = replace(record, team=team, gains={"cells": "time"})
        scene = build_row_scene(record)
        frame, painter = render_layers(scene, "cells", theme=theme)
        points = sample_inside(SQUARE.boundary_polygon.buffer(-0.1), 400)
        travel_times = np.linalg.norm(points[:, None] - record.positions[-1], axis=2) / speeds
        is_clear, owners = find_clear_owners(travel_times, 0.4)
        assert is_clear.sum() > 100
        assert set(owners[is_clear]) > {0, 1}
        pixels = painter.camera.to_pixels(points[is_clear])
        for pixel, robot in zip(pixels, owners[is_clear], strict=True):
            assert measure_error(frame, pixel, theme.get_cell_color(painter._hues[robot])) == 0

    def test_cells_of_fast_robots_are_drawn_first(self):
        record = record_walk(SQUARE, 6)
        team = replace(record.team, max_speed=np.array([1.0, 1.0, 0.3, 0.3, 0.3, 0.3]))
        scene = build_row_scene(replace(record, team=team, gains={"cells": "time"}))
        assert scene.cell_owners is not None
        assert scene.cell_owners[0] in (0, 1)

    def test_edges_of_cells_are_drawn_between_robots(self):
        frame, painter = render_layers(build_scene(TWO), "cells")
        for pixel in painter.camera.to_pixels(np.array([[4.0, 4.0], [3.0, 5.0], [6.0, 2.0]])):
            assert measure_min_error(frame, pixel, LIGHT.cell_edge) < 70

    @pytest.mark.parametrize(
        ("n", "is_plain"), [(100, False), pytest.param(1000, True, marks=pytest.mark.slow)]
    )
    def test_only_narrow_cells_have_plain_edges(self, n, is_plain):
        """Smooth edges have mixtures of the colors of edges and cells."""
        frame, _ = render_layers(build_row_scene(record_walk(SQUARE, n)), "cells")
        cell_colors = [LIGHT.get_cell_color(hue) for hue in range(len(LIGHT.robots))]
        plain_colors = {LIGHT.background, LIGHT.cell_edge, *cell_colors}
        colors = {tuple(color) for color in np.unique(frame.reshape(-1, 3), axis=0).tolist()}
        assert (colors <= plain_colors) == is_plain

    def test_cells_of_the_controller_are_used_with_full_communication(self):
        cells = partition(TWO, SQUARE.region)
        scene = build_cells_scene(np.inf, cells)
        assert scene.cells is cells.polygons
        assert scene.centroids is cells.centroids

    @pytest.mark.parametrize("communication_range", [np.inf, 3.0], ids=["unlimited", "3 m"])
    @pytest.mark.parametrize(
        "cells",
        [
            pytest.param(partition(np.array([[1.0, 4.0], [3.0, 4.0]]), SQUARE.region), id="other positions"),
            pytest.param(partition(np.array([[1.0, 4.0]]), SQUARE.region), id="one cell"),
            pytest.param("none", id="another type"),
            pytest.param(None, id="none"),
        ],
    )
    def test_true_cells_are_drawn_if_the_controller_has_others(self, communication_range, cells):
        frame, painter = render_layers(build_cells_scene(communication_range, cells), "cells")
        on_edge, in_first_cell = painter.camera.to_pixels(np.array([[3.0, 5.0], [5.0, 1.0]]))
        assert measure_min_error(frame, on_edge, LIGHT.cell_edge) < 70
        assert measure_error(frame, in_first_cell, LIGHT.get_cell_color(0)) == 0


class TestMap:
    @pytest.mark.parametrize("environment", [ROOMS, HALL], ids=["rooms", "hall"])
    def test_obstacles_are_drawn_on_blocked_positions_only(self, environment):
        """The courtyard of an obstacle in `ROOMS` is free."""
        frame, painter = render_layers(build_row_scene(record_walk(environment, 4)), "obstacles")
        blocked = sample_inside(environment.blocked.buffer(-0.08), 150)
        free = sample_inside(environment.free.buffer(-0.08), 300)
        assert len(blocked) > 50
        for pixel in painter.camera.to_pixels(blocked):
            assert measure_error(frame, pixel, LIGHT.obstacle) == 0
        for pixel in painter.camera.to_pixels(free):
            assert measure_error(frame, pixel, LIGHT.background) == 0

    def test_an_obstacle_in_the_courtyard_of_a_thin_one_is_drawn(self):
        ring = PolygonObstacle(
            ((0.5, 0.5), (7.5, 0.5), (7.5, 7.5), (0.5, 7.5)), (((1, 1), (7, 1), (7, 7), (1, 7)),)
        )
        island = PolygonObstacle(((1.5, 1.5), (6.5, 1.5), (6.5, 6.5), (1.5, 6.5)))
        yard = Environment("yard", SQUARE.boundary, (ring, island), {"spread": UniformStart()})
        frame, painter = render_layers(build_row_scene(record_walk(yard, 2)), "obstacles")
        points = np.array([[0.75, 4.0], [4.0, 4.0], [1.25, 4.0], [0.25, 4.0]])
        on_ring, on_island, between, outside = painter.camera.to_pixels(points)
        assert measure_error(frame, on_ring, LIGHT.obstacle) == 0
        assert measure_error(frame, on_island, LIGHT.obstacle) == 0
        assert measure_error(frame, between, LIGHT.background) == 0
        assert measure_error(frame, outside, LIGHT.background) == 0

    def test_the_boundary_is_the_convex_hull(self):
        frame, painter = render_layers(build_row_scene(record_walk(HALL, 4)), "boundary")
        corners = HALL.region.vertices
        midpoints = (corners + np.roll(corners, -1, axis=0)) / 2
        for pixel in painter.camera.to_pixels(midpoints):
            assert measure_min_error(frame, pixel, LIGHT.boundary) < 40
        concave_side = painter.camera.to_pixels(np.array([6.0, 7.0]))
        assert measure_error(frame, concave_side, LIGHT.background) == 0

    @pytest.mark.parametrize("size", [SIZE, (1279, 961), pytest.param((1920, 1440), marks=pytest.mark.slow)])
    def test_the_boundary_has_clean_corners(self, size):
        """Corners neither stick out beyond the sides nor have notches."""
        frame, painter = render_layers(build_scene(TWO), "boundary", size=size)
        is_drawn = np.abs(frame - np.array(LIGHT.background)).max(axis=2) > 50
        height, width = is_drawn.shape
        columns = np.flatnonzero(is_drawn.any(axis=0))
        columns_of_sides = np.flatnonzero(is_drawn[height // 2])
        assert columns[[0, -1]].tolist() == columns_of_sides[[0, -1]].tolist()
        rows = np.flatnonzero(is_drawn.any(axis=1))
        rows_of_sides = np.flatnonzero(is_drawn[:, width // 2])
        assert rows[[0, -1]].tolist() == rows_of_sides[[0, -1]].tolist()
        for x, y in painter.camera.to_pixels(SQUARE.region.vertices).round().astype(int):
            assert is_drawn[y, x]

    def test_grid_lines_are_at_whole_meters(self):
        pixels, painter = list_pixels(build_row_scene(record_walk(HALL, 4)), "grid")
        points = painter.camera.to_world(pixels.astype(float))
        distances_m = np.abs(points - np.rint(points)).min(axis=1)
        assert distances_m.max() * painter.camera.zoom < 1.1
        assert len({round(x) for x in points[:, 0]}) > 10

    def test_the_grid_stays_inside_the_region(self):
        pixels, painter = list_pixels(build_row_scene(record_walk(HALL, 4)), "grid")
        points = painter.camera.to_world(pixels.astype(float))
        region = HALL.region.polygon.buffer(1.5 / painter.camera.zoom)
        assert shapely.contains_xy(region, points).all()

    def test_starts_are_green_rings(self):
        record = record_walk(SQUARE, 5)
        frame, painter = render_layers(build_row_scene(record), "starts")
        for center in painter.camera.to_pixels(record.positions[0]):
            assert measure_error(frame, center, LIGHT.background) == 0
            for direction in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                pixel = center + 4.5 * painter.scale * np.array(direction)
                assert measure_min_error(frame, pixel, LIGHT.start) < 60


class TestCrowds:
    def test_half_of_the_discs_do_not_overlap(self):
        positions = 4.0 + np.random.default_rng(0).normal(size=(150, 2)) * 0.9
        radii, painter = compute_radii(positions, radius_m=0.01)
        pixels = painter.camera.to_pixels(positions)
        distances = np.linalg.norm(pixels[:, None] - pixels, axis=2)
        np.fill_diagonal(distances, np.inf)
        assert radii[0] < 9.0 * painter.scale
        is_alone = (distances >= 2 * radii[0] - 0.5).all(axis=1)
        assert np.count_nonzero(is_alone) >= 75

    def test_discs_are_not_smaller_than_the_robots(self):
        positions = 4.0 + 0.01 * np.arange(8).reshape(4, 2)
        radii, painter = compute_radii(positions, radius_m=0.3)
        assert radii == pytest.approx(0.3 * painter.camera.zoom, abs=0.25)

    def test_numbers_are_drawn_only_if_they_fit(self, monkeypatch):
        inner_radii = {}
        render_disc = sprites.render_disc

        def render_and_note_radius(radius, shift, *, ring_width, text, **colors):
            inner_radii[text] = radius - ring_width
            return render_disc(radius, shift, ring_width=ring_width, text=text, **colors)

        monkeypatch.setattr(sprites, "render_disc", render_and_note_radius)
        for spacing, numbers in ((0.06, {""}), (0.8, {"1", "2", "3", "4"})):
            inner_radii.clear()
            positions = 2.0 + spacing * np.arange(8).reshape(4, 2)
            scene = replace(build_scene(positions), team=Team.homogeneous(4, radius=0.01))
            _, painter = render_layers(scene, "robots")
            assert set(inner_radii) == numbers
            is_large = min(inner_radii.values()) > 5 * painter.scale
            assert is_large is (numbers != {""})

    def test_a_fine_screen_shows_smaller_numbers(self, monkeypatch):
        """At scale 2, as on phones, digits of 10 px are sharp; at scale 1, they would be 5 px high."""
        texts = []
        render_disc = sprites.render_disc

        def render_and_note_text(radius, shift, *, text, **style):
            texts.append(text)
            return render_disc(radius, shift, text=text, **style)

        monkeypatch.setattr(sprites, "render_disc", render_and_note_text)
        for scale, has_numbers in ((1.0, False), (2.0, True)):
            painter = Painter(SQUARE, (640, 480), LIGHT, scale=scale)
            center = np.array([320.0, 240.0])
            positions = painter.camera.to_world(center + scale * np.array([[0.0, 0.0], [11.0, 0.0]]))
            team = Team.homogeneous(2, radius=0.01)
            texts.clear()
            painter.render_frame(replace(build_scene(positions), team=team))
            assert ({"1", "2"} <= set(texts)) == has_numbers

    def test_start_marks_shrink_in_a_crowd(self):
        crowd = 4.0 + 0.02 * np.arange(20).reshape(10, 2)
        radii = []
        for starts in (crowd, TWO):
            scene = replace(build_scene(TWO), starts=starts)
            pixels, painter = list_pixels(scene, "starts", size=(800, 800))
            x, _ = painter.camera.to_pixels(starts[0])
            radii.append((x - pixels[:, 0].min()) / painter.scale)
        crowded_radius, radius = radii
        assert crowded_radius < 4.0
        assert radius > 4.5


class TestRobots:
    def test_each_robot_has_a_disc_of_its_hue_and_a_number(self):
        scene = build_row_scene(record_walk(SQUARE, 9, seed=3))
        frame, painter = render_layers(scene, "robots")
        pixels = painter.camera.to_pixels(scene.snapshot.positions)
        for (x, y), hue in zip(pixels, painter._hues, strict=True):
            assert measure_min_error(frame, (x, y - 5.0), LIGHT.robots[hue]) < 30
        assert min(count_number_pixels(frame, painter, scene)) >= 4

    def test_discs_without_numbers_have_no_pixels_of_their_color(self, monkeypatch):
        """Otherwise the previous test could not fail."""
        render_disc = sprites.render_disc

        def render_without_number(radius, shift, *, text, **style):
            return render_disc(radius, shift, **style)

        monkeypatch.setattr(sprites, "render_disc", render_without_number)
        scene = build_row_scene(record_walk(SQUARE, 9, seed=3))
        frame, painter = render_layers(scene, "robots")
        assert max(count_number_pixels(frame, painter, scene)) == 0

    def test_each_robot_has_its_own_number(self):
        """Of the discs with numbers 1 to 9, that with the number of the robot is most similar."""
        scene = build_row_scene(record_walk(SQUARE, 9, seed=3))
        frame, painter = render_layers(scene, "robots")
        for robot, pixel in enumerate(painter.camera.to_pixels(scene.snapshot.positions)):
            subpixel = np.rint((pixel + 0.5) * sprites.SUPERSAMPLING).astype(int)
            patch = extract_patch(frame, subpixel // sprites.SUPERSAMPLING, 4)
            shift = tuple((subpixel % sprites.SUPERSAMPLING).tolist())
            fill = LIGHT.robots[painter._hues[robot]]
            errors = []
            for number in range(1, 10):
                expected = render_numbered_disc(number, shift, fill, painter.scale)
                errors.append(np.abs(patch - expected).sum())
            assert int(np.argmin(errors)) == robot

    def test_robots_one_and_seven_look_different(self):
        frame_of_one, painter = render_layers(build_scene(ONE), "robots")
        frame_of_seven, _ = render_layers(build_scene(SEVEN), "robots")
        pixel = painter.camera.to_pixels(ONE[0])
        patch_of_one = extract_patch(frame_of_one, pixel, 5).min(axis=2)
        patch_of_seven = extract_patch(frame_of_seven, pixel, 5).min(axis=2)
        assert (np.abs(patch_of_one - patch_of_seven) > 60).sum() > 5

    def test_a_large_robot_is_drawn_to_scale(self):
        scene = replace(build_scene(ONE), team=Team.homogeneous(1, radius=1.5))
        pixels, painter = list_pixels(scene, "robots")
        width, height = np.ptp(pixels, axis=0) + 1
        assert width == pytest.approx(3.0 * painter.camera.zoom, abs=4)
        assert height == pytest.approx(width, abs=1)

    def test_robots_of_different_size_are_drawn_to_scale(self):
        record = record_walk(SQUARE, 3)
        record = replace(record, team=replace(record.team, radius=np.array([0.3, 0.6, 0.9])))
        scene = build_row_scene(record)
        _, painter = render_layers(scene, "robots")
        canvas = Canvas(pygame.Surface(SIZE), painter.camera, LIGHT, 1.0, choose_robot_hues(3))
        expected = record.team.radius * painter.camera.zoom
        np.testing.assert_allclose(compute_drawn_radii(canvas, scene), expected, atol=0.26)

    @pytest.mark.parametrize("count", [6, 50])
    def test_robots_of_a_dense_team_are_large_enough_to_show_their_colors(self, count):
        positions = np.random.default_rng(0).uniform(3.0, 3.1, (count, 2))
        radii, painter = compute_radii(positions, radius_m=0.01)
        min_radius = {6: 5.0, 50: 3.0}[count]
        assert radii.min() >= min_radius * painter.scale - 0.25

    @pytest.mark.parametrize("shape", ["clump", "pair"])
    def test_robots_of_equal_size_have_discs_of_equal_size(self, shape):
        positions = {
            "clump": [(1, 1), (1.2, 1), (1, 1.25), (1.4, 1.4), (2.1, 1), (1, 2.3)],
            "pair": [(1, 1), (1.2, 1), (4, 4), (6, 2), (2, 6), (6, 6)],
        }
        radii, painter = compute_radii(np.array(positions[shape], dtype=float), radius_m=0.05)
        assert len(set(radii.tolist())) == 1
        # Two robots that touch do not make the numbers of all others too small to read.
        is_readable = radii[0] == pytest.approx(READABLE_RADIUS_PX * painter.scale, abs=0.25)
        assert is_readable == (shape == "pair")

    @pytest.mark.slow
    def test_robots_move_by_quarters_of_a_pixel(self):
        _, painter = render_layers(build_scene(ONE), "robots")
        frames = []
        for quarters in range(5):
            shift_m = quarters / 4 / painter.camera.zoom
            frame, _ = render_layers(build_scene(ONE + (shift_m, 0.0)), "robots")
            frames.append(frame)
        for earlier, later in pairwise(frames):
            assert (earlier != later).any()
        assert (np.roll(frames[0], 1, axis=1) == frames[4]).all()


class TestNumbers:
    def test_a_robot_with_a_number_looks_as_in_the_whole_team(self):
        """Robot 7 of a team of which only robots 7 and 2 are left has the same number and color."""
        expected, painter = render_layers(build_scene(SEVEN), "robots")
        pixel = painter.camera.to_pixels(SEVEN[6])
        scene = replace(build_scene(np.array([[4.0, 4.0], [6.0, 6.0]])), numbers=(7, 2))
        frame, _ = render_layers(scene, "robots")
        frame_without_numbers, _ = render_layers(replace(scene, numbers=None), "robots")
        expected_patch = extract_patch(expected, pixel, 9)
        assert (extract_patch(frame, pixel, 9) == expected_patch).all()
        assert (extract_patch(frame_without_numbers, pixel, 9) != expected_patch).any()

    def test_numbers_count_from_one_if_the_scene_has_none(self):
        scene = build_scene(TWO)
        assert [scene.get_number(row) for row in (0, 1)] == [1, 2]
        scene = replace(scene, numbers=(7, 2))
        assert [scene.get_number(row) for row in (0, 1)] == [7, 2]

    @THEMES
    def test_robots_of_a_small_team_keep_their_color(self, theme):
        positions = {1: (1.0, 1.0), 2: (4.0, 4.0), 3: (7.0, 7.0), 9: (7.0, 7.0)}
        painter = Painter(SQUARE, SIZE, theme)
        painter.show_only({"robots", "cells"})
        for numbers in ((1, 2, 3), (1, 3), (3,), (2, 9)):
            scene = build_scene(np.array([positions[number] for number in numbers]))
            frame = painter.render_frame(replace(scene, numbers=numbers)).astype(int)
            for number in numbers:
                x, y = painter.camera.to_pixels(np.array(positions[number]))
                robot_color = theme.robots[number - 1]
                cell_color = theme.get_cell_color(number - 1)
                assert measure_min_error(frame, (x, y - 5.0), robot_color) < 30
                assert measure_error(frame, (x, y + 30.0), cell_color) == 0

    def test_numbers_beyond_the_hues_do_not_choose_colors(self):
        scene = replace(build_scene(TWO), numbers=(4, 10))
        _, painter = render_layers(scene, "robots")
        assert painter._hues.tolist() == [0, 1]


class TestTrajectories:
    @pytest.mark.parametrize("colors", ["robots", "paper"])
    def test_trajectories_run_along_the_positions(self, colors):
        record = record_walk(SQUARE, 4)
        layers = build_standard_layers(colors)
        frame, painter = render_layers(
            build_row_scene(record), "trajectories", layers=layers, size=(800, 800)
        )
        for robot in range(4):
            color = LIGHT.trajectory if colors == "paper" else LIGHT.robots[robot]
            for pixel in painter.camera.to_pixels(record.positions[5:35:4, robot]):
                assert measure_min_error(frame, pixel, color) < 110

    def test_a_growing_trail_looks_like_one_drawn_at_once(self):
        record = record_walk(SQUARE, 5, steps=60)
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"trajectories"})
        for row in range(60):
            frame = painter.render_frame(build_row_scene(record, row)).astype(int)
        expected, _ = render_layers(build_row_scene(record), "trajectories")
        is_drawn = (expected != LIGHT.background).any(axis=2)
        assert is_drawn.sum() > 500
        assert np.abs(frame - expected)[is_drawn].mean() < 12
        paths = painter.camera.to_pixels(record.positions.swapaxes(0, 1))
        near_paths = shapely.union_all([shapely.LineString(path) for path in paths]).buffer(3.0)
        columns, rows = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
        is_far = ~shapely.contains_xy(near_paths, columns, rows)
        assert (frame[is_far] == LIGHT.background).all()

    def test_another_run_or_an_earlier_time_is_redrawn(self):
        first = record_walk(SQUARE, 5, seed=1)
        second = record_walk(SQUARE, 5, seed=2)
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"trajectories"})
        painter.render_frame(build_row_scene(first))
        for scene in (build_row_scene(second), build_row_scene(second, 20), build_row_scene(first, 3)):
            expected, _ = render_layers(scene, "trajectories")
            assert (painter.render_frame(scene) == expected).all()

    def test_only_the_recent_part_of_a_fading_trail_is_drawn(self):
        record = record_walk(SQUARE, 1, steps=80)
        scene = replace(build_row_scene(record), trail_fade=1.0)
        frame, painter = render_layers(scene, "trajectories")
        old_pixel, new_pixel = painter.camera.to_pixels(record.positions[[20, 78], 0])
        assert (extract_patch(frame, old_pixel, 2) == LIGHT.background).all()
        assert measure_min_error(frame, new_pixel, LIGHT.robots[0]) < 110


CARTS = Environment(
    "carts",
    ((0, 0), (8, 0), (8, 6), (0, 6)),
    (
        CircleObstacle((1, 1), 0.5, "cart", ObstaclePath(((1, 1), (5, 1), (5, 4)), 1.0)),
        CircleObstacle((6, 3), 0.8),
    ),
)


def build_cart_scene(environment, time=0.0):
    """Return a scene with the obstacles of an environment at a time in s."""
    moving = list_moving_obstacles(environment, time)
    return Scene(environment.at(time), Team.homogeneous(1), moving=moving)


class TestMovingObstacles:
    def test_moving_obstacles_have_positions_and_headings(self):
        (cart,) = list_moving_obstacles(CARTS, 6.0)
        assert cart.middle == pytest.approx([5.0, 3.0])
        assert cart.heading == pytest.approx([0.0, 1.0])
        assert cart.path.tolist() == pytest.approx(np.array([[1, 1], [5, 1], [5, 4], [1, 1]]))

    def test_static_obstacles_do_not_move(self):
        assert list_moving_obstacles(CARTS.static, 6.0) == []

    @THEMES
    def test_moving_obstacles_differ_from_static_ones(self, theme):
        painter = Painter(CARTS, (480, 360), theme)
        frame = painter.render_frame(build_cart_scene(CARTS, 2.0)).astype(int)
        points = np.array([[6.0, 3.3], [3.0, 1.3], [3.0, 1.0]])
        on_static_obstacle, on_cart, on_arrow = painter.camera.to_pixels(points)
        assert theme.moving_obstacle != theme.obstacle
        assert measure_error(frame, on_static_obstacle, theme.obstacle) == 0
        assert measure_error(frame, on_cart, theme.moving_obstacle) == 0
        assert measure_error(frame, on_arrow, theme.ink) < 5

    def test_the_legend_lists_moving_obstacles_if_there_are_any(self):
        painter = Painter(CARTS, (480, 360))
        texts = list_legend_texts(painter, build_cart_scene(CARTS, 2.0))
        assert texts[-1] == "moving obstacle and its path"
        texts = list_legend_texts(painter, build_cart_scene(CARTS.static))
        assert "moving obstacle and its path" not in texts
