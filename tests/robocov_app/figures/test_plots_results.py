"""Plots of many runs: bands of cost, final costs and ratios of pairs."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from page_layout import assert_layout_is_clear

from robocov_app.figures.cost_bands import Band, compute_quartiles, plot_cost_bands
from robocov_app.figures.curves import CurveMargins, TimeCurve, add_curve_axes, draw_curves
from robocov_app.figures.final_values import Sample, plot_final_values
from robocov_app.figures.page import FigurePage, ValueAxis, get_figure, to_plot_color
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
RATIOS = SAMPLES[0].values / SAMPLES[1].values
PAIRS = Pairs("RAPF / RPF", choose_style("rapf"), RATIOS, bootstrap(RATIOS))


def plot_bands(bands: list[Band], size: tuple[int, int] = (860, 360), unit: str = "m") -> Figure:
    return plot_cost_bands(bands, size, ValueAxis("distance (m)", unit))


def plot_boxes(groups: list[tuple[str, list[Sample]]], width: int = 420) -> Axes:
    return plot_final_values(groups, ValueAxis("distance (m)"), width=width, scale=1.0).axes[0]


def plot_ratios(pairs: Pairs) -> Axes:
    return plot_pairs([pairs], "ratio", width=420, scale=1.0).axes[0]


def list_curve_lines(axes: Axes) -> list[Line2D]:
    """Return the lines of medians, without their end marks."""
    return [line for line in axes.lines if len(line.get_xdata()) == len(TIME)]


def list_points(axes: Axes) -> list[Line2D]:
    """Return the points of each sample."""
    return [line for line in axes.lines if line.get_marker() == "o" and line.get_clip_on()]


def assert_texts_end_on_page(figure: Figure) -> None:
    """Check that no text of the first axes is cut off at the right."""
    renderer = figure.canvas.get_renderer()
    for text in figure.axes[0].texts:
        assert text.get_window_extent(renderer).x1 <= figure.bbox.x1 + 0.5


class TestBands:
    def test_a_band_reaches_from_the_first_quartile_to_the_third(self) -> None:
        axes = plot_bands(BANDS[:2]).axes[0]
        for band, collection in zip(BANDS[:2], axes.collections, strict=True):
            corners = collection.get_paths()[0].vertices
            y_at_end = corners[corners[:, 0] == TIME[-1], 1]
            quartiles = np.percentile(band.values[:, -1], [25, 75])
            assert (y_at_end.min(), y_at_end.max()) == pytest.approx(tuple(quartiles))

    def test_more_than_two_bands_are_bars_between_the_quartiles(self) -> None:
        axes = plot_bands(BANDS).axes[0]
        assert all(isinstance(collection, LineCollection) for collection in axes.collections)
        for band, bars in zip(BANDS, axes.collections, strict=True):
            low, high = np.percentile(band.values, [25, 75], axis=0)
            for (time, start), (_, end) in bars.get_segments():
                assert start == pytest.approx(np.interp(time, TIME, low))
                assert end == pytest.approx(np.interp(time, TIME, high))

    def test_bars_of_different_bands_are_at_different_times(self) -> None:
        axes = plot_bands(BANDS).axes[0]
        times = [bar[0, 0] for bars in axes.collections for bar in bars.get_segments()]
        assert np.diff(np.sort(times)).min() > 1.0

    def test_the_line_of_a_band_is_the_median(self) -> None:
        lines = list_curve_lines(plot_bands(BANDS).axes[0])
        for band, line in zip(BANDS, lines, strict=True):
            assert line.get_ydata() == pytest.approx(np.median(band.values, axis=0))

    def test_the_axes_contain_all_bands(self) -> None:
        low, high = plot_bands(BANDS).axes[0].get_ylim()
        for band in BANDS:
            assert low <= np.percentile(band.values, 25, axis=0).min()
            assert high >= np.percentile(band.values, 75, axis=0).max()

    def test_a_single_run_is_a_line_without_a_band(self) -> None:
        axes = plot_bands([build_band("RAPF", "rapf", 2.0, runs=1)]).axes[0]
        assert list_curve_lines(axes)
        assert not axes.collections

    def test_labels_have_the_final_median(self) -> None:
        axes = plot_bands(BANDS, unit="m").axes[0]
        labels = {text.get_text() for text in axes.texts}
        assert labels == {f"{band.label}  {np.median(band.values[:, -1]):.3f} m" for band in BANDS}

    @pytest.mark.parametrize("size", [(420, 290), (860, 360)])
    def test_bands_and_labels_fit_on_the_page(self, size: tuple[int, int]) -> None:
        figure = plot_bands(BANDS, size)
        assert_layout_is_clear(figure)
        assert_texts_end_on_page(figure)

    @pytest.mark.parametrize("size", [(420, 290), (860, 360)])
    def test_long_names_are_shortened_but_values_are_not(self, size: tuple[int, int]) -> None:
        long_name = "TheControllerOfSomebodyWhoLikesLongNames" * 2
        figure = plot_bands([BANDS[0]._replace(label=long_name), BANDS[1]], size)
        long_label, short_label = (text.get_text() for text in figure.axes[0].texts)
        assert short_label.startswith("RPF  ")
        assert re.fullmatch(r"TheCon.*…  [\d.]+ m", long_label)
        assert_texts_end_on_page(figure)


class TestStyles:
    def test_controllers_of_the_paper_have_their_colors(self) -> None:
        styles = choose_controller_styles(["rpf", "mine", "rapf", "other", "mine"])
        assert styles["rapf"].get_color(LIGHT) == LIGHT.controllers["rapf"]

    def test_custom_controllers_have_further_colors_in_their_order(self) -> None:
        styles = choose_controller_styles(["rpf", "mine", "rapf", "other", "mine"])
        assert styles["mine"].get_color(DARK) == DARK.others[0]
        assert styles["other"].get_color(LIGHT) == LIGHT.others[1]

    def test_controllers_have_the_same_colors_in_all_plots(self) -> None:
        expected = to_plot_color(LIGHT.controllers["rpf"])
        for axes in (plot_bands(BANDS).axes[0], plot_boxes([("", SAMPLES)])):
            assert expected in {line.get_color() for line in axes.lines}

    @pytest.mark.parametrize(
        "controllers", [["rapf"] * 6, ["mine", "rapf", "mine", "rpf", "rapf", "mine"]], ids=["equal", "mixed"]
    )
    def test_curves_of_one_controller_differ_in_color_dashes_and_mark(self, controllers: list[str]) -> None:
        styles = choose_curve_styles(controllers)
        for values in zip(*styles, strict=True):
            assert len({str(value) for value in values}) == len(controllers)
        for theme in (LIGHT, DARK):
            assert len({style.get_color(theme) for style in styles}) == len(controllers)

    @given(st.lists(st.sampled_from(["rapf", "lloyd", "mine", "other"]), max_size=8))
    def test_eight_curves_have_different_styles(self, controllers: list[str]) -> None:
        styles = choose_curve_styles(controllers)
        assert len(set(styles)) == len(controllers)

    @given(st.lists(st.sampled_from(["rapf", "lloyd", "mine", "other"]), max_size=8))
    def test_the_first_curve_of_a_controller_has_its_style(self, controllers: list[str]) -> None:
        styles = choose_curve_styles(controllers)
        for name, style in choose_controller_styles(controllers).items():
            assert styles[controllers.index(name)] == style


class TestFinalCosts:
    @pytest.mark.parametrize("width", [420, 860])
    def test_each_value_of_a_sample_is_a_point(self, width: int) -> None:
        axes = plot_boxes([("Rooms", SAMPLES), ("Museum", SAMPLES[:2])], width)
        points = [sorted(line.get_xdata()) for line in list_points(axes)]
        assert points == [sorted(sample.values) for sample in [*SAMPLES, *SAMPLES[:2]]]

    @pytest.mark.parametrize("width", [420, 860])
    def test_groups_have_headings(self, width: int) -> None:
        axes = plot_boxes([("Rooms", SAMPLES), ("Museum", SAMPLES[:2])], width)
        assert {text.get_text() for text in axes.texts} == {"Rooms", "Museum"}

    @pytest.mark.parametrize("width", [420, 860])
    def test_texts_fit_on_a_page_of_the_requested_width(self, width: int) -> None:
        axes = plot_boxes([("Rooms", SAMPLES), ("Museum", SAMPLES[:2])], width)
        figure = get_figure(axes)
        assert figure.bbox.width == pytest.approx(width, abs=0.1)
        renderer = figure.canvas.get_renderer()
        for text in [*axes.texts, *axes.get_yticklabels()]:
            assert text.get_window_extent(renderer).x0 >= -0.5

    def test_values_that_are_not_finite_are_not_drawn(self) -> None:
        sample = Sample("RAPF", choose_style("rapf"), np.array([1.0, np.nan, 3.0]))
        axes = plot_boxes([("", [sample])])
        assert axes.lines[0].get_xdata().tolist() == [1.0, 3.0]


def test_quartiles_are_those_of_finite_values() -> None:
    """The second column has no finite value."""
    values = np.array([[1.0, np.nan], [3.0, np.nan], [np.inf, np.nan]])
    quartiles = np.array(compute_quartiles(values))
    assert quartiles[:, 0].tolist() == [1.5, 2.0, 2.5]
    assert np.isnan(quartiles[:, 1]).all()


class TestPairs:
    def test_pairs_have_their_confidence_interval(self) -> None:
        axes = plot_ratios(PAIRS)
        spans = [tuple(line.get_xdata()) for line in axes.lines]
        assert (PAIRS.interval.low, PAIRS.interval.high) in spans

    def test_ratios_have_a_logarithmic_axis_with_a_line_at_one(self) -> None:
        axes = plot_ratios(PAIRS)
        assert axes.get_xscale() == "log"
        assert (1.0, 1.0) in [tuple(line.get_xdata()) for line in axes.lines]

    @pytest.mark.parametrize("controller", ["rapf", "mine"])
    def test_pairs_have_the_color_of_their_style(self, controller: str) -> None:
        style = choose_style(controller)
        (points,) = list_points(plot_ratios(PAIRS._replace(style=style)))
        assert points.get_color() == to_plot_color(style.get_color(LIGHT))

    def test_a_single_pair_has_no_interval(self) -> None:
        pairs = Pairs("RAPF / RPF", choose_style("rapf"), np.array([0.5]), bootstrap([0.5]))
        for line in plot_ratios(pairs).lines:
            assert np.isfinite(np.asarray(line.get_xdata(), dtype=float)).all()


def test_a_curve_without_finite_values_is_not_drawn() -> None:
    curves = [
        TimeCurve("RAPF", "rapf", TIME, np.full_like(TIME, 2.0)),
        TimeCurve("RPF", "rpf", TIME, np.full_like(TIME, np.nan)),
    ]
    page = FigurePage((600, 400), LIGHT)
    axes = add_curve_axes(page, curves, CurveMargins(left=30, top=30, bottom=30, right=30))
    draw_curves(axes, curves, LIGHT)
    assert [text.get_text() for text in axes.texts] == ["RAPF  2.000 m"]


def test_curves_without_any_finite_value_have_empty_axes() -> None:
    curves = [TimeCurve("RAPF", "rapf", TIME, np.full_like(TIME, np.nan))]
    page = FigurePage((600, 400), LIGHT)
    axes = add_curve_axes(page, curves, CurveMargins(left=30, top=30, bottom=30, right=30))
    draw_curves(axes, curves, LIGHT)
    assert not axes.lines
    low, high = axes.get_ylim()
    assert low == 0.0 < high
