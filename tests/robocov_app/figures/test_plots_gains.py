"""Plots of results against gains."""

from collections.abc import Iterable

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.text import Text

from robocov_app.figures.gains import (
    MAX_DRAWN_RUNS,
    MAX_LEVELS,
    GainGrid,
    GainResults,
    plot_gain_grid,
    plot_gains,
)
from robocov_app.look.colors import compute_contrast
from robocov_app.look.curve_styles import choose_controller_styles
from robocov_app.look.theme import DARK, HEAT_LEVELS, LIGHT, Theme

GAINS = np.repeat([0.1, 0.3, 1.0, 3.0, np.nan], 4)
VALUES = np.arange(20.0)


def plot_results(gains: list[float] | np.ndarray, values: np.ndarray) -> Axes:
    """Return the axes of a plot of one controller's results, with a gain and a value for each run."""
    style = choose_controller_styles(["rapf"])["rapf"]
    results = GainResults("RAPF", style, np.array(gains), values)
    return plot_gains([results], "attraction_limit (N)", (420, 290), "cost").axes[0]


def get_texts(texts: Iterable[Text]) -> list[str]:
    return [text.get_text() for text in texts]


def test_runs_without_a_limit_are_at_the_right_end() -> None:
    axes = plot_results(GAINS, VALUES)
    assert get_texts(axes.get_xticklabels()) == ["0.1", "0.3", "1", "3", "no limit"]
    points = axes.lines[0].get_xdata()
    assert np.isfinite(points).all()
    assert points.max() == axes.get_xticks()[-1]
    assert points.max() > 3.0


def test_each_run_is_a_point_and_each_gain_has_a_median() -> None:
    axes = plot_results(GAINS, VALUES)
    points, medians = axes.lines
    assert len(points.get_xdata()) == len(VALUES)
    assert medians.get_ydata().tolist() == np.median(VALUES.reshape(5, 4), axis=1).tolist()


@pytest.mark.parametrize(
    ("gains", "scale"),
    [
        pytest.param([1.0, 2.0, 3.0], "linear", id="narrow"),
        pytest.param([0.0, 1.0, 100.0], "linear", id="with zero"),
        pytest.param([1.0, 30.0], "log", id="wide"),
        pytest.param(GAINS, "log", id="wide with none"),
    ],
)
def test_the_axis_of_a_wide_positive_range_is_logarithmic(
    gains: list[float] | np.ndarray, scale: str
) -> None:
    axes = plot_results(gains, np.ones(len(gains)))
    assert axes.get_xscale() == scale


@pytest.mark.parametrize("gains", [[1.0, 2.0, 3.0], [0.0, 1.0, 100.0], [1.0, 30.0]], ids=repr)
def test_the_axis_contains_all_gains(gains: list[float]) -> None:
    axes = plot_results(gains, np.ones(len(gains)))
    low, high = axes.get_xlim()
    assert low < min(gains)
    assert high > max(gains)


def test_many_different_gains_have_points_but_no_medians() -> None:
    gains = np.geomspace(0.01, 10.0, 3 * MAX_LEVELS)
    axes = plot_results(gains, np.ones(len(gains)))
    assert all(line.get_linestyle() in ("None", "none") for line in axes.lines)
    assert len(axes.get_xticks()) <= 8


def test_only_some_of_very_many_runs_are_drawn() -> None:
    n_runs = 5 * MAX_DRAWN_RUNS
    axes = plot_results(np.resize([1.0, 2.0], n_runs), np.ones(n_runs))
    assert len(axes.lines[0].get_xdata()) <= MAX_DRAWN_RUNS


class TestGrid:
    @pytest.fixture
    def axes(self) -> Axes:
        """A grid of two gains, of which the second may be unlimited, with one missing result."""
        values = np.array([[1.25, 2.5], [np.nan, 0.5]])
        grid = GainGrid("k_rep", "limit", [0.1, 1.0], [2.0, None], values)
        return plot_gain_grid(grid, (420, 290)).axes[0]

    def test_each_result_is_a_colored_field_with_its_number(self, axes: Axes) -> None:
        assert sorted(get_texts(axes.texts)) == ["0.50", "1.25", "2.50"]
        assert len(axes.patches) == 3

    def test_only_the_lowest_number_is_bold(self, axes: Axes) -> None:
        bold_texts = [text for text in axes.texts if text.get_fontweight() == "bold"]
        assert get_texts(bold_texts) == ["0.50"]

    def test_an_unlimited_gain_is_labeled_none(self, axes: Axes) -> None:
        assert get_texts(axes.get_yticklabels()) == ["2", "none"]

    def test_numbers_have_enough_digits_to_differ(self) -> None:
        values = np.array([[1.0, 1.001, 1.002]])
        grid = GainGrid("a", "b", [1.0, 2.0, 3.0], [1.0], values)
        axes = plot_gain_grid(grid, (420, 290)).axes[0]
        assert len(set(get_texts(axes.texts))) == 3

    @pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
    def test_colors_differ_and_text_is_legible_on_them(self, theme: Theme) -> None:
        colors = theme.muted_heat
        assert len(colors) == HEAT_LEVELS
        assert len(set(colors)) == HEAT_LEVELS
        assert min(compute_contrast(theme.ink, color) for color in colors) >= 4.5
