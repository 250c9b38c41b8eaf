"""Figures of runs: trajectories, maps, comparisons and costs."""

import re
import subprocess
import sys
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pygame
import pytest
from drawn_run import CORRIDOR, HALL, ROOMS, SHAFT, record_walk
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from page_layout import assert_layout_is_clear, boxes_overlap

from robocov.density import Gaussian, Gaussians
from robocov.environment import CircleObstacle, Environment, ObstaclePath
from robocov.errors import ParameterError
from robocov.team import Team
from robocov.voronoi import partition
from robocov_app.figures.comparisons import plot_comparison
from robocov_app.figures.cost_curves import plot_cost
from robocov_app.figures.curves import TimeCurve, format_end_label
from robocov_app.figures.files import save_figure
from robocov_app.figures.map_pages import plot_environment, plot_trajectories
from robocov_app.figures.page import to_plot_color
from robocov_app.figures.run_drawing import START_NUMBER_PT
from robocov_app.look.theme import DARK, LIGHT

MAPS = [ROOMS, HALL, CORRIDOR, SHAFT]
TIME = np.linspace(0.0, 60.0, 121)


def build_curves(*final_costs):
    """Return curves of up to four controllers that approach some final costs in m."""
    names = ["rapf", "rpf", "lloyd", "other"]
    curves = []
    for name, final_cost in zip(names, final_costs, strict=False):
        curves.append(TimeCurve(name.upper(), name, TIME, final_cost + 2 * np.exp(-TIME / 10)))
    return curves


def list_legend_texts(figure):
    """Return the texts of the only legend of a figure."""
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


def list_texts(figure):
    """Return the texts of a figure outside its axes."""
    return [text.get_text() for text in figure.texts]


def find_collection(axes, kind):
    """Return the only collection of exactly this type."""
    (collection,) = (collection for collection in axes.collections if type(collection) is kind)
    return collection


def find_marks(axes, marker):
    """Return the only line with a marker."""
    (line,) = (line for line in axes.lines if line.get_marker() == marker)
    return line


def has_marks(axes, marker):
    return any(line.get_marker() == marker for line in axes.lines)


def list_start_rings(axes):
    """Return the rings at starts."""
    return [line for line in axes.lines if line.get_marker() == "o"]


def list_start_numbers(axes):
    """Return the numbers next to starts, which are the smallest texts."""
    return [text for text in axes.texts if text.get_fontsize() == START_NUMBER_PT]


def list_robot_numbers(axes):
    """Return the numbers in robots and next to them."""
    return [text for text in axes.texts if text.get_fontsize() > START_NUMBER_PT]


def measure_text_boxes(axes):
    """Return the boxes of all texts in axes, px."""
    renderer = axes.figure.canvas.get_renderer()
    return [text.get_window_extent(renderer) for text in axes.texts]


def to_colors(collection_colors):
    """Return the different colors of a collection without opacity."""
    return {to_rgb(color) for color in collection_colors}


def measure_text_heights(figure):
    """Return the font size of each text, px."""
    texts = [text for text in figure.findobj(Text) if text.get_text()]
    return [text.get_fontsize() * figure.dpi / 72 for text in texts]


@pytest.mark.parametrize("environment", MAPS, ids=lambda environment: environment.name)
@pytest.mark.parametrize(
    "size",
    [
        None,
        (900, 600),
        pytest.param((1400, 901), marks=pytest.mark.slow),
        pytest.param((2560, 1440), marks=pytest.mark.slow),
    ],
)
def test_no_element_is_covered_or_cut_off(environment, size):
    record = record_walk(environment, 6)
    assert_layout_is_clear(plot_trajectories(record, size=size, mean_distance=1.2345))
    assert_layout_is_clear(plot_environment(environment, size=size))


@pytest.mark.parametrize("environment", MAPS, ids=lambda environment: environment.name)
def test_maps_are_not_distorted(environment):
    axes = plot_trajectories(record_walk(environment, 3), size=(1000, 800)).axes[0]
    box = axes.get_window_extent()
    left, right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    assert box.width / (right - left) == pytest.approx(box.height / (top - bottom))


@pytest.mark.parametrize("size", [(901, 600), (641, 487), pytest.param((2560, 1440), marks=pytest.mark.slow)])
def test_a_png_has_the_requested_size(tmp_path, size):
    figures = {
        "trajectories.png": plot_trajectories(record_walk(ROOMS, 3), size=size),
        "cost.png": plot_cost(build_curves(1.0), size=size),
    }
    for name, figure in figures.items():
        save_figure(figure, tmp_path / name)
        assert pygame.image.load(tmp_path / name).get_size() == size
    assert {path.name for path in tmp_path.iterdir()} == set(figures)


class TestComparison:
    @pytest.mark.parametrize(
        "n_records",
        [
            pytest.param(1, marks=pytest.mark.slow),
            pytest.param(2, marks=pytest.mark.slow),
            3,
            pytest.param(5, marks=pytest.mark.slow),
        ],
    )
    @pytest.mark.parametrize("size", [None, (900, 600), pytest.param((2560, 1440), marks=pytest.mark.slow)])
    @pytest.mark.parametrize(
        "environment", [ROOMS, CORRIDOR, SHAFT], ids=lambda environment: environment.name
    )
    def test_a_comparison_has_a_map_and_a_cost_for_each_record(self, environment, n_records, size):
        records = [record_walk(environment, 4, seed=k) for k in range(n_records)]
        costs = [1.0 + k for k in range(n_records)]
        figure = plot_comparison(records, size=size, mean_distances=costs)
        assert_layout_is_clear(figure)
        assert len(figure.axes) == n_records
        assert len({(axes.get_xlim(), axes.get_ylim()) for axes in figure.axes}) == 1
        sizes = np.array([axes.get_window_extent().size for axes in figure.axes])
        assert np.ptp(sizes, axis=0).max() < 1e-6
        text = "\n".join(list_texts(figure))
        for cost in costs:
            assert f"mean distance {cost:.3f} m" in text

    def test_maps_of_different_sizes_have_the_same_scale(self):
        figure = plot_comparison([record_walk(ROOMS, 3), record_walk(HALL, 3)])
        for axes in figure.axes:
            assert axes.get_xlim() == (0.0, 16.0)
            assert axes.get_ylim() == (0.0, 11.0)

    @pytest.mark.parametrize(
        ("environment", "n_rows"), [(ROOMS, 1), (CORRIDOR, 3)], ids=["rooms", "corridor"]
    )
    def test_only_wide_maps_are_stacked(self, environment, n_rows):
        figure = plot_comparison([record_walk(environment, 3)] * 3)
        assert len({round(axes.get_position().y0, 6) for axes in figure.axes}) == n_rows

    def test_common_facts_are_in_the_heading_only(self):
        figure = plot_comparison([record_walk(ROOMS, 3), record_walk(ROOMS, 3, controller="rpf")])
        assert sum("t = 3.9 s" in text for text in list_texts(figure)) == 1

    def test_different_facts_are_at_each_map(self):
        figure = plot_comparison([record_walk(ROOMS, 3, steps=40), record_walk(ROOMS, 3, steps=21)])
        text = "\n".join(list_texts(figure))
        assert "t = 3.9 s" in text
        assert "t = 2.0 s" in text

    def test_the_legend_lists_centroids_if_one_of_the_controllers_has_some(self):
        figure = plot_comparison([record_walk(ROOMS, 5, controller="rpf"), record_walk(ROOMS, 5)])
        order = ["final position", "cell centroid", "final Voronoi cell"]
        assert [text for text in list_legend_texts(figure) if text in order] == order

    def test_entries_that_are_not_drawn_leave_no_space_in_the_legend(self):
        record = record_walk(ROOMS, 3)
        at_goals = replace(record, goals=record.positions)
        without_goals = replace(record, goals=np.full_like(record.goals, np.nan))
        heights = [plot_comparison([item, record]).bbox.height for item in (at_goals, without_goals)]
        assert heights[0] == heights[1]

    def test_texts_are_legible_at_half_the_size(self):
        figure = plot_comparison([record_walk(ROOMS, 3)] * 3)
        assert figure.bbox.width == pytest.approx(1600, abs=0.1)
        assert min(text.get_fontsize() * figure.dpi / 72 for text in figure.texts) >= 17


PLOTS_OF_A_SIZE = pytest.mark.parametrize(
    "plot",
    [
        pytest.param(plot_trajectories, id="trajectories"),
        pytest.param(lambda record, size: plot_comparison([record] * 3, size=size), id="comparison"),
    ],
)


@PLOTS_OF_A_SIZE
@pytest.mark.parametrize("size", [(200, 100), (20, 400)])
def test_a_page_without_space_for_maps_is_rejected(plot, size):
    with pytest.raises(ParameterError, match=f"size: expected .*, got {size[0]} x {size[1]} pixels"):
        plot(record_walk(ROOMS, 3), size=size)


INVALID_SIZES = pytest.mark.parametrize(
    "size", [(0, 0), (-1, 300), (10**9, 500), (float("nan"), 500), (500,), "ab", 500]
)
INVALID_SIZE_MESSAGE = "size: expected width and height from 1 to 8388607 pixels, got"


@PLOTS_OF_A_SIZE
@INVALID_SIZES
def test_a_size_that_no_figure_can_have_is_rejected(plot, size):
    with pytest.raises(ParameterError, match=INVALID_SIZE_MESSAGE):
        plot(record_walk(ROOMS, 3), size=size)


@INVALID_SIZES
def test_a_size_that_no_figure_of_costs_can_have_is_rejected(size):
    with pytest.raises(ParameterError, match=INVALID_SIZE_MESSAGE):
        plot_cost(build_curves(1.0), size=size)


@PLOTS_OF_A_SIZE
def test_texts_grow_with_the_page(plot):
    small = plot(record_walk(ROOMS, 3), size=(960, 640))
    large = plot(record_walk(ROOMS, 3), size=(2880, 1920))
    min_height = min(measure_text_heights(small))
    assert min(measure_text_heights(large)) == pytest.approx(3 * min_height, rel=0.35)


class TestTrajectories:
    def test_trajectories_have_the_positions_of_the_record(self):
        record = record_walk(ROOMS, 5)
        lines = find_collection(plot_trajectories(record).axes[0], LineCollection)
        for robot, segment in enumerate(lines.get_segments()):
            assert segment == pytest.approx(record.positions[:, robot])

    def test_final_positions_are_discs_and_starts_are_rings(self):
        record = record_walk(ROOMS, 5)
        axes = plot_trajectories(record).axes[0]
        discs = find_collection(axes, PathCollection)
        assert np.asarray(discs.get_offsets()) == pytest.approx(record.positions[-1])
        rings = list_start_rings(axes)
        assert {ring.get_markerfacecolor() for ring in rings} == {"none"}
        starts = np.concatenate([ring.get_xydata() for ring in rings])
        assert starts == pytest.approx(record.positions[0])

    def test_trajectory_start_and_final_position_of_a_robot_have_the_same_color(self):
        axes = plot_trajectories(record_walk(ROOMS, 5)).axes[0]
        trails = [to_rgb(color) for color in find_collection(axes, LineCollection).get_colors()]
        discs = [to_rgb(color) for color in find_collection(axes, PathCollection).get_facecolors()]
        rings = [to_rgb(ring.get_markeredgecolor()) for ring in list_start_rings(axes)]
        assert trails == discs == rings
        assert len(set(trails)) == 5

    def test_the_scheme_of_the_paper_is_green_red_and_blue(self):
        axes = plot_trajectories(record_walk(ROOMS, 5), colors="paper").axes[0]
        trails = find_collection(axes, LineCollection).get_colors()
        assert to_colors(trails) == {to_plot_color(LIGHT.trajectory)}
        discs = find_collection(axes, PathCollection).get_facecolors()
        assert to_colors(discs) == {to_plot_color(LIGHT.final)}
        rings = list_start_rings(axes)
        assert to_colors(ring.get_markeredgecolor() for ring in rings) == {to_plot_color(LIGHT.start)}

    def test_discs_have_the_radii_of_the_robots(self):
        record = record_walk(ROOMS, 3)
        radii = (0.3, 0.4, 0.5)
        axes = plot_trajectories(
            replace(record, team=replace(Team.homogeneous(3), radius=np.array(radii)))
        ).axes[0]
        px_per_m = axes.get_window_extent().width / 16.0
        assert measure_radii(axes) / px_per_m == pytest.approx(radii, rel=1e-3)

    def test_numbers_do_not_overlap_each_other(self):
        axes = plot_trajectories(record_walk(ROOMS, 9, seed=4)).axes[0]
        boxes = measure_text_boxes(axes)
        assert len(boxes) == 18
        assert not any(boxes_overlap(first, second) for first, second in combinations(boxes, 2))

    def test_contacts_are_stars_with_a_legend_entry(self):
        record = record_walk(ROOMS, 2)
        positions = record.positions.copy()
        positions[20:, 0] = (0.6, 5.0)
        positions[20:, 1] = (0.6 + 2 * float(record.team.radius[0]), 5.0)
        figure = plot_trajectories(replace(record, positions=positions))
        stars = find_marks(figure.axes[0], (8, 2, 0.0))
        assert stars.get_xydata()[-1] == pytest.approx((0.6 + float(record.team.radius[0]), 5.0))
        assert to_rgb(stars.get_markeredgecolor()) == to_plot_color(LIGHT.error)
        assert "contact" in list_legend_texts(figure)

    def test_a_run_without_contacts_has_no_legend_entry_for_them(self):
        assert "contact" not in list_legend_texts(plot_trajectories(record_walk(HALL, 1)))

    def test_cells_and_centroids_are_the_final_ones(self):
        record = record_walk(ROOMS, 5)
        axes = plot_trajectories(record).axes[0]
        expected = partition(record.positions[-1], ROOMS.region)
        outlines = find_collection(axes, PolyCollection).get_paths()
        assert len(outlines) == 5
        assert outlines[2].vertices[:-1] == pytest.approx(expected.polygons[2])
        assert np.asarray(find_marks(axes, "+").get_xydata()) == pytest.approx(expected.centroids)

    def test_centroids_below_robots_are_not_drawn(self):
        record = record_walk(ROOMS, 5)
        final_positions = record.positions[-1]
        for _ in range(61):
            final_positions = partition(final_positions, ROOMS.region).centroids
        positions = np.concatenate([record.positions[:-1], final_positions[None]])
        goals = np.concatenate([record.goals[:-1], final_positions[None]])
        figure = plot_trajectories(replace(record, positions=positions, goals=goals))
        assert not has_marks(figure.axes[0], "+")
        assert "cell centroid" not in list_legend_texts(figure)

    def test_a_run_has_the_same_goals_in_figures_of_all_sizes(self):
        record = record_walk(ROOMS, 5)
        goals = record.goals.copy()
        # The longer side of the map is 16 m, so the limit is 0.48 m.
        goals[-1] = record.positions[-1] + [[0.0, 0.0], [0.3, 0.0], [0.47, 0.0], [0.49, 0.0], [0.6, 0.0]]
        record_with_goals = replace(record, goals=goals)
        figure = plot_trajectories(record_with_goals)
        narrow_figure = plot_comparison([record_with_goals] * 4)
        for axes in (figure.axes[0], narrow_figure.axes[0]):
            assert find_marks(axes, "x").get_xydata() == pytest.approx(goals[-1, 3:])

    def test_the_cell_of_a_single_robot_has_no_legend_entry(self):
        assert "final Voronoi cell" in list_legend_texts(plot_trajectories(record_walk(ROOMS, 2)))
        assert "final Voronoi cell" not in list_legend_texts(plot_trajectories(record_walk(ROOMS, 1)))

    def test_cells_on_a_density_are_outlines(self):
        weighted = ROOMS.with_density(Gaussians((Gaussian((1.0, 1.0), weight=4.0, sigma=1.0),)))
        cells = find_collection(plot_trajectories(record_walk(weighted, 5)).axes[0], PolyCollection)
        assert len(cells.get_facecolors()) == 0
        assert len(cells.get_paths()) == 5

    def test_marks_and_numbers_follow_the_size_of_large_robots(self):
        small = plot_trajectories(record_walk(ROOMS, 3)).axes[0]
        record = record_walk(ROOMS, 3)
        large_team = Team.homogeneous(3, radius=5.0 * float(record.team.radius[0]))
        large = plot_trajectories(replace(record, team=large_team)).axes[0]
        large_size = list_start_rings(large)[0].get_markersize()
        assert large_size > 2.0 * list_start_rings(small)[0].get_markersize()

    def test_starts_are_smaller_in_a_large_team(self):
        small_team = plot_trajectories(record_walk(CORRIDOR, 3)).axes[0]
        large_team = plot_trajectories(record_walk(CORRIDOR, 40)).axes[0]
        large_team_size = list_start_rings(large_team)[0].get_markersize()
        assert large_team_size < list_start_rings(small_team)[0].get_markersize()

    def test_titles_contain_changed_gains(self):
        record = record_walk(ROOMS, 3)
        changed = replace(record, gains={**record.gains, "k_rep": 2.0})
        assert list_texts(plot_trajectories(record))[0].startswith("RAPF  ·")
        assert list_texts(plot_trajectories(changed))[0].startswith("RAPF, k_rep = 2  ·")

    def test_a_controller_without_goals_has_no_centroids(self):
        figure = plot_trajectories(record_walk(ROOMS, 5, controller="rpf"))
        assert not has_marks(figure.axes[0], "+")
        assert "cell centroid" not in list_legend_texts(figure)

    def test_other_goals_are_times_signs(self):
        record = record_walk(ROOMS, 5)
        goals = record.goals.copy()
        goals[-1] = record.positions[-1] + (0.8, 0.3)
        record_with_other_goals = replace(record, goals=goals)
        axes = plot_trajectories(record_with_other_goals).axes[0]
        assert find_marks(axes, "x").get_xydata() == pytest.approx(goals[-1])
        assert not has_marks(axes, "+")
        texts = list_legend_texts(plot_comparison([record_with_other_goals, record]))
        assert {"goal", "cell centroid"} < set(texts)

    def test_each_robot_has_its_number_at_its_final_position(self):
        record = record_walk(ROOMS, 12, seed=4)
        large_team = Team.homogeneous(12, radius=0.3)
        texts = list_robot_numbers(plot_trajectories(replace(record, team=large_team)).axes[0])
        final_positions = [tuple(position) for position in record.positions[-1].tolist()]
        assert [text.get_text() for text in texts] == [str(number) for number in range(1, 13)]
        assert [text.get_position() for text in texts] == final_positions

    @pytest.mark.parametrize("row", [0, -1], ids=["start", "end"])
    def test_the_numbers_of_small_robots_are_next_to_them_and_their_starts(self, row):
        record = record_walk(ROOMS, 6, seed=4)
        axes = plot_trajectories(replace(record, team=Team.homogeneous(6, radius=0.05))).axes[0]
        numbers = list_start_numbers(axes) if row == 0 else list_robot_numbers(axes)
        assert [text.get_text() for text in numbers] == [str(number) for number in range(1, 7)]
        places = np.array([text.get_position() for text in numbers])
        distances = np.linalg.norm(places - record.positions[row], axis=1)
        assert distances.min() > 0.05
        assert distances.max() < 0.6

    def test_starts_of_a_large_team_have_no_numbers(self):
        axes = plot_trajectories(record_walk(ROOMS, 31)).axes[0]
        assert not list_start_numbers(axes)

    @pytest.mark.parametrize(("n", "n_colors"), [(5, 5), (40, 1)])
    def test_only_trajectories_of_small_teams_have_different_colors(self, n, n_colors):
        axes = plot_trajectories(record_walk(ROOMS, n), theme=DARK).axes[0]
        lines = find_collection(axes, LineCollection)
        assert len(to_colors(lines.get_colors())) == n_colors

    def test_unknown_colors_are_rejected(self):
        with pytest.raises(ParameterError, match="colors"):
            plot_trajectories(record_walk(ROOMS, 2), colors="rainbow")

    def test_the_title_names_controller_map_time_and_cost(self):
        figure = plot_trajectories(record_walk(ROOMS, 6), mean_distance=1.23456)
        title, facts = list_texts(figure)[:2]
        assert "RAPF" in title
        assert "rooms" in title
        assert "t = 3.9 s" in facts
        assert "mean distance 1.235 m" in facts
        assert "6 robots" in facts

    def test_the_legend_lists_starts_trajectories_and_final_positions(self):
        texts = list_legend_texts(plot_trajectories(record_walk(ROOMS, 6)))
        assert texts[:3] == ["start", "trajectory", "final position"]

    @pytest.mark.parametrize(
        ("environment", "has_obstacles"), [(ROOMS, True), (CORRIDOR, False)], ids=["rooms", "corridor"]
    )
    def test_the_legend_lists_obstacles_if_the_map_has_some(self, environment, has_obstacles):
        texts = list_legend_texts(plot_trajectories(record_walk(environment, 3)))
        assert ("obstacle (unknown to robots)" in texts) == has_obstacles

    def test_the_scale_bar_has_the_length_of_its_label(self):
        figure = plot_trajectories(record_walk(ROOMS, 3))
        bar_lines = [artist for artist in figure.artists if isinstance(artist, Line2D)]
        bar = max(bar_lines, key=lambda line: np.ptp(line.get_xdata()))
        bar_px = np.ptp(bar.get_xdata()) * figure.bbox.width
        px_per_m = figure.axes[0].get_window_extent().width / 16.0
        (label,) = [text for text in list_texts(figure) if re.fullmatch(r"[\d.]+ m", text)]
        assert bar_px / px_per_m == pytest.approx(float(label.removesuffix(" m")))

    def test_existing_axes_can_be_used(self):
        figure = Figure()
        axes = figure.subplots()
        assert plot_trajectories(record_walk(ROOMS, 3), axes) is figure
        assert axes.get_xlabel() == "x (m)"
        assert axes.get_ylabel() == "y (m)"
        assert axes.get_aspect() == 1.0
        assert not figure.legends


N_CROWDED = 100
"""Number of crowded robots in `record_crowd`."""


def record_crowd():
    """Return the record of 120 robots, of which the first 100 are crowded in a lattice at the end."""
    record = record_walk(ROOMS, 120)
    final_positions = record.positions[-1].copy()
    x, y = np.meshgrid(np.arange(10), np.arange(10))
    final_positions[:N_CROWDED] = 2.0 + 0.12 * np.column_stack([x.ravel(), y.ravel()])
    positions = np.concatenate([record.positions[:-1], final_positions[None]])
    return replace(record, positions=positions, team=Team.homogeneous(120, radius=0.03))


def measure_radii(axes):
    """Return the radii of the discs at final positions, (n,) px."""
    areas = find_collection(axes, PathCollection).get_sizes()
    return np.sqrt(areas) / 2 * axes.figure.dpi / 72


class TestLargeTeam:
    def test_crowded_discs_do_not_overlap(self):
        record = record_crowd()
        axes = plot_trajectories(record, size=(1000, 700)).axes[0]
        radii = measure_radii(axes)[:N_CROWDED]
        pixels = axes.transData.transform(record.positions[-1, :N_CROWDED])
        distances = np.linalg.norm(pixels[:, None] - pixels, axis=2)
        np.fill_diagonal(distances, np.inf)
        assert (radii[:, None] + radii <= distances + 1e-6).all()

    def test_small_robots_have_no_numbers(self):
        axes = plot_trajectories(record_crowd(), size=(1000, 700)).axes[0]
        assert not axes.texts

    def test_trajectories_are_thinner_than_those_of_a_small_team(self):
        widths = []
        for record in (record_crowd(), record_walk(ROOMS, 6)):
            axes = plot_trajectories(record, size=(1000, 700)).axes[0]
            widths.append(find_collection(axes, LineCollection).get_linewidths()[0])
        width, width_in_small_team = widths
        assert width < 0.7 * width_in_small_team


def list_curve_lines(axes):
    """Return the lines of curves, without their end marks."""
    return [line for line in axes.lines if len(line.get_xdata()) == len(TIME)]


def list_end_marks(axes):
    """Return the markers at the ends of curves."""
    return [line.get_marker() for line in axes.lines if len(line.get_xdata()) == 1]


class TestCost:
    def test_equal_curves_are_all_visible(self):
        """The solid curve is visible in the gaps of the others; each has its own dashes and mark."""
        axes = plot_cost(build_curves(1.0, 1.0, 1.0, 1.0)[::-1]).axes[0]
        lines = list_curve_lines(axes)
        assert len({line.get_linewidth() for line in lines}) == 1
        lowest = min(lines, key=lambda line: line.get_zorder())
        assert lowest.get_linestyle() == "-"
        assert len({str(line._dash_pattern) for line in lines}) == 4
        assert len(set(list_end_marks(axes))) == 4

    def test_end_marks_of_equal_curves_do_not_overlap(self):
        axes = plot_cost(build_curves(1.0, 1.0, 1.0, 1.0)).axes[0]
        marks = [line for line in axes.lines if len(line.get_xdata()) == 1]
        pixels = [line.get_transform().transform(line.get_xydata())[0] for line in marks]
        size = marks[0].get_markersize() * axes.figure.dpi / 72
        assert (np.diff(sorted(y for _, y in pixels)) > size).all()

    def test_the_style_of_a_controller_does_not_depend_on_others(self):
        values = 1.0 + np.exp(-TIME)
        lloyd = TimeCurve("LA", "lloyd", TIME, values)
        axes_of_lloyd = plot_cost([lloyd]).axes[0]
        axes_of_both = plot_cost([TimeCurve("mine", "mine", TIME, values), lloyd]).axes[0]
        (line,) = list_curve_lines(axes_of_lloyd)
        _, line_in_both = list_curve_lines(axes_of_both)
        assert line.get_color() == line_in_both.get_color()
        assert line._dash_pattern == line_in_both._dash_pattern
        assert list_end_marks(axes_of_lloyd)[0] == list_end_marks(axes_of_both)[1]

    def test_two_custom_controllers_have_different_colors(self):
        figure = plot_cost([TimeCurve("a", "a", TIME, TIME + 1), TimeCurve("b", "b", TIME, TIME + 2)])
        first, second = list_curve_lines(figure.axes[0])
        assert first.get_color() != second.get_color()

    @pytest.mark.parametrize("end", [1.0, 20.0, 60.0, 90.0])
    def test_ticks_of_the_time_axis_are_round(self, end):
        figure = plot_cost([TimeCurve("A", "rapf", np.linspace(0, end, 9), np.linspace(2, 1, 9))])
        figure.canvas.draw()
        labels = [text.get_text() for text in figure.axes[0].get_xticklabels()]
        assert len(labels) >= 3
        assert all(re.fullmatch(r"\d+|0\.\d", label) for label in labels)

    def test_axes_have_units(self):
        axes = plot_cost(build_curves(1.0)).axes[0]
        assert "(s)" in axes.get_xlabel()
        assert "(m)" in axes.get_ylabel()

    def test_lines_have_the_values_of_the_curves_and_the_colors_of_their_controllers(self):
        curves = build_curves(1.0, 1.4)
        lines = list_curve_lines(plot_cost(curves).axes[0])
        for line, (_, name, time, values) in zip(lines, curves, strict=True):
            assert np.asarray(line.get_xdata()).tolist() == time.tolist()
            assert np.asarray(line.get_ydata()).tolist() == values.tolist()
            assert to_rgb(line.get_color()) == to_plot_color(LIGHT.controllers[name])
        assert len({str(line.get_linestyle()) for line in lines}) == 2

    def test_labels_at_the_ends_have_the_final_costs(self):
        axes = plot_cost(build_curves(1.0, 1.4)).axes[0]
        assert [text.get_text() for text in axes.texts] == ["RAPF  1.005 m", "RPF  1.405 m"]

    @pytest.mark.parametrize(
        "final_costs", [(1.0,), (1.0, 1.0, 1.0, 1.0), (1.0, 1.01, 3.0), (0.0, 0.001, 0.002)]
    )
    @pytest.mark.parametrize("size", [(900, 600), (2560, 1440), (500, 320)])
    def test_labels_do_not_overlap_and_have_the_order_of_their_curves(self, final_costs, size):
        figure = plot_cost(build_curves(*final_costs), size=size)
        figure.canvas.draw()
        renderer = figure.canvas.get_renderer()
        axes = figure.axes[0]
        boxes = [text.get_window_extent(renderer) for text in axes.texts]
        axes_right = axes.get_window_extent().x1
        for box in boxes:
            assert axes_right < box.x0
            assert box.x1 <= size[0]
            assert box.y0 >= 0
            assert box.y1 <= size[1]
        for box, other in combinations(boxes, 2):
            assert not boxes_overlap(box, other)
        order = np.argsort([box.y0 for box in boxes], kind="stable")
        assert order.tolist() == np.argsort(final_costs, kind="stable").tolist()

    @pytest.mark.parametrize("size", [(900, 600), (2560, 1440), (500, 320)])
    def test_labels_of_axes_are_on_the_page(self, size):
        figure = plot_cost(build_curves(1.0, 1.01, 3.0), size=size)
        figure.canvas.draw()
        renderer = figure.canvas.get_renderer()
        axes = figure.axes[0]
        texts = [*axes.get_xticklabels(), *axes.get_yticklabels(), axes.xaxis.label, axes.yaxis.label]
        for text in texts:
            if text.get_text():
                box = text.get_window_extent(renderer)
                assert box.x0 >= 0
                assert box.y0 >= 0

    def test_the_label_of_a_curve_with_gaps_has_the_last_known_cost(self):
        values = np.full(len(TIME), 2.0)
        values[-3:] = np.nan
        axes = plot_cost([TimeCurve("A", "rapf", TIME, values)]).axes[0]
        assert axes.texts[0].get_text() == "A  2.000 m"

    def test_a_constant_curve_is_inside_the_axes(self):
        axes = plot_cost([TimeCurve("A", "rapf", TIME, np.full(len(TIME), 2.0))]).axes[0]
        low, high = axes.get_ylim()
        assert low < 2.0 < high

    @pytest.mark.parametrize(
        "curves",
        [
            pytest.param([], id="none"),
            pytest.param([TimeCurve("A", "rapf", TIME, TIME[:-1])], id="different lengths"),
            pytest.param([TimeCurve("A", "rapf", TIME, np.full(len(TIME), np.nan))], id="only nan"),
        ],
    )
    def test_invalid_curves_are_rejected(self, curves):
        with pytest.raises(ParameterError, match="curve"):
            plot_cost(curves)


_IMPORT_AND_PLOT = """
import sys
import robocov_app.figures.files, robocov_app.look.curve_styles, robocov_app.report.replay
assert "matplotlib" not in sys.modules
import robocov_app.figures.map_pages
sys.path.insert(0, sys.argv[1])
from drawn_run import ROOMS, record_walk
robocov_app.figures.map_pages.plot_trajectories(record_walk(ROOMS, 3))
assert "matplotlib.pyplot" not in sys.modules and "pygame" not in sys.modules
"""


@pytest.mark.slow
def test_matplotlib_is_imported_late_and_pyplot_and_pygame_never():
    process = subprocess.run(
        [sys.executable, "-c", _IMPORT_AND_PLOT, str(Path(__file__).parents[1])],
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stderr


def test_names_are_not_interpreted_as_formulas(tmp_path):
    """Missing characters must not raise a warning either, which would be an error here."""
    name = "cost $x^2$ and $y$ $\\frac$ [/] { 倉庫 🤖"
    record = replace(record_walk(HALL, 3), environment=replace(HALL, name=name))
    figure = plot_trajectories(record, size=(640, 480))
    save_figure(figure, tmp_path / "trajectories.png")
    assert any(name in text for text in list_texts(figure))
    assert not any(text.get_parse_math() for text in figure.texts)
    curve = TimeCurve(name, "mine", record.time, record.time)
    save_figure(plot_cost([curve]), tmp_path / "cost.svg")


def test_areas_of_large_maps_are_written_without_an_exponent() -> None:
    environment = Environment("campus", ((0, 0), (200, 0), (200, 150), (0, 150)))
    texts = list_texts(plot_environment(environment))
    assert any("30000 m² inside the boundary, 30000 m² free" in text for text in texts)


@pytest.mark.parametrize(
    ("value", "unit", "label"),
    [
        (12.3456, "m", "RAPF  12.346 m"),
        (3.14159, "s", "RAPF  3.142 s"),
        (252.845, "J", "RAPF  252.8 J"),
        (73.946, "%", "RAPF  73.9%"),
        (9999.96, "J", "RAPF  10,000 J"),
        (12345.6, "J", "RAPF  12,346 J"),
        (2.0, "", "RAPF  2.000"),
        (-0.01, "%", "RAPF  0.0%"),
    ],
)
def test_final_values_have_few_digits(value: float, unit: str, label: str) -> None:
    curve = TimeCurve("RAPF", "rapf", np.arange(3.0), np.array([1.0, value, np.nan]))
    assert format_end_label(curve, unit) == label


class TestMovingObstacles:
    STATIC = Environment("hall", ((0, 0), (8, 0), (8, 6), (0, 6)), (CircleObstacle((6, 3), 0.8),))
    CART = CircleObstacle((1, 1), 0.5, "cart", ObstaclePath(((1, 1), (5, 1)), 1.0, "back-and-forth"))
    MOVING = replace(STATIC, obstacles=(*STATIC.obstacles, CART))

    def test_the_legend_lists_moving_obstacles_if_there_are_any(self):
        label = "moving obstacle and its path"
        assert label not in list_legend_texts(plot_environment(self.STATIC))
        assert label in list_legend_texts(plot_environment(self.MOVING))

    def test_the_legend_lists_obstacles_at_rest_only_if_there_are_any(self):
        label = "obstacle (unknown to robots)"
        assert label in list_legend_texts(plot_environment(self.MOVING))
        assert label not in list_legend_texts(plot_environment(replace(self.MOVING, obstacles=(self.CART,))))

    def test_a_moving_obstacle_has_a_path_and_an_arrow(self):
        axes = plot_environment(self.MOVING).axes[0]
        assert any(np.allclose(line.get_xydata()[0], (1, 1)) for line in axes.lines)
        (arrow,) = axes.texts
        assert arrow.arrow_patch is not None
