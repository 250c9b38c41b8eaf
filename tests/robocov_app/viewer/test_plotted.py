"""The plotted quantity, distance or time, and its choice."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from driven_window import open_viewer

from robocov.cost import CoverageCost
from robocov.team import Team
from robocov_app.viewer.session.past.curves import DISTANCE, TIME
from robocov_app.viewer.session.setup.robot_properties import RobotProperties

FAST = Team.homogeneous(2, max_speed=1.0)
SLOW = Team.homogeneous(1, max_speed=0.25)
MIXED = RobotProperties.from_team(Team.concatenate([FAST, SLOW]))


def test_teams_with_different_speeds_have_a_curve_of_the_mean_time(tmp_path: Path) -> None:
    with open_viewer(tmp_path, properties=MIXED) as driver:
        session = driver.session
        pane = driver.session.timeline.panes[0]
        np.testing.assert_array_equal(session.displayed.get_setup(pane).speed_limits, [1.0, 1.0, 0.25])
        session.playback.is_playing = True
        driver.run_frames(20)
        session.playback.is_playing = False
        driver.run_frames(2)
        positions = session.displayed.get_positions(pane)
        cost = CoverageCost(session.displayed.environment, 16)
        expected = cost(positions, np.array([1.0, 1.0, 0.25])).mean_time
        assert pane.curves["time"].values[-1] == expected
        assert session.displayed.get_costs("time") == (
            session.displayed.time,
            {pane.number: pytest.approx(expected)},
        )
        # The remaining robots are equally fast, and the curve of the time continues.
        session.fail_robot(3)
        driver.run_frames(2)
        assert session.displayed.get_setup(pane).speed_limits.tolist() == [1.0, 1.0]
        assert pane.curves["time"].values[-1] == pytest.approx(pane.distance_curve.values[-1])


def test_the_plotted_quantity_is_chosen_by_key_and_click(tmp_path: Path) -> None:
    with open_viewer(tmp_path, properties=MIXED) as driver:
        chart = driver.window.chart
        driver.session.playback.is_playing = True
        driver.run_frames(20)
        driver.session.playback.is_playing = False
        driver.run_frames(8)
        assert chart.quantity is DISTANCE
        before = driver.copy_frame()
        driver.press_key("y")
        driver.run_frames(2)
        assert chart.quantity is TIME
        assert not driver.shows_frame(before)
        left, top, width, _ = chart.switch_box
        driver.click(left + width / 2, top + 6)
        assert chart.quantity is DISTANCE
        assert driver.session.timeline.is_live, "the click does not reach the time line"


def test_both_quantities_have_ghost_curves(tmp_path: Path) -> None:
    with open_viewer(tmp_path, properties=MIXED) as driver:
        driver.session.playback.is_playing = True
        driver.run_frames(60)
        driver.session.playback.is_playing = False
        driver.session.show_time(0.4)
        driver.session.branch()
        assert [ghost.quantity for ghost in driver.session.timeline.ghosts] == ["distance", "time"]
        pane = driver.session.timeline.panes[0]
        assert pane.distance_curve.last_time <= 0.4 + 1e-6
        assert pane.curves["time"].last_time <= 0.4 + 1e-6


def test_teams_with_equal_speeds_have_no_choice(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.run_frames(3)
        assert driver.session.displayed.get_setup(driver.session.timeline.panes[0]).speed_limits is None
        driver.press_key("y")
        assert driver.window.chart.quantity is DISTANCE
        assert "equally fast" in driver.viewer.message
        assert driver.window.chart.switch_box is None
