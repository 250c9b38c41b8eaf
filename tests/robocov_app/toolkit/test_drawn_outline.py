"""Outlines drawn with the mouse."""

import pytest

from robocov_app.toolkit.drawn_outline import DrawnOutline


def press_points(outline: DrawnOutline, *points: tuple[float, float]) -> list[bool]:
    return [outline.press(point, point, 0.2) for point in points]


def test_points_are_pressed_one_by_one_until_one_is_pressed_again():
    outline = DrawnOutline()
    assert press_points(outline, (0, 0), (0, 0), (1, 0), (1, 0)) == [False, False, False, True]
    assert outline.take_points() == [(0, 0), (1, 0)] and outline.points == []


def test_a_ring_ends_at_its_first_point_once_it_has_enough():
    outline = DrawnOutline(min_points=3, closes=True)
    assert press_points(outline, (0, 0), (1, 0), (0, 0.1), (0.1, 0)) == [False, False, False, True]
    assert len(outline.take_points()) == 3


@pytest.mark.parametrize(("to", "clicked", "ended"), [
    ((3, 0), False, True),
    ((0.1, 0), False, False),
    ((3, 0), True, False),
])  # fmt: skip
def test_a_drag_ends_it_where_the_hand_did_not_just_shake(to, clicked, ended):
    outline = DrawnOutline(drags=True)
    press_points(outline, (0, 0))
    assert outline.is_dragging and outline.release(to, to, 0.5, clicked=clicked) == ended
    assert not outline.is_dragging and not outline.release(to, to, 0.5)


def test_two_points_are_all_that_a_rectangle_takes():
    outline = DrawnOutline(max_points=2, drags=True)
    assert press_points(outline, (0, 0)) == [False] and outline.release((0.1, 0), (0.1, 0), 0.5)
    assert outline.take_points() == [(0, 0), (0.1, 0)]
    assert press_points(outline, (0, 0), (1, 1)) == [False, True]
    assert outline.cancel() and not outline.cancel()
