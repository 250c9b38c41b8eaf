"""Pareto plots of the page: the front, the choice of points, and the placement of labels."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg

from robocov_app.benchmark.page import pareto_plots
from robocov_app.benchmark.page.label_placement import place_labels
from robocov_app.benchmark.page.pareto_plots import (
    ParetoPoint,
    draw_pareto_figure,
    find_pareto_front,
    thin_out_equal_values,
)
from robocov_app.look.curve_styles import choose_curve_styles

LABELED_POINTS = st.tuples(st.floats(100, 500), st.floats(80, 280), st.text("abcde", min_size=3, max_size=16))


@given(st.lists(LABELED_POINTS, min_size=2, max_size=4))
def test_labels_of_a_few_points_do_not_overlap(given_points: list[tuple[float, float, str]]) -> None:
    marks = np.array([(x, y) for x, y, _ in given_points])
    labels = [label for _, _, label in given_points]
    centers = place_labels(marks, labels, (0.0, 0.0, 600.0, 360.0), np.empty((0, 2)))
    half_sizes = np.array([(3.0 * len(label), 6.5) for label in labels])
    for k, j in combinations(range(len(labels)), 2):
        gaps = np.abs(centers[k] - centers[j]) - half_sizes[k] - half_sizes[j]
        assert gaps.max() > -1e-6


@pytest.mark.parametrize("line", [[(100, 180), (500, 180)], [(300, 80), (300, 180), (500, 280)]])
def test_labels_do_not_cross_a_line_through_their_marks(line: list[tuple[int, int]]) -> None:
    marks = np.array([(300.0, 180.0), (400.0, 230.0)])
    labels = ["Atlas", "Greedy submodular"]
    centers = place_labels(marks, labels, (0.0, 0.0, 600.0, 360.0), np.array(line, dtype=float))
    for mark, center, label in zip(marks, centers, labels, strict=True):
        half_size = np.array((3.0 * len(label), 6.5))
        box = shapely.box(*(center - half_size + 2.0), *(center + half_size - 2.0))
        assert not box.intersects(shapely.LineString(line))
        assert box.distance(shapely.Point(mark)) < 30.0


def test_labels_are_next_to_the_marks_of_a_figure() -> None:
    style = choose_curve_styles(["rapf"])[0]
    points = [
        ParetoPoint(style, "Near", x=1200.0, gap=30.0, is_rival=True),
        ParetoPoint(style, "Far", x=3800.0, gap=0.5, is_rival=True),
    ]
    figure = draw_pareto_figure(points, "bytes")
    (axes,) = figure.axes
    FigureCanvasAgg(figure).draw()
    for point, text in zip(points, axes.texts, strict=True):
        assert text.get_text() == point.label
        mark = axes.transData.transform((point.x, point.gap))
        box = text.get_window_extent()
        distance = np.linalg.norm(np.clip(mark, box.min, box.max) - mark)
        assert distance < 20.0
        assert axes.bbox.contains(*box.min) and axes.bbox.contains(*box.max)


def test_of_many_equal_values_only_the_smallest_gaps_are_drawn() -> None:
    style = choose_curve_styles(["rapf"])[0]
    equal = [
        ParetoPoint(style, f"{gap}", 1200.0, gap, is_rival=gap > 2.0) for gap in (5.0, 4.0, 3.0, 2.0, 1.0)
    ]
    other = ParetoPoint(style, "other", 1210.0, 9.0, is_rival=True)
    drawn, omitted = thin_out_equal_values([*equal, other])
    assert [point.label for point in drawn] == ["3.0", "1.0", "other"]
    assert [point.label for point in omitted] == ["2.0", "4.0", "5.0"]
    assert thin_out_equal_values([*equal[1:], other]) == ([*equal[1:], other], [])
    # No result from a file replaces a bundled one.
    bundled = ParetoPoint(style, "bundled", 1200.0, 6.0, is_rival=True, is_bundled=True)
    drawn, _ = thin_out_equal_values([*equal, bundled, other])
    assert [point.label for point in drawn] == ["3.0", "1.0", "bundled", "other"]


def test_omitted_points_are_named_with_the_value_by_which_they_were_grouped() -> None:
    style = choose_curve_styles(["rapf"])[0]
    values = {"a": 1200.0, "b": 1201.0, "c": 1202.0, "d": 1203.0, "e": 1204.0}
    equal = [ParetoPoint(style, label, x, 1.0, is_rival=True) for label, x in values.items()]
    _, omitted = thin_out_equal_values(equal)
    assert pareto_plots._describe_omitted_points(omitted, []) == (
        "Not drawn, because the gap of another controller with the same value (1200) is no larger: "
        "b; c; d; e."
    )


def test_points_at_zero_on_a_logarithmic_axis_are_named() -> None:
    style = choose_curve_styles(["rapf"])[0]
    points = [ParetoPoint(style, f"{x:g}", x, 1.0, is_rival=True) for x in (0.0, 1.0, 9.0)]
    drawn, zeros = pareto_plots._split_zeros(points)
    assert [point.label for point in drawn] == ["1", "9"] and [point.label for point in zeros] == ["0"]
    assert pareto_plots._split_zeros(points[:2]) == (points[:2], [])


def test_files_change_neither_the_front_nor_the_marks_of_bundled_results() -> None:
    style = choose_curve_styles(["rapf"])[0]
    bundled = [
        ParetoPoint(style, "Short", 5.0, 20.0, is_rival=True, is_bundled=True),
        ParetoPoint(style, "Good", 9.0, 3.0, is_rival=True, is_bundled=True),
    ]
    files = [
        ParetoPoint(style, "Better*", 4.0, 1.0, is_rival=True),
        ParetoPoint(style, "Same*", 9.0, 3.0, is_rival=True),
    ]
    lines = draw_pareto_figure([*bundled, *files], "bytes").axes[0].lines
    # The first line is the front. Marks that are drawn later cover others.
    points = [line.get_xydata().tolist() for line in lines]
    assert points[0] == [[5.0, 20.0], [9.0, 3.0]]
    assert points[1:] == [[[4.0, 1.0]], [[9.0, 3.0]], [[5.0, 20.0]], [[9.0, 3.0]]]
    assert draw_pareto_figure(files, "bytes").axes[0].lines[0].get_xydata().tolist() == [[4.0, 1.0]]


def test_files_with_equal_values_do_not_remove_bundled_results() -> None:
    style = choose_curve_styles(["rapf"])[0]
    bundled = [
        ParetoPoint(style, f"{gap}", 1200.0, gap, is_rival=True, is_bundled=True) for gap in (1.0, 2.0)
    ]
    files = [ParetoPoint(style, f"{gap}*", 1200.0, gap, is_rival=True) for gap in (0.1, 0.2, 0.3)]
    drawn, omitted = thin_out_equal_values([*bundled, *files])
    assert [point.label for point in drawn] == ["1.0", "2.0", "0.1*"]
    assert [point.label for point in omitted] == ["0.2*", "0.3*"]


@pytest.mark.parametrize("x", [5.0, 40.0, 72.0, 400.0])
@pytest.mark.parametrize("bundled_values", [(10.0, 18.0), (17.0, 18.0), (10.0, 12.0, 90.0)])
def test_bundled_results_fill_a_large_part_of_the_axis(x: float, bundled_values: Sequence[float]) -> None:
    """Bundled values with a ratio below 2 are treated as if the ratio were 2."""
    style = choose_curve_styles(["rapf"])[0]
    points = [ParetoPoint(style, "b", value, 1.0, is_rival=True, is_bundled=True) for value in bundled_values]
    points.append(ParetoPoint(style, "file", x, 1.0, is_rival=True))
    drawn, _ = pareto_plots._split_outliers(points)
    assert drawn[: len(bundled_values)] == points[:-1]
    (axes,) = draw_pareto_figure(drawn, "m").axes
    low = min(*bundled_values, max(bundled_values) / 2.0)
    ends = axes.transData.transform([(low, 1.0), (max(bundled_values), 1.0)])[:, 0]
    assert ends[1] - ends[0] > 0.3 * axes.bbox.width


@pytest.mark.parametrize(("x", "is_drawn"), [(0.01, False), (5.0, True), (12.0, True)])
def test_a_bundled_value_of_zero_fills_no_part_of_a_logarithmic_axis(x: float, is_drawn: bool) -> None:
    style = choose_curve_styles(["rapf"])[0]
    points = [
        ParetoPoint(style, "b", value, 1.0, is_rival=True, is_bundled=True) for value in (0.0, 10.0, 18.0)
    ]
    file_point = ParetoPoint(style, "file", x, 1.0, is_rival=True)
    drawn, outliers = pareto_plots._split_outliers([*points, file_point])
    assert (file_point in drawn) == is_drawn
    assert (file_point in outliers) == (not is_drawn)
    assert drawn[: len(points)] == points


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=1, max_size=12))
def test_no_point_dominates_the_pareto_front(points: list[tuple[int, int]]) -> None:
    front = {points[k] for k in find_pareto_front(points)}
    dominated = set()
    for x, y in points:
        if any(u <= x and v <= y and (u, v) != (x, y) for u, v in points):
            dominated.add((x, y))
    assert front == set(points) - dominated
