"""Trajectories: thinned, interrupted and fading ones."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pygame
import pytest
import shapely
from drawn_pixels import SIZE, find_layer, measure_error, measure_min_error, render_layers
from drawn_run import SQUARE, build_row_scene, build_scene, record_walk

from robocov_app.look.hues import choose_trail_color
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.render.layers.fading_trails import FADE_STEPS
from robocov_app.render.painter import Painter

ROWS_PER_SECOND = 20.0
SPEED_M_PER_S = 2.0
"""Speed of the robots on straight trails."""

THEMES = pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
THEMES_WITH_SLOW_DARK = pytest.mark.parametrize(
    "theme", [LIGHT, pytest.param(DARK, marks=pytest.mark.slow)], ids=["light", "dark"]
)
FADE_TIMES = pytest.mark.parametrize("fade_s", [None, 2.0], ids=["permanent", "fading"])


def build_random_trail(n_rows, n=3, seed=0):
    """Return smooth trajectories of n robots in the square, (n_rows, n, 2) m."""
    rng = np.random.default_rng(seed)
    time = np.arange(n_rows)[:, None] / ROWS_PER_SECOND
    frequency = rng.uniform(0.2, 0.7, size=(2, n))
    phase = rng.uniform(0, 6, size=(2, n))
    x = np.sin(time * frequency[0] + phase[0])
    y = np.cos(time * frequency[1] + phase[1])
    return 4.0 + 3.0 * np.stack([x, y], axis=2)


def build_straight_trail(n_rows, n=1):
    """Return parallel trajectories of n robots that move to the right, (n_rows, n, 2) m."""
    trail = np.empty((n_rows, n, 2))
    trail[..., 0] = 0.5 + SPEED_M_PER_S * np.arange(n_rows)[:, None] / ROWS_PER_SECOND
    trail[..., 1] = 1.0 + np.arange(n)
    return trail


def build_late_trail(n_rows=80, first_row=40):
    """Return a straight trail in which the second robot joins at a row, (n_rows, 2, 2) m."""
    trail = build_straight_trail(n_rows, 2)
    trail[:first_row, 1] = np.nan
    return trail


def build_painter(theme=LIGHT, size=SIZE, other_layers=()):
    """Return a painter that draws the trajectories and some other layers."""
    painter = Painter(SQUARE, size, theme)
    painter.show_only({"trajectories", *other_layers})
    return painter


def get_trajectory_layer(painter):
    """Return the object that draws the trajectories, with its cached page."""
    return find_layer("trajectories", painter.layers).draw.__self__


def render_trail(painter, trail, *, fade_s=None, time=None, numbers=None):
    """Return the next frame of a painter with a trail, (height, width, 3)."""
    if time is None:
        time = np.arange(len(trail)) / ROWS_PER_SECOND
    positions = np.nan_to_num(trail[-1], nan=1.0)
    scene = replace(build_scene(positions), trail=trail, trail_time=time, trail_fade=fade_s, numbers=numbers)
    return painter.render_frame(scene).astype(int)


def render_with_new_painter(trail, **options):
    """Return the frame of a trail that was not drawn before, (height, width, 3)."""
    return render_trail(build_painter(), trail, **options)


def measure_ink(frame, theme=LIGHT):
    """Return the maximum difference of a channel from the background at each pixel, (height, width)."""
    return np.abs(frame - np.array(theme.background)).max(axis=2)


def split_at_gaps(path):
    """Return the lines and points of a path, (n_rows, 2) px, between its rows of nan."""
    is_present = np.isfinite(path[:, 0])
    parts = np.split(path, np.flatnonzero(np.diff(is_present)) + 1)
    parts = [part for part in parts if np.isfinite(part[0, 0])]
    return [shapely.LineString(part) if len(part) > 1 else shapely.Point(part[0]) for part in parts]


def count_pixels_off_paths(painter, trail, frame, theme=LIGHT, margin_px=3.0):
    """Return the number of pixels drawn farther than a margin from all paths."""
    paths = []
    for path in painter.camera.to_pixels(trail.swapaxes(0, 1)):
        paths.extend(split_at_gaps(path))
    near_paths = shapely.union_all(paths).buffer(margin_px)
    rows, columns = np.nonzero(measure_ink(frame, theme))
    return int((~shapely.contains_xy(near_paths, columns, rows)).sum())


def measure_strengths(frame, painter, trail, rows, theme):
    """Return the ink at some rows of the path of the first robot, (len(rows),)."""
    ink = measure_ink(frame, theme)
    pixels = np.rint(painter.camera.to_pixels(trail[rows, 0])).astype(int)
    return [int(ink[y - 1 : y + 3, x].max()) for x, y in pixels]


def measure_full_strength(theme):
    """Return the ink of the opaque color of the first robot's trail."""
    color = np.array(choose_trail_color(theme, 0), dtype=int)
    return int(np.abs(color - np.array(theme.background)).max())


class TestThinning:
    """In a long run, every second row of the older part of a trail is dropped."""

    N_ROWS = 120
    N_ROWS_WHEN_THINNED = 80

    def thin(self, trail):
        """Return a trail without every second row of its older part, and its times in s."""
        first_kept_row = self.N_ROWS_WHEN_THINNED // 2
        older_rows = np.arange(0, first_kept_row, 2)
        newer_rows = np.arange(first_kept_row, len(trail))
        rows = np.concatenate([older_rows, newer_rows])
        return trail[rows], rows / ROWS_PER_SECOND

    @FADE_TIMES
    @pytest.mark.parametrize("n_new_rows", [pytest.param(0, marks=pytest.mark.slow), 3])
    def test_thinning_keeps_the_cached_page(self, fade_s, n_new_rows):
        trail = build_random_trail(self.N_ROWS)
        painter = build_painter()
        painter_of_thinned_trail = build_painter()
        for n_rows in range(1, self.N_ROWS_WHEN_THINNED + 1):
            render_trail(painter, trail[:n_rows], fade_s=fade_s)
            render_trail(painter_of_thinned_trail, trail[:n_rows], fade_s=fade_s)
        layer = get_trajectory_layer(painter_of_thinned_trail)
        n_kept_pages = 0
        for n_rows in range(self.N_ROWS_WHEN_THINNED + n_new_rows, self.N_ROWS + 1):
            page = layer._page
            key = layer._key
            expected = render_trail(painter, trail[:n_rows], fade_s=fade_s)
            thinned_trail, time = self.thin(trail[:n_rows])
            frame = render_trail(painter_of_thinned_trail, thinned_trail, fade_s=fade_s, time=time)
            assert (frame == expected).all()
            is_same_fade_step = layer._key == key
            if fade_s is None or is_same_fade_step:
                assert layer._page is page
                n_kept_pages += 1
        assert n_kept_pages > 0

    def test_a_new_painter_draws_nearly_the_same_trail(self):
        trail = build_random_trail(self.N_ROWS)
        expected = render_with_new_painter(trail)
        thinned_trail, time = self.thin(trail)
        frame = render_with_new_painter(thinned_trail, time=time)
        is_drawn = measure_ink(expected) > 0
        assert is_drawn.sum() > 800
        assert np.abs(expected - frame)[is_drawn].mean() < 12

    def test_another_trail_of_the_same_length_is_redrawn(self):
        painter = build_painter()
        for seed in (0, 1, 0):
            trail = build_random_trail(60, seed=seed)
            assert (render_trail(painter, trail) == render_with_new_painter(trail)).all()

    def test_gaps_do_not_prevent_thinning(self):
        trail = build_late_trail()
        painter = build_painter()
        layer = get_trajectory_layer(painter)
        render_trail(painter, trail[:60])
        page = layer._page
        rows = np.r_[0:30:2, 30:80]
        render_trail(painter, trail[rows], time=rows / ROWS_PER_SECOND)
        assert layer._page is page


class TestGaps:
    """Robots are absent, with nan in the trail, before they join and after they fail."""

    @FADE_TIMES
    @THEMES_WITH_SLOW_DARK
    @pytest.mark.parametrize(
        "row_counts", [(1, 20, 38, 40, 41, 42, 60, 80), (80,)], ids=["stepwise", "at once"]
    )
    def test_the_path_of_a_late_robot_begins_where_it_joins(self, row_counts, theme, fade_s):
        trail = build_late_trail(first_row=40)
        painter = build_painter(theme)
        for n_rows in row_counts:
            frame = render_trail(painter, trail[:n_rows], fade_s=fade_s)
            assert count_pixels_off_paths(painter, trail[:n_rows], frame, theme) == 0
        for pixel in painter.camera.to_pixels(trail[[60, 70, 78], 1]):
            assert measure_min_error(frame, pixel, choose_trail_color(theme, 1)) < 120
        x, y = painter.camera.to_pixels(trail[40, 1]).astype(int)
        ink_before_joining = measure_ink(frame, theme)[y - 4 : y + 5, : x - 3]
        assert ink_before_joining.max() == 0

    @FADE_TIMES
    @pytest.mark.parametrize(
        "row_counts", [(1, 20, 30, 31, 39, 40, 41, 42, 60), (60,)], ids=["stepwise", "at once"]
    )
    def test_a_robot_that_rejoins_elsewhere_has_two_separate_paths(self, row_counts, fade_s):
        trail = build_straight_trail(60, 2)
        trail[30:40, 1] = np.nan
        trail[40:, 1, 1] = 6.0
        painter = build_painter()
        for n_rows in row_counts:
            frame = render_trail(painter, trail[:n_rows], fade_s=fade_s)
            assert count_pixels_off_paths(painter, trail[:n_rows], frame) == 0
        for pixel in painter.camera.to_pixels(trail[[26, 44, 55], 1]):
            assert measure_min_error(frame, pixel, choose_trail_color(LIGHT, 1)) < 150

    @pytest.mark.parametrize("fade_s", [None, 20.0], ids=["permanent", "fading"])
    def test_a_slow_robot_that_rejoins_elsewhere_has_two_separate_paths(self, fade_s):
        trail = build_straight_trail(30, 2) * (0.05, 1.0) + (2.0, 0.0)
        trail[14:17, 1] = np.nan
        trail[17:, 1, 1] = 5.0
        painter = build_painter()
        frame = render_trail(painter, trail, fade_s=fade_s)
        assert count_pixels_off_paths(painter, trail, frame) == 0
        assert (measure_ink(frame) > 0).any()

    @FADE_TIMES
    def test_the_path_of_a_failed_robot_stays(self, fade_s):
        trail = build_straight_trail(50, 2)
        trail[35:, 1] = np.nan
        painter = build_painter()
        for n_rows in range(1, 51):
            frame = render_trail(painter, trail[:n_rows], fade_s=fade_s)
        assert count_pixels_off_paths(painter, trail, frame) == 0
        pixel = painter.camera.to_pixels(trail[30, 1])
        assert measure_min_error(frame, pixel, choose_trail_color(LIGHT, 1)) < 200

    @FADE_TIMES
    def test_a_robot_that_is_always_absent_has_no_path(self, fade_s):
        trail = build_straight_trail(40, 2)
        trail[:, 1] = np.nan
        painter = build_painter()
        frame = render_trail(painter, trail, fade_s=fade_s)
        assert count_pixels_off_paths(painter, trail, frame) == 0

    @FADE_TIMES
    def test_without_any_robot_nothing_is_drawn(self, fade_s):
        trail = np.full((5, 2, 2), np.nan)
        painter = build_painter()
        assert (render_trail(painter, trail, fade_s=fade_s) == LIGHT.background).all()
        assert (render_trail(painter, trail[:1], fade_s=fade_s) == LIGHT.background).all()


class TestFading:
    @THEMES
    def test_older_parts_are_fainter(self, theme):
        trail = build_straight_trail(70)
        painter = build_painter(theme)
        frame = render_trail(painter, trail, fade_s=3.0)
        rows = np.arange(68, 2, -6)
        strengths = measure_strengths(frame, painter, trail, rows, theme)
        ages = (69 - rows) / ROWS_PER_SECOND
        full = measure_full_strength(theme)
        assert strengths[0] > 0.85 * full
        assert all(newer > older for newer, older in pairwise(strengths) if newer)
        assert 0.35 * full < np.interp(1.5, ages, strengths) < 0.75 * full
        assert np.interp(2.7, ages, strengths) < 0.3 * full

    @THEMES
    def test_parts_older_than_the_fade_time_are_not_drawn(self, theme):
        trail = build_straight_trail(70)
        painter = build_painter(theme)
        frame = render_trail(painter, trail, fade_s=3.0)
        age_of_row_5 = (69 - 5) / ROWS_PER_SECOND
        assert age_of_row_5 > 3.0
        assert measure_strengths(frame, painter, trail, [5], theme) == [0]

    @THEMES_WITH_SLOW_DARK
    def test_a_growing_trail_is_strong_at_its_end_and_has_no_holes(self, theme):
        trail = build_straight_trail(70)
        painter = build_painter(theme)
        full = measure_full_strength(theme)
        for n_rows in range(2, 71, 4):
            frame = render_trail(painter, trail[:n_rows], fade_s=3.0)
            is_checked = n_rows % 12 != 6  # Checking each frame would take long.
            if is_checked:
                rows = np.arange(n_rows - 2, max(n_rows - 50, 0), -1)
                strengths = measure_strengths(frame, painter, trail, rows, theme)
                assert all(strength > 0.2 * full for strength in strengths)
                assert all(strength > 0.75 * full for strength in strengths[:8])
        assert measure_strengths(frame, painter, trail, [5], theme) == [0]

    @THEMES
    def test_colors_are_between_those_of_the_cell_and_of_the_trail(self, theme):
        trail = build_straight_trail(70)
        painter = build_painter(theme, other_layers={"cells"})
        frame = render_trail(painter, trail, fade_s=3.0)
        cell_color = theme.get_cell_color(0)
        low = np.minimum(cell_color, choose_trail_color(theme, 0)) - 4
        high = np.maximum(cell_color, choose_trail_color(theme, 0)) + 4
        for x, y in np.rint(painter.camera.to_pixels(trail[8:68, 0])).astype(int):
            column = frame[y - 3 : y + 4, x]
            assert (column >= low).all()
            assert (column <= high).all()
        faint_pixel = painter.camera.to_pixels(trail[14, 0])
        assert 0 < measure_error(frame, faint_pixel, cell_color) < 60

    def test_newer_paths_are_on_top(self):
        n_rows = 61
        distance = SPEED_M_PER_S * np.arange(n_rows) / ROWS_PER_SECOND
        trail = np.empty((n_rows, 2, 2))
        trail[:, 0] = np.column_stack([np.full(n_rows, 4.0), 6.5 - distance])  # crosses (4, 4) at 1.25 s
        trail[:, 1] = np.column_stack([3.5 + distance, np.full(n_rows, 4.0)])  # crosses (4, 4) at 0.25 s
        painter = build_painter()
        crossing = painter.camera.to_pixels(np.array([4.0, 4.0]))
        first_color = choose_trail_color(LIGHT, 0)
        second_color = choose_trail_color(LIGHT, 1)
        frame = render_trail(painter, trail, fade_s=3.0)
        assert measure_error(frame, crossing, first_color) < measure_error(frame, crossing, second_color)
        frame_of_swapped_robots = render_trail(painter, trail[:, ::-1], fade_s=3.0)
        assert measure_error(frame_of_swapped_robots, crossing, second_color) < 110

    def test_slow_robots_have_paths_without_holes(self):
        n_rows = 400
        trail = np.empty((n_rows, 2, 2))
        trail[:, 0] = build_random_trail(n_rows, 1)[:, 0]
        trail[:, 1, 0] = 2.0 + 0.0009 * np.arange(n_rows)
        trail[:, 1, 1] = 1.0
        painter = build_painter()
        frame = render_trail(painter, trail, fade_s=20.0)
        (left, y), (right, _) = np.rint(painter.camera.to_pixels(trail[[200, -1], 1])).astype(int)
        ink_along_path = measure_ink(frame)[y - 2 : y + 4, left:right]
        assert ink_along_path.shape[1] > 7
        assert ink_along_path.max(axis=0).min() > 60

    @pytest.mark.slow
    def test_rows_as_old_as_the_fade_time_are_drawn_despite_rounding(self):
        trail = build_straight_trail(40)
        painter = build_painter()
        n_rounded_up = 0
        for rows_per_second in (7.0, 10.0, 30.0):
            time = np.arange(40) / rows_per_second
            fade_s = 3 / rows_per_second
            for n_rows in range(5, 40):
                age = time[n_rows - 1] - time[n_rows - 4]
                n_rounded_up += age / fade_s > 1.0
                frame = render_trail(painter, trail[:n_rows], fade_s=fade_s, time=time[:n_rows])
                assert (measure_ink(frame) > 0).any()
        assert n_rounded_up > 0

    def test_the_page_is_redrawn_once_per_fade_step(self):
        trail = build_random_trail(200)
        painter = build_painter()
        layer = get_trajectory_layer(painter)
        pages = []
        for n_rows in range(100, 200):
            render_trail(painter, trail[:n_rows], fade_s=6.0)
            if not pages or layer._page is not pages[-1]:
                pages.append(layer._page)
        n_fade_steps = (100 / ROWS_PER_SECOND) / (6.0 / FADE_STEPS)
        assert len(pages) == pytest.approx(n_fade_steps, abs=2)

    def test_another_run_or_an_earlier_time_is_redrawn(self):
        painter = build_painter()
        render_trail(painter, build_random_trail(43), fade_s=4.0)
        trails = [
            build_random_trail(43, seed=1),
            build_random_trail(41, seed=1),
            build_random_trail(42),
            build_random_trail(20),
            build_random_trail(3),
        ]
        for trail in trails:
            frame = render_trail(painter, trail, fade_s=4.0)
            assert (frame == render_with_new_painter(trail, fade_s=4.0)).all()

    def test_switching_fading_on_and_off_redraws_the_trail(self):
        trail = build_random_trail(90)
        painter = build_painter()
        permanent = render_trail(painter, trail)
        fading = render_trail(painter, trail, fade_s=1.5)
        assert (fading == render_with_new_painter(trail, fade_s=1.5)).all()
        assert (render_trail(painter, trail) == permanent).all()

    def test_a_fading_trail_is_shorter(self):
        trail = build_random_trail(90)
        permanent = render_with_new_painter(trail)
        fading = render_with_new_painter(trail, fade_s=1.5)
        assert (measure_ink(fading) > 0).sum() < 0.7 * (measure_ink(permanent) > 0).sum()

    def test_a_trail_without_times_does_not_fade(self):
        trail = build_random_trail(90)
        scene = replace(build_scene(trail[-1]), trail=trail, trail_time=None, trail_fade=1.5)
        frame = build_painter().render_frame(scene)
        assert (frame == render_with_new_painter(trail)).all()

    def test_robots_at_rest_have_only_dots(self):
        trail = np.repeat(build_random_trail(1), 30, axis=0)
        for n_rows in (30, 1):
            frame = render_with_new_painter(trail[:n_rows], fade_s=1.0)
            assert (measure_ink(frame) > 0).sum() <= 3 * 9

    def test_large_teams_have_one_quiet_color(self):
        trail = build_straight_trail(40, 12) * (1.0, 0.55)
        painter = build_painter()
        frame = render_trail(painter, trail, fade_s=4.0)
        for pixel in painter.camera.to_pixels(trail[37]):
            assert measure_min_error(frame, pixel, LIGHT.trajectory) < 150


@FADE_TIMES
def test_trails_are_drawn_at_high_zoom(fade_s):
    trail = build_random_trail(60)
    painter = build_painter()
    painter.camera = replace(painter.camera, center=tuple(trail[-5, 0]), zoom=2e4)
    frame = render_trail(painter, trail, fade_s=fade_s)
    pixel = painter.camera.to_pixels(trail[-5, 0])
    assert measure_min_error(frame, pixel, choose_trail_color(LIGHT, 0), reach=3) < 110


@pytest.mark.parametrize("fade_s", [None, 4.0], ids=["permanent", "fading"])
def test_other_robot_numbers_change_the_colors(fade_s):
    trail = build_straight_trail(40, 2)
    painter = build_painter()
    for numbers in ((1, 2), (3, 4)):
        frame = render_trail(painter, trail, fade_s=fade_s, numbers=numbers)
        assert (frame == render_with_new_painter(trail, fade_s=fade_s, numbers=numbers)).all()
        for row, number in enumerate(numbers):
            color = choose_trail_color(LIGHT, number - 1)
            for pixel in painter.camera.to_pixels(trail[[30, 36], row]):
                assert measure_min_error(frame, pixel, color) < 90


@pytest.mark.slow
@pytest.mark.parametrize("size", [(640, 480), (1600, 1200)])
def test_a_growing_trail_has_no_holes_or_thick_joints(size):
    record = record_walk(SQUARE, 3, steps=80)
    painter = build_painter(size=size)
    for row in range(1, 80):
        frame = painter.render_frame(build_row_scene(record, row)).astype(int)
    frame_at_once, _ = render_layers(build_row_scene(record), "trajectories", size=size)
    for row in range(4, 74, 2):
        for pixel in painter.camera.to_pixels(record.positions[row]):
            ink = measure_error(frame, pixel, LIGHT.background)
            ink_at_once = measure_error(frame_at_once, pixel, LIGHT.background)
            assert ink > 0
            assert abs(ink - ink_at_once) < 130


def test_no_smooth_line_has_only_two_points(monkeypatch):
    """With two points, `pygame.draw.aalines` reads memory beyond them, so that frames would vary."""
    point_counts = []
    draw_lines = pygame.draw.aalines

    def draw_and_count(surface, color, closed, points):
        point_counts.append(len(points))
        return draw_lines(surface, color, closed, points)

    monkeypatch.setattr(pygame.draw, "aalines", draw_and_count)
    painter = build_painter()
    painter.scale = 0.5
    for n_rows in range(2, 30):
        render_trail(painter, build_random_trail(n_rows))
    assert point_counts
    assert min(point_counts) > 2
