"""Plots of many runs together."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from page_layout import assert_layout_is_clear

from robocov_app.figures.cost_bands import Band, compute_quartiles, plot_cost_bands
from robocov_app.figures.final_costs import Sample, plot_final_costs
from robocov_app.figures.page import get_figure, to_plot_color
from robocov_app.figures.pairs import Pairs, plot_pairs
from robocov_app.figures.statistics import bootstrap
from robocov_app.look.curve_styles import CurveStyle, choose_controller_styles, choose_curve_styles
from robocov_app.look.theme import DARK, LIGHT

RNG = np.random.default_rng(3)
TIME = np.linspace(0.0, 30.0, 31)


def choose_style(controller: str) -> CurveStyle:
    return choose_controller_styles([controller])[controller]


def build_band(label: str, controller: str, final: float, runs: int = 9) -> Band:
    ends = final + RNG.normal(0.0, 0.1, (runs, 1))
    return Band(label, choose_style(controller), TIME, ends + (6.0 - ends) * np.exp(-TIME / 5.0))


BANDS = [
    build_band("RAPF", "rapf", 2.0),
    build_band("RPF", "rpf", 4.0),
    build_band("Mine", "mine.py:Mine", 2.1),
]
SAMPLES = [
    Sample("RAPF", choose_style("rapf"), RNG.normal(2.0, 0.2, 30)),
    Sample("RPF", choose_style("rpf"), RNG.normal(4.0, 0.6, 30)),
    Sample(
        "A controller with a name that is far too long for any plot",
        choose_style("mine"),
        RNG.normal(3.0, 0.6, 3),
    ),
]
PAIRS = [
    Pairs("RAPF / RPF", choose_style("rapf"), a / b, bootstrap(a / b))
    for a, b in [(SAMPLES[0].values, SAMPLES[1].values)]
]


def plot_bands(bands: list[Band], size: tuple[int, int] = (860, 360), unit: str = "m") -> Figure:
    return plot_cost_bands(bands, size, "distance (m)", unit)


def plot_boxes(groups: list[tuple[str, list[Sample]]], width: int = 420) -> Axes:
    return plot_final_costs(groups, "distance (m)", width=width, scale=1.0).axes[0]


def plot_ratios(pairs: list[Pairs]) -> Axes:
    return plot_pairs(pairs, "ratio", width=420, scale=1.0).axes[0]


def test_a_band_reaches_from_the_first_quartile_to_the_third() -> None:
    axes = plot_bands(BANDS).axes[0]
    assert len(axes.collections) == 3
    for band, collection in zip(BANDS, axes.collections, strict=True):
        corners = collection.get_paths()[0].vertices
        last = np.sort(corners[corners[:, 0] == TIME[-1], 1])
        assert (last[0], last[-1]) == pytest.approx(tuple(np.percentile(band.values[:, -1], [25, 75])))
    lines = [line for line in axes.lines if len(line.get_xdata()) == len(TIME)]
    for band, line in zip(BANDS, lines, strict=True):
        assert line.get_ydata() == pytest.approx(np.median(band.values, axis=0))
    low, high = axes.get_ylim()
    assert low <= min(np.percentile(band.values, 25, axis=0).min() for band in BANDS)
    assert high >= max(np.percentile(band.values, 75, axis=0).max() for band in BANDS)


def test_a_single_run_is_a_line_without_a_band() -> None:
    axes = plot_bands([build_band("RAPF", "rapf", 2.0, runs=1)]).axes[0]
    assert not axes.collections


def test_labels_have_the_final_median() -> None:
    axes = plot_bands(BANDS, unit="m").axes[0]
    labels = {text.get_text() for text in axes.texts}
    assert labels == {f"{band.label}  {np.median(band.values[:, -1]):.3f} m" for band in BANDS}


@pytest.mark.parametrize("size", [(420, 290), (860, 360)])
def test_bands_and_labels_fit_on_the_page(size) -> None:
    figure = plot_bands(BANDS, size)
    assert_layout_is_clear(figure)
    renderer = figure.canvas.get_renderer()
    for text in figure.axes[0].texts:
        assert text.get_window_extent(renderer).x1 <= figure.bbox.x1 + 0.5


@pytest.mark.parametrize("size", [(860, 360), (420, 290)])
def test_long_names_are_shortened_and_values_are_not(size) -> None:
    long_band = BANDS[0]._replace(label="TheControllerOfSomebodyWhoLikesLongNames" * 2)
    figure = plot_bands([long_band, BANDS[1]], size)
    renderer = figure.canvas.get_renderer()
    shortened, whole = figure.axes[0].texts
    assert whole.get_text().startswith("RPF  ")
    assert (
        shortened.get_text().startswith("TheCon")
        and "…  " in shortened.get_text()
        and shortened.get_text().endswith(" m")
    )
    for text in (shortened, whole):
        assert text.get_window_extent(renderer).x1 <= figure.bbox.x1 + 0.5


def test_controllers_keep_their_colors_in_all_plots() -> None:
    known = choose_controller_styles(["rpf", "mine", "rapf", "other", "mine"])
    assert known["rapf"].get_color(LIGHT) == LIGHT.controllers["rapf"]
    assert known["mine"].get_color(DARK) == DARK.others[0]
    assert known["other"].get_color(LIGHT) == LIGHT.others[1]
    for axes in (plot_bands(BANDS).axes[0], plot_boxes([("", SAMPLES)])):
        assert to_plot_color(LIGHT.controllers["rpf"]) in {line.get_color() for line in axes.lines}


@pytest.mark.parametrize("controllers", [["rapf"] * 6, ["mine", "rapf", "mine", "rpf", "rapf", "mine"]])
def test_gains_of_one_controller_differ_in_color_dashes_and_mark(controllers) -> None:
    styles = choose_curve_styles(controllers)
    for part in zip(*styles, strict=True):
        assert len(set(map(str, part))) == len(controllers)
    for theme in (LIGHT, DARK):
        assert len({style.get_color(theme) for style in styles}) == len(controllers)


@given(st.lists(st.sampled_from(["rapf", "lloyd", "mine", "other"]), max_size=8))
def test_eight_curves_have_different_styles(controllers) -> None:
    styles = choose_curve_styles(controllers)
    assert len(set(styles)) == len(controllers)
    for name, style in choose_controller_styles(controllers).items():
        assert styles[controllers.index(name)] == style


@pytest.mark.parametrize("width", [420, 860])
def test_every_value_of_a_sample_is_a_point(width) -> None:
    axes = plot_boxes([("Rooms", SAMPLES), ("Museum", SAMPLES[:2])], width)
    figure = get_figure(axes)
    points = [line for line in axes.lines if line.get_marker() == "o" and line.get_clip_on()]
    samples = [*SAMPLES, *SAMPLES[:2]]
    assert [sorted(line.get_xdata()) for line in points] == [sorted(sample.values) for sample in samples]
    assert {text.get_text() for text in axes.texts} == {"Rooms", "Museum"}
    assert figure.bbox.width == pytest.approx(width, abs=0.1)
    renderer = figure.canvas.get_renderer()
    for text in [*axes.texts, *axes.get_yticklabels()]:
        assert text.get_window_extent(renderer).x0 >= -0.5


def test_values_that_are_not_finite_are_left_out() -> None:
    axes = plot_boxes([("", [Sample("RAPF", choose_style("rapf"), np.array([1.0, np.nan, 3.0]))])])
    assert axes.lines[0].get_xdata().tolist() == [1.0, 3.0]
    low, middle, high = compute_quartiles(np.array([[1.0, np.nan], [3.0, np.nan], [np.inf, np.nan]]))
    assert (low[0], middle[0], high[0]) == (1.5, 2.0, 2.5)
    assert np.isnan([low[1], middle[1], high[1]]).all()


def test_pairs_have_their_interval_and_a_line_at_one() -> None:
    axes = plot_ratios(PAIRS)
    ratio = PAIRS[0].interval
    spans = [tuple(line.get_xdata()) for line in axes.lines]
    assert (ratio.low, ratio.high) in spans
    assert any(span == (1.0, 1.0) for span in spans)
    assert axes.get_xscale() == "log"


def test_pairs_have_the_color_of_their_style() -> None:
    mine = choose_style("mine")
    for each, color in (
        (PAIRS[0], LIGHT.controllers["rapf"]),
        (PAIRS[0]._replace(style=mine), mine.get_color(LIGHT)),
    ):
        (points,) = (
            line for line in plot_ratios([each]).lines if line.get_marker() == "o" and line.get_clip_on()
        )
        assert points.get_color() == to_plot_color(color)


def test_a_single_pair_has_no_interval() -> None:
    alone = Pairs("RAPF / RPF", choose_style("rapf"), np.array([0.5]), bootstrap([0.5]))
    axes = plot_ratios([alone])
    assert all(np.isfinite(np.asarray(line.get_xdata(), dtype=float)).all() for line in axes.lines)
