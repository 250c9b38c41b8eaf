from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pointer_events import build_event
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
from robocov_app.viewer.tools.tool import ViewerDrawState, ViewerTool
from robocov_app.viewer.tools.toolbox import ViewerToolbox


def build_tools() -> dict[str, ViewerTool]:
    """Return the tools by their names."""
    return ViewerToolbox(Inspection()).by_name


def clicked(tool, session, *points, number=None) -> str | None:
    """Click at places one after the other; return what was told last."""
    said = None
    for point in points:
        tool.move(session, build_event(point))
        said = tool.press(session, build_event(point, robot=number))
        said = tool.release(session, build_event(point), clicked=True) or said
    return said


def dragged(tool, session, start, *points, number=None) -> str | None:
    """Drag from one place to others; return what was told."""
    said = tool.press(session, build_event(start, robot=number))
    for point in points:
        tool.move(session, build_event(point))
    return tool.release(session, build_event(points[-1]), clicked=False) or said


def place_of(session, number) -> list[float]:
    pane = session.timeline.panes[0]
    return pane.simulation.positions[pane.get_row(number)].tolist()


def test_the_box_has_every_tool_once():
    tools = build_tools()
    assert list(tools) == [
        *("hand", "polygon", "wall", "circle", "brush", "eraser", "robot", "failure", "ruler")
    ]
    for name, tool in tools.items():
        assert tool.name == name
        assert tool.title
        assert tool.hint


@pytest.mark.parametrize("name", [*build_tools(), ""])
def test_a_tool_that_was_not_used_does_nothing(name):
    tool, session = build_tools().get(name, ViewerTool()), start_session()
    before = describe_state(session)
    tool.move(session, build_event((1.0, 1.0)))
    assert tool.release(session, build_event((1.0, 1.0)), clicked=False) is None
    assert tool.finish(session) is None
    assert not tool.cancel(session)
    assert tool.build_draw_state(session) == ViewerDrawState()
    assert describe_state(session) == before


class TestHand:
    def test_a_click_chooses_a_robot_and_moves_nothing(self):
        hand, session = HandTool(Inspection()), start_session()
        before = describe_state(session)
        x, y = place_of(session, 2)
        assert dragged(hand, session, (x, y), (x + 0.01, y), number=2) is None
        assert hand.inspection.selected == 2
        assert not hand.is_holding
        assert describe_state(session) == before
        assert hand.cancel(session)
        assert hand.inspection.selected is None
        assert not hand.cancel(session)

    def test_it_drags_robots(self):
        hand, session = HandTool(Inspection()), start_session()
        x, y = place_of(session, 2)
        hand.press(session, build_event((x, y), robot=2))
        assert hand.is_holding
        hand.move(session, build_event((3.0, 3.0)))
        assert place_of(session, 2) == [3.0, 3.0]
        # back to where it was taken
        hand.move(session, build_event((x, y)))
        assert place_of(session, 2) == [x, y]
        assert hand.release(session, build_event((x, y)), clicked=False) is None

    def test_it_throws_robots(self):
        hand, session = HandTool(Inspection()), start_session()
        session.playback.is_playing = True
        hand.press(session, build_event(tuple(place_of(session, 2)), robot=2))
        hand.move(session, build_event((3.0, 3.2)))
        assert session.timeline.drag == (2, (3.0, 3.2))
        session.playback.advance(0.1)
        hand.move(session, build_event((3.1, 3.2)))
        assert session.timeline.drag == (2, (3.1, 3.2))
        hand.release(session, build_event((3.1, 3.2)), clicked=False)
        assert session.timeline.drag is None
        assert session.timeline.events[-1].text == "robot 2 was dragged"

    def test_who_gives_up_lets_go(self):
        hand, session = HandTool(Inspection()), start_session()
        session.playback.is_playing = True
        hand.press(session, build_event(tuple(place_of(session, 2)), robot=2))
        hand.move(session, build_event((3.0, 3.2)))
        assert hand.cancel(session)
        assert session.timeline.drag is None
        assert not hand.is_holding
        hand.move(session, build_event((1.0, 1.0)))
        assert session.timeline.drag is None

    def test_it_drags_robots_that_failed(self):
        hand, session = HandTool(Inspection()), start_session()
        session.fail_robot(2)
        session.playback.is_playing = True
        failed = session.timeline.panes[0].setup.failed
        dragged(hand, session, failed[2], (3.0, 3.2), number=2)
        assert session.timeline.panes[0].setup.failed == {2: (3.0, 3.2)}

    def test_a_robot_that_is_gone_meanwhile(self):
        hand, session = HandTool(Inspection()), start_session()
        session.playback.is_playing = True
        hand.press(session, build_event(tuple(place_of(session, 2)), robot=2))
        hand.move(session, build_event((3.0, 3.2)))
        session.remove_robot(2)
        hand.move(session, build_event((3.0, 3.5)))
        assert hand.release(session, build_event((3.0, 3.5)), clicked=False) is None
        assert session.timeline.drag is None

    def test_it_moves_obstacles(self):
        hand, session = HandTool(Inspection()), start_session()
        hand.press(session, build_event((4.2, 1.2)))
        assert hand.obstacle == 0
        assert hand.build_draw_state(session) == ViewerDrawState()
        hand.move(session, build_event((4.5, 2.2)))
        state = hand.build_draw_state(session)
        assert state.obstacle == replace(HALL.obstacles[0], center=(4.5, 2.2))
        assert (state.line, state.label) == (((4.2, 1.2), (4.5, 2.2)), "1.04 m")
        assert session.displayed.environment is HALL
        assert hand.release(session, build_event((4.5, 2.2)), clicked=False) == "circle “pillar” moved"
        assert session.displayed.environment.obstacles == (state.obstacle, HALL.obstacles[1])
        assert hand.build_draw_state(session) == ViewerDrawState()
        assert session.undo() == "circle “pillar” moved"
        assert session.displayed.environment == HALL

    def test_a_click_on_an_obstacle_or_the_floor_moves_nothing(self):
        hand, session = HandTool(Inspection()), start_session()
        before = describe_state(session)
        assert clicked(hand, session, (4.2, 1.2), (5.5, 3.5)) is None
        hand.press(session, build_event((5.5, 3.5)))
        assert not hand.is_holding
        assert describe_state(session) == before

    def test_another_map_meanwhile(self):
        hand, session = HandTool(Inspection()), start_session()
        hand.press(session, build_event((4.2, 1.2)))
        hand.move(session, build_event((4.5, 2.2)))
        session.edit_map(replace(HALL, obstacles=(HALL.obstacles[1], HALL.obstacles[0])), "turned round")
        assert hand.build_draw_state(session) == ViewerDrawState()
        assert hand.release(session, build_event((4.5, 2.2)), clicked=False) is None
        hand.press(session, build_event((4.2, 1.2)))
        hand.move(session, build_event((4.5, 2.2)))
        session.edit_map(replace(HALL, obstacles=()), "emptied")
        assert hand.build_draw_state(session) == ViewerDrawState()
        assert hand.release(session, build_event((4.5, 2.2)), clicked=False) is None
        assert session.displayed.environment.obstacles == ()

    def test_from_the_past(self):
        hand, session = HandTool(Inspection()), advance_session(start_session(), 20)
        session.fail_robot(2)
        session.show_time(0.1)
        dragged(hand, session, place_of(session, 1), (3.0, 3.0), number=2)
        assert session.timeline.is_live
        assert session.timeline.end_time == pytest.approx(0.1)
        assert place_of(session, 2) == [3.0, 3.0]


class TestPolygon:
    CORNERS = ((3.2, 3.2), (4.2, 3.2), (4.2, 3.8))

    def test_enter_closes_it(self):
        tool, session = AddPolygonTool(), start_session()
        assert clicked(tool, session, *self.CORNERS) is None
        assert session.displayed.environment is HALL
        assert tool.finish(session) == "polygon drawn"
        assert session.displayed.environment.obstacles[-1] == PolygonObstacle(self.CORNERS)
        assert tool.build_draw_state(session) == ViewerDrawState()
        assert tool.finish(session) is None

    def test_a_click_on_the_first_corner_closes_it(self):
        tool, session = AddPolygonTool(), start_session()
        assert clicked(tool, session, *self.CORNERS, (3.25, 3.2)) == "polygon drawn"
        assert session.displayed.environment.obstacles[-1] == PolygonObstacle(self.CORNERS)

    def test_it_shows_what_it_would_be(self):
        tool, session = AddPolygonTool(), start_session()
        clicked(tool, session, self.CORNERS[0])
        tool.move(session, build_event((3.2, 3.7)))
        state = tool.build_draw_state(session)
        assert (state.line, state.is_closed, state.label) == (((3.2, 3.2), (3.2, 3.7)), False, "0.50 m")
        clicked(tool, session, self.CORNERS[1])
        assert tool.build_draw_state(session).is_closed
        assert tool.cancel(session)
        assert not tool.cancel(session)
        assert tool.build_draw_state(session) == ViewerDrawState()

    def test_a_double_click_closes_it_and_is_one_corner(self):
        tool, session = AddPolygonTool(), start_session()
        assert clicked(tool, session, *self.CORNERS, self.CORNERS[-1]) == "polygon drawn"
        assert len(session.displayed.environment.obstacles[-1].vertices) == 3

    def test_what_is_none_is_refused(self):
        tool, session = AddPolygonTool(), start_session()
        before = describe_state(session)
        clicked(tool, session, *self.CORNERS[:2])
        with pytest.raises(MapError, match="three corners"):
            tool.finish(session)
        clicked(tool, session, (3.2, 3.2), (4.2, 3.8), (4.2, 3.2), (3.2, 3.8))
        with pytest.raises(MapError, match="crosses itself"):
            tool.finish(session)
        assert describe_state(session) == before


class TestWall:
    def test_enter_ends_it(self):
        tool, session = AddWallTool(), start_session()
        clicked(tool, session, (3.2, 3.2), (3.2, 3.8))
        tool.move(session, build_event((3.8, 3.8)))
        state = tool.build_draw_state(session)
        assert state.obstacle == WallObstacle(((3.2, 3.2), (3.2, 3.8), (3.8, 3.8)), DEFAULT_WALL_WIDTH_M)
        assert state.label == "0.60 m, 0.1 m wide"
        assert tool.finish(session) == "wall drawn"
        assert session.displayed.environment.obstacles[-1] == WallObstacle(
            ((3.2, 3.2), (3.2, 3.8)), DEFAULT_WALL_WIDTH_M
        )
        assert tool.finish(session) is None

    def test_a_click_on_the_last_point_ends_it(self):
        tool, session = AddWallTool(), start_session()
        assert clicked(tool, session, (3.2, 3.2), (3.2, 3.8), (3.21, 3.8)) == "wall drawn"

    def test_a_wall_may_come_round_to_its_first_point(self):
        tool, session = AddWallTool(), start_session()
        clicked(tool, session, (3.2, 3.0), (4.0, 3.0), (4.0, 3.8), (3.2, 3.8), (3.2, 3.0))
        assert tool.finish(session) == (
            "wall drawn; 0.5 m² cut off; a gap of 15 cm, too narrow for a robot"  # to the wall above
        )
        assert len(session.displayed.environment.obstacles[-1].points) == 5

    def test_wider_and_narrower(self):
        tool, session = AddWallTool(), start_session()
        tool.resize(session, 1.25)
        assert tool.width == 0.125
        clicked(tool, session, (3.2, 3.2), (3.2, 3.8))
        tool.finish(session)
        assert session.displayed.environment.obstacles[-1].width == 0.125
        for factor, end in ((0.8, 0.02), (1.25, 5.0)):
            for _ in range(60):
                tool.resize(session, factor)
            assert tool.width == end

    def test_a_point_is_no_wall(self):
        tool, session = AddWallTool(), start_session()
        clicked(tool, session, (3.2, 3.2))
        assert tool.build_draw_state(session).obstacle is None
        with pytest.raises(MapError, match="two points that are apart"):
            tool.finish(session)
        assert session.displayed.environment is HALL


class TestCircle:
    def test_it_is_drawn_from_its_middle(self):
        tool, session = AddCircleTool(), start_session()
        tool.press(session, build_event((3.5, 3.2)))
        assert tool.build_draw_state(session).obstacle is None
        tool.move(session, build_event((3.5, 3.5)))
        assert tool.build_draw_state(session).label == "radius 0.30 m"
        assert tool.build_draw_state(session).obstacle == CircleObstacle((3.5, 3.2), 0.3)
        assert tool.release(session, build_event((3.5, 3.5)), clicked=False) == "circle drawn"
        assert session.displayed.environment.obstacles[-1] == CircleObstacle((3.5, 3.2), 0.3)
        assert tool.release(session, build_event((3.5, 3.5)), clicked=False) is None

    def test_a_click_is_no_circle(self):
        tool, session = AddCircleTool(), start_session()
        with pytest.raises(MapError, match="drag from its middle"):
            clicked(tool, session, (3.5, 3.2))
        tool.press(session, build_event((3.5, 3.2)))
        assert tool.cancel(session)
        assert tool.release(session, build_event((3.5, 3.9)), clicked=False) is None
        assert session.displayed.environment is HALL


class TestEraser:
    def test_it_deletes_obstacles(self):
        session = start_session()
        assert clicked(build_tools()["eraser"], session, (2.53, 3.0)) == "wall deleted"
        assert clicked(build_tools()["eraser"], session, (4.2, 1.73)) == "circle “pillar” deleted"
        assert session.displayed.environment.obstacles == ()
        assert clicked(build_tools()["eraser"], session, (4.2, 1.2)) is None

    def test_a_robot_before_an_obstacle(self):
        session = start_session()
        assert clicked(build_tools()["eraser"], session, (4.2, 1.2), number=2) == "robot 2 removed"
        assert get_robot_numbers(session) == ((1, 3), ())
        assert session.displayed.environment is HALL

    def test_the_last_robot_stays(self):
        session = start_session(robots=1)
        with pytest.raises(ParameterError, match="last working robot"):
            clicked(build_tools()["eraser"], session, (1.0, 1.0), number=1)


def test_robots_join_where_it_is_clicked():
    session = start_session()
    assert clicked(build_tools()["robot"], session, (3.5, 3.2)) == "robot 4 joined"
    assert place_of(session, 4) == [3.5, 3.2]
    # in an obstacle it is as near as there is room
    assert clicked(build_tools()["robot"], session, (4.2, 1.2)) == "robot 5 joined"
    assert compute_penetration(session) <= 0.0


def test_robots_fail_and_work_again():
    tool, session = build_tools()["failure"], advance_session(start_session(RAPF, LLOYD), 5)
    assert clicked(tool, session, (1.0, 1.0)) is None
    assert clicked(tool, session, (1.0, 1.0), number=2) == "robot 2 failed"
    assert get_robot_numbers(session) == ((1, 3), (2,))
    assert clicked(tool, session, (1.0, 1.0), number=2) == "robot 2 works again"
    assert get_robot_numbers(session) == ((1, 2, 3), ())
    # as it was at the moment that is looked at
    advance_session(session, 5)
    session.fail_robot(3)
    session.show_time(0.1)
    assert clicked(tool, session, (1.0, 1.0), number=3) == "robot 3 failed"


class TestRuler:
    def test_it_measures(self):
        tool, session = RulerTool(), start_session()
        before = describe_state(session)
        tool.press(session, build_event((1.0, 1.0)))
        tool.move(session, build_event((4.0, 5.0)))
        assert tool.build_draw_state(session).line == ((1.0, 1.0), (4.0, 5.0))
        assert tool.build_draw_state(session).label == "5.00 m  (Δx 3.00, Δy 4.00)"
        tool.release(session, build_event((4.0, 5.0)), clicked=False)
        # and stays there
        tool.move(session, build_event((2.0, 2.0)))
        assert tool.build_draw_state(session).line == ((1.0, 1.0), (4.0, 5.0))
        assert tool.cancel(session)
        assert tool.build_draw_state(session) == ViewerDrawState()
        assert not tool.cancel(session)
        assert describe_state(session) == before


def test_it_is_told_who_was_pushed_and_which_starts_are_covered():
    session = start_session(start="spread")
    session.place_robot(1, (5.2, 3.2))
    said = dragged(AddCircleTool(), session, (5.2, 3.2), (5.2, 3.75))
    assert said == "circle drawn; 1 robot pushed out of the way; it covers the start far"
    session.place_robot(1, (1.0, 2.5))
    session.place_robot(2, (1.5, 2.5))
    said = dragged(AddCircleTool(), session, (1.2, 2.5), (1.2, 2.9))
    assert said == "circle drawn; 2 robots pushed out of the way"


points = st.tuples(st.floats(-1, 7), st.floats(-1, 5))
uses = st.tuples(
    st.sampled_from(list(build_tools())),
    st.sampled_from(["press", "move", "release", "finish", "cancel", "undo", "step"]),
    points,
    st.none() | st.integers(1, 4),
)


@given(st.lists(uses, max_size=30))
@settings(max_examples=60)
def test_however_tools_are_used_nothing_breaks(actions):
    session, tools = start_session(), build_tools()
    session.playback.is_playing = True
    for name, action, point, number in actions:
        tool = tools[name]
        working, failed = get_robot_numbers(session)
        number = number if number in (*working, *failed) else None
        try:
            if action == "press":
                said = tool.press(session, build_event(point, robot=number))
            elif action == "move":
                said = tool.move(session, build_event(point))
            elif action == "undo":
                said = session.undo()
            elif action == "step":
                said = session.playback.advance(0.05) and None
            elif action == "cancel":
                said = None if isinstance(tool.cancel(session), bool) else "?"
            else:
                said = (
                    tool.release(session, build_event(point), clicked=False)
                    if action == "release"
                    else tool.finish(session)
                )
        except RobocovError as error:
            said = str(error)
        assert said is None or said == " ".join(said.split()) != ""
        for each in tools.values():
            assert len(each.build_draw_state(session).line) != 1
    assert compute_penetration(session) < 2e-3
