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
    measure_least_error,
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


def build_scan(place=(4.0, 4.0), rays=120, reach=3.0, wall=5.4):
    """Return what a sensor measures beside a wall along x = `wall`."""
    angle = np.arange(rays) * (2 * np.pi / rays)
    heading = np.column_stack([np.cos(angle), np.sin(angle)])
    with np.errstate(divide="ignore"):
        length = np.where(heading[:, 0] > 0, (wall - place[0]) / heading[:, 0], np.inf)
    return np.array(place), np.array(place) + np.minimum(length, reach)[:, None] * heading


def build_scan_scene(*scans):
    return replace(build_scene(ONE), scans=scans)


class TestRayScan:
    @THEMES
    def test_only_the_scanned_area_is_tinted(self, theme):
        place, ends = build_scan()
        frame, painter = render_layers(build_scan_scene((place, ends)), "scan", theme=theme)
        area = shapely.Polygon(ends)
        away = [
            measure_error(frame, p, theme.background)
            for p in painter.camera.to_pixels(sample_inside(area.buffer(-0.1), 300))
        ]
        assert min(away) > 8
        assert max(away) < 90
        around = sample_inside(SQUARE.boundary_polygon.difference(area.buffer(0.15)), 200)
        for pixel in painter.camera.to_pixels(around):
            assert measure_error(frame, pixel, theme.background) == 0

    @THEMES
    def test_only_rays_that_hit_end_in_dots(self, theme):
        place, ends = build_scan()
        frame, painter = render_layers(build_scan_scene((place, ends)), "scan", theme=theme)
        for pixel, end in zip(painter.camera.to_pixels(ends), ends, strict=True):
            far = measure_least_error(frame, pixel, theme.final)
            assert far < 40 if end[0] > 5.39 else far > 60

    def test_rays_are_sparse_near_the_robot(self):
        """They are seen far out, and near the robot there is no more ink than there."""
        place, ends = build_scan(wall=8.0)
        frame, painter = render_layers(build_scan_scene((place, ends)), "scan")
        rows, columns = np.indices(frame.shape[:2])
        x, y = painter.camera.to_pixels(place)
        away = np.hypot(columns - x, rows - y) / painter.scale
        ink = np.abs(frame - np.array(LIGHT.background)).max(axis=2)
        reach = 3.0 * painter.camera.zoom / painter.scale
        near = ink[(away > 14) & (away < 30)]
        far = ink[(away > 0.7 * reach) & (away < 0.9 * reach)]
        assert near.mean() < 1.3 * far.mean()
        assert far.max() > np.median(far) + 10
        rim = ink[(away > 0.8 * reach - 0.5) & (away < 0.8 * reach + 0.5)]
        assert (rim > np.median(ink[(away > 3) & (away < 10)]) + 5).sum() >= 100

    def test_overlapping_scans_are_not_darker(self):
        alone, painter = render_layers(build_scan_scene(build_scan(wall=9.0)), "scan")
        both, _ = render_layers(
            build_scan_scene(build_scan(wall=9.0), build_scan((4.5, 4.0), wall=9.0)), "scan"
        )
        fills = []
        for frame in (alone, both):
            x, y = np.rint(painter.camera.to_pixels(np.array([4.25, 4.0]))).astype(int)
            colors, count = np.unique(
                frame[y - 30 : y + 31, x - 30 : x + 31].reshape(-1, 3), axis=0, return_counts=True
            )
            fills.append(colors[count.argmax()].tolist())
        assert fills[0] == fills[1] != list(LIGHT.background)

    def test_scans_are_drawn_at_high_zoom(self):
        scene = build_scan_scene(build_scan())
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"scan"})
        painter.camera = Camera((5.4, 4.0), 2e4, painter.camera.view)
        frame = painter.render_frame(scene).astype(int)
        assert measure_least_error(frame, painter.camera.to_pixels(np.array([5.4, 4.0])), LIGHT.final) < 10
        assert measure_error(frame, (SIZE[0] // 2 + 60, SIZE[1] // 2), LIGHT.background) == 0
        assert measure_error(frame, (SIZE[0] // 2 - 60, SIZE[1] // 2 - 40), LIGHT.background) > 8
        painter.camera = Camera((400.0, 4.0), 100.0, painter.camera.view)
        assert (painter.render_frame(scene) == 255).all()

    def test_without_scans_nothing_is_drawn(self):
        pixels, painter = list_pixels(build_scene(ONE), "scan")
        assert len(pixels) == 0
        assert list_legend_texts(painter, build_scene(ONE)) == []
        assert list_legend_texts(painter, build_scan_scene(build_scan())) == ["ray scan"]


SEEN = np.array([[7.2, 2.8], [11.0, 3.75], [4.0, 5.0]])
"""Places on the obstacles of `ROOMS`."""


def build_sensed_scene(points=SEEN, numbers=(1, 2, 3), time=0.0, n=4, **more):
    """Return a scene in which robots have sensed points."""
    sensed = SensedPoints()
    sensed.add(time, numbers, np.asarray(points))
    return replace(build_row_scene(record_walk(ROOMS, n)), sensed=sensed, **more)


def find_dots(frame, painter, theme=LIGHT, points=SEEN):
    """Return which points are drawn."""
    color = theme.forces["repulsion_obstacle"]
    return [measure_least_error(frame, pixel, color) < 25 for pixel in painter.camera.to_pixels(points)]


class TestSensedObstacles:
    @THEMES
    def test_sensed_points_contrast_with_pale_obstacles(self, theme):
        frame, painter = render_layers(build_sensed_scene(), "obstacles", "sensed", theme=theme)
        assert find_dots(frame, painter, theme) == [True, True, True]
        pale = mix(theme.background, theme.obstacle, 0.3)
        solid = sample_inside(ROOMS.blocked.buffer(-0.12), 150)
        solid = solid[np.linalg.norm(solid[:, None] - SEEN, axis=2).min(axis=1) > 0.15]
        for pixel in painter.camera.to_pixels(solid):
            assert measure_error(frame, pixel, pale) == 0
        assert compute_contrast(theme.forces["repulsion_obstacle"], pale) > 4
        for pixel in painter.camera.to_pixels(sample_inside(ROOMS.free.buffer(-0.12), 200)):
            assert measure_error(frame, pixel, theme.background) == 0  # that of the courtyard too

    def test_pale_obstacles_keep_their_outline(self):
        frame, painter = render_layers(build_sensed_scene(), "obstacles", "sensed")
        edge = painter.camera.to_pixels(np.array([[4.0, 4.0], [2.5, 7.0], [2.5, 7.6], [10.05, 2.8]]))
        for pixel in edge:
            assert measure_least_error(frame, pixel, mix(LIGHT.background, LIGHT.obstacle_edge, 0.6)) < 40

    def test_an_obstacle_in_a_courtyard_is_pale_as_well(self):
        ring = PolygonObstacle(
            ((0.5, 0.5), (7.5, 0.5), (7.5, 7.5), (0.5, 7.5)), (((1, 1), (7, 1), (7, 7), (1, 7)),)
        )
        island = PolygonObstacle(((1.5, 1.5), (6.5, 1.5), (6.5, 6.5), (1.5, 6.5)))
        yard = Environment("yard", SQUARE.boundary, (ring, island), {"spread": UniformStart()})
        frame, painter = render_layers(
            replace(build_row_scene(record_walk(yard, 2)), sensed=SensedPoints()), "obstacles", "sensed"
        )
        pale = mix(LIGHT.background, LIGHT.obstacle, 0.3)
        for point, color in (((0.75, 4.0), pale), ((4.0, 4.0), pale), ((1.25, 4.0), LIGHT.background)):
            assert measure_error(frame, painter.camera.to_pixels(np.array(point)), color) == 0

    def test_the_boundary_does_not_change(self):
        scene = build_row_scene(record_walk(HALL, 2))  # a third of it lies along what is outside
        plain, painter = render_layers(scene, "obstacles", "boundary")
        frame, _ = render_layers(replace(scene, sensed=SensedPoints()), "obstacles", "boundary", "sensed")
        corners = HALL.region.vertices
        for part in np.linspace(0.01, 0.99, 60):
            for pixel in painter.camera.to_pixels(corners + part * (np.roll(corners, -1, axis=0) - corners)):
                x, y = np.rint(pixel).astype(int)
                assert np.abs(frame[y, x] - plain[y, x]).max() < 50
        pale, _ = render_layers(replace(scene, sensed=SensedPoints()), "obstacles", "sensed")
        assert (pale != frame).any()

    def test_points_are_drawn_without_the_obstacle_layer(self):
        pixels, painter = list_pixels(build_sensed_scene(), "sensed")
        away = np.linalg.norm(pixels[:, None] - painter.camera.to_pixels(SEEN), axis=2)
        assert len(pixels) >= 3 * 9
        assert away.min(axis=1).max() < 2.1 * painter.scale + 1.5

    def test_only_points_of_the_selected_robot_are_drawn(self):
        scene = build_sensed_scene(selected=1, numbers=(1, 7, 3))
        scene = replace(scene, numbers=(1, 7, 3, 9))
        frame, painter = render_layers(scene, "obstacles", "sensed")
        assert find_dots(frame, painter) == [False, True, False]
        assert list_legend_texts(painter, scene)[-1] == "known obstacles"
        frame = painter.render_frame(replace(scene, selected=None)).astype(int)
        assert find_dots(frame, painter) == [True, True, True]
        assert list_legend_texts(painter, replace(scene, selected=None))[-1] == "known obstacles"

    def test_points_depend_on_the_time(self):
        record = record_walk(ROOMS, 4)
        sensed = SensedPoints()
        for time, point in zip((0.0, 1.0, 2.0), SEEN, strict=True):
            sensed.add(time, (1,), point[None])
        painter = Painter(ROOMS, SIZE)
        painter.show_only({"obstacles", "sensed"})
        for row, known in ((0, 1), (10, 2), (15, 2), (20, 3), (39, 3), (12, 2), (0, 1)):
            frame = painter.render_frame(replace(build_row_scene(record, row), sensed=sensed)).astype(int)
            assert find_dots(frame, painter) == [True] * known + [False] * (3 - known)

    def test_another_history_replaces_all_points(self):
        painter = Painter(ROOMS, SIZE)
        painter.show_only({"obstacles", "sensed"})
        scene = build_sensed_scene(SEEN[:2], (1, 2))
        painter.render_frame(scene)
        scene.sensed.remove_after(-1.0)  # the same object, as long as before
        scene.sensed.add(0.0, (1, 2), SEEN[1:])
        assert find_dots(painter.render_frame(scene).astype(int), painter) == [False, True, True]
        assert find_dots(painter.render_frame(build_sensed_scene(SEEN[:2], (1, 2))).astype(int), painter) == [
            True,
            True,
            False,
        ]

    def test_another_map_theme_or_view_is_redrawn(self):
        painter = Painter(ROOMS, SIZE)
        painter.show_only({"obstacles", "sensed"})
        painter.render_frame(build_sensed_scene())
        painter.theme = DARK
        assert find_dots(painter.render_frame(build_sensed_scene()).astype(int), painter, DARK) == [
            True,
            True,
            True,
        ]
        painter.camera = painter.camera.pan(40, -30)
        assert find_dots(painter.render_frame(build_sensed_scene()).astype(int), painter, DARK) == [
            True,
            True,
            True,
        ]
        scene = build_sensed_scene(
            environment=Environment("empty", ROOMS.boundary, (), {"spread": UniformStart()})
        )
        frame = painter.render_frame(scene).astype(int)
        at = painter.camera.to_pixels(np.array([4.4, 5.5]))
        assert measure_error(frame, at, DARK.background) == 0

    def test_known_points_are_not_redrawn(self, monkeypatch):
        counts = []
        draw_dots = known_obstacles.draw_dots

        def count_dots(canvas, centers, *style):
            counts.append(len(centers))
            draw_dots(canvas, centers, *style)

        monkeypatch.setattr(known_obstacles, "draw_dots", count_dots)
        sensed = SensedPoints()
        layer = find_layer("sensed")
        painter = Painter(ROOMS, SIZE, layers=[layer])
        painter.show_only({"sensed"})
        record = record_walk(ROOMS, 4)
        pages = set()
        for row in range(9):
            if row in (0, 5):
                sensed.add(0.1 * row, (1, 2), SEEN[:2] + 0.1 * row)
            painter.render_frame(replace(build_row_scene(record, row), sensed=sensed))
            pages.add(id(layer.draw.__self__._page))
        assert counts == [2, 2]
        assert len(pages) == 1

    @THEMES
    def test_known_points_do_not_hide_headings_of_obstacles(self, theme):
        cart = CircleObstacle(
            (12.0, 7.0), 0.8, "cart", ObstaclePath(((12, 7), (15, 7)), 1.0, "back-and-forth")
        )
        carts = replace(ROOMS, obstacles=(*ROOMS.obstacles, cart))
        scene = replace(
            build_sensed_scene(), environment=carts.at(1.0), moving=list_moving_obstacles(carts, 1.0)
        )
        frame, painter = render_layers(scene, "sensed", "obstacles", theme=theme)
        middle = painter.camera.to_pixels(np.array([13.0, 7.0]))
        assert measure_least_error(frame, middle, theme.ink) < 30
        pale = mix(theme.background, theme.obstacle, 0.3)
        assert measure_least_error(frame, painter.camera.to_pixels(np.array([13.0, 7.5])), pale) < 5

    def test_without_knowledge_nothing_is_drawn(self):
        scene = build_row_scene(record_walk(ROOMS, 4))
        assert len(list_pixels(scene, "sensed")[0]) == 0
        assert not find_layer("sensed").can_draw(scene)


WAY = np.array([[1.0, 1.0], [4.0, 2.0], [6.0, 6.0]])


def build_path_scene(*corners, positions=TWO):
    return replace(build_scene(positions), path=np.array(corners or WAY, dtype=float))


def find_tags(frame, painter, words, theme=LIGHT):
    return find_text(frame, words, round(theme.text * painter.scale), theme, theme.final)


class TestCursorPath:
    @THEMES
    def test_leads_along_its_corners(self, theme):
        frame, painter = render_layers(build_path_scene(), "path", theme=theme)
        for start, end in pairwise(WAY):
            for part in np.linspace(0.15, 0.95, 9):
                pixel = painter.camera.to_pixels(start + part * (end - start))
                assert measure_least_error(frame, pixel, theme.final) < 50
        assert (
            measure_least_error(frame, painter.camera.to_pixels(WAY[0]), theme.final) < 5
        )  # a dot at the cursor

    def test_only_the_path_is_drawn(self):
        pixels, painter = list_pixels(build_path_scene(), "path")
        line = shapely.LineString(painter.camera.to_pixels(WAY)).buffer(3 * painter.scale)
        begin = shapely.Point(painter.camera.to_pixels(WAY[0])).buffer(75 * painter.scale)
        assert shapely.contains_xy(line.union(begin), pixels).all()

    @THEMES
    def test_the_path_has_a_halo(self, theme):
        scene = build_path_scene((1.0, 4.0), (7.0, 4.0))
        frame, painter = render_layers(scene, "cells", "path", theme=theme)
        pixel = painter.camera.to_pixels(np.array([5.5, 4.0]))
        column = frame[int(pixel[1]) - 5 : int(pixel[1]) + 6, int(pixel[0])]
        away = np.abs(column - np.array(theme.background)).max(axis=1)
        assert away[:5].min() < 12
        assert away[6:].min() < 12

    @THEMES
    @pytest.mark.parametrize(
        ("corners", "words"),
        [
            (WAY, f"{np.hypot(3, 1) + np.hypot(2, 4):.2f} m"),
            ([[4.0, 1.0], [4.0, 1.5]], "0.50 m"),
            ([[1.0, 7.0], [1.0, 6.96]], "0.04 m"),
        ],
    )
    def test_its_length_is_written_at_the_cursor(self, theme, corners, words):
        frame, painter = render_layers(build_path_scene(*corners), "path", theme=theme)
        found = find_tags(frame, painter, words, theme)
        assert len(found) == 1
        away = found[0] - painter.camera.to_pixels(np.array(corners[0]))
        assert np.abs(away).max() < 45 * painter.scale
        assert len(find_tags(frame, painter, "9.87 m", theme)) == 0

    def test_long_paths_have_whole_meters(self):
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"path"})
        painter.camera = Camera((4.0, 4.0), 0.5, painter.camera.view)
        frame = painter.render_frame(build_path_scene((4.0, 4.0), (4.0, 240.5))).astype(int)
        assert len(find_tags(frame, painter, "236 m")) == 1

    @pytest.mark.parametrize("corner", [(0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)])
    @pytest.mark.parametrize("zoom", [50.0, 90.0])
    def test_the_tag_stays_in_the_picture(self, corner, zoom):
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"path"})
        painter.camera = Camera((4.0, 4.0), zoom, painter.camera.view)
        frame = painter.render_frame(build_path_scene(corner, (4.0, 4.0))).astype(int)
        assert len(find_tags(frame, painter, "5.66 m")) == 1

    @pytest.mark.parametrize("angle", np.arange(8) * np.pi / 4)
    def test_the_tag_hides_neither_path_nor_robot(self, angle):
        heading = np.array([np.cos(angle), np.sin(angle)])
        end = 4.0 + 0.6 * heading
        scene = build_path_scene((4.0, 4.0), end, positions=np.array([end]))
        frame, painter = render_layers(scene, "path")
        assert len(find_tags(frame, painter, "0.60 m")) == 1
        for part in (0.3, 0.45, 0.6, 0.8):
            assert (
                measure_least_error(frame, painter.camera.to_pixels(4.0 + 0.6 * part * heading), LIGHT.final)
                < 50
            )
        both, _ = render_layers(scene, "path", "robots")
        alone, _ = render_layers(scene, "robots")
        disc = (alone != 255).any(axis=2)
        free = (frame == 255).all(axis=2)
        assert (both[disc & free] == alone[disc & free]).all()
        assert find_tags(both, painter, "0.60 m").tolist() == find_tags(frame, painter, "0.60 m").tolist()

    @pytest.mark.parametrize("side", [(1, 1), (-1, 1), (-1, -1), (1, -1)])
    def test_the_tag_hides_no_other_robot(self, side):
        positions = 4.0 + np.array([[0.4 * side[0], 0.35 * side[1]], [0.0, -2.0]])
        scene = build_path_scene((4.0, 4.0), (4.0, 2.0), positions=positions)
        frame, painter = render_layers(scene, "path")
        assert len(find_tags(frame, painter, "2.00 m")) == 1
        x, y = np.rint(painter.camera.to_pixels(positions[0])).astype(int)
        assert (frame[y - 4 : y + 5, x - 4 : x + 5] == 255).all()

    @pytest.mark.parametrize("path", [None, np.empty((0, 2)), np.array([[1.0, 1.0]])])
    def test_without_a_path_nothing_is_drawn(self, path):
        scene = replace(build_scene(TWO), path=path)
        pixels, painter = list_pixels(scene, "path")
        assert len(pixels) == 0
        assert list_legend_texts(painter, scene) == []


@THEMES
def test_glyphs_of_the_legend(theme):
    for layer, scene, color in (
        ("scan", build_scan_scene(build_scan()), theme.final),
        ("sensed", build_sensed_scene(), theme.forces["repulsion_obstacle"]),
        ("path", build_path_scene(), theme.final),
    ):
        pictures = render_legend_symbols(find_layer(layer), scene, theme)
        assert len(pictures) == 1
        check_legend_symbol(pictures[0], theme, color)
