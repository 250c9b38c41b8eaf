"""Validation of sketches: errors, warnings and their positions."""

from dataclasses import replace

import pytest
import shapely
from drawn_sketches import HALL, drafts, list_problems, valid_sketches
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import (
    CircleObstacle,
    DiscStart,
    ObstaclePath,
    PointsStart,
    PolygonObstacle,
    UniformStart,
    WallObstacle,
)
from robocov.errors import MapError
from robocov.mapfile import list_bundled_maps, load_map
from robocov_app.editor.model.sketch import BOUNDARY, Sketch
from robocov_app.editor.model.validation import translate_message


def build_hall(*shapes, starts=(), **others) -> Sketch:
    return (
        Sketch("Hall", boundary=HALL, starts=starts).with_obstacles(shapes)[0]
        if not others
        else replace(build_hall(*shapes, starts=starts), **others)
    )


def is_valid(sketch: Sketch) -> bool:
    try:
        sketch.build_environment()
    except MapError:
        return False
    return True


@settings(max_examples=count_examples(200))
@given(st.one_of(drafts(), valid_sketches()))
def test_there_is_an_error_exactly_if_the_map_is_invalid(sketch):
    found = list_problems(sketch)
    assert any(problem.is_error for problem in found) != is_valid(sketch), [
        problem.message for problem in found
    ]
    keys = {item.key for item in sketch.obstacles} | {name for name, _ in sketch.starts} | {BOUNDARY, None}
    for problem in found:
        assert problem.owner in keys
        assert problem.message.strip() and "\n" not in problem.message
        if problem.geometry is not None:
            assert not shapely.is_empty(problem.geometry)
    graves = [problem.is_error for problem in found]
    assert graves == sorted(graves, reverse=True)


@pytest.mark.parametrize("name", list_bundled_maps())
def test_bundled_maps_have_no_errors(name):
    assert not any(each.is_error for each in list_problems(Sketch.from_environment(load_map(name))))


BOW_TIE = ((1.0, 1.0), (3.0, 3.0), (3.0, 1.0), (1.0, 3.0))
BOX = ((1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (1.0, 3.0))


@pytest.mark.parametrize(
    ("sketch", "message", "position", "owner"),
    [
        (Sketch("n"), "there is no boundary: draw one around the free space", None, BOUNDARY),
        (build_hall(name=""), "the map has no name", None, None),
        (
            build_hall(name="x" * 101),
            "the map has a name of 101 characters: it must not exceed 100",
            None,
            None,
        ),
        (build_hall(boundary=()), "boundary: it has no corners: it needs three", None, BOUNDARY),
        (
            build_hall(boundary=((0.0, 0.0), (4.0, 0.0), (0.0, 0.0))),
            "boundary: it has two corners: it needs three",
            (2.0, 0.0),
            BOUNDARY,
        ),
        (
            build_hall(boundary=((0.0, 0.0), (4.0, 0.0), (2.0, 0.0))),
            "boundary: it encloses nothing: its corners lie on one line",
            (2.0, 0.0),
            BOUNDARY,
        ),
        (
            build_hall(boundary=((0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 4.0))),
            "boundary: it crosses or touches itself at (2, 2)",
            (2.0, 2.0),
            BOUNDARY,
        ),
        (
            build_hall(boundary=((0.0, 0.0), (2e4, 0.0), (0.0, 5.0))),
            "boundary: it measures 20000 × 5 m: neither side may exceed 10 km",
            (1e4, 2.5),
            BOUNDARY,
        ),
        (
            build_hall(boundary=((0.0, 0.0), (123456.0, 0.0), (0.0, 5.0))),
            "boundary: it measures 123456 × 5 m: neither side may exceed 10 km",
            (61728.0, 2.5),
            BOUNDARY,
        ),
        (
            build_hall(boundary=((0.0, 0.0), (1e8, 0.0), (0.0, 5.0))),
            "boundary: (100000000, 0) is too far away: coordinates must be within 10000 km of the origin",
            (1e8, 0.0),
            BOUNDARY,
        ),
        (
            build_hall(PolygonObstacle(BOW_TIE, (), "desk")),
            "polygon “desk”: its outline crosses or touches itself at (2, 2)",
            (2.0, 2.0),
            0,
        ),
        (
            build_hall(PolygonObstacle(((1.0, 1.0),))),
            "polygon 1: its outline has one corner: it needs three",
            (1.0, 1.0),
            0,
        ),
        (
            build_hall(PolygonObstacle(BOX, (((2.0, 2.0), (5.0, 2.0), (5.0, 2.5), (2.0, 2.5)),))),
            "polygon 1: a hole sticks out of its outline",
            (4.0, 2.25),
            0,
        ),
        (
            build_hall(
                PolygonObstacle(
                    BOX,
                    (
                        ((1.5, 1.5), (2.0, 1.5), (2.0, 2.0), (1.5, 2.0)),
                        ((1.7, 1.7), (2.5, 1.7), (2.5, 2.5), (1.7, 2.5)),
                    ),
                )
            ),
            "polygon 1: a hole meets the outline or another hole: it must be apart from them",
            (2.1, 2.1),
            0,
        ),
        (
            build_hall(PolygonObstacle(BOX, (((1.5, 1.5), (2.0, 1.5)),))),
            "polygon 1: a hole has two corners: it needs three",
            (1.75, 1.5),
            0,
        ),
        (
            build_hall(CircleObstacle((2.0, 3.0), 0.0, "")),
            "circle 1: its radius is 0 m: it must be at least 1 mm",
            (2.0, 3.0),
            0,
        ),
        (build_hall(CircleObstacle((2.0, 3.0), 1.0, "")), "circle 1: has no name", None, 0),
        (
            build_hall(WallObstacle(((2.0, 3.0),), 0.1)),
            "wall 1: it has no length: it needs two different points",
            (2.0, 3.0),
            0,
        ),
        (
            build_hall(WallObstacle(((2.0, 3.0), (4.0, 3.0)), -1.0)),
            "wall 1: its width is -1 m: it must be at least 1 mm",
            (2.0, 3.0),
            0,
        ),
        (
            build_hall(PolygonObstacle(((-1.0, -1.0), (20.0, -1.0), (20.0, 20.0), (-1.0, 20.0)))),
            "no free space is left inside the boundary",
            (6.0, 4.0),
            BOUNDARY,
        ),
        (
            build_hall(
                PolygonObstacle(BOX, (), "desk"), starts=(("a", PointsStart(((5.0, 5.0), (2.0, 2.0)))),)
            ),
            "start “a”: position 2 at (2, 2) is inside polygon “desk”",
            (2.0, 2.0),
            "a",
        ),
        (
            build_hall(starts=(("a", PointsStart(((50.0, 5.0),))),)),
            "start “a”: position 1 at (50, 5) is outside the boundary",
            (50.0, 5.0),
            "a",
        ),
        (
            build_hall(starts=(("a", PointsStart(((1.0, 1.0), (1.0, 1.0)))),)),
            "start “a”: the position (1, 1) occurs twice: each robot needs its own",
            (1.0, 1.0),
            "a",
        ),
        (
            build_hall(starts=(("a", PointsStart(())),)),
            "start “a”: has no positions: it needs one for each robot",
            None,
            "a",
        ),
        (
            build_hall(starts=(("", DiscStart((2.0, 2.0), 1.0)),)),
            "a start has no name",
            None,
            "",
        ),
        (
            build_hall(PolygonObstacle(BOX), starts=(("a", DiscStart((2.0, 2.0), 0.5)),)),
            "start “a”: a robot of radius 0.1 m does not fit into its disc",
            (2.0, 2.0),
            "a",
        ),
    ],
)
def test_problems_are_reported_at_their_position(sketch, message, position, owner):
    (found, *_) = [
        problem for problem in list_problems(sketch) if problem.is_error and problem.message == message
    ] or [pytest.fail(str([problem.message for problem in list_problems(sketch)]))]
    assert found.owner == owner
    assert not is_valid(sketch)
    if position is None:
        assert found.geometry is None
    else:
        assert found.geometry.distance(shapely.Point(position)) < 1e-9


def test_a_broken_object_does_not_hide_other_problems():
    sketch = build_hall(
        PolygonObstacle(BOW_TIE),
        CircleObstacle((6.0, 6.0), 1.0),
        WallObstacle((), 0.1),
        starts=(("a", PointsStart(((6.0, 6.0),))), ("b", PointsStart(((1.5, 2.0), (2.0, 1.5))))),
    )
    message = [problem.message for problem in list_problems(sketch) if problem.is_error]
    assert message == [
        "polygon 1: its outline crosses or touches itself at (2, 2)",
        "wall 3: it has no length: it needs two different points",
        "start “a”: position 1 at (6, 6) is inside circle 2",
        # One position is inside a half of the bow tie; the other one is free.
        "start “b”: position 1 at (1.5, 2) is inside polygon 1",
    ]


def list_warnings(sketch: Sketch, radius: float = 0.15) -> list[str]:
    found = list_problems(sketch, radius)
    assert not any(problem.is_error for problem in found)
    return [problem.message for problem in found]


def test_possible_mistakes_are_warnings():
    assert list_warnings(build_hall()) == []
    assert list_warnings(build_hall(CircleObstacle((20.0, 3.0), 1.0, "lamp"))) == [
        "circle “lamp” lies outside the boundary"
    ]
    # An obstacle that only touches the boundary from outside has no effect either.
    beside = PolygonObstacle(((12.0, 1.0), (13.0, 1.0), (13.0, 2.0)))
    assert list_warnings(build_hall(beside)) == ["polygon 1 lies outside the boundary"]
    twice = CircleObstacle((5.0, 5.0), 1.0, "a")
    assert list_warnings(build_hall(twice, replace(twice, name="b"))) == [
        "circle “b” duplicates another obstacle"
    ]
    doubled = PolygonObstacle(((1.0, 1.0), (1.0, 1.0), (3.0, 1.0), (3.0, 3.0)))
    assert list_warnings(build_hall(doubled)) == ["polygon 1: two vertices have the same position, (1, 1)"]
    ended = WallObstacle(((1.0, 1.0), (4.0, 1.0), (4.0, 4.0), (1.0, 1.0)), 0.1)
    assert not [message for message in list_warnings(build_hall(ended)) if "two vertices" in message]


def test_paths_through_obstacles_are_reported_at_the_overlap():
    wall = WallObstacle(((6.0, 0.0), (6.0, 4.0)), 0.2, "screen")
    cart = CircleObstacle((2.0, 2.0), 0.5, "cart", ObstaclePath(((2.0, 2.0), (10.0, 2.0)), 1.0))
    assert list_warnings(build_hall(cart)) == []
    (problem,) = list_problems(build_hall(wall, cart))
    assert problem.message == "circle “cart” moves through wall “screen”"
    assert problem.owner == 1 and not problem.is_error
    assert problem.geometry.bounds == pytest.approx((5.9, 1.5, 6.1, 2.5), abs=1e-3)
    out = replace(cart, path=ObstaclePath(((2.0, 2.0), (14.0, 2.0)), 1.0))
    assert list_warnings(build_hall(out)) == ["circle “cart” moves through the boundary"]


def test_sealed_rooms_and_pockets_are_reported():
    frame = PolygonObstacle(
        ((2.0, 2.0), (6.0, 2.0), (6.0, 6.0), (2.0, 6.0)), (((2.5, 2.5), (5.5, 2.5), (5.5, 5.5), (2.5, 5.5)),)
    )
    box = PolygonObstacle(
        ((8.0, 2.0), (9.0, 2.0), (9.0, 3.0), (8.0, 3.0)), (((8.4, 2.4), (8.6, 2.4), (8.6, 2.6), (8.4, 2.6)),)
    )
    message = list_warnings(build_hall(frame, box))
    assert message == [
        "the room of 9 m² around (4, 4) is sealed: it has no entrance",
        "1 sealed pocket is smaller than a robot, 0.04 m² in total",
    ]


def test_the_area_of_a_large_sealed_room_is_written_without_an_exponent():
    frame = PolygonObstacle(
        ((20.0, 20.0), (70.0, 20.0), (70.0, 70.0), (20.0, 70.0)),
        (((25.0, 25.0), (65.0, 25.0), (65.0, 65.0), (25.0, 65.0)),),
    )
    boundary = ((0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0))
    message = list_warnings(build_hall(frame, boundary=boundary))
    assert message == ["the room of 1600 m² around (45, 45) is sealed: it has no entrance"]


def test_a_start_that_is_too_narrow_for_larger_robots_is_a_warning():
    room = PolygonObstacle(
        ((2.0, 2.0), (6.0, 2.0), (6.0, 6.0), (2.0, 6.0)), (((3.0, 3.0), (3.8, 3.0), (3.8, 3.8), (3.0, 3.8)),)
    )
    sketch = build_hall(
        room, starts=(("a", DiscStart((3.4, 3.4), 0.2)), ("b", PointsStart(((1.0, 1.0), (1.5, 1.0)))))
    )
    assert not [message for message in list_warnings(sketch, 0.2) if "start" in message]
    message = [message for message in list_warnings(sketch, 0.5) if "start" in message]
    assert message[0] == "start “a”: a robot of radius 0.5 m does not fit into its disc"
    assert message[1] == "start “b”: position 1 at (1, 1) and position 2 are 0.5 m apart: robots need 1 m"
    assert list_warnings(build_hall(starts=(("all", UniformStart()),)), 3.9) == []
    assert list_warnings(build_hall(starts=(("all", UniformStart()),)), 4.0) == [
        "start “all”: a robot of radius 4 m does not fit into the free space"
    ]


def test_tight_positions_are_reported_at_their_position():
    spots = ((0.1, 1.0), (5.0, 5.0), (5.3, 5.0), (11.95, 7.0))
    found = list_problems(build_hall(starts=(("a", PointsStart(spots)),)), 0.2)
    assert [(problem.message, problem.geometry.centroid.coords[0]) for problem in found] == [
        ("start “a”: position 1 at (0.1, 1) is 0.1 m from a wall: robots need 0.2 m", (0.1, 1.0)),
        (
            "start “a”: position 4 at (11.95, 7) is 0.05 m from a wall: robots need 0.2 m",
            (11.95, 7.0),
        ),
        (
            "start “a”: position 2 at (5, 5) and position 3 are 0.3 m apart: robots need 0.4 m",
            (5.15, 5.0),
        ),
    ]


def test_messages_name_objects_instead_of_paths():
    pillar = CircleObstacle((1.0, 1.0), 0.3, "pillar")
    sketch = build_hall(pillar, PolygonObstacle(((1.0, 1.0), (3.0, 1.0), (3.0, 3.0))))
    for message, message in [
        ("map: obstacles[0]: is odd", "circle “pillar”: is odd"),
        ("map: obstacles[1].vertices[0]: is odd", "polygon 2, corner 1: is odd"),
        ("map: obstacles[1].vertices[2][1]: is odd", "polygon 2, corner 3: is odd"),
        ("map: obstacles[1].holes[0][3]: is odd", "polygon 2, hole 1, corner 4: is odd"),
        ("map: obstacles[9]: is odd", "obstacles[9]: is odd"),
        ("obstacles[1].path.speed: is odd", "polygon 2, path, speed: is odd"),
        ("obstacles[1].path.points[0]: is odd", "polygon 2, path, point 1: is odd"),
        ("density.areas[2].vertices[0]: is odd", "density, area 3, corner 1: is odd"),
        ("starts.corner.positions[1]: is odd", "start “corner”, position 2: is odd"),
        ("boundary[3]: is odd", "boundary, corner 4: is odd"),
    ]:
        assert translate_message(message, sketch) == message
