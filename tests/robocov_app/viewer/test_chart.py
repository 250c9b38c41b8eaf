"""Chart of the costs: times and columns, colors of curves, events."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from driven_window import Driver, open_viewer
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.render.canvas import Canvas
from robocov_app.viewer.chart.curves import (
    GhostLine,
    find_nearest_ghost,
    map_curve_colors,
    simplify_points,
)
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.window.screen_video import copy_pixels


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[Driver]:
    with open_viewer(tmp_path, ControllerChoice("rapf"), ControllerChoice("rpf")) as opened_driver:
        yield opened_driver


def play(driver: Driver, frames: int = 60) -> None:
    driver.session.playback.is_playing = True
    driver.run_frames(frames)
    driver.session.playback.is_playing = False
    driver.run_frames(8)


def test_a_paused_window_is_not_called_live(driver: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn_texts: list[str] = []
    draw_text = Canvas.draw_text

    def draw_and_list(canvas: Canvas, text: str, *args: Any, **kwargs: Any) -> int:
        drawn_texts.append(text)
        return draw_text(canvas, text, *args, **kwargs)

    monkeypatch.setattr(Canvas, "draw_text", draw_and_list)
    for is_playing, expected, other in ((True, "Live", "Paused"), (False, "Paused", "Live")):
        driver.session.playback.is_playing = is_playing
        drawn_texts.clear()
        driver.window.chart.draw(driver.window.screen)
        assert expected in drawn_texts
        assert other not in drawn_texts


@pytest.mark.parametrize("width", [480, 900])
def test_times_do_not_overlap_in_a_narrow_chart(
    tmp_path: Path, width: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    ends: list[tuple[float, float]] = []
    draw_text = Canvas.draw_text

    def draw_and_list(canvas: Canvas, text: str, position: Any, **options: Any) -> int:
        width = draw_text(canvas, text, position, **options)
        if options.get("anchor") == "middle":
            ends.append((position[0] - width / 2, position[0] + width / 2))
        return width

    monkeypatch.setattr(Canvas, "draw_text", draw_and_list)
    with open_viewer(tmp_path, size=(width, 1200), scale=3.0) as driver:
        driver.viewer.view.has_panel = False
        driver.settle()
        ends.clear()
        driver.window.chart._image = None
        driver.run_frames(1)
    assert ends
    assert all(left[1] <= right[0] for left, right in pairwise(ends))


def test_columns_correspond_to_times(driver: Driver) -> None:
    play(driver)
    chart = driver.window.chart
    for time in (0.0, 0.3, driver.session.timeline.end_time):
        assert chart.to_time(chart.to_column(time)) == pytest.approx(time, abs=1e-9)
    assert chart.to_time(-100.0) == 0.0
    assert chart.to_time(1e5) == driver.session.timeline.end_time


def test_curves_are_drawn_in_the_colors_of_their_controllers(driver: Driver) -> None:
    play(driver)
    window = driver.window
    left, top, width, height = window.layout.chart
    picture = copy_pixels(window.screen)[top : top + height, left : left + width].astype(int)
    for pane in driver.session.timeline.panes:
        color = np.array(map_curve_colors(driver.session.timeline.panes, window.theme)[pane.number])
        assert (np.abs(picture - color).max(axis=2) < 12).sum() > 20, pane.controller.name


def test_panes_with_equal_controllers_have_different_colors(tmp_path: Path) -> None:
    with open_viewer(
        tmp_path,
        ControllerChoice("rapf"),
        ControllerChoice("rapf", {"k_rep": 1.0}),
        ControllerChoice("rpf"),
        ControllerChoice("rpf"),
    ) as driver:
        colors = set(map_curve_colors(driver.session.timeline.panes, driver.window.theme).values())
        assert len(colors) == 4


def test_an_event_is_drawn_at_its_time(driver: Driver) -> None:
    play(driver)
    window = driver.window
    before = copy_pixels(window.screen).copy()
    driver.viewer.attempt(lambda: driver.session.fail_robot(1))
    driver.run_frames(8)
    after = copy_pixels(window.screen)
    column = round(window.chart.to_column(driver.session.timeline.end_time))
    _, top, _, height = window.layout.chart
    middle = top + height // 2
    changed = np.abs(after[middle].astype(int) - before[middle]).max(axis=1)
    assert changed[column - 2 : column + 3].max() > 20
    assert changed[: column - 60].max() == 0


def test_values_are_compared_at_a_time_that_all_curves_contain(driver: Driver) -> None:
    play(driver)
    first, second = driver.session.timeline.panes
    last = first.distance_curve.last_time
    values = {pane.number: pane.distance_curve.values[-1] for pane in (first, second)}
    second.distance_curve.add(last + 0.01, 99.0)
    driver.session.timeline.run.step += 60
    time, costs = driver.session.displayed.get_costs()
    assert time == last
    assert costs == pytest.approx(values)


def test_values_of_the_past_are_shown_at_once(driver: Driver) -> None:
    play(driver, 100)
    _, top, width, height = driver.window.layout.chart
    live = copy_pixels(driver.window.screen)[top : top + height, width - 150 : width].copy()
    # 1.0 equals True, which must not be taken for an unchanged key of the page.
    driver.session.show_time(1.0)
    assert driver.session.displayed.time == 1.0
    assert not driver.session.timeline.is_live
    driver.run_frames(1)
    assert not np.array_equal(
        copy_pixels(driver.window.screen)[top : top + height, width - 150 : width], live
    )


def test_the_curve_of_a_branch_is_found_between_its_samples() -> None:
    ghosts = [
        GhostLine(3, np.array([[0.0, 0.0], [100.0, 0.0]])),
        GhostLine(5, np.array([[0.0, 20.0], [100.0, 20.0]])),
    ]
    assert find_nearest_ghost(ghosts, np.array([50.0, 4.0]), reach=6.0) == 3
    assert find_nearest_ghost(ghosts, np.array([50.0, 17.0]), reach=6.0) == 5
    assert find_nearest_ghost(ghosts, np.array([50.0, 10.0]), reach=6.0) is None
    assert find_nearest_ghost([], np.array([50.0, 10.0]), reach=6.0) is None


def test_points_on_straight_sections_are_left_out() -> None:
    """Segments of a curve overlap at their ends, which would be visible as dots."""
    x = np.arange(100.0)
    y = np.where(x < 50.0, 20.0, 20.0 + (x - 50.0))
    points = simplify_points(np.column_stack([x, y]))
    assert points.tolist() == [[0.0, 20.0], [50.0, 20.0], [99.0, 69.0]]


@given(st.lists(st.floats(0.0, 100.0), min_size=2, max_size=60))
def test_a_simplified_curve_differs_by_less_than_a_pixel(rows: list[float]) -> None:
    columns = 3.0 * np.arange(len(rows))
    points = simplify_points(np.column_stack([columns, rows]))
    assert points[0].tolist() == [columns[0], rows[0]]
    assert points[-1].tolist() == [columns[-1], rows[-1]]
    line = shapely.LineString(points)
    distances = shapely.distance(line, shapely.points(columns, rows))
    assert distances.max() < 0.25
