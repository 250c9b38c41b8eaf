import numpy as np
import pytest
from color_vision import find_least_difference
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from robocov.errors import ParameterError
from robocov_app.look.colors import choose_text_color, compute_contrast, mix
from robocov_app.look.curve_styles import choose_controller_styles
from robocov_app.look.hues import MAX_OWN_HUES, N_SHARED_HUES, choose_robot_hues, choose_trail_color
from robocov_app.look.theme import THEMES, get_theme
from robocov_app.toolkit.overlay import get_accent_ink


def find_adjacent_pairs(points: np.ndarray) -> np.ndarray:
    triangles = Delaunay(points).simplices
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]])
    return np.unique(np.sort(pairs, axis=1), axis=0).astype(np.intp)


def test_contrast_of_black_on_white_is_21():
    assert compute_contrast((0, 0, 0), (255, 255, 255)) == pytest.approx(21.0)
    assert compute_contrast((90, 90, 90), (90, 90, 90)) == pytest.approx(1.0)


@pytest.mark.parametrize("theme", THEMES.values(), ids=lambda theme: theme.name)
class TestReadability:
    def test_text(self, theme):
        assert compute_contrast(theme.ink, theme.background) >= 10
        assert compute_contrast(theme.faint, theme.background) >= 4.5
        assert compute_contrast(theme.ink, theme.panel) >= 10

    def test_the_chosen_tool_stands_out_for_all_color_visions(self, theme):
        assert find_least_difference([theme.accent, theme.panel]) >= 30
        assert find_least_difference([theme.accent, get_accent_ink(theme)]) >= 30
        assert compute_contrast(get_accent_ink(theme), theme.accent) >= 4.5

    def test_numbers_on_robots(self, theme):
        for fill in theme.robots:
            assert compute_contrast(choose_text_color(fill), fill) >= 4.0

    def test_names_on_obstacles(self, theme):
        assert compute_contrast(choose_text_color(theme.obstacle), theme.obstacle) >= 4.5

    def test_marks_and_curves_on_the_page(self, theme):
        marks = [theme.start, theme.final, theme.trajectory, theme.others[0], theme.velocity]
        marks += [*theme.controllers.values(), *theme.forces.values()]
        for mark in marks:
            assert compute_contrast(mark, theme.background) >= 3.0

    def test_obstacles_stand_out_on_every_cell(self, theme):
        for hue in range(MAX_OWN_HUES):
            for cell in (theme.get_cell_color(hue), theme.get_paper_cell_color(hue), theme.background):
                assert compute_contrast(theme.obstacle, cell) >= 3.0
                # Moving obstacles are paler, but have a wide outline.
                assert compute_contrast(theme.obstacle_edge, cell) >= 3.0
            # Where the density is highest, the outline stands out.
            peak = mix(theme.get_cell_color(hue), theme.density, theme.density_strength)
            assert compute_contrast(theme.obstacle_edge, peak) >= 3.0
            assert compute_contrast(theme.get_cell_color(hue), peak) >= 1.4

    def test_obstacles_or_their_outlines_stand_out_on_a_distance_map(self, theme):
        for color in theme.build_heat_table(50).tolist():
            contrasts = [compute_contrast(part, tuple(color)) for part in (theme.obstacle, theme.background)]
            assert max(contrasts) >= 2.2

    def test_color_blind_viewers_tell_cells_apart(self, theme):
        cells = [theme.get_cell_color(hue) for hue in range(MAX_OWN_HUES)]
        assert find_least_difference(cells[:N_SHARED_HUES]) >= 8.0
        assert find_least_difference(cells) >= 4.5

    def test_color_blind_viewers_tell_the_papers_controllers_apart(self, theme):
        assert find_least_difference(list(theme.controllers.values())) >= 18.0

    def test_starts_and_trajectories_on_every_cell(self, theme):
        for hue in range(MAX_OWN_HUES):
            assert compute_contrast(theme.trajectory, theme.get_cell_color(hue)) >= 2.0
            assert compute_contrast(theme.start, theme.get_cell_color(hue)) >= 2.0

    def test_trails_can_be_followed_on_their_cells_and_differ(self, theme):
        trails = [choose_trail_color(theme, hue) for hue in range(MAX_OWN_HUES)]
        assert len(set(trails)) == MAX_OWN_HUES
        for hue, trail in enumerate(trails):
            assert compute_contrast(trail, theme.get_cell_color(hue)) >= 2.4
            assert compute_contrast(trail, theme.background) >= 2.4

    def test_controllers_of_ones_own_differ_from_all_others(self, theme):
        curves = [*theme.controllers.values(), *theme.others]
        apart = np.abs(np.array(curves, dtype=float)[:, None] - curves).max(axis=2)
        assert (apart + 1000 * np.eye(len(curves))).min() >= 60
        for curve in curves:
            assert compute_contrast(curve, theme.background) >= 4.5

    def test_hues_differ(self, theme):
        assert len(set(theme.robots)) == MAX_OWN_HUES
        cells = np.array([theme.get_cell_color(hue) for hue in range(N_SHARED_HUES)], dtype=float)
        apart = np.abs(cells[:, None] - cells[None]).max(axis=2) + 1000 * np.eye(N_SHARED_HUES)
        assert apart.min() >= 9

    def test_the_papers_colors(self, theme):
        red, green, blue = theme.get_controller_color("rapf")
        assert blue > red and blue > green
        red, green, blue = theme.get_controller_color("rpf")
        assert red > green and red > blue
        assert theme.start[1] == max(theme.start)
        assert theme.final[2] == max(theme.final)
        assert theme.trajectory[0] == max(theme.trajectory)
        assert theme.get_controller_color("somebody's own") == theme.others[0]


def test_controllers_differ_in_dashes_and_markers_too():
    names = ["rapf", "rpf", "lloyd", "first", "second", "third", "fourth", "fifth"]
    styles = choose_controller_styles(names).values()
    assert len({str(style.dashes) for style in styles}) == len(names)
    assert len({style.mark for style in styles}) == len(names)


def test_unknown_theme_is_named_with_the_nearest():
    with pytest.raises(ParameterError, match="did you mean 'dark'"):
        get_theme("drak")


def test_mix_ends():
    assert mix((1, 2, 3), (101, 202, 203), 0.0) == (1, 2, 3)
    assert mix((1, 2, 3), (101, 202, 203), 1.0) == (101, 202, 203)


@given(st.integers(1, MAX_OWN_HUES))
def test_small_teams_have_one_hue_each(n):
    assert choose_robot_hues(n).tolist() == list(range(n))


@settings(deadline=None, max_examples=40)
@given(st.integers(MAX_OWN_HUES + 1, 150), st.integers(0, 10_000))
def test_cells_of_large_teams_differ_from_their_neighbors(n, seed):
    adjacency = find_adjacent_pairs(np.random.default_rng(seed).uniform(size=(n, 2)))
    hues = choose_robot_hues(n, adjacency)
    assert hues.min() >= 0 and hues.max() < N_SHARED_HUES
    assert (hues[adjacency[:, 0]] != hues[adjacency[:, 1]]).all()


@settings(deadline=None, max_examples=30)
@given(st.integers(MAX_OWN_HUES + 1, 80), st.integers(0, 10_000))
def test_colors_stay_but_for_cells_that_conflict(n, seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(size=(n, 2))
    before = choose_robot_hues(n, find_adjacent_pairs(points))
    assert choose_robot_hues(n, find_adjacent_pairs(points), before).tolist() == before.tolist()
    adjacency = find_adjacent_pairs(points + rng.normal(scale=0.01, size=(n, 2)))
    after = choose_robot_hues(n, adjacency, before)
    assert (after[adjacency[:, 0]] != after[adjacency[:, 1]]).all()
    conflicts = int((before[adjacency[:, 0]] == before[adjacency[:, 1]]).sum())
    # a conflict may push a neighbor aside, which pushes another, but the rest of the map keeps its colors
    assert (after != before).sum() <= 6 * conflicts


def test_a_wheel_with_too_many_spokes_is_colored_afresh():
    # the hub's neighbors show every color: no color is free for it
    ring = [(i, i % 11 + 1) for i in range(1, 12)]
    spokes = [(0, i) for i in range(1, 12)]
    adjacency = np.sort(np.array(ring + spokes), axis=1)
    before = np.array([0, 0, 1, 2, 3, 4, 5, 1, 2, 3, 4, 5])
    after = choose_robot_hues(12, adjacency, before)
    assert (after[adjacency[:, 0]] != after[adjacency[:, 1]]).all()


def test_without_adjacency_hues_take_turns_and_stay():
    hues = choose_robot_hues(20)
    assert set(hues.tolist()) == set(range(N_SHARED_HUES))
    assert choose_robot_hues(20, None, hues[::-1].copy()).tolist() == hues[::-1].tolist()
