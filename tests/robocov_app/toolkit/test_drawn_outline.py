"""Outlines drawn with the mouse."""

import pytest

from robocov_app.toolkit.tools.drawn_outline import DrawnOutline

CLICK_REACH_M = 0.2
"""Distance within which a press hits a point."""
DRAG_REACH_M = 0.5
"""Distance within which a release still belongs to a press."""


def press_points(outline: DrawnOutline, *points: tuple[float, float]) -> list[bool]:
    """Press at points, and return whether each press completed the outline."""
    return [outline.press(point, point, CLICK_REACH_M) for point in points]


def test_a_repeated_point_completes_a_line() -> None:
    outline = DrawnOutline()
    assert press_points(outline, (0, 0), (0, 0), (1, 0), (1, 0)) == [False, False, False, True]
    assert outline.take_points() == [(0, 0), (1, 0)]


def test_points_are_taken_once() -> None:
    outline = DrawnOutline()
    press_points(outline, (0, 0), (1, 0), (1, 0))
    outline.take_points()
    assert outline.points == []


def test_the_first_point_completes_a_ring() -> None:
    outline = DrawnOutline(min_points=3, can_close=True)
    assert press_points(outline, (0, 0), (1, 0), (0, 0.1), (0.1, 0)) == [False, False, False, True]
    assert len(outline.take_points()) == 3


@pytest.mark.parametrize(
    ("point", "is_click", "is_complete"),
    [
        pytest.param((3, 0), False, True, id="long drag"),
        pytest.param((0.1, 0), False, False, id="short drag"),
        pytest.param((3, 0), True, False, id="click"),
    ],
)
def test_only_a_long_drag_completes_a_line(
    point: tuple[float, float], is_click: bool, is_complete: bool
) -> None:
    outline = DrawnOutline(can_drag=True)
    press_points(outline, (0, 0))
    assert outline.is_dragging
    assert outline.release(point, point, DRAG_REACH_M, is_click=is_click) == is_complete
    assert not outline.is_dragging


def test_a_second_release_completes_nothing() -> None:
    outline = DrawnOutline(can_drag=True)
    press_points(outline, (0, 0))
    outline.release((3, 0), (3, 0), DRAG_REACH_M)
    assert not outline.release((3, 0), (3, 0), DRAG_REACH_M)


def test_a_short_drag_completes_a_rectangle() -> None:
    outline = DrawnOutline(max_points=2, can_drag=True)
    assert press_points(outline, (0, 0)) == [False]
    assert outline.release((0.1, 0), (0.1, 0), DRAG_REACH_M)
    assert outline.take_points() == [(0, 0), (0.1, 0)]


def test_two_presses_complete_a_rectangle() -> None:
    outline = DrawnOutline(max_points=2, can_drag=True)
    assert press_points(outline, (0, 0), (1, 1)) == [False, True]


def test_an_outline_is_cancelled_once() -> None:
    outline = DrawnOutline(max_points=2, can_drag=True)
    press_points(outline, (0, 0), (1, 1))
    assert outline.cancel()
    assert not outline.cancel()
