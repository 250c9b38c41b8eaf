"""Plots of what a result depends on."""

import numpy as np
import pytest
from matplotlib.axes import Axes

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
from robocov_app.look.theme import DARK, HEAT_LEVELS, LIGHT

GAINS = np.repeat([0.1, 0.3, 1.0, 3.0, np.nan], 4)
VALUES = np.arange(20.0)


def draw_axes(gains: np.ndarray, values: np.ndarray, gain: str) -> Axes:
    style = choose_controller_styles(["rapf"])["rapf"]
    return plot_gains([GainResults("RAPF", style, gains, values)], gain, (420, 290), "cost").axes[0]


def get_texts(ticks) -> list[str]:
    return [tick.get_text() for tick in ticks]


def test_no_limit_has_a_tick_at_the_right_end() -> None:
    axes = draw_axes(GAINS, VALUES, "attraction_limit (N)")
    assert axes.get_xscale() == "log"
    assert get_texts(axes.get_xticklabels()) == ["0.1", "0.3", "1", "3", "none"]
    points, medians = axes.lines
    assert len(points.get_xdata()) == 20 and np.isfinite(points.get_xdata()).all()
    assert medians.get_ydata().tolist() == [np.median(VALUES[k : k + 4]) for k in range(0, 20, 4)]
    assert points.get_xdata().max() == axes.get_xticks()[-1] > 3.0


@pytest.mark.parametrize(
    ("gains", "scale"), [([1.0, 2.0, 3.0], "linear"), ([0.0, 1.0, 100.0], "linear"), ([1.0, 30.0], "log")]
)
def test_the_axis_of_a_wide_range_is_logarithmic(gains, scale) -> None:
    axes = draw_axes(np.array(gains), np.ones(len(gains)), "k")
    assert axes.get_xscale() == scale
    low, high = axes.get_xlim()
    assert low < min(gains) and high > max(gains)


def test_a_sampled_range_has_points_without_medians() -> None:
    gains = np.geomspace(0.01, 10.0, 3 * MAX_LEVELS)
    axes = draw_axes(gains, np.ones(len(gains)), "k")
    assert not [line for line in axes.lines if line.get_linestyle() not in ("None", "none")]
    assert len(axes.get_xticks()) <= 8


def test_only_some_of_very_many_runs_are_drawn() -> None:
    count = 5 * MAX_DRAWN_RUNS
    axes = draw_axes(np.resize([1.0, 2.0], count), np.ones(count), "k")
    assert len(axes.lines[0].get_xdata()) <= MAX_DRAWN_RUNS


def test_a_grid_has_its_numbers_and_the_lowest_is_bold() -> None:
    values = np.array([[1.25, 2.5], [np.nan, 0.5]])
    grid = GainGrid("k_rep", "limit", [0.1, 1.0], [2.0, None], values)
    axes = plot_gain_grid(grid, (420, 290)).axes[0]
    assert sorted(get_texts(axes.texts)) == ["0.50", "1.25", "2.50"]
    assert [text.get_text() for text in axes.texts if text.get_fontweight() == "bold"] == ["0.50"]
    assert len(axes.patches) == 3
    assert get_texts(axes.get_yticklabels()) == ["2", "none"]


def test_numbers_of_a_grid_show_small_differences() -> None:
    values = np.array([[1.0, 1.001, 1.002]])
    grid = GainGrid("a", "b", [1.0, 2.0, 3.0], [1.0], values)
    axes = plot_gain_grid(grid, (420, 290)).axes[0]
    assert len(set(get_texts(axes.texts))) == 3


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_text_is_legible_on_all_colors_of_a_grid(theme) -> None:
    colors = theme.muted_heat
    assert len(colors) == len(set(colors)) == HEAT_LEVELS
    assert min(compute_contrast(theme.ink, color) for color in colors) >= 4.5
