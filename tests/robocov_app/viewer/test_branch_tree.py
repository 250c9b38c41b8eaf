"""The timeline: icons of events, and the branches as a small tree that can be clicked."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from driven_window import Driver
from sample_sessions import PILLAR, advance_session

from robocov_app.toolkit.widgets.icons import ICONS
from robocov_app.viewer.chart import pointer_tag
from robocov_app.viewer.chart.branch_tree import MAX_BRANCH_LINES, find_branch_line, list_branch_lines
from robocov_app.viewer.chart.events import _EVENT_ICONS, _OTHER_EVENT_ICON, describe_events_at, list_badges
from robocov_app.viewer.chart.scale import TOP_PX
from robocov_app.viewer.session.editing.map_edits import add_obstacle

STEPS = 60
MIN_ICON_PIXELS = 10
MAX_COLOR_DIFFERENCE = 60


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
    assert driver.window.chart._describe_branch(driver.pixel) == line.text
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
    (badge,) = list_badges(driver.window.chart._frame)
    assert badge.events[0].kind in _EVENT_ICONS


def test_badges_of_events_close_together_do_not_overlap(driver: Driver) -> None:
    session = driver.session
    environment = session.displayed.environment
    for _ in range(8):
        advance_session(session, 12)
        session.edit_map(add_obstacle(environment, PILLAR), "circle added")
        session.edit_map(environment, "circle deleted")
    badges = list_badges(driver.window.chart._frame)
    assert sum(len(badge.events) for badge in badges) == 16
    assert all(left.right <= right.left for left, right in pairwise(badges))


def count_ink_pixels(driver: Driver, left: int, right: int) -> int:
    """Return the number of pixels of badges in the color of icons, between two columns."""
    chart = driver.window.chart
    top = chart.layout.chart.top + TOP_PX
    badges = driver.copy_frame()[top : top + 20, left:right]
    return int((np.abs(badges - chart.theme.ink).max(axis=2) < MAX_COLOR_DIFFERENCE).sum())


def test_two_events_at_the_same_time_share_a_badge_that_names_both(driver: Driver) -> None:
    session = driver.session
    advance_session(session, STEPS)
    session.fail_robot(1)
    session.edit_map(add_obstacle(session.displayed.environment, PILLAR), "circle added")
    driver.run_frames(8)
    chart = driver.window.chart
    (badge,) = list_badges(chart._frame)
    assert [event.kind for event in badge.events] == ["failure", "obstacle"]
    middle = round((badge.left + badge.right) / 2)
    for left, right in ((round(badge.left), middle), (middle, round(badge.right))):
        assert count_ink_pixels(driver, left + 3, right - 3) > MIN_ICON_PIXELS
    for column in (badge.left + 2, badge.right - 2):
        text = describe_events_at(chart._frame, round(column))
        assert "robot 1 failed" in text
        assert "circle added" in text


def test_the_tag_of_events_is_below_their_badges(driver: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    tops: list[float] = []
    monkeypatch.setattr(
        pointer_tag, "draw_tag", lambda screen, text, position, *more: tops.append(position[1])
    )
    session = driver.session
    advance_session(session, STEPS)
    session.fail_robot(1)
    chart = driver.window.chart
    driver.move(chart.to_column(STEPS * session.timeline.scenario.dt), chart.layout.chart.top + 60)
    driver.run_frames(1)
    half_height = 10
    assert tops
    assert min(tops) - half_height >= chart.layout.chart.top + TOP_PX + 19
