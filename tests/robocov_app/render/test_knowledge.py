"""Layers that show what robots know: ray scans, sensed obstacles and the path to the cursor."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely
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
    sample_inside,
)
from drawn_run import HALL, ROOMS, SQUARE, build_row_scene, build_scene, record_walk
from rendered_text import check_legend_symbol, find_text, render_legend_symbols

from robocov.environment import CircleObstacle, Environment, ObstaclePath, PolygonObstacle, UniformStart
from robocov_app.look.colors import compute_contrast, mix
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.camera import Camera
from robocov_app.render.layers import known_obstacles
from robocov_app.render.moving_obstacles import list_moving_obstacles
from robocov_app.render.painter import Painter
from robocov_app.render.sensed_points import SensedPoints

THEMES = pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])


def measure_ink(frame, theme=LIGHT):
    """Return the maximum difference of a channel from the background at each pixel, (height, width)."""
    return np.abs(frame - np.array(theme.background)).max(axis=2)


def measure_distances(frame, painter, position):
    """Return the distance of each pixel from a position in m, (height, width) px at scale 1."""
    rows, columns = np.indices(frame.shape[:2])
    x, y = painter.camera.to_pixels(np.array(position))
    return np.hypot(columns - x, rows - y) / painter.scale


def build_scan(position=(4.0, 4.0), n_rays=120, sensing_range=3.0, wall_x=5.4):
    """Return a sensor's position left of a long wall, (2,) m, and the ends of its rays, (n_rays, 2) m."""
    origin = np.array(position)
    angles = np.arange(n_rays) * (2 * np.pi / n_rays)
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    with np.errstate(divide="ignore"):
        wall_distances = np.where(directions[:, 0] > 0, (wall_x - origin[0]) / directions[:, 0], np.inf)
    lengths = np.minimum(wall_distances, sensing_range)
    return origin, origin + lengths[:, None] * directions


def build_scan_scene(*scans):
    """Return a scene with one robot and some ray scans."""
    return replace(build_scene(ONE), scans=scans)


class TestRayScan:
    @THEMES
    def test_only_the_scanned_area_is_tinted(self, theme):
        origin, ends = build_scan()
        frame, painter = render_layers(build_scan_scene((origin, ends)), "scan", theme=theme)
        area = shapely.Polygon(ends)
        inside = painter.camera.to_pixels(sample_inside(area.buffer(-0.1), 300))
        ink = [measure_error(frame, pixel, theme.background) for pixel in inside]
        assert min(ink) > 8
        assert max(ink) < 90
        unscanned = SQUARE.boundary_polygon.difference(area.buffer(0.15))
        for pixel in painter.camera.to_pixels(sample_inside(unscanned, 200)):
            assert measure_error(frame, pixel, theme.background) == 0

    @THEMES
    def test_only_rays_that_hit_a_wall_end_in_dots(self, theme):
        origin, ends = build_scan(wall_x=5.4)
        frame, painter = render_layers(build_scan_scene((origin, ends)), "scan", theme=theme)
        for pixel, end in zip(painter.camera.to_pixels(ends), ends, strict=True):
            error = measure_min_error(frame, pixel, theme.final)
            is_hit = end[0] > 5.39
            if is_hit:
                assert error < 40
            else:
                assert error > 60

    def test_rays_do_not_pile_up_near_the_robot(self):
        sensing_range = 3.0
        origin, ends = build_scan(sensing_range=sensing_range, wall_x=8.0)
        frame, painter = render_layers(build_scan_scene((origin, ends)), "scan")
        ink = measure_ink(frame)
        distances = measure_distances(frame, painter, origin)
        range_px = sensing_range * painter.camera.zoom / painter.scale
        near = ink[(distances > 14) & (distances < 30)]
        far = ink[(distances > 0.7 * range_px) & (distances < 0.9 * range_px)]
        assert near.mean() < 1.3 * far.mean()

    def test_single_rays_are_visible_far_from_the_robot(self):
        sensing_range = 3.0
        origin, ends = build_scan(n_rays=120, sensing_range=sensing_range, wall_x=8.0)
        frame, painter = render_layers(build_scan_scene((origin, ends)), "scan")
        ink = measure_ink(frame)
        distances = measure_distances(frame, painter, origin)
        range_px = sensing_range * painter.camera.zoom / painter.scale
        far = ink[(distances > 0.7 * range_px) & (distances < 0.9 * range_px)]
        assert far.max() > np.median(far) + 10
        circle = ink[np.abs(distances - 0.8 * range_px) < 0.5]
        tint = np.median(ink[(distances > 3) & (distances < 10)])
        assert (circle > tint + 5).sum() >= 100

    def test_overlapping_scans_are_not_darker(self):
        scan = build_scan(wall_x=9.0)
        other_scan = build_scan((4.5, 4.0), wall_x=9.0)
        fills = []
        for scene in (build_scan_scene(scan), build_scan_scene(scan, other_scan)):
            frame, painter = render_layers(scene, "scan")
            x, y = np.rint(painter.camera.to_pixels(np.array([4.25, 4.0]))).astype(int)
            patch = frame[y - 30 : y + 31, x - 30 : x + 31].reshape(-1, 3)
            colors, counts = np.unique(patch, axis=0, return_counts=True)
            fills.append(tuple(colors[counts.argmax()].tolist()))
        assert fills[0] == fills[1]
        assert fills[0] != LIGHT.background

    def test_scans_are_drawn_at_high_zoom(self):
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"scan"})
        painter.camera = Camera((5.4, 4.0), 2e4, painter.camera.view)
        frame = painter.render_frame(build_scan_scene(build_scan(wall_x=5.4))).astype(int)
        wall_pixel = painter.camera.to_pixels(np.array([5.4, 4.0]))
        center_x = SIZE[0] // 2
        center_y = SIZE[1] // 2
        assert measure_min_error(frame, wall_pixel, LIGHT.final) < 10
        assert measure_error(frame, (center_x + 60, center_y), LIGHT.background) == 0
        assert measure_error(frame, (center_x - 60, center_y - 40), LIGHT.background) > 8

    def test_scans_outside_the_view_are_not_drawn(self):
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"scan"})
        painter.camera = Camera((400.0, 4.0), 100.0, painter.camera.view)
        assert (painter.render_frame(build_scan_scene(build_scan())) == LIGHT.background).all()

    def test_without_scans_nothing_is_drawn(self):
        pixels, _ = list_pixels(build_scene(ONE), "scan")
        assert len(pixels) == 0

    def test_the_legend_lists_scans_if_there_are_any(self):
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"scan"})
        assert list_legend_texts(painter, build_scene(ONE)) == []
        assert list_legend_texts(painter, build_scan_scene(build_scan())) == ["ray scan"]


SENSED_POINTS = np.array([[7.2, 2.8], [11.0, 3.75], [4.0, 5.0]])
"""Points on the obstacles of `ROOMS`, m."""


def build_sensed_scene(points=SENSED_POINTS, numbers=(1, 2, 3)):
    """Return a scene of four robots, of which some have sensed one point each."""
    sensed = SensedPoints()
    sensed.add(0.0, numbers, points)
    return replace(build_row_scene(record_walk(ROOMS, 4)), sensed=sensed)


def build_sensed_painter(theme=LIGHT):
    """Return a painter of the obstacles and of what robots know of them."""
    painter = Painter(ROOMS, SIZE, theme)
    painter.show_only({"obstacles", "sensed"})
    return painter


def list_visible_points(frame, painter, theme=LIGHT):
    """Return the indices of the sensed points that have a dot."""
    color = theme.forces["repulsion_obstacle"]
    pixels = painter.camera.to_pixels(SENSED_POINTS)
    return [k for k, pixel in enumerate(pixels) if measure_min_error(frame, pixel, color) < 25]


def get_pale_color(theme):
    """Return the color of obstacles below what robots know of them."""
    return mix(theme.background, theme.obstacle, 0.3)


class TestSensedObstacles:
    @THEMES
    def test_sensed_points_are_dots_on_pale_obstacles(self, theme):
        frame, painter = render_layers(build_sensed_scene(), "obstacles", "sensed", theme=theme)
        assert list_visible_points(frame, painter, theme) == [0, 1, 2]
        blocked = sample_inside(ROOMS.blocked.buffer(-0.12), 150)
        distances = np.linalg.norm(blocked[:, None] - SENSED_POINTS, axis=2).min(axis=1)
        for pixel in painter.camera.to_pixels(blocked[distances > 0.15]):
            assert measure_error(frame, pixel, get_pale_color(theme)) == 0

    @THEMES
    def test_sensed_points_contrast_with_pale_obstacles(self, theme):
        assert compute_contrast(theme.forces["repulsion_obstacle"], get_pale_color(theme)) > 4

    @THEMES
    def test_free_space_is_not_covered(self, theme):
        """The courtyard of an obstacle in `ROOMS` is free, too."""
        frame, painter = render_layers(build_sensed_scene(), "obstacles", "sensed", theme=theme)
        for pixel in painter.camera.to_pixels(sample_inside(ROOMS.free.buffer(-0.12), 200)):
            assert measure_error(frame, pixel, theme.background) == 0

    def test_pale_obstacles_keep_their_outline(self):
        frame, painter = render_layers(build_sensed_scene(), "obstacles", "sensed")
        outline_color = mix(LIGHT.background, LIGHT.obstacle_edge, 0.6)
        outline_points = np.array([[4.0, 4.0], [2.5, 7.0], [2.5, 7.6], [10.05, 2.8]])
        for pixel in painter.camera.to_pixels(outline_points):
            assert measure_min_error(frame, pixel, outline_color) < 40

    def test_an_obstacle_in_a_courtyard_is_pale(self):
        ring = PolygonObstacle(
            ((0.5, 0.5), (7.5, 0.5), (7.5, 7.5), (0.5, 7.5)), (((1, 1), (7, 1), (7, 7), (1, 7)),)
        )
        island = PolygonObstacle(((1.5, 1.5), (6.5, 1.5), (6.5, 6.5), (1.5, 6.5)))
        yard = Environment("yard", SQUARE.boundary, (ring, island), {"spread": UniformStart()})
        scene = replace(build_row_scene(record_walk(yard, 2)), sensed=SensedPoints())
        frame, painter = render_layers(scene, "obstacles", "sensed")
        on_ring, on_island, between = painter.camera.to_pixels(
            np.array([[0.75, 4.0], [4.0, 4.0], [1.25, 4.0]])
        )
        assert measure_error(frame, on_ring, get_pale_color(LIGHT)) == 0
        assert measure_error(frame, on_island, get_pale_color(LIGHT)) == 0
        assert measure_error(frame, between, LIGHT.background) == 0

    def test_the_boundary_does_not_become_pale(self):
        """In `HALL`, a third of the boundary lies along blocked space."""
        scene = build_row_scene(record_walk(HALL, 2))
        sensed_scene = replace(scene, sensed=SensedPoints())
        expected, painter = render_layers(scene, "obstacles", "boundary")
        frame, _ = render_layers(sensed_scene, "obstacles", "boundary", "sensed")
        corners = HALL.region.vertices
        sides = np.roll(corners, -1, axis=0) - corners
        for fraction in np.linspace(0.01, 0.99, 60):
            pixels = np.rint(painter.camera.to_pixels(corners + fraction * sides)).astype(int)
            for x, y in pixels:
                assert np.abs(frame[y, x] - expected[y, x]).max() < 50
        frame_without_boundary, _ = render_layers(sensed_scene, "obstacles", "sensed")
        assert (frame_without_boundary != frame).any()

    def test_points_are_drawn_without_the_obstacle_layer(self):
        pixels, painter = list_pixels(build_sensed_scene(), "sensed")
        dots = painter.camera.to_pixels(SENSED_POINTS)
        distances = np.linalg.norm(pixels[:, None] - dots, axis=2).min(axis=1)
        assert len(pixels) >= 3 * 9
        assert distances.max() < 2.1 * painter.scale + 1.5

    def test_only_points_of_the_selected_robot_are_drawn(self):
        scene = replace(build_sensed_scene(numbers=(1, 7, 3)), numbers=(1, 7, 3, 9))
        frame, painter = render_layers(replace(scene, selected=1), "obstacles", "sensed")
        assert list_visible_points(frame, painter) == [1]
        frame = painter.render_frame(replace(scene, selected=None)).astype(int)
        assert list_visible_points(frame, painter) == [0, 1, 2]

    @pytest.mark.parametrize("selected", [None, 1])
    def test_the_legend_lists_known_obstacles(self, selected):
        scene = replace(build_sensed_scene(), selected=selected)
        assert list_legend_texts(build_sensed_painter(), scene)[-1] == "known obstacles"

    def test_only_points_sensed_before_the_displayed_time_are_drawn(self):
        record = record_walk(ROOMS, 4)
        sensed = SensedPoints()
        for time, point in zip((0.0, 1.0, 2.0), SENSED_POINTS, strict=True):
            sensed.add(time, (1,), point[None])
        painter = build_sensed_painter()
        for row in (0, 10, 15, 20, 39, 12, 0):
            n_sensed = 1 + (row >= 10) + (row >= 20)
            scene = replace(build_row_scene(record, row), sensed=sensed)
            frame = painter.render_frame(scene).astype(int)
            assert list_visible_points(frame, painter) == list(range(n_sensed))

    def test_another_history_replaces_all_points(self):
        painter = build_sensed_painter()
        scene = build_sensed_scene(SENSED_POINTS[:2], (1, 2))
        painter.render_frame(scene)
        # The same object has as many points as before.
        scene.sensed.remove_after(-1.0)
        scene.sensed.add(0.0, (1, 2), SENSED_POINTS[1:])
        frame = painter.render_frame(scene).astype(int)
        assert list_visible_points(frame, painter) == [1, 2]
        frame = painter.render_frame(build_sensed_scene(SENSED_POINTS[:2], (1, 2))).astype(int)
        assert list_visible_points(frame, painter) == [0, 1]

    def test_points_are_redrawn_in_another_theme_and_view(self):
        painter = build_sensed_painter()
        painter.render_frame(build_sensed_scene())
        painter.theme = DARK
        frame = painter.render_frame(build_sensed_scene()).astype(int)
        assert list_visible_points(frame, painter, DARK) == [0, 1, 2]
        painter.camera = painter.camera.pan(40, -30)
        frame = painter.render_frame(build_sensed_scene()).astype(int)
        assert list_visible_points(frame, painter, DARK) == [0, 1, 2]

    def test_obstacles_of_another_map_are_redrawn(self):
        painter = build_sensed_painter()
        pixel = painter.camera.to_pixels(np.array([4.4, 5.5]))
        frame = painter.render_frame(build_sensed_scene()).astype(int)
        assert measure_error(frame, pixel, get_pale_color(LIGHT)) == 0
        empty_map = Environment("empty", ROOMS.boundary, (), {"spread": UniformStart()})
        frame = painter.render_frame(replace(build_sensed_scene(), environment=empty_map)).astype(int)
        assert measure_error(frame, pixel, LIGHT.background) == 0

    def test_known_points_are_not_redrawn(self, monkeypatch):
        dot_counts = []
        draw_dots = known_obstacles.draw_dots

        def draw_and_count(canvas, centers, *style):
            dot_counts.append(len(centers))
            draw_dots(canvas, centers, *style)

        monkeypatch.setattr(known_obstacles, "draw_dots", draw_and_count)
        sensed = SensedPoints()
        layer = find_layer("sensed")
        painter = Painter(ROOMS, SIZE, layers=[layer])
        painter.show_only({"sensed"})
        record = record_walk(ROOMS, 4)
        pages = set()
        for row in range(9):
            if row in (0, 5):
                sensed.add(0.1 * row, (1, 2), SENSED_POINTS[:2] + 0.1 * row)
            painter.render_frame(replace(build_row_scene(record, row), sensed=sensed))
            pages.add(id(layer.draw.__self__._page))
        assert dot_counts == [2, 2]
        assert len(pages) == 1

    @THEMES
    def test_headings_of_moving_obstacles_stay_visible(self, theme):
        path = ObstaclePath(((12, 7), (15, 7)), 1.0, "back-and-forth")
        cart = CircleObstacle((12.0, 7.0), 0.8, "cart", path)
        environment = replace(ROOMS, obstacles=(*ROOMS.obstacles, cart))
        scene = replace(
            build_sensed_scene(),
            environment=environment.at(1.0),
            moving=list_moving_obstacles(environment, 1.0),
        )
        frame, painter = render_layers(scene, "sensed", "obstacles", theme=theme)
        on_arrow, beside_arrow = painter.camera.to_pixels(np.array([[13.0, 7.0], [13.0, 7.5]]))
        assert measure_min_error(frame, on_arrow, theme.ink) < 30
        assert measure_min_error(frame, beside_arrow, get_pale_color(theme)) < 5

    def test_without_sensed_points_nothing_is_drawn(self):
        scene = build_row_scene(record_walk(ROOMS, 4))
        pixels, _ = list_pixels(scene, "sensed")
        assert len(pixels) == 0
        assert not find_layer("sensed").can_draw(scene)


CURSOR_PATH = ((1.0, 1.0), (4.0, 2.0), (6.0, 6.0))
"""Corners of a path from the cursor to a robot, m."""


def build_path_scene(corners=CURSOR_PATH, positions=TWO):
    """Return a scene with a path from the cursor to a robot."""
    return replace(build_scene(positions), path=np.array(corners, dtype=float))


def find_length_labels(frame, painter, text, theme=LIGHT):
    """Return the centers of all labels of a path with a text, (n, 2) px."""
    return find_text(frame, text, round(theme.text * painter.scale), theme, theme.final)


class TestCursorPath:
    @THEMES
    def test_the_path_leads_along_its_corners(self, theme):
        corners = np.array(CURSOR_PATH)
        frame, painter = render_layers(build_path_scene(corners), "path", theme=theme)
        for start, end in pairwise(corners):
            for fraction in np.linspace(0.15, 0.95, 9):
                pixel = painter.camera.to_pixels(start + fraction * (end - start))
                assert measure_min_error(frame, pixel, theme.final) < 50

    @THEMES
    def test_the_path_has_a_dot_at_the_cursor(self, theme):
        frame, painter = render_layers(build_path_scene(), "path", theme=theme)
        cursor = painter.camera.to_pixels(np.array(CURSOR_PATH[0]))
        assert measure_min_error(frame, cursor, theme.final) < 5

    def test_only_the_path_and_its_label_are_drawn(self):
        pixels, painter = list_pixels(build_path_scene(), "path")
        corners = painter.camera.to_pixels(np.array(CURSOR_PATH))
        line = shapely.LineString(corners).buffer(3 * painter.scale)
        label_area = shapely.Point(corners[0]).buffer(75 * painter.scale)
        assert shapely.contains_xy(line.union(label_area), pixels).all()

    @THEMES
    def test_the_path_has_a_halo(self, theme):
        scene = build_path_scene([(1.0, 4.0), (7.0, 4.0)])
        frame, painter = render_layers(scene, "cells", "path", theme=theme)
        x, y = painter.camera.to_pixels(np.array([5.5, 4.0])).astype(int)
        ink_across = measure_ink(frame, theme)[y - 5 : y + 6, x]
        assert ink_across[:5].min() < 12
        assert ink_across[6:].min() < 12

    @THEMES
    @pytest.mark.parametrize(
        ("corners", "label"),
        [
            (CURSOR_PATH, f"{np.hypot(3, 1) + np.hypot(2, 4):.2f} m"),
            ([(4.0, 1.0), (4.0, 1.5)], "0.50 m"),
            ([(1.0, 7.0), (1.0, 6.96)], "0.04 m"),
        ],
    )
    def test_the_path_length_is_next_to_the_cursor(self, theme, corners, label):
        frame, painter = render_layers(build_path_scene(corners), "path", theme=theme)
        centers = find_length_labels(frame, painter, label, theme)
        assert len(centers) == 1
        offset = centers[0] - painter.camera.to_pixels(np.array(corners[0]))
        assert np.abs(offset).max() < 45 * painter.scale
        assert len(find_length_labels(frame, painter, "9.87 m", theme)) == 0

    def test_long_path_lengths_are_in_whole_meters(self):
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"path"})
        painter.camera = Camera((4.0, 4.0), 0.5, painter.camera.view)
        frame = painter.render_frame(build_path_scene([(4.0, 4.0), (4.0, 240.5)])).astype(int)
        assert len(find_length_labels(frame, painter, "236 m")) == 1

    @pytest.mark.parametrize("cursor", [(0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)])
    @pytest.mark.parametrize("zoom", [50.0, 90.0])
    def test_the_label_stays_in_the_view(self, cursor, zoom):
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"path"})
        painter.camera = Camera((4.0, 4.0), zoom, painter.camera.view)
        frame = painter.render_frame(build_path_scene([cursor, (4.0, 4.0)])).astype(int)
        assert len(find_length_labels(frame, painter, "5.66 m")) == 1

    @pytest.mark.parametrize("angle", np.arange(8) * np.pi / 4)
    def test_the_label_covers_neither_the_path_nor_its_robot(self, angle):
        cursor = np.array([4.0, 4.0])
        direction = np.array([np.cos(angle), np.sin(angle)])
        robot = cursor + 0.6 * direction
        scene = build_path_scene([cursor, robot], positions=robot[None])
        frame, painter = render_layers(scene, "path")
        labels = find_length_labels(frame, painter, "0.60 m")
        assert len(labels) == 1
        for fraction in (0.3, 0.45, 0.6, 0.8):
            pixel = painter.camera.to_pixels(cursor + 0.6 * fraction * direction)
            assert measure_min_error(frame, pixel, LIGHT.final) < 50
        frame_with_robot, _ = render_layers(scene, "path", "robots")
        frame_without_path, _ = render_layers(scene, "robots")
        is_robot = measure_ink(frame_without_path) > 0
        is_path = measure_ink(frame) > 0
        is_only_robot = is_robot & ~is_path
        assert (frame_with_robot[is_only_robot] == frame_without_path[is_only_robot]).all()
        labels_with_robot = find_length_labels(frame_with_robot, painter, "0.60 m")
        assert labels_with_robot.tolist() == labels.tolist()

    @pytest.mark.parametrize("side", [(1, 1), (-1, 1), (-1, -1), (1, -1)])
    def test_the_label_covers_no_other_robot(self, side):
        positions = 4.0 + np.array([[0.4 * side[0], 0.35 * side[1]], [0.0, -2.0]])
        scene = build_path_scene([(4.0, 4.0), (4.0, 2.0)], positions=positions)
        frame, painter = render_layers(scene, "path")
        assert len(find_length_labels(frame, painter, "2.00 m")) == 1
        x, y = np.rint(painter.camera.to_pixels(positions[0])).astype(int)
        assert (frame[y - 4 : y + 5, x - 4 : x + 5] == LIGHT.background).all()

    @pytest.mark.parametrize("path", [None, np.empty((0, 2)), np.array([[1.0, 1.0]])])
    def test_without_a_path_nothing_is_drawn(self, path):
        scene = replace(build_scene(TWO), path=path)
        pixels, painter = list_pixels(scene, "path")
        assert len(pixels) == 0
        assert list_legend_texts(painter, scene) == []


@THEMES
@pytest.mark.parametrize("name", ["scan", "sensed", "path"])
def test_legend_symbols_have_the_color_of_their_layer(theme, name):
    scenes = {
        "scan": build_scan_scene(build_scan()),
        "sensed": build_sensed_scene(),
        "path": build_path_scene(),
    }
    colors = {
        "scan": theme.final,
        "sensed": theme.forces["repulsion_obstacle"],
        "path": theme.final,
    }
    (image,) = render_legend_symbols(find_layer(name), scenes[name], theme)
    check_legend_symbol(image, theme, colors[name])
