"""Colors of themes: contrast, color blindness, and hues of robots and controllers."""

from itertools import combinations

import numpy as np
import pytest
from color_vision import find_min_difference, measure_difference
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from scipy.spatial import Delaunay

from robocov.errors import ParameterError
from robocov_app.look.colors import choose_text_color, compute_contrast, mix
from robocov_app.look.curve_styles import choose_controller_styles
from robocov_app.look.hues import MAX_OWN_HUES, N_SHARED_HUES, choose_robot_hues, choose_trail_color
from robocov_app.look.theme import THEMES, get_theme
from robocov_app.toolkit.overlay import get_accent_ink

BLACK = (0, 0, 0)
WHITE = (255, 255, 255)


def find_adjacent_pairs(points: np.ndarray) -> np.ndarray:
    """Return the pairs of points that share an edge of the Delaunay triangulation, (m, 2)."""
    triangles = Delaunay(points).simplices
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]])
    return np.unique(np.sort(pairs, axis=1), axis=0).astype(np.intp)


def list_cell_colors(theme):
    """Return the color of the cell of each hue."""
    return [theme.get_cell_color(hue) for hue in range(MAX_OWN_HUES)]


def find_min_channel_difference(colors):
    """Return the minimum over all pairs of colors of the maximum difference of a channel."""
    differences = [np.abs(np.subtract(one, other)).max() for one, other in combinations(colors, 2)]
    return min(differences)


def test_the_contrast_of_black_on_white_is_21():
    assert compute_contrast(BLACK, WHITE) == pytest.approx(21.0)


def test_the_contrast_of_equal_colors_is_1():
    assert compute_contrast((90, 90, 90), (90, 90, 90)) == pytest.approx(1.0)


@pytest.mark.parametrize("theme", THEMES.values(), ids=lambda theme: theme.name)
class TestContrast:
    def test_text_is_legible_on_the_background_and_on_panels(self, theme):
        assert compute_contrast(theme.ink, theme.background) >= 10
        assert compute_contrast(theme.faint, theme.background) >= 4.5
        assert compute_contrast(theme.ink, theme.panel) >= 10

    def test_text_is_legible_on_the_selected_tool(self, theme):
        assert compute_contrast(get_accent_ink(theme), theme.accent) >= 4.5

    def test_numbers_are_legible_on_robots(self, theme):
        for color in theme.robots:
            assert compute_contrast(choose_text_color(color), color) >= 4.0

    def test_names_are_legible_on_obstacles(self, theme):
        assert compute_contrast(choose_text_color(theme.obstacle), theme.obstacle) >= 4.5

    def test_marks_and_curves_stand_out_on_the_background(self, theme):
        colors = [theme.start, theme.final, theme.trajectory, theme.others[0], theme.velocity, theme.warning]
        colors += [*theme.controllers.values(), *theme.forces.values()]
        for color in colors:
            assert compute_contrast(color, theme.background) >= 3.0

    def test_obstacles_and_their_outlines_stand_out_on_cells(self, theme):
        """Moving obstacles are paler, but have a wide outline."""
        paper_cells = [theme.get_paper_cell_color(hue) for hue in range(MAX_OWN_HUES)]
        for cell in [*list_cell_colors(theme), *paper_cells, theme.background]:
            assert compute_contrast(theme.obstacle, cell) >= 3.0
            assert compute_contrast(theme.obstacle_edge, cell) >= 3.0

    def test_outlines_and_cells_stand_out_where_the_density_is_highest(self, theme):
        for cell in list_cell_colors(theme):
            shaded_cell = mix(cell, theme.density, theme.density_strength)
            assert compute_contrast(theme.obstacle_edge, shaded_cell) >= 3.0
            assert compute_contrast(cell, shaded_cell) >= 1.4

    def test_obstacles_or_their_outlines_stand_out_on_distances(self, theme):
        for color in theme.build_heat_table(50).tolist():
            contrast_of_obstacle = compute_contrast(theme.obstacle, tuple(color))
            contrast_of_outline = compute_contrast(theme.background, tuple(color))
            assert max(contrast_of_obstacle, contrast_of_outline) >= 2.2

    def test_starts_and_trajectories_stand_out_on_cells(self, theme):
        for cell in list_cell_colors(theme):
            assert compute_contrast(theme.trajectory, cell) >= 2.0
            assert compute_contrast(theme.start, cell) >= 2.0

    def test_trails_stand_out_on_their_cells_and_on_the_background(self, theme):
        for hue, cell in enumerate(list_cell_colors(theme)):
            trail = choose_trail_color(theme, hue)
            assert compute_contrast(trail, cell) >= 2.4
            assert compute_contrast(trail, theme.background) >= 2.4

    def test_curves_stand_out_on_the_background(self, theme):
        for curve in [*theme.controllers.values(), *theme.others]:
            assert compute_contrast(curve, theme.background) >= 4.5


@pytest.mark.parametrize("theme", THEMES.values(), ids=lambda theme: theme.name)
class TestDifferentColors:
    def test_the_selected_tool_is_visible_for_all_color_visions(self, theme):
        assert find_min_difference([theme.accent, theme.panel]) >= 30
        assert find_min_difference([theme.accent, get_accent_ink(theme)]) >= 30

    def test_cells_differ_for_all_color_visions(self, theme):
        cells = list_cell_colors(theme)
        assert find_min_difference(cells[:N_SHARED_HUES]) >= 8.0
        assert find_min_difference(cells) >= 4.5

    def test_cells_differ_clearly_for_normal_vision(self, theme):
        cells = list_cell_colors(theme)[:N_SHARED_HUES]
        differences = [measure_difference(first, second) for first, second in combinations(cells, 2)]
        assert min(differences) >= 9.0

    def test_cells_differ_from_the_background(self, theme):
        for cell in list_cell_colors(theme):
            assert find_min_difference([cell, theme.background]) >= 5.5

    def test_controllers_of_the_paper_differ_for_all_color_visions(self, theme):
        assert find_min_difference(list(theme.controllers.values())) >= 18.0

    def test_custom_controllers_differ_from_all_others(self, theme):
        curves = [*theme.controllers.values(), *theme.others]
        assert find_min_channel_difference(curves) >= 60

    def test_robots_differ(self, theme):
        assert len(set(theme.robots)) == MAX_OWN_HUES

    def test_trails_differ(self, theme):
        trails = {choose_trail_color(theme, hue) for hue in range(MAX_OWN_HUES)}
        assert len(trails) == MAX_OWN_HUES

    def test_cells_of_large_teams_differ(self, theme):
        cells = list_cell_colors(theme)[:N_SHARED_HUES]
        assert find_min_channel_difference(cells) >= 9


@pytest.mark.parametrize("theme", THEMES.values(), ids=lambda theme: theme.name)
class TestColorsOfThePaper:
    def test_rapf_is_blue_and_rpf_is_red(self, theme):
        red, green, blue = theme.get_controller_color("rapf")
        assert blue > max(red, green)
        red, green, blue = theme.get_controller_color("rpf")
        assert red > max(green, blue)

    def test_starts_are_green_final_positions_blue_and_trajectories_red(self, theme):
        assert theme.start[1] == max(theme.start)
        assert theme.final[2] == max(theme.final)
        assert theme.trajectory[0] == max(theme.trajectory)

    def test_an_unknown_controller_has_the_first_other_color(self, theme):
        assert theme.get_controller_color("somebody's own") == theme.others[0]


@pytest.mark.parametrize("theme", THEMES.values(), ids=lambda theme: theme.name)
def test_trajectories_of_failed_robots_are_visible_on_every_cell(theme):
    contrasts = [compute_contrast(theme.failed_trajectory, color) for color in list_cell_colors(theme)]
    assert min(contrasts) > 1.6


@pytest.mark.parametrize("theme", THEMES.values(), ids=lambda theme: theme.name)
def test_the_cell_in_a_legend_is_visible(theme):
    assert compute_contrast(theme.legend_cell, theme.panel) > 1.5


def test_controllers_differ_in_dashes_and_marks():
    names = ["rapf", "rpf", "lloyd", "first", "second", "third", "fourth", "fifth"]
    styles = choose_controller_styles(names).values()
    assert len({str(style.dashes) for style in styles}) == len(names)
    assert len({style.mark for style in styles}) == len(names)


def test_an_unknown_theme_is_rejected_with_a_suggestion():
    with pytest.raises(ParameterError, match="did you mean 'dark'"):
        get_theme("drak")


@pytest.mark.parametrize(("fraction", "color"), [(0.0, (1, 2, 3)), (1.0, (101, 202, 203))])
def test_mixtures_begin_and_end_with_their_colors(fraction, color):
    assert mix((1, 2, 3), (101, 202, 203), fraction) == color


def has_conflict(hues: np.ndarray, adjacency: np.ndarray) -> bool:
    """Return whether two adjacent cells have the same hue."""
    return bool((hues[adjacency[:, 0]] == hues[adjacency[:, 1]]).any())


class TestHuesOfRobots:
    @given(st.integers(1, MAX_OWN_HUES))
    def test_robots_of_small_teams_have_their_own_hues(self, n):
        assert choose_robot_hues(n).tolist() == list(range(n))

    @settings(deadline=None, max_examples=count_examples(40))
    @given(st.integers(MAX_OWN_HUES + 1, 150), st.integers(0, 10_000))
    def test_adjacent_cells_of_large_teams_have_different_hues(self, n, seed):
        adjacency = find_adjacent_pairs(np.random.default_rng(seed).uniform(size=(n, 2)))
        hues = choose_robot_hues(n, adjacency)
        assert hues.min() >= 0
        assert hues.max() < N_SHARED_HUES
        assert not has_conflict(hues, adjacency)

    @settings(deadline=None, max_examples=count_examples(30))
    @given(st.integers(MAX_OWN_HUES + 1, 80), st.integers(0, 10_000))
    def test_hues_without_conflicts_do_not_change(self, n, seed):
        adjacency = find_adjacent_pairs(np.random.default_rng(seed).uniform(size=(n, 2)))
        hues = choose_robot_hues(n, adjacency)
        assert choose_robot_hues(n, adjacency, hues).tolist() == hues.tolist()

    @settings(deadline=None, max_examples=count_examples(30))
    @given(st.integers(MAX_OWN_HUES + 1, 80), st.integers(0, 10_000))
    def test_few_hues_change_after_a_small_motion(self, n, seed):
        """A changed hue may conflict with a neighbor, which has to change too."""
        rng = np.random.default_rng(seed)
        points = rng.uniform(size=(n, 2))
        hues = choose_robot_hues(n, find_adjacent_pairs(points))
        adjacency = find_adjacent_pairs(points + rng.normal(scale=0.01, size=(n, 2)))
        n_conflicts = (hues[adjacency[:, 0]] == hues[adjacency[:, 1]]).sum()
        new_hues = choose_robot_hues(n, adjacency, hues)
        assert not has_conflict(new_hues, adjacency)
        assert (new_hues != hues).sum() <= 6 * n_conflicts

    def test_neighbors_change_if_they_have_all_hues(self):
        """Cell 0 is surrounded by cells 1 to 11, which have all hues, so none is left for it."""
        ring = [(k, k % 11 + 1) for k in range(1, 12)]
        spokes = [(0, k) for k in range(1, 12)]
        adjacency = np.sort(np.array(ring + spokes), axis=1)
        hues = np.array([0, 0, 1, 2, 3, 4, 5, 1, 2, 3, 4, 5])
        assert not has_conflict(choose_robot_hues(12, adjacency, hues), adjacency)

    def test_without_adjacency_all_hues_are_used(self):
        assert set(choose_robot_hues(20).tolist()) == set(range(N_SHARED_HUES))

    def test_without_adjacency_hues_do_not_change(self):
        hues = choose_robot_hues(20)[::-1].copy()
        assert choose_robot_hues(20, None, hues).tolist() == hues.tolist()
