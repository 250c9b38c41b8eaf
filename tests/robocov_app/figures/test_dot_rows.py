"""Rows of boxes and points."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes

from robocov_app.figures.dot_rows import MAX_POINTS, arrange_rows, create_row_axes
from robocov_app.figures.files import plain_style
from robocov_app.figures.final_costs import draw_box
from robocov_app.figures.pairs import set_ratio_axis
from robocov_app.look.curve_styles import choose_controller_styles
from robocov_app.look.theme import LIGHT

STYLE = choose_controller_styles(["rapf"])["rapf"]


def create_axes(rows: float = 1.0) -> Axes:
    """Return axes with some rows."""
    with plain_style():
        axes, _ = create_row_axes(rows, ["name"], LIGHT, width=420, scale=1.0)
    return axes


@given(st.lists(st.tuples(st.sampled_from(["", "a map"]), st.integers(1, 5)), min_size=1, max_size=6))
def test_rows_and_headings_do_not_overlap(groups: list[tuple[str, int]]) -> None:
    rows, headings, total = arrange_rows(groups)
    assert len(rows) == sum(count for _, count in groups)
    pairs = zip(groups, headings, strict=True)
    written_headings = [heading for (name, _), heading in pairs if name]
    heights = sorted([*rows, *written_headings])
    assert all(after - before > 0.8 for before, after in pairwise(heights))
    assert rows[-1] == pytest.approx(total - 0.5)
    assert heights[0] > 0.3


def test_a_page_is_as_high_as_its_rows() -> None:
    low = create_axes(2.0).figure.bbox.height
    high = create_axes(7.0).figure.bbox.height
    assert high - low == pytest.approx(5 * 30, abs=1.5)


def test_a_box_has_quartiles_median_and_whiskers() -> None:
    values = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 20.0])
    axes = create_axes()
    draw_box(axes, values, 0.5, STYLE, LIGHT)
    (box,) = axes.patches
    corners = box.get_xy()[:, 0]
    assert (corners.min(), corners.max()) == pytest.approx(tuple(np.percentile(values, [25, 75])))
    points, left, right, median = axes.lines
    assert sorted(points.get_xdata()) == values.tolist()
    assert left.get_xdata()[0] == 1.0
    assert right.get_xdata()[1] == 5.0  # 20 is more than 1.5 lengths of the box away.
    assert median.get_xdata()[0] == pytest.approx(3.5)


def test_few_values_have_no_box() -> None:
    axes = create_axes()
    draw_box(axes, np.array([1.0, 2.0]), 0.5, STYLE, LIGHT)
    assert not axes.patches and len(axes.lines) == 2
    axes = create_axes()
    draw_box(axes, np.array([1.0]), 0.5, STYLE, LIGHT)
    assert len(axes.lines) == 1


def test_only_some_of_very_many_values_are_drawn() -> None:
    axes = create_axes()
    draw_box(axes, np.linspace(0.0, 1.0, 5000), 0.5, STYLE, LIGHT)
    x = axes.lines[0].get_xdata()
    assert len(x) == MAX_POINTS
    assert (x[0], x[-1]) == (0.0, 1.0)


@given(st.lists(st.floats(1e-3, 1e4), min_size=1, max_size=8))
def test_an_axis_of_ratios_shows_all_ratios_and_one(ratios: list[float]) -> None:
    axes = create_axes()
    set_ratio_axis(axes, np.array(ratios), LIGHT)
    low, high = axes.get_xlim()
    assert low < min(*ratios, 1.0) and high > max(*ratios, 1.0)
    ticks = axes.get_xticks()
    assert 1.0 in ticks
    assert len(ticks) <= 16
