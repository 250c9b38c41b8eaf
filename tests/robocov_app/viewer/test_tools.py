"""Tools of the viewer: the hand, drawing tools, the eraser, robots, failures and the ruler."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pointer_events import build_event
from property_examples import count_examples
from sample_sessions import (
    HALL,
    LLOYD,
    RAPF,
    advance_session,
    compute_penetration,
    describe_state,
    get_robot_numbers,
    start_session,
)

from robocov.environment import CircleObstacle, PolygonObstacle, WallObstacle
from robocov.errors import MapError, ParameterError, RobocovError
from robocov_app.viewer.inspection import Inspection
from robocov_app.viewer.tools.hand import HandTool
from robocov_app.viewer.tools.outlines import DEFAULT_WALL_WIDTH_M, AddPolygonTool, AddWallTool
from robocov_app.viewer.tools.segments import AddCircleTool, RulerTool
from robocov_app.viewer.tools.tool import ViewerTool, ViewerToolOverlay
from robocov_app.viewer.tools.toolbox import ViewerToolbox


def build_tools() -> dict[str, ViewerTool]:
    """Return the tools by their names."""
    return ViewerToolbox(Inspection()).by_name


def click(tool, session, *points, number=None) -> str | None:
    """Click at several points; return the last message."""
    message = None
    for point in points:
        tool.move(session, build_event(point))
        message = tool.press(session, build_event(point, robot=number))
        message = tool.release(session, build_event(point), is_click=True) or message
    return message


def drag(tool, session, start, *points, number=None) -> str | None:
    """Drag from one point to others; return the message."""
    message = tool.press(session, build_event(start, robot=number))
    for point in points:
        tool.move(session, build_event(point))
    return tool.release(session, build_event(points[-1]), is_click=False) or message


def get_position(session, number) -> list[float]:
    pane = session.timeline.panes[0]
    return pane.simulation.positions[pane.get_row(number)].tolist()


def test_the_toolbox_contains_every_tool_once():
    tools = build_tools()
    assert list(tools) == [
        *("hand", "polygon", "wall", "circle", "brush", "eraser", "robot", "failure", "ruler")
    ]
    for name, tool in tools.items():
        assert tool.name == name
        assert tool.title
        assert tool.hint


@pytest.mark.parametrize("name", [*build_tools(), ""])
def test_an_unused_tool_does_nothing(name):
    tool = build_tools().get(name, ViewerTool())
    session = start_session()
    before = describe_state(session)
    tool.move(session, build_event((1.0, 1.0)))
    assert tool.release(session, build_event((1.0, 1.0)), is_click=False) is None
    assert tool.finish(session) is None
    assert not tool.cancel(session)
    assert tool.build_overlay(session) == ViewerToolOverlay()
    assert describe_state(session) == before


# hand


def test_a_click_selects_a_robot_and_moves_nothing():
    hand = HandTool(Inspection())
    session = start_session()
    before = describe_state(session)
    x, y = get_position(session, 2)
    assert drag(hand, session, (x, y), (x + 0.01, y), number=2) is None
    assert hand.inspection.selected == 2
    assert not hand.is_holding
    assert describe_state(session) == before
    assert hand.cancel(session)
    assert hand.inspection.selected is None
    assert not hand.cancel(session)


def test_the_hand_drags_robots():
    hand = HandTool(Inspection())
    session = start_session()
    x, y = get_position(session, 2)
    hand.press(session, build_event((x, y), robot=2))
    assert hand.is_holding
    hand.move(session, build_event((3.0, 3.0)))
    assert get_position(session, 2) == [3.0, 3.0]
    # The robot returns to its old position.
    hand.move(session, build_event((x, y)))
    assert get_position(session, 2) == [x, y]
    assert hand.release(session, build_event((x, y)), is_click=False) is None


def test_the_hand_throws_robots():
    hand = HandTool(Inspection())
    session = start_session()
    session.playback.is_playing = True
    hand.press(session, build_event(tuple(get_position(session, 2)), robot=2))
    hand.move(session, build_event((3.0, 3.2)))
    assert session.timeline.run.drag == (2, (3.0, 3.2))
    session.playback.advance(0.1)
    hand.move(session, build_event((3.1, 3.2)))
    assert session.timeline.run.drag == (2, (3.1, 3.2))
    hand.release(session, build_event((3.1, 3.2)), is_click=False)
    assert session.timeline.run.drag is None
    assert session.timeline.events[-1].text == "robot 2 was dragged"


def test_canceling_releases_a_dragged_robot():
    hand = HandTool(Inspection())
    session = start_session()
    session.playback.is_playing = True
    hand.press(session, build_event(tuple(get_position(session, 2)), robot=2))
    hand.move(session, build_event((3.0, 3.2)))
    assert hand.cancel(session)
    assert session.timeline.run.drag is None
    assert not hand.is_holding
    hand.move(session, build_event((1.0, 1.0)))
    assert session.timeline.run.drag is None


def test_the_hand_drags_failed_robots():
    hand = HandTool(Inspection())
    session = start_session()
    session.fail_robot(2)
    session.playback.is_playing = True
    failed = session.timeline.panes[0].setup.failed
    drag(hand, session, failed[2], (3.0, 3.2), number=2)
    assert session.timeline.panes[0].setup.failed == {2: (3.0, 3.2)}


def test_a_robot_can_be_removed_while_it_is_dragged():
    hand = HandTool(Inspection())
    session = start_session()
    session.playback.is_playing = True
    hand.press(session, build_event(tuple(get_position(session, 2)), robot=2))
    hand.move(session, build_event((3.0, 3.2)))
    session.remove_robot(2)
    hand.move(session, build_event((3.0, 3.5)))
    assert hand.release(session, build_event((3.0, 3.5)), is_click=False) is None
    assert session.timeline.run.drag is None


def test_the_hand_moves_obstacles():
    hand = HandTool(Inspection())
    session = start_session()
    hand.press(session, build_event((4.2, 1.2)))
    assert hand.is_holding
    assert hand.build_overlay(session).selected == HALL.obstacles[:1]
    hand.move(session, build_event((4.5, 2.2)))
    state = hand.build_overlay(session)
    assert state.obstacles == (replace(HALL.obstacles[0], center=(4.5, 2.2)),)
    assert state.line == ((4.2, 1.2), (4.5, 2.2))
    assert state.label == "1.04 m"
    assert session.displayed.environment is HALL
    assert hand.release(session, build_event((4.5, 2.2)), is_click=False) == "circle “pillar” moved"
    assert session.displayed.environment.obstacles == (*state.obstacles, HALL.obstacles[1])
    assert hand.build_overlay(session).selected == state.obstacles
    assert session.undo() == "circle “pillar” moved"
    assert session.displayed.environment == HALL


def test_a_click_on_an_obstacle_or_the_floor_moves_nothing():
    hand = HandTool(Inspection())
    session = start_session()
    before = describe_state(session)
    assert click(hand, session, (4.2, 1.2), (5.5, 3.5)) is None
    hand.press(session, build_event((5.5, 3.5)))
    assert not hand.is_holding
    assert describe_state(session) == before


def test_the_map_can_change_while_an_obstacle_is_dragged():
    hand = HandTool(Inspection())
    session = start_session()
    hand.press(session, build_event((4.2, 1.2)))
    hand.move(session, build_event((4.5, 2.2)))
    session.edit_map(replace(HALL, obstacles=(HALL.obstacles[1], HALL.obstacles[0])), "obstacles reversed")
    assert hand.build_overlay(session).selected == HALL.obstacles[:1]
    assert hand.release(session, build_event((4.5, 2.2)), is_click=False) is None
    hand.press(session, build_event((4.2, 1.2)))
    hand.move(session, build_event((4.5, 2.2)))
    session.edit_map(replace(HALL, obstacles=()), "obstacles deleted")
    assert hand.build_overlay(session) == ViewerToolOverlay()
    assert hand.release(session, build_event((4.5, 2.2)), is_click=False) is None
    assert session.displayed.environment.obstacles == ()


def test_dragging_a_robot_in_the_past_continues_from_there():
    hand = HandTool(Inspection())
    session = advance_session(start_session(), 20)
    session.fail_robot(2)
    session.show_time(0.1)
    drag(hand, session, get_position(session, 1), (3.0, 3.0), number=2)
    assert session.timeline.is_live
    assert session.timeline.end_time == pytest.approx(0.1)
    assert get_position(session, 2) == [3.0, 3.0]


# polygon


CORNERS = ((3.2, 3.2), (4.2, 3.2), (4.2, 3.8))


def test_enter_closes_a_polygon():
    tool = AddPolygonTool()
    session = start_session()
    assert click(tool, session, *CORNERS) is None
    assert session.displayed.environment is HALL
    assert tool.finish(session) == "polygon drawn"
    assert session.displayed.environment.obstacles[-1] == PolygonObstacle(CORNERS)
    assert tool.build_overlay(session) == ViewerToolOverlay()
    assert tool.finish(session) is None


def test_a_click_on_the_first_corner_closes_a_polygon():
    tool = AddPolygonTool()
    session = start_session()
    assert click(tool, session, *CORNERS, (3.25, 3.2)) == "polygon drawn"
    assert session.displayed.environment.obstacles[-1] == PolygonObstacle(CORNERS)


def test_an_unfinished_polygon_is_shown():
    tool = AddPolygonTool()
    session = start_session()
    click(tool, session, CORNERS[0])
    tool.move(session, build_event((3.2, 3.7)))
    overlay = tool.build_overlay(session)
    assert overlay.line == ((3.2, 3.2), (3.2, 3.7))
    assert not overlay.is_closed
    assert overlay.label == "0.50 m"
    click(tool, session, CORNERS[1])
    assert tool.build_overlay(session).is_closed
    assert tool.cancel(session)
    assert not tool.cancel(session)
    assert tool.build_overlay(session) == ViewerToolOverlay()


def test_a_double_click_closes_a_polygon_and_adds_one_corner():
    tool = AddPolygonTool()
    session = start_session()
    assert click(tool, session, *CORNERS, CORNERS[-1]) == "polygon drawn"
    assert len(session.displayed.environment.obstacles[-1].vertices) == 3


def test_invalid_polygons_are_rejected():
    tool = AddPolygonTool()
    session = start_session()
    before = describe_state(session)
    click(tool, session, *CORNERS[:2])
    with pytest.raises(MapError, match="three corners"):
        tool.finish(session)
    click(tool, session, (3.2, 3.2), (4.2, 3.8), (4.2, 3.2), (3.2, 3.8))
    with pytest.raises(MapError, match="crosses itself"):
        tool.finish(session)
    assert describe_state(session) == before


# wall


def test_finishing_a_wall_drops_the_previewed_segment():
    tool = AddWallTool()
    session = start_session()
    click(tool, session, (3.2, 3.2), (3.2, 3.8))
    tool.move(session, build_event((3.8, 3.8)))
    overlay = tool.build_overlay(session)
    previewed_wall = WallObstacle(((3.2, 3.2), (3.2, 3.8), (3.8, 3.8)), DEFAULT_WALL_WIDTH_M)
    assert overlay.obstacles == (previewed_wall,)
    assert overlay.label == "0.60 m, 0.1 m wide"
    assert tool.finish(session) == "wall drawn"
    assert session.displayed.environment.obstacles[-1] == WallObstacle(
        ((3.2, 3.2), (3.2, 3.8)), DEFAULT_WALL_WIDTH_M
    )
    assert tool.finish(session) is None


def test_a_click_on_the_last_point_ends_a_wall():
    tool = AddWallTool()
    session = start_session()
    assert click(tool, session, (3.2, 3.2), (3.2, 3.8), (3.21, 3.8)) == "wall drawn"


def test_a_wall_may_end_at_its_first_point():
    tool = AddWallTool()
    session = start_session()
    click(tool, session, (3.2, 3.0), (4.0, 3.0), (4.0, 3.8), (3.2, 3.8), (3.2, 3.0))
    assert tool.finish(session) == (
        "wall drawn; about 0.5 m² cut off; a passage of 15 cm, too narrow for a robot"  # to the wall above
    )
    assert len(session.displayed.environment.obstacles[-1].points) == 5


def test_the_width_of_walls_can_be_changed():
    tool = AddWallTool()
    session = start_session()
    tool.resize(session, 1.25)
    assert tool.width == 0.125
    click(tool, session, (3.2, 3.2), (3.2, 3.8))
    tool.finish(session)
    assert session.displayed.environment.obstacles[-1].width == 0.125
    for factor, end in ((0.8, 0.02), (1.25, 5.0)):
        for _ in range(60):
            tool.resize(session, factor)
        assert tool.width == end


def test_a_wall_requires_two_points():
    tool = AddWallTool()
    session = start_session()
    click(tool, session, (3.2, 3.2))
    assert tool.build_overlay(session).obstacles == ()
    with pytest.raises(MapError, match="two points that are apart"):
        tool.finish(session)
    assert session.displayed.environment is HALL


# circle


def test_a_circle_is_drawn_from_its_center():
    tool = AddCircleTool()
    session = start_session()
    tool.press(session, build_event((3.5, 3.2)))
    assert tool.build_overlay(session).obstacles == ()
    tool.move(session, build_event((3.5, 3.5)))
    assert tool.build_overlay(session).label == "radius 0.30 m"
    assert tool.build_overlay(session).obstacles == (CircleObstacle((3.5, 3.2), 0.3),)
    assert tool.release(session, build_event((3.5, 3.5)), is_click=False) == "circle drawn"
    assert session.displayed.environment.obstacles[-1] == CircleObstacle((3.5, 3.2), 0.3)
    assert tool.release(session, build_event((3.5, 3.5)), is_click=False) is None


def test_a_click_draws_no_circle():
    tool = AddCircleTool()
    session = start_session()
    with pytest.raises(MapError, match="drag from its center"):
        click(tool, session, (3.5, 3.2))
    tool.press(session, build_event((3.5, 3.2)))
    assert tool.cancel(session)
    assert tool.release(session, build_event((3.5, 3.9)), is_click=False) is None
    assert session.displayed.environment is HALL


# eraser


def test_the_eraser_deletes_obstacles():
    session = start_session()
    assert click(build_tools()["eraser"], session, (2.53, 3.0)) == "wall deleted"
    assert click(build_tools()["eraser"], session, (4.2, 1.73)) == "circle “pillar” deleted"
    assert session.displayed.environment.obstacles == ()
    message = click(build_tools()["eraser"], session, (4.2, 1.2))
    assert message == "nothing to delete here: choose an obstacle or a robot"


def test_the_eraser_prefers_robots_to_obstacles():
    session = start_session()
    assert click(build_tools()["eraser"], session, (4.2, 1.2), number=2) == "robot 2 removed"
    assert get_robot_numbers(session) == ((1, 3), ())
    assert session.displayed.environment is HALL


def test_the_last_robot_cannot_be_erased():
    session = start_session(robots=1)
    with pytest.raises(ParameterError, match="last working robot"):
        click(build_tools()["eraser"], session, (1.0, 1.0), number=1)


def test_robots_join_at_clicks():
    session = start_session()
    assert click(build_tools()["robot"], session, (3.5, 3.2)) == "robot 4 joined"
    assert get_position(session, 4) == [3.5, 3.2]
    # From a click in an obstacle, it joins as near as there is space.
    assert click(build_tools()["robot"], session, (4.2, 1.2)) == "robot 5 joined"
    assert compute_penetration(session) <= 0.0


def test_robots_fail_and_are_revived_by_clicks():
    tool = build_tools()["failure"]
    session = advance_session(start_session(RAPF, LLOYD), 5)
    assert click(tool, session, (1.0, 1.0)) == "no robot here: choose a robot to make it fail"
    assert get_robot_numbers(session) == ((1, 2, 3), ())
    assert click(tool, session, (1.0, 1.0), number=2) == "robot 2 failed"
    assert get_robot_numbers(session) == ((1, 3), (2,))
    assert click(tool, session, (1.0, 1.0), number=2) == "robot 2 works again"
    assert get_robot_numbers(session) == ((1, 2, 3), ())
    # The state at the displayed time decides.
    advance_session(session, 5)
    session.fail_robot(3)
    session.show_time(0.1)
    assert click(tool, session, (1.0, 1.0), number=3) == "robot 3 failed"


# ruler


def test_the_ruler_measures_a_distance():
    tool = RulerTool()
    session = start_session()
    before = describe_state(session)
    tool.press(session, build_event((1.0, 1.0)))
    tool.move(session, build_event((4.0, 5.0)))
    assert tool.build_overlay(session).line == ((1.0, 1.0), (4.0, 5.0))
    assert tool.build_overlay(session).label == "5.00 m  (Δx 3.00, Δy 4.00)"
    tool.release(session, build_event((4.0, 5.0)), is_click=False)
    # The measured line stays.
    tool.move(session, build_event((2.0, 2.0)))
    assert tool.build_overlay(session).line == ((1.0, 1.0), (4.0, 5.0))
    assert tool.cancel(session)
    assert tool.build_overlay(session) == ViewerToolOverlay()
    assert not tool.cancel(session)
    assert describe_state(session) == before


def test_a_click_of_the_ruler_says_what_to_do():
    assert (
        click(RulerTool(), start_session(), (1.0, 1.0)) == "nothing measured: drag from one point to another"
    )


def test_messages_count_pushed_robots_and_name_covered_starts():
    session = start_session(start="spread")
    session.place_robot(1, (5.2, 3.2))
    message = drag(AddCircleTool(), session, (5.2, 3.2), (5.2, 3.75))
    assert message == "circle drawn; 1 robot pushed out of the way; it covers the start far"
    session.place_robot(1, (1.0, 2.5))
    session.place_robot(2, (1.5, 2.5))
    message = drag(AddCircleTool(), session, (1.2, 2.5), (1.2, 2.9))
    assert message == "circle drawn; 2 robots pushed out of the way"


_points = st.tuples(st.floats(-1, 7), st.floats(-1, 5))
_uses = st.tuples(
    st.sampled_from(list(build_tools())),
    st.sampled_from(["press", "move", "release", "finish", "cancel", "undo", "step"]),
    _points,
    st.none() | st.integers(1, 4),
)


@given(st.lists(_uses, max_size=30))
@settings(max_examples=count_examples(60))
def test_tools_may_be_used_in_any_order(actions):
    session = start_session()
    tools = build_tools()
    session.playback.is_playing = True
    for name, action, point, number in actions:
        tool = tools[name]
        working, failed = get_robot_numbers(session)
        if number not in (*working, *failed):
            number = None
        message = None
        try:
            match action:
                case "press":
                    message = tool.press(session, build_event(point, robot=number))
                case "move":
                    tool.move(session, build_event(point))
                case "release":
                    message = tool.release(session, build_event(point), is_click=False)
                case "finish":
                    message = tool.finish(session)
                case "cancel":
                    tool.cancel(session)
                case "undo":
                    message = session.undo()
                case "step":
                    session.playback.advance(0.05)
        except RobocovError as error:
            message = str(error)
        if message is not None:
            # Messages are one line without surplus spaces, and never empty.
            assert message
            assert message == " ".join(message.split())
        for other in tools.values():
            assert len(other.build_overlay(session).line) != 1
    assert compute_penetration(session) < 2e-3
