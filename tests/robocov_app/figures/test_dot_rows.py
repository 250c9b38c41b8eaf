"""Rows of points and boxes, and axes of ratios."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes

from robocov_app.figures.dot_rows import MAX_POINTS, arrange_rows, create_row_axes
from robocov_app.figures.files import plain_style
from robocov_app.figures.final_values import Sample, plot_final_values
from robocov_app.figures.page import ValueAxis
from robocov_app.figures.pairs import set_ratio_axis
from robocov_app.look.curve_styles import choose_controller_styles
from robocov_app.look.theme import LIGHT

STYLE = choose_controller_styles(["rapf"])["rapf"]


def create_axes(rows: float = 1.0) -> Axes:
    """Return axes that are as high as some rows."""
    with plain_style():
        axes, _ = create_row_axes(rows, ["name"], LIGHT, width=420, scale=1.0)
    return axes


def plot_sample(values: np.ndarray) -> Axes:
    """Return axes with one row; the last of their lines is the mark of the controller."""
    samples = [Sample("name", STYLE, values)]
    return plot_final_values([("", samples)], ValueAxis("distance (m)"), width=420, scale=1.0).axes[0]


groups_of_rows = st.lists(
    st.tuples(st.sampled_from(["", "a map"]), st.integers(1, 5)), min_size=1, max_size=6
)
"""Heading (or none) and number of rows of each group."""


@given(groups_of_rows)
def test_rows_and_headings_do_not_overlap(groups: list[tuple[str, int]]) -> None:
    rows, headings, _ = arrange_rows(groups)
    pairs = zip(groups, headings, strict=True)
    written_headings = [height for (heading, _), height in pairs if heading]
    heights = sorted([*rows, *written_headings])
    assert all(below - above > 0.8 for above, below in pairwise(heights))
    assert heights[0] > 0.3


@given(groups_of_rows)
def test_each_row_has_a_height_and_the_last_one_is_at_the_end(groups: list[tuple[str, int]]) -> None:
    rows, _, total = arrange_rows(groups)
    assert len(rows) == sum(n_rows for _, n_rows in groups)
    assert rows[-1] == pytest.approx(total - 0.5)


def test_the_page_grows_with_the_number_of_rows() -> None:
    height_of_2_rows = create_axes(2.0).figure.bbox.height
    height_of_7_rows = create_axes(7.0).figure.bbox.height
    row_height_px = 30
    assert height_of_7_rows - height_of_2_rows == pytest.approx(5 * row_height_px, abs=1.5)


def test_a_box_has_quartiles_median_and_whiskers() -> None:
    """The value 20 is an outlier, since it is more than 1.5 interquartile ranges above the box."""
    values = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 20.0])
    axes = plot_sample(values)
    (box,) = axes.patches
    box_x = box.get_xy()[:, 0]
    points, left_whisker, right_whisker, median, _ = axes.lines
    assert (box_x.min(), box_x.max()) == pytest.approx(tuple(np.percentile(values, [25, 75])))
    assert sorted(points.get_xdata()) == values.tolist()
    assert left_whisker.get_xdata()[0] == 1.0
    assert right_whisker.get_xdata()[1] == 5.0
    assert median.get_xdata()[0] == pytest.approx(3.5)


@pytest.mark.parametrize(
    ("values", "n_lines"),
    [
        pytest.param([1.0, 2.0], 2, id="points and median"),
        pytest.param([1.0], 1, id="point"),
        pytest.param([np.nan], 0, id="no value"),
    ],
)
def test_few_values_have_no_box(values: list[float], n_lines: int) -> None:
    axes = plot_sample(np.array(values))
    assert not axes.patches
    *lines, _ = axes.lines
    assert len(lines) == n_lines


def test_only_some_of_very_many_values_are_drawn() -> None:
    axes = plot_sample(np.linspace(0.0, 1.0, 5000))
    points = axes.lines[0].get_xdata()
    assert len(points) == MAX_POINTS
    assert (points[0], points[-1]) == (0.0, 1.0)


@given(st.lists(st.floats(1e-3, 1e4), min_size=1, max_size=8))
def test_an_axis_of_ratios_contains_all_ratios_and_one(ratios: list[float]) -> None:
    axes = create_axes()
    set_ratio_axis(axes, np.array(ratios), LIGHT)
    low, high = axes.get_xlim()
    assert low < min(*ratios, 1.0)
    assert high > max(*ratios, 1.0)


@given(st.lists(st.floats(1e-3, 1e4), min_size=1, max_size=8))
def test_an_axis_of_ratios_has_few_ticks_and_one_at_one(ratios: list[float]) -> None:
    axes = create_axes()
    set_ratio_axis(axes, np.array(ratios), LIGHT)
    ticks = axes.get_xticks()
    assert 1.0 in ticks
    assert len(ticks) <= 16
