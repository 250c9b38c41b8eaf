from dataclasses import replace
from itertools import pairwise

import numpy as np
import pygame
import pytest
import shapely
from drawn_pixels import SIZE, find_layer, measure_error, measure_least_error, render_layers
from drawn_run import SQUARE, build_row_scene, build_scene, record_walk

from robocov_app.look.hues import choose_trail_color
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.layers.fading_trails import FADE_STEPS
from robocov_app.render.painter import Painter

THEMES = pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
MOSTLY_LIGHT = pytest.mark.parametrize(
    "theme", [LIGHT, pytest.param(DARK, marks=pytest.mark.slow)], ids=["light", "dark"]
)
FADES = pytest.mark.parametrize("fade", [None, 2.0], ids=["stays", "fades"])
RATE = 20.0
"""Rows for each second."""


def build_random_trail(rows, n=3, seed=0):
    """Return (rows, n, 2) m of smooth walks in the square."""
    rng = np.random.default_rng(seed)
    time = np.arange(rows)[:, None] / RATE
    speed = rng.uniform(0.2, 0.7, size=(2, n))
    phase = rng.uniform(0, 6, size=(2, n))
    return 4.0 + 3.0 * np.stack(
        [np.sin(time * speed[0] + phase[0]), np.cos(time * speed[1] + phase[1])], axis=2
    )


def build_straight_trail(rows, n=1):
    """Return walks to the right at 2 m/s below each other."""
    path = np.empty((rows, n, 2))
    path[..., 0] = 0.5 + 2.0 * np.arange(rows)[:, None] / RATE
    path[..., 1] = 1.0 + np.arange(n)
    return path


def build_trail_scene(trail, time=None, **more):
    time = np.arange(len(trail)) / RATE if time is None else time
    known = np.nan_to_num(trail[-1], nan=1.0)
    return replace(build_scene(known), trail=trail, trail_time=time, **more)


class FadingPainter(Painter):
    fade = None

    def draw(self, surface, scene):
        super().draw(surface, replace(scene, trail_fade=self.fade))


def build_painter(fade=None, theme=LIGHT, size=SIZE, also=()):
    """Return a painter of trajectories, and what draws them."""
    painter = FadingPainter(SQUARE, size, theme)
    painter.show_only({"trajectories", *also})
    painter.fade = fade
    return painter, find_layer("trajectories", painter.layers).draw.__self__


def render_trail(painter, *scene, **more):
    return painter.render_frame(build_trail_scene(*scene, **more)).astype(int)


def find_ink(frame, theme=LIGHT):
    return np.abs(frame - np.array(theme.background)).max(axis=2)


def count_pixels_off_paths(painter, trail, frame, theme=LIGHT, reach=3.0):
    """Return what is drawn farther than a few px from the paths, robot by robot, rows without nan only."""
    lines = []
    for path in painter.camera.to_pixels(trail.swapaxes(0, 1)):
        there = np.isfinite(path[:, 0])
        pieces = np.split(path, np.flatnonzero(np.diff(there)) + 1)
        pieces = [piece for piece in pieces if np.isfinite(piece[0, 0])]
        lines += [shapely.LineString(p) if len(p) > 1 else shapely.Point(p[0]) for p in pieces]
    near = shapely.union_all(lines).buffer(reach)
    rows, columns = np.nonzero(find_ink(frame, theme))
    return int((~shapely.contains_xy(near, columns, rows)).sum())


class TestThinning:
    """A long run's trail loses every second of its older rows."""

    rows = 120
    at = 80

    def thinned(self, trail):
        keep = np.concatenate([np.arange(0, self.at // 2, 2), np.arange(self.at // 2, len(trail))])
        return trail[keep], keep / RATE

    @FADES
    @pytest.mark.parametrize("together", [pytest.param(0, marks=pytest.mark.slow), 3])
    def test_a_continued_trail_gives_the_same_picture_without_redrawing(self, fade, together):
        """Also where rows were added before the next frame."""
        trail = build_random_trail(self.rows)
        whole, _ = build_painter(fade)
        thin, layer = build_painter(fade)
        for count in range(1, self.at + 1):
            render_trail(whole, trail[:count])
            render_trail(thin, trail[:count])
        page = layer._page
        before = layer._key
        for count in range(self.at + together, self.rows + 1):
            expected = render_trail(whole, trail[:count])
            seen = render_trail(thin, *self.thinned(trail[:count]))
            assert (expected == seen).all()
            if layer._key == before:  # no step of fading since
                assert layer._page is page
        assert fade is not None or layer._page is page

    def test_without_a_cached_page_the_picture_is_nearly_the_same(self):
        trail = build_random_trail(self.rows)
        expected = render_trail(build_painter()[0], trail)
        seen = render_trail(build_painter()[0], *self.thinned(trail))
        drawn_pixels = find_ink(expected) > 0
        assert drawn_pixels.sum() > 800
        assert np.abs(expected - seen)[drawn_pixels].mean() < 12

    def test_another_trail_of_the_same_length_is_redrawn(self):
        painter, _ = build_painter()
        for seed in (0, 1, 0):
            seen = render_trail(painter, build_random_trail(60, seed=seed))
            assert (seen == render_trail(build_painter()[0], build_random_trail(60, seed=seed))).all()


class TestGaps:
    """Rows have nan for robots that are not there then."""

    def late(self, rows=80, begin=40):
        trail = build_straight_trail(rows, 2)
        trail[:begin, 1] = np.nan
        return trail

    @FADES
    @MOSTLY_LIGHT
    def test_robots_that_join_later_are_drawn_from_there(self, fade, theme):
        trail = self.late()
        painter, _ = build_painter(fade, theme)
        for count in (1, 20, 38, 40, 41, 42, 60, 80):
            frame = render_trail(painter, trail[:count])
            assert count_pixels_off_paths(painter, trail[:count], frame, theme) == 0
        at_once = render_trail(build_painter(fade, theme)[0], trail)
        for each in (frame, at_once):
            assert count_pixels_off_paths(painter, trail, each, theme) == 0
            for row in (60, 70, 78):
                pixel = painter.camera.to_pixels(trail[row, 1])
                assert measure_least_error(each, pixel, choose_trail_color(theme, 1)) < 120
            first = painter.camera.to_pixels(trail[40, 1])
            assert (
                find_ink(each, theme)[:, : int(first[0]) - 3][int(first[1]) - 4 : int(first[1]) + 5].max()
                == 0
            )

    @FADES
    def test_robots_that_join_again_elsewhere_have_separate_paths(self, fade):
        trail = build_straight_trail(60, 2)
        trail[30:40, 1] = np.nan
        trail[40:, 1, 1] = 6.0
        painter, _ = build_painter(fade)
        for count in (1, 20, 30, 31, 39, 40, 41, 42, 60):
            frame = render_trail(painter, trail[:count])
            assert count_pixels_off_paths(painter, trail[:count], frame) == 0
        at_once = render_trail(build_painter(fade)[0], trail)
        assert count_pixels_off_paths(painter, trail, at_once) == 0
        for each in (frame, at_once):
            for row in (26, 44, 55):
                pixel = painter.camera.to_pixels(trail[row, 1])
                assert measure_least_error(each, pixel, choose_trail_color(LIGHT, 1)) < 150

    @FADES
    def test_slow_ones_leave_none_either(self, fade):
        trail = build_straight_trail(30, 2) * np.array([0.05, 1.0]) + np.array([2.0, 0.0])
        trail[14:17, 1] = np.nan
        trail[17:, 1, 1] = 5.0
        frame = render_trail(build_painter(fade and 20.0)[0], trail)
        assert count_pixels_off_paths(build_painter()[0], trail, frame) == 0
        assert (find_ink(frame) > 0).any()

    @FADES
    def test_robots_that_fail_leave_only_their_path(self, fade):
        trail = build_straight_trail(50, 2)
        trail[35:, 1] = np.nan
        painter, _ = build_painter(fade)
        for count in range(1, 51):
            frame = render_trail(painter, trail[:count])
        assert count_pixels_off_paths(painter, trail, frame) == 0
        assert (
            measure_least_error(frame, painter.camera.to_pixels(trail[30, 1]), choose_trail_color(LIGHT, 1))
            < 200
        )

    @FADES
    def test_an_absent_robot_has_no_path(self, fade):
        trail = build_straight_trail(40, 2)
        trail[:, 1] = np.nan
        alone = render_trail(build_painter(fade)[0], trail)
        painter, _ = build_painter(fade)
        assert count_pixels_off_paths(painter, trail, alone) == 0
        nowhere = np.full((5, 2, 2), np.nan)
        assert (render_trail(painter, nowhere) == 255).all()
        assert (render_trail(painter, nowhere[:1]) == 255).all()

    def test_gaps_do_not_hinder_thinning(self):
        trail = self.late()
        painter, layer = build_painter()
        render_trail(painter, trail[:60])
        page = layer._page
        keep = np.r_[0:30:2, 30:80]
        render_trail(painter, trail[keep], keep / RATE)
        assert layer._page is page


class TestFading:
    def strengths(self, frame, painter, trail, rows, theme):
        """Return how far the picture is from the background at rows of the first robot."""
        pixels = painter.camera.to_pixels(trail[rows, 0])
        strength = find_ink(frame, theme)
        return [int(strength[int(y) - 1 : int(y) + 3, int(x)].max()) for x, y in np.rint(pixels)]

    @THEMES
    def test_older_pieces_are_fainter(self, theme):
        trail = build_straight_trail(70)
        painter, _ = build_painter(3.0, theme)
        frame = render_trail(painter, trail)
        rows = np.arange(68, 2, -6)
        seen = self.strengths(frame, painter, trail, rows, theme)
        age = (69 - rows) / RATE
        full = max(abs(a - b) for a, b in zip(choose_trail_color(theme, 0), theme.background, strict=True))
        assert seen[0] > 0.85 * full
        assert all(new > old for new, old in pairwise(seen) if new)
        assert 0.35 * full < np.interp(1.5, age, seen) < 0.75 * full
        assert np.interp(2.7, age, seen) < 0.3 * full
        assert self.strengths(frame, painter, trail, [5], theme) == [0]  # 3.2 s ago

    @MOSTLY_LIGHT
    def test_frame_by_frame_too(self, theme):
        """The newest is strong at any time, and nothing is missing up to now."""
        trail = build_straight_trail(70)
        painter, _ = build_painter(3.0, theme)
        full = max(abs(a - b) for a, b in zip(choose_trail_color(theme, 0), theme.background, strict=True))
        for count in range(2, 71, 4):
            frame = render_trail(painter, trail[:count])
            if count % 12 == 6:
                continue  # to look at all of them takes a while
            rows = np.arange(count - 2, max(count - 50, 0), -1)
            seen = self.strengths(frame, painter, trail, rows, theme)
            assert all(strength > 0.2 * full for strength in seen)
            assert all(strength > 0.75 * full for strength in seen[:8])
        assert self.strengths(frame, painter, trail, [5], theme) == [0]

    @THEMES
    def test_trails_fade_into_the_layers_below(self, theme):
        """On a cell it is neither paler nor darker than the cell and the color of its robot."""
        trail = build_straight_trail(70)
        painter, _ = build_painter(3.0, theme, also={"cells"})
        frame = render_trail(painter, trail)
        low = np.minimum(theme.get_cell_color(0), choose_trail_color(theme, 0)) - 4
        high = np.maximum(theme.get_cell_color(0), choose_trail_color(theme, 0)) + 4
        for x, y in np.rint(painter.camera.to_pixels(trail[8:68, 0])).astype(int):
            column = frame[y - 3 : y + 4, x]
            assert (column >= low).all()
            assert (column <= high).all()
        x, y = np.rint(painter.camera.to_pixels(trail[14, 0])).astype(int)
        assert 0 < measure_least_error(frame, (x, y), theme.get_cell_color(0), reach=0) < 60

    def test_newer_paths_are_on_top(self):
        rows = 61
        trail = np.empty((rows, 2, 2))
        part = np.arange(rows) / RATE
        trail[:, 0] = np.column_stack([np.full(rows, 4.0), 6.5 - 2.0 * part])  # crosses late, at 1.25 s
        trail[:, 1] = np.column_stack([3.5 + 2.0 * part, np.full(rows, 4.0)])  # crosses early, at 0.25 s
        painter, _ = build_painter(3.0)
        pixel = painter.camera.to_pixels(np.array([4.0, 4.0]))
        frame = render_trail(painter, trail)
        assert measure_least_error(frame, pixel, choose_trail_color(LIGHT, 0), reach=0) < measure_least_error(
            frame, pixel, choose_trail_color(LIGHT, 1), reach=0
        )
        swapped = render_trail(painter, trail[:, ::-1])
        assert measure_least_error(swapped, pixel, choose_trail_color(LIGHT, 1), reach=0) < 110

    def test_slow_robots_have_trails_without_gaps(self):
        trail = np.empty((400, 2, 2))
        trail[:, 0] = build_random_trail(400, 1)[:, 0]
        trail[:, 1] = np.column_stack([2.0 + 0.0009 * np.arange(400), np.full(400, 1.0)])
        painter, _ = build_painter(20.0)
        frame = render_trail(painter, trail)
        first, last = np.rint(painter.camera.to_pixels(trail[[200, -1], 1])).astype(int)
        band = find_ink(frame)[first[1] - 2 : first[1] + 4, first[0] : last[0]]
        assert band.shape[1] > 7
        assert band.max(axis=0).min() > 60

    @pytest.mark.slow
    def test_the_oldest_rows_of_a_fading_trail_are_drawn(self):
        """Rounding may find them a little older."""
        painter, _ = build_painter(0.3)
        trail = build_straight_trail(40)
        older = 0
        for rate in (7.0, 10.0, 30.0):
            time = np.arange(40) / rate
            for count in range(5, 40):
                painter.fade = 3 / rate
                older += (time[count - 1] - time[count - 4]) / painter.fade > 1.0
                frame = render_trail(painter, trail[:count], time[:count])
                assert (find_ink(frame) > 0).any()
        assert older > 0

    def test_the_page_of_a_fading_trail_is_cached_between_steps(self):
        trail = build_random_trail(200)
        painter, layer = build_painter(6.0)
        pages = []
        for count in range(100, 200):
            render_trail(painter, trail[:count])
            if not pages or layer._page is not pages[-1]:
                pages.append(layer._page)
        assert len(pages) == pytest.approx(100 / RATE / (6.0 / FADE_STEPS), abs=2)

    def test_another_run_or_a_step_back_replaces_the_page(self):
        painter, _ = build_painter(4.0)
        render_trail(painter, build_random_trail(43))
        for trail in (
            build_random_trail(43, seed=1),
            build_random_trail(41, seed=1),
            build_random_trail(42),
            build_random_trail(20),
            build_random_trail(3),
        ):
            assert (render_trail(painter, trail) == render_trail(build_painter(4.0)[0], trail)).all()

    def test_other_colors_are_redrawn(self):
        trail = build_straight_trail(40, 2)
        for fade in (None, 4.0):
            painter, _ = build_painter(fade)
            for numbers in ((1, 2), (3, 4)):
                frame = render_trail(painter, trail, numbers=numbers)
                assert (frame == render_trail(build_painter(fade)[0], trail, numbers=numbers)).all()
                for row, number in enumerate(numbers):
                    for place in painter.camera.to_pixels(trail[[30, 36], row]):
                        assert measure_least_error(frame, place, choose_trail_color(LIGHT, number - 1)) < 90

    def test_it_may_be_switched_on_and_off(self):
        trail = build_random_trail(90)
        painter, _ = build_painter()
        stays = render_trail(painter, trail)
        painter.fade = 1.5
        fades = render_trail(painter, trail)
        assert (fades == render_trail(build_painter(1.5)[0], trail)).all()
        painter.fade = None
        assert (render_trail(painter, trail) == stays).all()
        assert (find_ink(fades) > 0).sum() < 0.7 * (find_ink(stays) > 0).sum()
        painter.fade = 1.5
        scene = replace(build_trail_scene(trail), trail_time=None)  # it cannot, without times
        assert (painter.render_frame(scene) == stays).all()

    def test_short_trails_and_robots_at_rest_draw_nothing_distant(self):
        still = np.repeat(build_random_trail(1), 30, axis=0)
        for trail in (still, still[:1]):
            frame = render_trail(build_painter(1.0)[0], trail)
            assert (find_ink(frame) > 0).sum() <= 3 * 9

    @FADES
    def test_scans_are_drawn_at_high_zoom(self, fade):
        painter, _ = build_painter(fade)
        trail = build_random_trail(60)
        x, y = trail[-5, 0]
        painter.camera = replace(painter.camera, center=(x, y), zoom=2e4)
        frame = render_trail(painter, trail)
        assert (
            measure_least_error(
                frame, painter.camera.to_pixels(trail[-5, 0]), choose_trail_color(LIGHT, 0), reach=3
            )
            < 110
        )

    def test_large_teams_are_in_one_quiet_color(self):
        trail = build_straight_trail(40, 12) * np.array([1.0, 0.55])
        frame = render_trail(build_painter(4.0)[0], trail)
        painter, _ = build_painter(4.0)
        red = [
            measure_least_error(frame, painter.camera.to_pixels(trail[37, k]), LIGHT.trajectory)
            for k in range(12)
        ]
        assert max(red) < 150


@pytest.mark.parametrize("size", [(640, 480), (1600, 1200)])
@pytest.mark.slow
def test_pieces_on_the_page_and_new_ones_are_alike(size):
    """Where a section begins or ends, the line is neither thicker nor broken."""
    record = record_walk(SQUARE, 3, steps=80)
    painter, _ = build_painter(size=size)
    for row in range(1, 80):
        frame = painter.render_frame(build_row_scene(record, row)).astype(int)
    at_once, _ = render_layers(build_row_scene(record), "trajectories", size=size)
    for row in range(4, 74, 2):
        for pixel in painter.camera.to_pixels(record.positions[row]):
            assert measure_least_error(frame, pixel, LIGHT.background, reach=0) > 0
            assert (
                abs(
                    measure_error(frame, pixel, LIGHT.background)
                    - measure_error(at_once, pixel, LIGHT.background)
                )
                < 130
            )


def test_a_short_path_is_drawn_once_and_smooth(monkeypatch):
    """With two points, `pygame.draw.aalines` reads memory beyond them, so that frames would vary."""
    n_points = []
    draw_lines = pygame.draw.aalines

    def draw_and_count(surface, color, closed, points):
        n_points.append(len(points))
        return draw_lines(surface, color, closed, points)

    monkeypatch.setattr(pygame.draw, "aalines", draw_and_count)
    painter, _ = build_painter()
    painter.scale = 0.5
    for rows in range(2, 30):
        render_trail(painter, build_random_trail(rows))
    assert n_points
    assert min(n_points) > 2
