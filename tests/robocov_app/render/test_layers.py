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
    measure_least_error,
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
from robocov_app.render.canvas import Canvas
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.render.layers.robots import compute_drawn_radii
from robocov_app.render.moving_obstacles import list_moving_obstacles
from robocov_app.render.painter import Painter
from robocov_app.render.scene import Scene


def test_every_layer_has_a_unique_name_and_a_title():
    layers = build_standard_layers()
    assert len({layer.name for layer in layers}) == len(layers)
    assert all(layer.title for layer in layers)


def test_without_visible_layers_nothing_is_drawn():
    pixels, _ = list_pixels(build_row_scene(record_walk(ROOMS, 6)))
    assert len(pixels) == 0


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
@pytest.mark.parametrize("n", [6, 30])
def test_a_cell_has_the_tint_of_the_nearest_robot(n, theme):
    record = record_walk(SQUARE, n)
    scene = build_row_scene(record)
    frame, painter = render_layers(scene, "cells", theme=theme)
    points = sample_inside(SQUARE.boundary_polygon.buffer(-0.1), 400)
    distances = np.linalg.norm(points[:, None] - record.positions[-1][None], axis=2)
    two = np.sort(distances, axis=1)[:, :2]
    clear = two[:, 1] - two[:, 0] > 0.12  # away from edges
    assert clear.sum() > 100
    pixels = painter.camera.to_pixels(points[clear])
    for pixel, robot in zip(pixels, distances[clear].argmin(axis=1), strict=True):
        assert measure_error(frame, pixel, theme.get_cell_color(painter._hues[robot])) == 0


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_cells_by_travel_time_have_the_tint_of_the_first_to_arrive(theme):
    """Slow robots' cells are holes in those of fast ones, with arcs for borders."""
    record = record_walk(SQUARE, 6)
    speeds = np.array([1.0, 1.0, 0.3, 0.3, 0.3, 0.3])
    team = replace(record.team, max_speed=speeds)
    record = replace(record, team=team, gains={"cells": "time"})
    scene = build_row_scene(record)
    assert scene.cell_owners is not None
    assert scene.cell_owners[0] in (0, 1), "the fast ones come first"
    frame, painter = render_layers(scene, "cells", theme=theme)
    points = sample_inside(SQUARE.boundary_polygon.buffer(-0.1), 400)
    times = np.linalg.norm(points[:, None] - record.positions[-1][None], axis=2) / speeds
    two = np.sort(times, axis=1)[:, :2]
    clear = two[:, 1] - two[:, 0] > 0.4  # away from edges
    assert clear.sum() > 100
    assert set(times[clear].argmin(axis=1)) > {0, 1}
    pixels = painter.camera.to_pixels(points[clear])
    for pixel, robot in zip(pixels, times[clear].argmin(axis=1), strict=True):
        assert measure_error(frame, pixel, theme.get_cell_color(painter._hues[robot])) == 0


def test_robots_of_different_size_are_drawn_to_scale():
    record = record_walk(SQUARE, 3)
    record = replace(record, team=replace(record.team, radius=np.array([0.3, 0.6, 0.9])))
    scene = build_row_scene(record)
    _, painter = render_layers(scene, "robots")
    canvas = Canvas(pygame.Surface(SIZE), painter.camera, LIGHT, 1.0, choose_robot_hues(3))
    expected = record.team.radius * painter.camera.zoom
    np.testing.assert_allclose(compute_drawn_radii(canvas, scene), expected, atol=0.26)


def test_edges_of_cells_are_drawn_between_robots():
    scene = build_scene(TWO)
    frame, painter = render_layers(scene, "cells")
    for point in ((4.0, 4.0), (3.0, 5.0), (6.0, 2.0)):
        assert measure_least_error(frame, painter.camera.to_pixels(np.array(point)), LIGHT.cell_edge) < 70


@pytest.mark.parametrize("n", [100, pytest.param(1000, marks=pytest.mark.slow)])
def test_narrow_cells_have_plain_edges(n):
    frame, _ = render_layers(build_row_scene(record_walk(SQUARE, n)), "cells")
    colors = {LIGHT.background, LIGHT.cell_edge, *map(LIGHT.get_cell_color, range(len(LIGHT.robots)))}
    assert (set(map(tuple, np.unique(frame.reshape(-1, 3), axis=0).tolist())) <= colors) == (n == 1000)


@pytest.mark.parametrize("environment", [ROOMS, HALL], ids=["rooms", "hall"])
def test_obstacles_are_drawn_on_blocked_positions(environment):
    frame, painter = render_layers(build_row_scene(record_walk(environment, 4)), "obstacles")
    solid = sample_inside(environment.blocked.buffer(-0.08), 150)
    free = sample_inside(environment.free.buffer(-0.08), 300)
    assert len(solid) > 50
    for pixel in painter.camera.to_pixels(solid):
        assert measure_error(frame, pixel, LIGHT.obstacle) == 0
    for pixel in painter.camera.to_pixels(free):  # the courtyard of ROOMS is free
        assert measure_error(frame, pixel, LIGHT.background) == 0


def test_an_obstacle_in_the_courtyard_of_a_thin_one_is_drawn():
    ring = PolygonObstacle(
        ((0.5, 0.5), (7.5, 0.5), (7.5, 7.5), (0.5, 7.5)), (((1, 1), (7, 1), (7, 7), (1, 7)),)
    )
    island = PolygonObstacle(((1.5, 1.5), (6.5, 1.5), (6.5, 6.5), (1.5, 6.5)))
    yard = Environment("yard", SQUARE.boundary, (ring, island), {"spread": UniformStart()})
    frame, painter = render_layers(build_row_scene(record_walk(yard, 2)), "obstacles")
    points = np.array([[0.75, 4.0], [4.0, 4.0], [1.25, 4.0], [0.25, 4.0]])
    colors = [LIGHT.obstacle, LIGHT.obstacle, LIGHT.background, LIGHT.background]
    for pixel, color in zip(painter.camera.to_pixels(points), colors, strict=True):
        assert measure_error(frame, pixel, color) == 0


def test_the_boundary_is_the_convex_hull():
    frame, painter = render_layers(build_row_scene(record_walk(HALL, 4)), "boundary")
    corners = HALL.region.vertices
    for middle in (corners + np.roll(corners, -1, axis=0)) / 2:
        assert measure_least_error(frame, painter.camera.to_pixels(middle), LIGHT.boundary) < 40
    assert measure_error(frame, painter.camera.to_pixels(np.array([6.0, 7.0])), LIGHT.background) == 0


def test_the_grid_has_lines_at_round_meters_inside_the_region_only():
    pixels, painter = list_pixels(build_row_scene(record_walk(HALL, 4)), "grid")
    points = painter.camera.to_world(pixels.astype(float))
    off = np.abs(points - np.rint(points)).min(axis=1)
    assert off.max() * painter.camera.zoom < 1.1
    assert shapely.contains_xy(HALL.region.polygon.buffer(1.5 / painter.camera.zoom), points).all()
    assert len({round(x) for x in points[:, 0]}) > 10


def test_starts_are_green_rings():
    record = record_walk(SQUARE, 5)
    frame, painter = render_layers(build_row_scene(record), "starts")
    for center in painter.camera.to_pixels(record.positions[0]):
        for side in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            on_ring = center + 4.5 * painter.scale * np.array(side)
            assert measure_least_error(frame, on_ring, LIGHT.start) < 60
        assert measure_error(frame, center, LIGHT.background) == 0


@pytest.mark.parametrize("size", [SIZE, (1279, 961), pytest.param((1920, 1440), marks=pytest.mark.slow)])
def test_the_boundary_has_clean_corners(size):
    """Nothing sticks out there: the corners reach as far as the sides between them."""
    frame, painter = render_layers(build_scene(TWO), "boundary", size=size)
    ink = np.abs(frame - np.array(LIGHT.background)).max(axis=2) > 50
    for picture in (ink, ink.T):
        whole = np.nonzero(picture.any(axis=0))[0]
        middle = np.nonzero(picture[picture.shape[0] // 2])[0]
        assert (whole.min(), whole.max()) == (middle.min(), middle.max())
    for x, y in painter.camera.to_pixels(SQUARE.region.vertices).round().astype(int):
        assert ink[y, x]


class TestCrowds:
    def radii(self, positions, size=SIZE, radius=0.1):
        scene = replace(build_scene(positions), team=Team.homogeneous(len(positions), radius=radius))
        painter = Painter(SQUARE, size)
        painter.render_frame(scene)
        canvas = Canvas(pygame.Surface(size), painter.camera, LIGHT, painter.scale, choose_robot_hues(0))
        return np.array(compute_drawn_radii(canvas, scene)), painter

    def test_discs_overlap_only_if_the_smallest_ones_would(self):
        positions = 4.0 + np.random.default_rng(0).normal(size=(150, 2)) * 0.9
        radii, painter = self.radii(positions)
        pixels = painter.camera.to_pixels(positions)
        apart = np.linalg.norm(pixels[:, None] - pixels[None], axis=2)
        least = np.maximum(0.1 * painter.camera.zoom, 2.4 * painter.scale)
        crowded = np.maximum(radii[:, None], radii[None]) > least + 0.5
        np.fill_diagonal(crowded, False)
        assert crowded.sum() > 1000
        assert (apart - radii[:, None] - radii[None])[crowded].min() > -0.5 - 0.5 * least

    def test_a_few_far_apart_are_readable_whatever_the_others_do(self):
        positions = np.vstack([4.0 + 0.01 * np.arange(8).reshape(4, 2), [[1.0, 1.0]]])
        radii, painter = self.radii(positions, radius=0.004)
        assert radii[-1] == pytest.approx(9.0 * painter.scale, abs=0.25)
        assert radii[:4].max() <= 2.4 * painter.scale + 0.5

    def test_numbers_are_drawn_only_if_they_fit(self, monkeypatch):
        from robocov_app.render import sprites

        seen = {}
        disc = sprites.render_disc

        def watch(radius, shift, *, ring_width, text, **colors):
            seen[text] = radius - ring_width
            return disc(radius, shift, ring_width=ring_width, text=text, **colors)

        monkeypatch.setattr(sprites, "render_disc", watch)
        positions = np.vstack([4.0 + 0.06 * np.arange(16).reshape(8, 2), [[1.0, 1.0], [7.0, 1.0]]])
        scene = build_scene(positions)
        scene = replace(scene, team=Team.homogeneous(10, radius=0.01))
        _, painter = render_layers(scene, "robots")
        assert set(seen) == {"", "9", "10"}
        assert seen["9"] > 5 * painter.scale > seen[""]

    def test_marks_shrink_in_a_crowd(self):
        near = replace(build_scene(TWO), starts=4.0 + 0.02 * np.arange(20).reshape(10, 2))
        far = replace(build_scene(TWO), starts=np.array([[2.0, 2.0], [6.0, 6.0]]))
        sizes = []
        for scene in (near, far):
            pixels, painter = list_pixels(scene, "starts", size=(800, 800))
            first = painter.camera.to_pixels(scene.starts)[0]
            sizes.append((first[0] - pixels[:, 0].min()) / painter.scale)
        assert sizes[0] < 4.0 < 4.5 < sizes[1]


class TestRobots:
    def ink_of_numbers(self, frame, painter, scene):
        """Return how many pixels within each disc are nearly of its number's color."""
        counts = []
        for pixel, hue in zip(painter.camera.to_pixels(scene.snapshot.positions), painter._hues, strict=True):
            x, y = np.rint(pixel).astype(int)
            patch = frame[y - 3 : y + 4, x - 3 : x + 4].reshape(-1, 3)
            color = np.array(choose_text_color(LIGHT.robots[hue]))
            counts.append(int((np.abs(patch - color).max(axis=1) < 70).sum()))
        return counts

    def test_each_has_a_disc_of_its_hue_and_a_number(self):
        scene = build_row_scene(record_walk(SQUARE, 9, seed=3))
        frame, painter = render_layers(scene, "robots")
        for pixel, hue in zip(painter.camera.to_pixels(scene.snapshot.positions), painter._hues, strict=True):
            rim = pixel + np.array([0.0, -5.0])
            assert measure_least_error(frame, rim, LIGHT.robots[hue]) < 30
        assert min(self.ink_of_numbers(frame, painter, scene)) >= 4

    def test_the_test_for_numbers_sees_their_absence(self, monkeypatch):
        from robocov_app.render import sprites

        render_disc = sprites.render_disc

        def render_without_number(radius, shift, *, text, **style):
            return render_disc(radius, shift, **style)

        monkeypatch.setattr(sprites, "render_disc", render_without_number)
        scene = build_row_scene(record_walk(SQUARE, 9, seed=3))
        frame, painter = render_layers(scene, "robots")
        assert max(self.ink_of_numbers(frame, painter, scene)) == 0

    def test_numbers_are_those_of_the_robots(self):
        """Of all nine numbers drawn in a robot's place, its own looks most like the picture."""
        from robocov_app.render import sprites

        scene = build_row_scene(record_walk(SQUARE, 9, seed=3))
        frame, painter = render_layers(scene, "robots")
        for robot, pixel in enumerate(painter.camera.to_pixels(scene.snapshot.positions)):
            quarters = np.rint((pixel + 0.5) * sprites.SUPERSAMPLING).astype(int)
            x, y = quarters // sprites.SUPERSAMPLING
            shift = tuple((quarters % sprites.SUPERSAMPLING).tolist())
            fill = LIGHT.robots[painter._hues[robot]]
            misses = []
            for number in range(1, 10):
                radius = round(9.0 * painter.scale * 2) / 2
                sprite = sprites.render_disc(
                    radius,
                    shift,
                    fill=fill,
                    ring=(255,) * 3,
                    ring_width=1.6 * painter.scale,
                    edge=(0,) * 3,
                    text=str(number),
                )
                pixels = np.frombuffer(pygame.image.tobytes(sprite, "RGB"), np.uint8)
                pixels = pixels.reshape(sprite.get_height(), sprite.get_width(), 3).astype(int)
                half = sprite.get_width() // 2
                middle = pixels[half - 4 : half + 5, half - 4 : half + 5]
                misses.append(np.abs(frame[y - 4 : y + 5, x - 4 : x + 5] - middle).sum())
            assert int(np.argmin(misses)) == robot

    def test_numbers_differ(self):
        """Robots 1 and 7 at one place look different, in the middle of the disc."""
        one, painter = render_layers(build_scene(np.array([[4.0, 4.0]])), "robots")
        several = np.column_stack([np.full(7, 1.0), np.arange(7.0) + 0.5])
        several[6] = 4.0
        seven, _ = render_layers(build_scene(several), "robots")
        x, y = np.rint(painter.camera.to_pixels(np.array([4.0, 4.0]))).astype(int)
        light = [frame[y - 5 : y + 6, x - 5 : x + 6].min(axis=2) for frame in (one, seven)]
        assert (np.abs(light[0] - light[1]) > 60).sum() > 5

    def test_a_large_robot_is_drawn_in_true_size(self):
        scene = replace(build_scene(ONE), team=Team.homogeneous(1, radius=1.5))
        pixels, painter = list_pixels(scene, "robots")
        width, height = np.ptp(pixels, axis=0) + 1
        assert width == pytest.approx(3.0 * painter.camera.zoom, abs=4)
        assert height == pytest.approx(width, abs=1)

    @pytest.mark.slow
    def test_slow_robots_glide(self):
        """A shift by a quarter of a pixel changes the picture."""
        _, painter = render_layers(build_scene(ONE), "robots")
        frames = [
            render_layers(build_scene(ONE + np.array([[k / 4 / painter.camera.zoom, 0.0]])), "robots")[0]
            for k in range(5)
        ]
        for first, second in pairwise(frames):
            assert (first != second).any()
        assert (np.roll(frames[0], 1, axis=1) == frames[4]).all()


class TestNumbers:
    def patch(self, frame, painter, place, reach=9):
        x, y = np.rint(painter.camera.to_pixels(np.array(place))).astype(int)
        return frame[y - reach : y + reach + 1, x - reach : x + reach + 1]

    def test_robots_are_called_by_theirs(self):
        """What is called 7 looks as the seventh of seven does, number and color."""
        several = np.column_stack([np.full(7, 1.0), np.arange(7.0) + 0.5])
        several[6] = 4.0
        expected, painter = render_layers(build_scene(several), "robots")
        named = replace(build_scene(np.array([[4.0, 4.0], [6.0, 6.0]])), numbers=(7, 2))
        frame, _ = render_layers(named, "robots")
        assert (self.patch(frame, painter, (4.0, 4.0)) == self.patch(expected, painter, (4.0, 4.0))).all()
        unnamed, _ = render_layers(replace(named, numbers=None), "robots")
        assert (self.patch(unnamed, painter, (4.0, 4.0)) != self.patch(expected, painter, (4.0, 4.0))).any()
        assert [named.get_number(row) for row in (0, 1)] == [7, 2]
        assert [build_scene(TWO).get_number(row) for row in (0, 1)] == [1, 2]

    @pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
    def test_in_a_small_team_colors_stay_with_them(self, theme):
        places = np.array([[1.0, 1.0], [4.0, 4.0], [7.0, 7.0]])
        painter = Painter(SQUARE, SIZE, theme)
        painter.show_only({"robots", "cells"})
        for numbers in ((1, 2, 3), (1, 3), (3,), (2, 9)):
            rows = [3 if number == 9 else number for number in numbers]
            positions = places[np.array(rows) - 1]
            frame = painter.render_frame(replace(build_scene(positions), numbers=numbers)).astype(int)
            for number, place in zip(numbers, positions, strict=True):
                pixel = painter.camera.to_pixels(place)
                assert measure_least_error(frame, pixel - np.array([0.0, 5.0]), theme.robots[number - 1]) < 30
                assert (
                    measure_error(frame, pixel + np.array([0.0, 30.0]), theme.get_cell_color(number - 1)) == 0
                )

    def test_numbers_beyond_the_hues_do_not_matter(self):
        scene = replace(build_scene(TWO), numbers=(4, 10))
        _, painter = render_layers(scene, "robots")
        assert painter._hues.tolist() == [0, 1]


class TestCells:
    def scene(self, reach, used):
        scene = build_scene(TWO, communication_range=reach)
        decision = replace(scene.snapshot.decision, cells=used)
        snapshot = Snapshot(scene.snapshot.seen, decision)
        return Scene.from_snapshot(SQUARE, scene.team, snapshot)

    def test_cells_of_the_controller_are_used_with_full_communication(self):
        used = partition(TWO, SQUARE.region)
        scene = self.scene(np.inf, used)
        assert scene.cells is used.polygons
        assert scene.centroids is used.centroids

    @pytest.mark.parametrize("reach", [np.inf, 3.0])
    @pytest.mark.parametrize(
        "used",
        [
            partition(np.array([[1.0, 4.0], [3.0, 4.0]]), SQUARE.region),
            partition(np.array([[1.0, 4.0]]), SQUARE.region),
            "none",
            None,
        ],
    )
    def test_true_cells_are_drawn_if_the_controller_has_others(self, reach, used):
        scene = self.scene(reach, used)
        frame, painter = render_layers(scene, "cells")
        assert (
            measure_least_error(frame, painter.camera.to_pixels(np.array([3.0, 5.0])), LIGHT.cell_edge) < 70
        )
        assert (
            measure_error(frame, painter.camera.to_pixels(np.array([5.0, 1.0])), LIGHT.get_cell_color(0)) == 0
        )


class TestTrajectories:
    @pytest.mark.parametrize("colors", ["robots", "paper"])
    def test_run_along_the_positions(self, colors):
        record = record_walk(SQUARE, 4)
        frame, painter = render_layers(
            build_row_scene(record), "trajectories", layers=build_standard_layers(colors), size=(800, 800)
        )
        for robot in range(4):
            color = LIGHT.trajectory if colors == "paper" else LIGHT.robots[robot]
            for pixel in painter.camera.to_pixels(record.positions[5:35:4, robot]):
                assert measure_least_error(frame, pixel, color) < 110

    def test_frames_one_by_one_look_like_the_whole_trail(self):
        record = record_walk(SQUARE, 5, steps=60)
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"trajectories"})
        for row in range(60):
            stepwise = painter.render_frame(build_row_scene(record, row)).astype(int)
        at_once, _ = render_layers(build_row_scene(record), "trajectories")
        drawn_pixels = (at_once != 255).any(axis=2)
        assert drawn_pixels.sum() > 500
        assert np.abs(stepwise - at_once)[drawn_pixels].mean() < 12
        far = ~shapely.contains_xy(
            shapely.union_all(
                [
                    shapely.LineString(painter.camera.to_pixels(path))
                    for path in record.positions.swapaxes(0, 1)
                ]
            ).buffer(3.0),
            *np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])),
        )
        assert (stepwise[far] == 255).all()

    def test_another_run_or_a_step_back_replaces_the_page(self):
        first = record_walk(SQUARE, 5, seed=1)
        second = record_walk(SQUARE, 5, seed=2)
        painter = Painter(SQUARE, SIZE)
        painter.show_only({"trajectories"})
        painter.render_frame(build_row_scene(first))
        for scene in (build_row_scene(second), build_row_scene(second, 20), build_row_scene(first, 3)):
            fresh, _ = render_layers(scene, "trajectories")
            assert (painter.render_frame(scene) == fresh).all()

    def test_fading_forgets_the_past(self):
        record = record_walk(SQUARE, 1, steps=80)
        frame, painter = render_layers(replace(build_row_scene(record), trail_fade=1.0), "trajectories")
        old, new = painter.camera.to_pixels(record.positions[[20, 78], 0])
        assert measure_least_error(frame, old, LIGHT.background, reach=2) == 0
        assert (frame[int(old[1]) - 2 : int(old[1]) + 3, int(old[0]) - 2 : int(old[0]) + 3] == 255).all()
        assert measure_least_error(frame, new, LIGHT.robots[0]) < 110


class TestMovingObstacles:
    CARTS = Environment(
        "carts",
        ((0, 0), (8, 0), (8, 6), (0, 6)),
        (
            CircleObstacle((1, 1), 0.5, "cart", ObstaclePath(((1, 1), (5, 1), (5, 4)), 1.0)),
            CircleObstacle((6, 3), 0.8),
        ),
    )

    def scene(self, time: float) -> Scene:
        return Scene(self.CARTS.at(time), Team.homogeneous(1), moving=list_moving_obstacles(self.CARTS, time))

    def test_moving_obstacles_have_positions_and_headings(self):
        (cart,) = list_moving_obstacles(self.CARTS, 6.0)
        assert cart.middle == pytest.approx([5.0, 3.0])
        assert cart.heading == pytest.approx([0.0, 1.0])
        assert cart.path.tolist() == pytest.approx(np.array([[1, 1], [5, 1], [5, 4], [1, 1]]))
        assert list_moving_obstacles(self.CARTS.static, 6.0) == []

    @pytest.mark.parametrize("theme", [LIGHT, DARK])
    def test_moving_obstacles_differ_from_static_ones(self, theme):
        painter = Painter(self.CARTS, (480, 360), theme)
        frame = painter.render_frame(self.scene(2.0))

        def get_color_at(x, y):
            column, row = painter.camera.to_pixels(np.array([x, y])).round().astype(int)
            return tuple(frame[row, column].tolist())

        assert get_color_at(6.0, 3.3) == theme.obstacle
        assert get_color_at(3.0, 1.3) == theme.moving_obstacle != theme.obstacle
        assert np.abs(np.subtract(get_color_at(3.0, 1.0), theme.ink)).max() < 5  # the arrow
        assert list_legend_texts(painter, self.scene(2.0))[-1] == "moving obstacle and its path"
        assert not any(
            "moving" in words
            for words in list_legend_texts(painter, Scene(self.CARTS.static, Team.homogeneous(1)))
        )
