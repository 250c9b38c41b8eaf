"""Outlines drawn with the mouse."""

import pytest

from robocov_app.toolkit.tools.drawn_outline import DrawnOutline


def press_points(outline: DrawnOutline, *points: tuple[float, float]) -> list[bool]:
    return [outline.press(point, point, 0.2) for point in points]


def test_a_repeated_point_completes_a_line():
    outline = DrawnOutline()
    assert press_points(outline, (0, 0), (0, 0), (1, 0), (1, 0)) == [False, False, False, True]
    assert outline.take_points() == [(0, 0), (1, 0)]
    assert outline.points == []


def test_the_first_point_completes_a_ring():
    outline = DrawnOutline(min_points=3, can_close=True)
    assert press_points(outline, (0, 0), (1, 0), (0, 0.1), (0.1, 0)) == [False, False, False, True]
    assert len(outline.take_points()) == 3


@pytest.mark.parametrize(("to", "clicked", "ended"), [
    ((3, 0), False, True),
    ((0.1, 0), False, False),
    ((3, 0), True, False),
])  # fmt: skip
def test_a_long_drag_completes_a_line(to, clicked, ended):
    outline = DrawnOutline(can_drag=True)
    press_points(outline, (0, 0))
    assert outline.is_dragging
    assert outline.release(to, to, 0.5, clicked=clicked) == ended
    assert not outline.is_dragging
    assert not outline.release(to, to, 0.5)


def test_a_rectangle_is_complete_after_two_points():
    outline = DrawnOutline(max_points=2, can_drag=True)
    assert press_points(outline, (0, 0)) == [False]
    assert outline.release((0.1, 0), (0.1, 0), 0.5)
    assert outline.take_points() == [(0, 0), (0.1, 0)]
    assert press_points(outline, (0, 0), (1, 1)) == [False, True]
    assert outline.cancel()
    assert not outline.cancel()
