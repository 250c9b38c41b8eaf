import re
import subprocess
import sys
from dataclasses import replace
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

from robocov.environment import CircleObstacle, Environment, ObstaclePath
from robocov.errors import ParameterError
from robocov.team import Team
from robocov.voronoi import partition
from robocov_app.figures.curves import TimeCurve, format_end_label
from robocov_app.figures.files import save_figure
from robocov_app.figures.page import to_plot_color
from robocov_app.figures.runs import plot_comparison, plot_cost, plot_environment, plot_trajectories
from robocov_app.look.theme import DARK, LIGHT

SIZES = [(900, 600), (1400, 901), (2560, 1440)]
MAPS = [ROOMS, HALL, CORRIDOR, SHAFT]
T = np.linspace(0.0, 60.0, 121)


def build_curves(*finals):
    names = ["rapf", "rpf", "lloyd", "other"]
    return [
        TimeCurve(name.upper(), name, T, final + 2 * np.exp(-T / 10))
        for name, final in zip(names, finals, strict=False)
    ]


@pytest.mark.parametrize("environment", MAPS, ids=lambda map_: map_.name)
@pytest.mark.parametrize(
    "size", [None, (900, 600), *(pytest.param(size, marks=pytest.mark.slow) for size in SIZES[1:])]
)
def test_no_element_covers_or_cuts_another(environment, size):
    record = record_walk(environment, 6)
    assert_layout_is_clear(plot_trajectories(record, size=size, mean_distance=1.2345))
    assert_layout_is_clear(plot_environment(environment, size=size))


@pytest.mark.parametrize(
    "count", [pytest.param(count, marks=[] if count == 3 else pytest.mark.slow) for count in (1, 2, 3, 5)]
)
@pytest.mark.parametrize("size", [None, (900, 600), pytest.param((2560, 1440), marks=pytest.mark.slow)])
@pytest.mark.parametrize("environment", [ROOMS, CORRIDOR, SHAFT], ids=lambda map_: map_.name)
def test_comparisons_are_clear_and_at_one_scale(environment, count, size):
    records = [record_walk(environment, 4, seed=k) for k in range(count)]
    figure = plot_comparison(records, size=size, mean_distances=[1.0 + k for k in range(count)])
    assert len(figure.axes) == count
    assert_layout_is_clear(figure)
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in figure.axes}) == 1
    sizes = np.array([axes.get_window_extent().size for axes in figure.axes])
    assert np.ptp(sizes, axis=0).max() < 1e-6
    words = [text.get_text() for text in figure.texts]
    for k in range(count):
        assert any(f"mean distance {1.0 + k:.3f} m" in text for text in words)


def test_maps_of_different_sizes_are_compared_at_one_scale():
    figure = plot_comparison([record_walk(ROOMS, 3), record_walk(HALL, 3)])
    first, second = figure.axes
    assert first.get_xlim() == second.get_xlim() == (0.0, 16.0)
    assert first.get_ylim() == second.get_ylim() == (0.0, 11.0)


@pytest.mark.parametrize("environment", MAPS, ids=lambda map_: map_.name)
def test_the_arena_is_not_distorted(environment):
    axes = plot_trajectories(record_walk(environment, 3), size=(1000, 800)).axes[0]
    box = axes.get_window_extent()
    left, right = axes.get_xlim()
    low, high = axes.get_ylim()
    assert box.width / (right - left) == pytest.approx(box.height / (high - low))


@pytest.mark.parametrize("size", [(901, 600), (641, 487), pytest.param((2560, 1440), marks=pytest.mark.slow)])
def test_a_png_has_the_requested_size(tmp_path, size):
    path = tmp_path / "a.png"
    for figure in (
        plot_trajectories(record_walk(ROOMS, 3), size=size),
        plot_cost(build_curves(1.0), size=size),
    ):
        save_figure(figure, path)
        assert pygame.image.load(path).get_size() == size
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.png"]


class TestTrajectories:
    def test_colors_of_the_paper_and_positions_of_the_record(self):
        record = record_walk(ROOMS, 5)
        axes = plot_trajectories(record).axes[0]
        (lines,) = [c for c in axes.collections if isinstance(c, LineCollection)]
        assert {to_rgb(c) for c in lines.get_colors()} == {to_plot_color(LIGHT.trajectory)}
        for robot, segment in enumerate(lines.get_segments()):
            assert segment == pytest.approx(record.positions[:, robot])
        (finals,) = [
            c for c in axes.collections if isinstance(c, PathCollection) and not isinstance(c, LineCollection)
        ]
        assert np.asarray(finals.get_offsets()) == pytest.approx(record.positions[-1])
        assert {to_rgb(c) for c in finals.get_facecolors()} == {to_plot_color(LIGHT.final)}
        starts = next(line for line in axes.lines if line.get_marker() == "o")
        assert np.asarray(starts.get_xydata()) == pytest.approx(record.positions[0])
        assert to_rgb(starts.get_markeredgecolor()) == to_plot_color(LIGHT.start)
        assert starts.get_markerfacecolor() == "none"

    def test_cells_and_centroids_are_the_final_ones(self):
        record = record_walk(ROOMS, 5)
        axes = plot_trajectories(record).axes[0]
        cells = partition(record.positions[-1], ROOMS.region)
        (drawn,) = [c for c in axes.collections if isinstance(c, PolyCollection)]
        assert len(drawn.get_paths()) == 5
        assert drawn.get_paths()[2].vertices[:-1] == pytest.approx(cells.polygons[2])
        marks = next(line for line in axes.lines if line.get_marker() == "+")
        assert np.asarray(marks.get_xydata()) == pytest.approx(cells.centroids)

    def test_a_robot_hides_the_centroid_below_it(self):
        record = record_walk(ROOMS, 5)
        last = partition(record.positions[-1], ROOMS.region).centroids
        for _ in range(60):
            last = partition(last, ROOMS.region).centroids
        positions = np.concatenate([record.positions, last[None]])
        goals = np.concatenate([record.goals, last[None]])
        arrived = replace(record, positions=positions, goals=goals)
        axes = plot_trajectories(arrived).axes[0]
        marks = next(line for line in axes.lines if line.get_marker() == "+")
        assert len(marks.get_xydata()) == 0

    def test_a_controller_without_goals_has_no_centroids(self):
        figure = plot_trajectories(record_walk(ROOMS, 5, controller="rpf"))
        assert not any(line.get_marker() == "+" for line in figure.axes[0].lines)
        (legend,) = figure.legends
        assert "cell centroid" not in [text.get_text() for text in legend.get_texts()]
        mixed = plot_comparison([record_walk(ROOMS, 5, controller="rpf"), record_walk(ROOMS, 5)])
        (legend,) = mixed.legends
        words = [text.get_text() for text in legend.get_texts()]
        assert words[2:5] == ["final position", "cell centroid", "final Voronoi cell"]

    def test_other_goals_are_labeled_goals(self):
        record = record_walk(ROOMS, 5)
        goals = record.goals.copy()
        goals[-1] = record.positions[-1] + np.array([0.8, 0.3])
        axes = plot_trajectories(replace(record, goals=goals)).axes[0]
        (marks,) = (line for line in axes.lines if line.get_marker() == "x")
        assert marks.get_xydata() == pytest.approx(goals[-1])
        assert not any(line.get_marker() == "+" for line in axes.lines)
        (legend,) = plot_comparison([replace(record, goals=goals), record]).legends
        words = [text.get_text() for text in legend.get_texts()]
        assert {"goal", "cell centroid"} < set(words)

    def test_many_robots_stay_readable(self):
        record = record_walk(ROOMS, 120)
        last = record.positions[-1].copy()
        last[:100] = 2.0 + 0.12 * np.stack(np.meshgrid(np.arange(10), np.arange(10)), axis=-1).reshape(-1, 2)
        record = replace(
            record,
            positions=np.concatenate([record.positions[:-1], last[None]]),
            team=Team.homogeneous(120, radius=0.03),
        )
        axes = plot_trajectories(record, size=(1000, 700)).axes[0]
        (finals,) = [c for c in axes.collections if type(c) is PathCollection]
        radius = np.sqrt(finals.get_sizes()) / 2 * axes.figure.dpi / 72
        pixels = axes.transData.transform(last)
        apart = np.linalg.norm(pixels[:, None] - pixels[None], axis=2) + 1e9 * np.eye(120)
        assert (radius[:, None] + radius[None] <= apart + 1e-6)[:100, :100].all()
        assert radius[100:].max() > 1.2 * radius[:100].max()
        numbered = {int(text.get_text()) for text in axes.texts}
        assert not numbered & set(range(12, 90)) and numbered & set(range(101, 121))
        few = plot_trajectories(record_walk(ROOMS, 6), size=(1000, 700)).axes[0]
        widths = [
            next(c for c in a.collections if isinstance(c, LineCollection)).get_linewidths()[0]
            for a in (axes, few)
        ]
        assert widths[0] < 0.7 * widths[1]

    def test_every_robot_has_its_number(self):
        record = record_walk(ROOMS, 12, seed=4)
        texts = plot_trajectories(record).axes[0].texts
        assert [text.get_text() for text in texts] == [str(k) for k in range(1, 13)]
        assert [text.get_position() for text in texts] == [tuple(p) for p in record.positions[-1].tolist()]

    @pytest.mark.parametrize("n", [5, 40])
    def test_robots_colors(self, n):
        axes = plot_trajectories(record_walk(ROOMS, n), colors="robots", theme=DARK).axes[0]
        (lines,) = [c for c in axes.collections if isinstance(c, LineCollection)]
        assert len({to_rgb(c) for c in lines.get_colors()}) == (5 if n == 5 else 1)
        with pytest.raises(ParameterError, match="colors"):
            plot_trajectories(record_walk(ROOMS, 2), colors="rainbow")

    def test_title_and_legend(self):
        figure = plot_trajectories(record_walk(ROOMS, 6), mean_distance=1.23456)
        words = [text.get_text() for text in figure.texts]
        assert any("RAPF" in text and "rooms" in text for text in words)
        assert any("t = 3.9 s" in t and "mean distance 1.235 m" in t and "6 robots" in t for t in words)
        (legend,) = figure.legends
        entries = [text.get_text() for text in legend.get_texts()]
        assert entries[:3] == ["start", "trajectory", "final position"]
        assert "obstacle (unknown to robots)" in entries
        (legend,) = plot_trajectories(record_walk(CORRIDOR, 3)).legends
        assert "obstacle (unknown to robots)" not in [text.get_text() for text in legend.get_texts()]

    def test_the_scale_bar_has_the_length_of_its_label(self):
        figure = plot_trajectories(record_walk(ROOMS, 3))
        box = figure.axes[0].get_window_extent()
        bars = [artist for artist in figure.artists if isinstance(artist, Line2D)]
        bar = max(bars, key=lambda line: np.ptp(line.get_xdata()))
        pixels = np.ptp(bar.get_xdata()) * figure.bbox.width
        label = next(t.get_text() for t in figure.texts if re.fullmatch(r"[\d.]+ m", t.get_text()))
        assert pixels / (box.width / 16.0) == pytest.approx(float(label.split()[0]))

    def test_existing_axes_can_be_used(self):
        figure = Figure()
        axes = figure.subplots()
        assert plot_trajectories(record_walk(ROOMS, 3), axes) is figure
        assert axes.get_xlabel() == "x (m)" and axes.get_ylabel() == "y (m)"
        assert axes.get_aspect() == 1.0
        assert not figure.legends


class TestText:
    """Sizes in pixels of what is read: it grows with the page."""

    def heights(self, figure):
        return [text.get_fontsize() * figure.dpi / 72 for text in figure.findobj(Text) if text.get_text()]

    @pytest.mark.parametrize(
        "draw", [plot_trajectories, lambda record, size: plot_comparison([record] * 3, size=size)]
    )
    def test_text_grows_with_the_page(self, draw):
        small = draw(record_walk(ROOMS, 3), size=(960, 640))
        large = draw(record_walk(ROOMS, 3), size=(2880, 1920))
        assert min(self.heights(large)) == pytest.approx(3 * min(self.heights(small)), rel=0.35)

    def test_a_comparison_is_legible_at_half_its_size(self):
        figure = plot_comparison([record_walk(ROOMS, 3)] * 3)
        assert figure.bbox.width == pytest.approx(1600, abs=0.1)
        assert min(text.get_fontsize() * figure.dpi / 72 for text in figure.texts) >= 17

    def test_common_facts_are_in_the_heading_only(self):
        figure = plot_comparison([record_walk(ROOMS, 3), record_walk(ROOMS, 3, controller="rpf")])
        words = [text.get_text() for text in figure.texts]
        assert sum("t = 3.9 s" in text for text in words) == 1
        different = plot_comparison([record_walk(ROOMS, 3, steps=40), record_walk(ROOMS, 3, steps=21)])
        words = " ".join(text.get_text() for text in different.texts)
        assert "t = 3.9 s" in words and "t = 2.0 s" in words

    @pytest.mark.parametrize(("environment", "rows"), [(ROOMS, 1), (CORRIDOR, 3)])
    def test_wide_maps_are_stacked(self, environment, rows):
        figure = plot_comparison([record_walk(environment, 3)] * 3)
        assert len({round(axes.get_position().y0, 6) for axes in figure.axes}) == rows


class TestCost:
    def test_equal_curves_are_all_visible(self):
        """Each is wider than the next, which lies on it, and has dashes and a mark of its own."""
        figure = plot_cost(build_curves(1.0, 1.0, 1.0, 1.0))
        long = [line for line in figure.axes[0].lines if len(line.get_xdata()) == len(T)]
        widths = [line.get_linewidth() for line in long]
        assert (np.diff(widths) < -0.5).all()
        assert [line.get_zorder() for line in long] == sorted(line.get_zorder() for line in long)
        dashes = {str(line._dash_pattern) for line in long}
        marks = {line.get_marker() for line in figure.axes[0].lines if len(line.get_xdata()) == 1}
        assert len(dashes) == len(marks) == 4

    def test_the_style_of_a_controller_does_not_depend_on_others(self):
        time = T
        values = 1.0 + np.exp(-T)
        lloyd = TimeCurve("LA", "lloyd", time, values)
        alone = plot_cost([lloyd]).axes[0].lines
        among = plot_cost([TimeCurve("mine", "mine", time, values), lloyd]).axes[0].lines
        assert alone[0].get_color() == among[2].get_color()
        assert alone[0]._dash_pattern == among[2]._dash_pattern
        assert alone[1].get_marker() == among[3].get_marker()

    def test_two_custom_controllers_have_different_colors(self):
        figure = plot_cost([TimeCurve("a", "a", T, T + 1), TimeCurve("b", "b", T, T + 2)])
        first, _, second, *_ = figure.axes[0].lines
        assert first.get_color() != second.get_color()

    @pytest.mark.parametrize("end", [1.0, 20.0, 60.0, 90.0])
    def test_times_are_round_numbers(self, end):
        figure = plot_cost([TimeCurve("A", "rapf", np.linspace(0, end, 9), np.linspace(2, 1, 9))])
        figure.canvas.draw()
        words = [text.get_text() for text in figure.axes[0].get_xticklabels()]
        assert len(words) >= 3
        assert all(re.fullmatch(r"\d+|0\.\d", word) for word in words)

    def test_values_units_and_the_papers_colors(self):
        given_curves = build_curves(1.0, 1.4)
        figure = plot_cost(given_curves)
        axes = figure.axes[0]
        assert "(s)" in axes.get_xlabel() and "(m)" in axes.get_ylabel()
        long = [line for line in axes.lines if len(line.get_xdata()) == len(T)]
        for line, (_, name, time, values) in zip(long, given_curves, strict=True):
            assert np.asarray(line.get_xdata()).tolist() == time.tolist()
            assert np.asarray(line.get_ydata()).tolist() == values.tolist()
            assert to_rgb(line.get_color()) == to_plot_color(LIGHT.controllers[name])
        assert len({str(line.get_linestyle()) for line in long}) == 2
        assert [text.get_text() for text in axes.texts] == ["RAPF  1.005 m", "RPF  1.405 m"]

    @pytest.mark.parametrize("finals", [(1.0,), (1.0, 1.0, 1.0, 1.0), (1.0, 1.01, 3.0), (0.0, 0.001, 0.002)])
    @pytest.mark.parametrize("size", [(900, 600), (2560, 1440), (500, 320)])
    def test_labels_are_separate_ordered_and_on_the_page(self, finals, size):
        figure = plot_cost(build_curves(*finals), size=size)
        figure.canvas.draw()
        renderer = figure.canvas.get_renderer()
        axes = figure.axes[0]
        words = [text.get_window_extent(renderer) for text in axes.texts if isinstance(text, Text)]
        arena = axes.get_window_extent()
        for k, box in enumerate(words):
            assert box.x0 > arena.x1 and box.x1 <= size[0] and box.y0 >= 0 and box.y1 <= size[1]
            assert not any(boxes_overlap(box, other) for other in words[k + 1 :])
        heights = [box.y0 for box in words]
        assert np.argsort(heights, kind="stable").tolist() == np.argsort(finals, kind="stable").tolist()
        for text in [*axes.get_xticklabels(), *axes.get_yticklabels(), axes.xaxis.label, axes.yaxis.label]:
            if text.get_text():
                box = text.get_window_extent(renderer)
                assert box.x0 >= 0 and box.y0 >= 0

    def test_gaps_and_constant_curves(self):
        values = np.full(len(T), 2.0)
        values[-3:] = np.nan
        figure = plot_cost([TimeCurve("A", "rapf", T, values)])
        assert figure.axes[0].texts[0].get_text() == "A  2.000 m"
        low, high = figure.axes[0].get_ylim()
        assert low < 2.0 < high

    @pytest.mark.parametrize(
        "bad", [[], [TimeCurve("A", "rapf", T, T[:-1])], [TimeCurve("A", "rapf", T, np.full(len(T), np.nan))]]
    )
    def test_invalid_curves_are_named(self, bad):
        with pytest.raises(ParameterError, match="curve"):
            plot_cost(bad)


_LAZY = """
import sys
import robocov_app.figures.files, robocov_app.look.curve_styles, robocov_app.report.replay
assert "matplotlib" not in sys.modules
import robocov_app.figures.runs
sys.path.insert(0, sys.argv[1])
from page_layout import assert_layout_is_clear, boxes_overlap, measure_extents
from drawn_run import ROOMS, record_walk
robocov_app.figures.runs.plot_trajectories(record_walk(ROOMS, 3))
assert "matplotlib.pyplot" not in sys.modules and "pygame" not in sys.modules
"""


@pytest.mark.slow
def test_matplotlib_is_imported_late_and_pyplot_and_pygame_never():
    done = subprocess.run(
        [sys.executable, "-c", _LAZY, str(Path(__file__).parents[1])],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_names_are_never_markup(tmp_path):
    """No formula, and no warning (an error here) of letters that the font has not."""
    name = "cost $x^2$ and $y$ $\\frac$ [/] { 倉庫 🤖"
    record = replace(record_walk(HALL, 3), environment=replace(HALL, name=name))
    figure = plot_trajectories(record, size=(640, 480))
    save_figure(figure, tmp_path / "a.png")
    assert any(name in text.get_text() for text in figure.texts)
    assert not any(text.get_parse_math() for text in figure.texts)
    save_figure(plot_cost([TimeCurve(name, "mine", record.time, record.time)]), tmp_path / "b.svg")


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (12.3456, "m", "RAPF  12.346 m"),
        (3.14159, "s", "RAPF  3.142 s"),
        (252.845, "J", "RAPF  252.8 J"),
        (73.946, "%", "RAPF  73.9%"),
        (12345.6, "J", "RAPF  12,346 J"),
        (2.0, "", "RAPF  2.000"),
    ],
)
def test_final_values_are_rounded_for_reading(value: float, unit: str, words: str) -> None:
    curve = TimeCurve("RAPF", "rapf", np.arange(3.0), np.array([1.0, value, np.nan]))
    assert format_end_label(curve, unit) == words


def test_moving_obstacles_have_an_arrow_a_path_and_a_legend_entry():
    cart = CircleObstacle((1, 1), 0.5, "cart", ObstaclePath(((1, 1), (5, 1)), 1.0, "back-and-forth"))
    plain = Environment("hall", ((0, 0), (8, 0), (8, 6), (0, 6)), (CircleObstacle((6, 3), 0.8),))
    moving = replace(plain, obstacles=(*plain.obstacles, cart))
    label = "moving obstacle and its path"
    words = [
        [text.get_text() for text in plot_environment(each).legends[0].get_texts()]
        for each in (plain, moving)
    ]
    assert label not in words[0]
    assert label in words[1]
    axes = plot_environment(moving).axes[0]
    assert any(np.allclose(line.get_xydata()[0], (1, 1)) for line in axes.lines)
    assert [text.arrow_patch is not None for text in axes.texts] == [True]
