"""Plots of degradations under disturbances, and of gaps."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from robocov_app.figures.final_values import Sample
from robocov_app.figures.statistics import Interval
from robocov_app.look.curve_styles import choose_curve_styles
from robocov_app.look.theme import LIGHT
from robocov_app.replication.figures.comparison_plots import draw_gaps
from robocov_app.replication.figures.degradation_plot import draw_degradations
from robocov_app.replication.results.study_results import Degradation


def build_degradations() -> list[Degradation]:
    rows = []
    for axis, values in (
        ("loss", (0.0, 0.5)),
        ("communication_range", (None, 2.0)),
        ("failure_rate", (0.0, 0.1)),
    ):
        for k, value in enumerate(values):
            for name, label in (("rapf", "RAPF"), ("lloyd", "Lloyd")):
                ratio = Interval(1.0 + 0.2 * k, 1.0, 1.0 + 0.4 * k)
                rows.append(Degradation(axis, value, name, label, ratio, 6))
    return rows


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_each_disturbance_has_a_panel_and_each_controller_a_curve(theme: str) -> None:
    figure = draw_degradations(build_degradations(), theme=theme)
    panels = figure.axes
    assert [axes.get_title(loc="left") for axes in panels] == [
        "Message loss",
        "Communication range (m)",
        "Failure rate (1/s)",
    ]
    assert [text.get_text() for text in panels[1].get_xticklabels()] == ["no limit", "2"]
    assert {text.get_text() for text in figure.legends[0].get_texts()} == {"RAPF", "Lloyd"}
    for axes in panels:
        marked = [line for line in axes.lines if line.get_marker() in ("o", "^")]
        assert len(marked) == 2
        np.testing.assert_allclose(marked[0].get_ydata(), [1.0, 1.2])
        low, high = axes.get_ylim()
        assert low < 1.0
        assert high > 1.4
    # The panels do not overlap.
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    boxes = [axes.get_tightbbox(renderer) for axes in panels]
    assert not any(first.overlaps(second) for first, second in combinations(boxes, 2))
    assert all(box.x0 >= 0 and box.x1 <= figure.bbox.x1 for box in boxes)


def test_degradations_without_a_ratio_are_left_out() -> None:
    unknown = Interval(float("nan"), float("nan"), float("nan"))
    rows = [replace(row, ratio=unknown) if row.value == 0.1 else row for row in build_degradations()]
    figure = draw_degradations(rows)
    assert figure.axes[2].get_ylim() == figure.axes[0].get_ylim()


def test_gaps_below_the_reference_are_shown_with_the_reference() -> None:
    (style,) = choose_curve_styles(["rapf"])
    (axes,) = draw_gaps([Sample("RAPF", style, np.array([-1.0, -0.5]))], LIGHT).axes
    low, high = axes.get_xlim()
    assert low < -1.0
    assert high == 0.0
    assert axes.get_xticks().tolist() == [0.0]
