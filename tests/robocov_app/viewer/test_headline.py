"""The large number next to the chart, the area that is cut off, and branches under the pointer."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pygame
import pytest
from driven_window import Driver, open_viewer
from sample_sessions import RPF

from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import measure_text
from robocov_app.viewer.chart.captions import _HEADLINE_LEFT_PX, HEADLINE_TEXT_PX
from robocov_app.viewer.window.status import MIN_UNCOVERED_AREA_M2, describe_cut_off


@pytest.fixture
def drawn_texts(monkeypatch: pytest.MonkeyPatch) -> dict[str, float]:
    """Size of each text that canvases draw during the test."""
    sizes: dict[str, float] = {}
    draw_text = Canvas.draw_text

    def draw_and_list(canvas: Canvas, text: str, *args: object, **kwargs: object) -> float:
        sizes[text] = float(kwargs.get("size") or 0.0)  # type: ignore[arg-type]
        return draw_text(canvas, text, *args, **kwargs)  # type: ignore[arg-type]

    monkeypatch.setattr(Canvas, "draw_text", draw_and_list)
    return sizes


def set_cut_off_area(driver: Driver, monkeypatch: pytest.MonkeyPatch, area: float) -> None:
    answer = SimpleNamespace(result=SimpleNamespace(uncovered_area=area))
    known = {pane.number: answer for pane in driver.session.timeline.panes}
    monkeypatch.setattr(driver.viewer.costs, "known", known)


def test_the_mean_distance_is_a_large_number_with_its_unit(
    driver: Driver, drawn_texts: dict[str, float]
) -> None:
    driver.run_frames(2)
    drawn_texts.clear()
    driver.window.chart.draw(driver.window.screen)
    value = driver.session.timeline.panes[0].distance_curve.values[-1]
    assert drawn_texts[f"{value:.3f} m"] == HEADLINE_TEXT_PX


@pytest.mark.parametrize("value", [2.5, 12.392, 88.888, 888.888])
def test_the_large_number_ends_within_the_chart(
    driver: Driver, drawn_texts: dict[str, float], value: float
) -> None:
    driver.run_frames(2)
    displayed = driver.session.displayed
    pane = driver.session.timeline.panes[0]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(displayed), "get_costs", lambda self, name: (0.0, {pane.number: value}))
        drawn_texts.clear()
        driver.window.chart.draw(driver.window.screen)
    (number,) = [text for text, size in drawn_texts.items() if size == HEADLINE_TEXT_PX]
    assert float(number.removesuffix(" m")) == pytest.approx(value, abs=0.5)
    frame = driver.window.chart._frame
    left = frame.times.right + _HEADLINE_LEFT_PX * frame.scale
    width = measure_text(number, round(HEADLINE_TEXT_PX * frame.scale), bold=True)
    assert left + width <= driver.window.layout.chart.width


@pytest.mark.parametrize("pane_count", [1, 2])
def test_the_area_that_is_cut_off_is_written_next_to_the_number(
    driver: Driver, drawn_texts: dict[str, float], monkeypatch: pytest.MonkeyPatch, pane_count: int
) -> None:
    if pane_count > 1:
        driver.session.add_pane(RPF)
    driver.run_frames(3)
    set_cut_off_area(driver, monkeypatch, 2.44)
    drawn_texts.clear()
    driver.window.chart.draw(driver.window.screen)
    assert "without 2.4 m² cut off" in " ".join(drawn_texts)
    set_cut_off_area(driver, monkeypatch, 0.9 * MIN_UNCOVERED_AREA_M2)
    drawn_texts.clear()
    driver.window.chart.draw(driver.window.screen)
    assert not any("cut off" in text for text in drawn_texts)
    assert describe_cut_off(driver.viewer, driver.session.timeline.panes[0]) == ""


@pytest.mark.parametrize(("scale", "is_phone"), [(1.0, False), (2.31, True)], ids=["computer", "phone"])
def test_the_whole_note_about_the_cut_off_area_is_in_the_window(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    scale: float,
    is_phone: bool,
) -> None:
    boxes: dict[str, pygame.Rect] = {}
    draw_text = Canvas.draw_text

    def draw_and_list(canvas: Canvas, text: str, position: tuple[float, float], **kwargs: Any) -> int:
        width = draw_text(canvas, text, position, **kwargs)
        boxes[text] = pygame.Rect(round(position[0]), round(position[1]), width, 0)
        return width

    with open_viewer(tmp_path, size=(900, 1828), scale=scale) as driver:
        driver.viewer.view.is_compact = is_phone
        driver.viewer.view.has_panel = not is_phone
        driver.run_frames(3)
        set_cut_off_area(driver, monkeypatch, 1234.5)
        monkeypatch.setattr(Canvas, "draw_text", draw_and_list)
        driver.window.chart.draw(driver.window.screen)
        chart = driver.window.layout.chart
    note_boxes = [box for text, box in boxes.items() if text in "without 1234.5 m² cut off"]
    assert len(note_boxes) >= 2
    visible = pygame.Rect(0, 0, chart.width, chart.height)
    assert all(visible.contains(box) for box in note_boxes)


def test_a_branch_is_described_under_the_pointer_only(driver: Driver) -> None:
    driver.session.playback.is_playing = True
    driver.run_frames(60)
    driver.viewer.attempt(lambda: driver.session.fail_robot(1))
    driver.run_frames(60)
    driver.press_key("ctrl+z")
    driver.session.playback.is_playing = False
    driver.run_frames(10)
    chart = driver.window.chart
    chart.draw(driver.window.screen)
    assert chart.ghosts
    x, y = chart.ghosts[0].points[-2]
    pixel = (round(x), round(y + driver.window.layout.chart.top))
    description = chart._describe_branch(pixel)
    assert "RAPF" in description
    assert "Click" in description
    assert chart._describe_branch((pixel[0], pixel[1] - 40)) == ""
