"""Rows of boxes and points."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.figures.files import plain_style
from robocov_app.figures.results import MOST_POINTS, draw_box, laid_rows, ratio_limits, rows_page
from robocov_app.look.curve_styles import choose_controller_styles
from robocov_app.look.theme import LIGHT

STYLE = choose_controller_styles(["rapf"])["rapf"]


def axes_of(rows=1.0):
    with plain_style():
        return rows_page(rows, ["name"], LIGHT, 420, 1.0)[0]


@given(st.lists(st.tuples(st.sampled_from(["", "a map"]), st.integers(1, 5)), min_size=1, max_size=6))
def test_rows_and_headings_do_not_overlap(groups) -> None:
    places, heads, total = laid_rows(groups)
    assert len(places) == sum(count for _, count in groups)
    taken = sorted([*places, *(head for (name, _), head in zip(groups, heads, strict=True) if name)])
    assert all(after - before > 0.8 for before, after in pairwise(taken))
    assert places[-1] == pytest.approx(total - 0.5) and taken[0] > 0.3


def test_a_page_is_as_high_as_its_rows() -> None:
    low, high = (axes_of(rows).figure.bbox.height for rows in (2.0, 7.0))
    assert high - low == pytest.approx(5 * 30, abs=1.5)


def test_a_box_has_quartiles_median_and_whiskers() -> None:
    values = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 20.0])
    axes = axes_of()
    draw_box(axes, values, 0.5, STYLE, LIGHT)
    (box,) = axes.patches
    corners = box.get_xy()[:, 0]
    assert (corners.min(), corners.max()) == pytest.approx(tuple(np.percentile(values, [25, 75])))
    points, left, right, median = axes.lines
    assert sorted(points.get_xdata()) == values.tolist()
    assert left.get_xdata()[0] == 1.0
    assert right.get_xdata()[1] == 5.0  # 20 is farther than 1.5 boxes away
    assert median.get_xdata()[0] == pytest.approx(3.5)


def test_few_values_have_no_box() -> None:
    axes = axes_of()
    draw_box(axes, np.array([1.0, 2.0]), 0.5, STYLE, LIGHT)
    assert not axes.patches and len(axes.lines) == 2
    alone = axes_of()
    draw_box(alone, np.array([1.0]), 0.5, STYLE, LIGHT)
    assert len(alone.lines) == 1


def test_of_very_many_values_some_points_are_drawn() -> None:
    axes = axes_of()
    draw_box(axes, np.linspace(0.0, 1.0, 5000), 0.5, STYLE, LIGHT)
    drawn = axes.lines[0].get_xdata()
    assert len(drawn) == MOST_POINTS
    assert (drawn[0], drawn[-1]) == (0.0, 1.0)


@given(st.lists(st.floats(1e-3, 1e4), min_size=1, max_size=8))
def test_an_axis_of_ratios_shows_all_of_them_and_one(ratios) -> None:
    axes = axes_of()
    ratio_limits(axes, np.array(ratios), LIGHT)
    low, high = axes.get_xlim()
    assert low < min(*ratios, 1.0) and high > max(*ratios, 1.0)
    marks = axes.get_xticks()
    assert 1.0 in marks and len(marks) <= 16
