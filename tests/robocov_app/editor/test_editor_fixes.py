"""Fixes: a fix removes its problem and causes no other."""

from dataclasses import replace

import pytest
from drawn_sketches import HALL

from robocov.environment import CircleObstacle, DiscStart, PointsStart, PolygonObstacle, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.edits.fixes import FIXES, fill_unreachable, find_fix
from robocov_app.editor.model.measurement import measure
from robocov_app.editor.model.sketch import Sketch

BOX = ((2.0, 2.0), (6.0, 2.0), (6.0, 6.0), (2.0, 6.0))
BOW_TIE = PolygonObstacle(((1.0, 1.0), (3.0, 3.0), (3.0, 1.0), (1.0, 3.0)))


def build_hall(*shapes, starts=(), **others) -> Sketch:
    return replace(Sketch("Hall", boundary=HALL, starts=starts).with_obstacles(shapes)[0], **others)


def build_rooms(width: float) -> Sketch:
    """Return a hall that two walls part, with a door of a width between them."""
    middle = 4.0
    low = WallObstacle(((6.0, 0.0), (6.0, middle - width / 2)), 0.1)
    high = WallObstacle(((6.0, middle + width / 2), (6.0, 8.0)), 0.1)
    return build_hall(low, high)


@pytest.mark.parametrize(
    ("sketch", "kind", "words"),
    [
        (
            build_hall(CircleObstacle((3.0, 3.0), 1.0), boundary=None),
            "no boundary",
            "drawn around everything",
        ),
        (Sketch("Hall"), "no boundary", "boundary of 10 m × 10 m drawn"),
        (build_hall(BOW_TIE), "crossing", "1 outline repaired"),
        (build_hall(CircleObstacle((20.0, 3.0), 1.0, "lamp")), "outside", "circle “lamp” deleted"),
        (build_hall(*[CircleObstacle((5.0, 5.0), 1.0)] * 2), "twice", "circle deleted"),
        (build_hall(PolygonObstacle(((1.0, 1.0), *BOX[:1], *BOX))), "double", "polygon 1: vertices merged"),
        (build_hall(PolygonObstacle(BOX, (((3.0, 3.0), (5.0, 3.0), (5.0, 5.0)),))), "sealed", "filled"),
        (build_hall(PolygonObstacle(BOX, (((3.0, 3.0), (3.2, 3.0), (3.2, 3.2)),))), "sealed", "filled"),
        (build_rooms(0.3), "narrow", "wall 1 shortened by 0.1 m"),
        (
            build_hall(
                WallObstacle(((2.0, 5.0), (8.0, 5.0)), 0.2), WallObstacle(((2.0, 5.5), (8.0, 5.5)), 0.2)
            ),
            "narrow",
            "wall 1 moved by 0.1 m",
        ),
        (
            build_hall(CircleObstacle((6.0, 2.0), 3.0), CircleObstacle((6.0, 5.6), 0.3)),
            "narrow",
            "circle 2 moved",
        ),
        (build_rooms(0.3), "cut off", "filled"),
        (
            build_hall(PolygonObstacle(BOX), starts=(("a", PointsStart(((2.1, 4.0), (1.0, 4.0)))),)),
            "spot",
            "start “a”: position 1 moved",
        ),
        (build_hall(starts=(("a", PointsStart(((1.0, 1.0), (1.1, 1.0)))),)), "spot", "position 2 moved"),
        (build_hall(starts=(("a", PointsStart(((1.0, 1.0), (1.0, 1.0)))),)), "spot", "position 2 moved"),
        (build_hall(starts=(("a", PointsStart(((0.05, 4.0),))),)), "spot", "position 1 moved"),
        (
            build_hall(PolygonObstacle(BOX), starts=(("a", DiscStart((3.0, 4.0), 0.3)),)),
            "no space",
            "“a” moved",
        ),
    ],
)
def test_a_fix_solves_its_problem(sketch, kind, words):
    radius = 0.2
    before = measure(sketch, radius).problems
    problem = next(each for each in before if each.kind == kind)
    assert FIXES[kind].title
    change = find_fix(sketch, problem, radius)
    assert words in change.description
    after = measure(change.sketch, radius).problems
    assert kind not in [each.kind for each in after], [each.message for each in after]
    assert len(after) < len(before)


@pytest.mark.parametrize(
    ("obstacle", "wall", "words"),
    [
        # The wall ends next to the boundary, at 45 degrees to it.
        (None, WallObstacle(((6.0, 0.35), (8.0, 2.35)), 0.1), "wall 1 shortened by 0.12 m"),
        (None, WallObstacle(((8.0, 2.35), (6.0, 0.35)), 0.1), "wall 1 shortened by 0.12 m"),
        # A corner of the wall is next to one of the polygon.
        (
            PolygonObstacle(((5.0, 1.0), (6.0, 3.0), (7.0, 1.0))),
            WallObstacle(((6.0, 3.5), (8.0, 5.5)), 0.6),
            "wall 2 shortened by 0.044 m",
        ),
    ],
    ids=["boundary", "boundary, last end", "corner"],
)
def test_a_gap_at_the_end_of_an_oblique_wall_is_widened_enough(obstacle, wall, words):
    radius = 0.2
    sketch = build_hall(wall) if obstacle is None else build_hall(obstacle, wall)
    before = measure(sketch, radius)
    problem = next(each for each in before.problems if each.kind == "narrow")
    change = find_fix(sketch, problem, radius)
    assert words in change.description
    after = measure(change.sketch, radius)
    assert "narrow" not in [each.kind for each in after.problems]
    assert after.gap.width >= 2 * radius


def test_all_unreachable_areas_are_filled_at_once():
    frame = PolygonObstacle(BOX, (((3.0, 3.0), (5.0, 3.0), (5.0, 5.0), (3.0, 5.0)),))
    fork = ((8.0, 0.0), (8.0, 3.0), (8.2, 3.0), (8.2, 0.2), (8.5, 0.2), (8.5, 3.0), (9.0, 0.0))
    sketch = build_hall(frame, PolygonObstacle(fork))
    assert measure(sketch, 0.3).problems
    after = measure(fill_unreachable(sketch, 0.3).sketch, 0.3)
    assert not after.problems and len(after.reached) == 1
    with pytest.raises(MapError, match="nothing to fill"):
        fill_unreachable(build_hall(), 0.3)
    with pytest.raises(MapError, match="fits anywhere"):
        fill_unreachable(build_hall(), 5.0)


def test_problems_without_a_fix_give_none():
    locked = build_rooms(0.3)
    locked = replace(locked, obstacles=tuple(replace(item, locked=True) for item in locked.obstacles))
    narrow = next(each for each in measure(locked, 0.2).problems if each.kind == "narrow")
    assert find_fix(locked, narrow, 0.2) is None
    nameless = build_hall(name="")
    assert find_fix(nameless, measure(nameless).problems[0], 0.2) is None
    full = build_hall(starts=(("a", PointsStart(((-1.0, 4.0),))),))
    assert find_fix(full, measure(full, 5.0).problems[0], 5.0) is None
