"""The figures of the replication: text, colors, curves and files."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_run import HALL, ROOMS, SQUARE, record_walk
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.colors import to_rgb
from page_layout import assert_layout_is_clear

from robocov.metrics import CostHistory
from robocov.voronoi import partition
from robocov_app.figures.files import save_figure
from robocov_app.figures.page import to_plot_color
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.replication.figures.paper_figures import FIGURES, WIDE_PX, draw_figure
from robocov_app.replication.results.study_results import FigureRun


def build_figure_run(environment, controller: str, final: float, seed: int = 0) -> FigureRun:
    time = np.linspace(0.0, 60.0, 121)
    cost = final + 3.0 * np.exp(-time / 8)
    record = replace(record_walk(environment, 6, seed=seed, controller=controller), label=controller.upper())
    return FigureRun(record, CostHistory(time, cost, 80.0 * cost, np.zeros_like(time)))


RUNS = {
    "convex/rapf": build_figure_run(SQUARE, "rapf", 1.3),
    "convex/lloyd": build_figure_run(SQUARE, "lloyd", 1.31, 1),
    "a/rapf": build_figure_run(ROOMS, "rapf", 1.8),
    "a/rpf": build_figure_run(ROOMS, "rpf", 3.5, 1),
    "b/rapf": build_figure_run(HALL, "rapf", 2.2),
    "b/rpf": build_figure_run(HALL, "rpf", 3.9, 1),
    "other/rapf": build_figure_run(HALL, "rapf", 2.0, 2),
    "other/rpf": build_figure_run(HALL, "rpf", 4.3, 3),
}
PARTITION = record_walk(SQUARE, 6)


@pytest.mark.parametrize("number", range(1, 9))
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_no_text_is_covered_or_cut_off(number, theme):
    figure = draw_figure(number, RUNS, PARTITION, theme)
    if number not in (3, 5, 7):
        assert_layout_is_clear(figure)
    assert to_rgb(figure.get_facecolor()) == to_plot_color((LIGHT if theme == "light" else DARK).background)


def test_figures_are_numbered_from_1_to_8():
    assert list(FIGURES) == list(range(1, 9))


@pytest.mark.slow
@pytest.mark.parametrize("number", range(1, 9))
def test_files_are_reproducible_and_as_wide_as_columns_of_a_journal(number, tmp_path):
    figure = draw_figure(number, RUNS, PARTITION, "light")
    width = figure.get_size_inches()[0]
    assert width == pytest.approx(3.5 if number == 1 else 7.16, abs=0.01)
    assert figure.dpi == 300
    save_figure(figure, tmp_path / "a.pdf")
    save_figure(draw_figure(number, RUNS, PARTITION, "light"), tmp_path / "b.pdf")
    content = (tmp_path / "a.pdf").read_bytes()
    assert content == (tmp_path / "b.pdf").read_bytes()
    assert b"/FontFile2" in content and b"/Type3" not in content


def test_figure_1_shows_robots_and_centers_of_mass():
    axes = draw_figure(1, RUNS, PARTITION, "light").axes[0]
    centers = partition(PARTITION.positions[0], SQUARE.region).centroids
    (dots,) = [line for line in axes.lines if len(line.get_xdata()) == 6]
    assert np.asarray(dots.get_xydata()) == pytest.approx(centers)
    (robots,) = [c for c in axes.collections if type(c) is PathCollection]
    assert np.asarray(robots.get_offsets()) == pytest.approx(PARTITION.positions[0])
    assert {to_rgb(c) for c in robots.get_facecolors()} == {to_plot_color(LIGHT.final)}


@pytest.mark.parametrize(
    ("number", "left", "right"),
    [
        (2, "convex/rapf", "convex/lloyd"),
        (4, "a/rapf", "a/rpf"),
        (6, "b/rapf", "b/rpf"),
        (8, "other/rapf", "other/rpf"),
    ],
)
def test_panels_show_trajectories_in_the_papers_colors(number, left, right):
    figure = draw_figure(number, RUNS, PARTITION, "light")
    for axes, name in zip(figure.axes, (left, right), strict=True):
        (lines,) = [c for c in axes.collections if isinstance(c, LineCollection)]
        assert lines.get_segments()[2] == pytest.approx(RUNS[name].record.positions[:, 2])
        assert {to_rgb(c) for c in lines.get_colors()} == {to_plot_color(LIGHT.trajectory)}
    texts = [text.get_text() for text in figure.texts]
    assert f"(a)  {RUNS[left].record.label}" in texts and f"(b)  {RUNS[right].record.label}" in texts
    for name in (left, right):
        assert f"mean distance {RUNS[name].history.mean_distance[-1]:.3f} m" in texts
    assert len({axes.get_position().height for axes in figure.axes}) == 1


@pytest.mark.parametrize(
    ("number", "case", "other"), [(3, "convex", "lloyd"), (5, "a", "rpf"), (7, "b", "rpf")]
)
def test_cost_figures_have_a_curve_for_each_controller(number, case, other):
    figure = draw_figure(number, RUNS, PARTITION, "light")
    (axes,) = figure.axes
    curves = [line for line in axes.lines if len(line.get_xdata()) == 121]
    for line, controller in zip(curves, ("rapf", other), strict=True):
        assert np.asarray(line.get_ydata()) == pytest.approx(
            RUNS[f"{case}/{controller}"].history.mean_distance
        )
        assert to_rgb(line.get_color()) == to_plot_color(LIGHT.controllers[controller])
    figure.canvas.draw()
    for text in (*axes.texts, axes.xaxis.label, axes.yaxis.label):
        box = text.get_window_extent()
        assert box.x0 >= 0 and box.x1 <= WIDE_PX and box.y0 >= 0 and box.y1 <= 1050


def test_the_legend_names_centroids_only_if_some_are_visible():
    def list_labels(runs):
        (legend,) = draw_figure(2, runs, PARTITION, "light").legends
        return [text.get_text() for text in legend.get_texts()]

    def replace_goals(compute_goals):
        return {
            name: FigureRun(replace(run.record, goals=compute_goals(run.record)), run.history)
            for name, run in RUNS.items()
        }

    assert "cell centroid" in list_labels(RUNS)
    arrived = list_labels(replace_goals(lambda record: record.positions))
    assert not {"cell centroid", "goal"} & set(arrived)
    runs = replace_goals(lambda record: record.positions + 1.0)
    assert "goal" in list_labels(runs)  # These goals are no centroids.
