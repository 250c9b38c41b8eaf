"""Plots of many runs together."""

import numpy as np
import pytest
from clear_pages import all_clear
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robocov_app.figures.page import figure_of, tone
from robocov_app.figures.results import (
    Band,
    Pairs,
    Sample,
    compute_quartiles,
    plot_cost_bands,
    plot_final_costs,
    plot_pairs,
)
from robocov_app.figures.statistics import bootstrap
from robocov_app.look.curve_styles import CurveStyle, choose_controller_styles, choose_curve_styles
from robocov_app.look.theme import DARK, LIGHT

RNG = np.random.default_rng(3)
TIME = np.linspace(0.0, 30.0, 31)


def style(controller: str) -> CurveStyle:
    return choose_controller_styles([controller])[controller]


def band(label: str, controller: str, final: float, runs: int = 9) -> Band:
    ends = final + RNG.normal(0.0, 0.1, (runs, 1))
    return Band(label, style(controller), TIME, ends + (6.0 - ends) * np.exp(-TIME / 5.0))


BANDS = [band("RAPF", "rapf", 2.0), band("RPF", "rpf", 4.0), band("Mine", "mine.py:Mine", 2.1)]
SAMPLES = [
    Sample("RAPF", style("rapf"), RNG.normal(2.0, 0.2, 30)),
    Sample("RPF", style("rpf"), RNG.normal(4.0, 0.6, 30)),
    Sample("A law with a name that is far too long for any plot", style("mine"), RNG.normal(3.0, 0.6, 3)),
]
PAIRS = [
    Pairs("RAPF / RPF", style("rapf"), a / b, bootstrap(a / b))
    for a, b in [(SAMPLES[0].values, SAMPLES[1].values)]
]


def figure_with(bands: list[Band], size: tuple[int, int] = (860, 360), unit: str = "m") -> Figure:
    return plot_cost_bands(bands, size, "distance (m)", unit)


def boxes(rows: list[tuple[str, list[Sample]]], width: int = 420) -> Axes:
    return plot_final_costs(rows, "distance (m)", width, 1.0).axes[0]


def paired(pairs: list[Pairs]) -> Axes:
    return plot_pairs(pairs, "ratio", 420, 1.0).axes[0]


def test_a_band_reaches_from_the_first_quartile_to_the_third() -> None:
    axes = figure_with(BANDS).axes[0]
    assert len(axes.collections) == 3
    for each, drawn in zip(BANDS, axes.collections, strict=True):
        corners = drawn.get_paths()[0].vertices
        last = np.sort(corners[corners[:, 0] == TIME[-1], 1])
        assert (last[0], last[-1]) == pytest.approx(tuple(np.percentile(each.values[:, -1], [25, 75])))
    lines = [line for line in axes.lines if len(line.get_xdata()) == len(TIME)]
    for each, line in zip(BANDS, lines, strict=True):
        assert line.get_ydata() == pytest.approx(np.median(each.values, axis=0))
    low, high = axes.get_ylim()
    assert low <= min(np.percentile(each.values, 25, axis=0).min() for each in BANDS)
    assert high >= max(np.percentile(each.values, 75, axis=0).max() for each in BANDS)


def test_a_single_run_is_a_line_without_a_band() -> None:
    axes = figure_with([band("RAPF", "rapf", 2.0, runs=1)]).axes[0]
    assert not axes.collections


def test_labels_tell_the_median_at_the_end() -> None:
    axes = figure_with(BANDS, unit="m").axes[0]
    said = {text.get_text() for text in axes.texts}
    assert said == {f"{each.label}  {np.median(each.values[:, -1]):.3f} m" for each in BANDS}


@pytest.mark.parametrize("size", [(420, 290), (860, 360)])
def test_bands_are_drawn_on_a_page_without_anything_cut(size) -> None:
    figure = figure_with(BANDS, size)
    all_clear(figure)
    renderer = figure.canvas.get_renderer()
    for text in figure.axes[0].texts:
        assert text.get_window_extent(renderer).x1 <= figure.bbox.x1 + 0.5


@pytest.mark.parametrize("size", [(860, 360), (420, 290)])
def test_names_that_are_too_long_are_cut_and_values_are_not(size) -> None:
    long = BANDS[0]._replace(label="TheControllerOfSomebodyWhoLikesLongNames" * 2)
    figure = figure_with([long, BANDS[1]], size)
    renderer = figure.canvas.get_renderer()
    cut, whole = figure.axes[0].texts
    assert whole.get_text().startswith("RPF  ")
    assert cut.get_text().startswith("TheCon") and "…  " in cut.get_text() and cut.get_text().endswith(" m")
    for text in (cut, whole):
        assert text.get_window_extent(renderer).x1 <= figure.bbox.x1 + 0.5


def test_controllers_keep_their_colors_in_all_plots() -> None:
    known = choose_controller_styles(["rpf", "mine", "rapf", "other", "mine"])
    assert known["rapf"].get_color(LIGHT) == LIGHT.controllers["rapf"]
    assert known["mine"].get_color(DARK) == DARK.others[0]
    assert known["other"].get_color(LIGHT) == LIGHT.others[1]
    for axes in (figure_with(BANDS).axes[0], boxes([("", SAMPLES)])):
        assert tone(LIGHT.controllers["rpf"]) in {line.get_color() for line in axes.lines}


@pytest.mark.parametrize("controllers", [["rapf"] * 6, ["mine", "rapf", "mine", "rpf", "rapf", "mine"]])
def test_gains_of_one_controller_differ_in_color_dashes_and_mark(controllers) -> None:
    styles = choose_curve_styles(controllers)
    for part in zip(*styles, strict=True):
        assert len(set(map(str, part))) == len(controllers)
    for theme in (LIGHT, DARK):
        assert len({style.get_color(theme) for style in styles}) == len(controllers)


@given(st.lists(st.sampled_from(["rapf", "lloyd", "mine", "other"]), max_size=8))
def test_no_two_of_eight_curves_have_one_style(controllers) -> None:
    styles = choose_curve_styles(controllers)
    assert len(set(styles)) == len(controllers)
    for name, style in choose_controller_styles(controllers).items():
        assert styles[controllers.index(name)] == style


@pytest.mark.parametrize("width", [420, 860])
def test_every_value_of_a_sample_is_a_point(width) -> None:
    axes = boxes([("Rooms", SAMPLES), ("Museum", SAMPLES[:2])], width)
    figure = figure_of(axes)
    points = [line for line in axes.lines if line.get_marker() == "o" and line.get_clip_on()]
    values = [*SAMPLES, *SAMPLES[:2]]
    assert [sorted(line.get_xdata()) for line in points] == [sorted(each.values) for each in values]
    assert {text.get_text() for text in axes.texts} == {"Rooms", "Museum"}
    assert figure.bbox.width == pytest.approx(width, abs=0.1)
    renderer = figure.canvas.get_renderer()
    for text in [*axes.texts, *axes.get_yticklabels()]:
        assert text.get_window_extent(renderer).x0 >= -0.5


def test_what_is_not_finite_is_left_out() -> None:
    axes = boxes([("", [Sample("RAPF", style("rapf"), np.array([1.0, np.nan, 3.0]))])])
    assert axes.lines[0].get_xdata().tolist() == [1.0, 3.0]
    low, middle, high = compute_quartiles(np.array([[1.0, np.nan], [3.0, np.nan], [np.inf, np.nan]]))
    assert (low[0], middle[0], high[0]) == (1.5, 2.0, 2.5)
    assert np.isnan([low[1], middle[1], high[1]]).all()


def test_pairs_have_their_interval_and_one_is_marked() -> None:
    axes = paired(PAIRS)
    ratio = PAIRS[0].interval
    spans = [tuple(line.get_xdata()) for line in axes.lines]
    assert (ratio.low, ratio.high) in spans
    assert any(span == (1.0, 1.0) for span in spans)
    assert axes.get_xscale() == "log"


def test_pairs_have_the_color_of_their_style() -> None:
    mine = style("mine")
    for each, color in (
        (PAIRS[0], LIGHT.controllers["rapf"]),
        (PAIRS[0]._replace(style=mine), mine.get_color(LIGHT)),
    ):
        (points,) = (line for line in paired([each]).lines if line.get_marker() == "o" and line.get_clip_on())
        assert points.get_color() == tone(color)


def test_a_single_pair_has_no_interval() -> None:
    alone = Pairs("RAPF / RPF", style("rapf"), np.array([0.5]), bootstrap([0.5]))
    axes = paired([alone])
    assert all(np.isfinite(np.asarray(line.get_xdata(), dtype=float)).all() for line in axes.lines)
