"""The timeline: icons of events, and the branches as a small tree that can be clicked."""

from __future__ import annotations

from dataclasses import replace

import pytest
from driven_window import Driver
from sample_sessions import PILLAR, advance_session

from robocov_app.toolkit.widgets.icons import ICONS
from robocov_app.viewer.chart.branch_tree import MAX_BRANCH_LINES, find_branch_line, list_branch_lines
from robocov_app.viewer.chart.events import _EVENT_ICONS, _OTHER_EVENT_ICON, select_badges
from robocov_app.viewer.session.editing.map_edits import add_obstacle

STEPS = 60


def branch_off(driver: Driver) -> None:
    """Let robot 1 fail at half the time, then go back further, and continue with another obstacle."""
    session = driver.session
    advance_session(session, STEPS)
    session.fail_robot(1)
    advance_session(session, STEPS)
    session.show_time(0.5 * STEPS * session.timeline.scenario.dt)
    session.edit_map(add_obstacle(session.displayed.environment, PILLAR), "circle added")
    advance_session(session, STEPS)
    driver.run_frames(2)


def test_a_branch_is_a_line_from_where_the_paths_part_to_its_end(driver: Driver) -> None:
    branch_off(driver)
    dt = driver.session.timeline.scenario.dt
    (line,) = driver.window.chart.branch_lines
    assert line.start_time == pytest.approx(0.5 * STEPS * dt)
    assert line.end_time == pytest.approx(2 * STEPS * dt)
    assert "robot 1 failed" in line.text


def test_a_click_on_a_branch_enters_it_and_the_other_one_is_left(driver: Driver) -> None:
    branch_off(driver)
    (line,) = driver.window.chart.branch_lines
    left = driver.session.timeline.head.number
    box = driver.window.chart.get_branch_box(line)
    driver.click(box.right - 6, box.centery)
    driver.run_frames(2)
    assert driver.session.timeline.head.number == line.node
    assert [other.node for other in driver.window.chart.branch_lines] == [left]


def test_a_branch_is_described_under_the_pointer(driver: Driver) -> None:
    branch_off(driver)
    (line,) = driver.window.chart.branch_lines
    box = driver.window.chart.get_branch_box(line)
    before = driver.copy_frame()
    driver.move(box.right - 6, box.centery)
    driver.run_frames(1)
    assert driver.window.chart._describe_ghost(driver.pixel) == line.text
    assert not driver.shows_frame(before)


def test_a_branch_beyond_the_axis_ends_there(driver: Driver) -> None:
    """A lesson starts at time 0, and its axis is shorter than the branches of the session before."""
    branch_off(driver)
    chart = driver.window.chart
    long_line = replace(chart.branch_lines[0], end_time=1e4)
    box = chart.get_branch_box(long_line)
    assert box.right <= chart._frame.times.right + 5 * driver.window.layout.scale
    pixel = (round(chart._frame.times.right) + 30, box.centery)
    assert find_branch_line(chart._frame, [long_line], pixel) is None


def test_a_branch_is_entered_by_the_keyboard(driver: Driver) -> None:
    branch_off(driver)
    (line,) = driver.window.chart.branch_lines
    driver.window.chart_focus.set_focus(f"branch:{line.node}")
    driver.press_key("return")
    assert driver.session.timeline.head.number == line.node


def test_the_tree_shows_the_newest_branches_only(driver: Driver) -> None:
    session = driver.session
    advance_session(session, 4)
    for _ in range(MAX_BRANCH_LINES + 2):
        session.seek(session.timeline.document.nodes[0], 2)
        session.fail_robot(1)
        advance_session(session, 2)
    assert len(list_branch_lines(session.timeline)) == MAX_BRANCH_LINES


def test_every_event_has_an_icon(driver: Driver) -> None:
    branch_off(driver)
    assert {*_EVENT_ICONS.values(), _OTHER_EVENT_ICON} <= {*ICONS}
    (event,) = select_badges(driver.window.chart._frame)
    assert event.kind in _EVENT_ICONS


def test_badges_of_events_close_together_do_not_overlap(driver: Driver) -> None:
    session = driver.session
    for number in (1, 2):
        advance_session(session, 1)
        session.fail_robot(number)
    (event,) = select_badges(driver.window.chart._frame)
    assert event.text == "robot 2 failed"
