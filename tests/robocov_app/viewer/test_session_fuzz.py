"""Random sessions, longer than those of the property tests: all states are recomputed bit for bit."""

from __future__ import annotations

import json
import random
from contextlib import suppress

import numpy as np
import pytest
from sample_sessions import LLOYD, RAPF, get_positions, start_session

from robocov.conditions import Conditions, Failure
from robocov.environment import CircleObstacle
from robocov.errors import RobocovError
from robocov_app.viewer.session.editing.map_edits import add_obstacle
from robocov_app.viewer.session.files.session_file import build_session_content, format_session, parse_session
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties

UNKNOWN_ROBOT = 9


class RandomUser:
    """Edits a session at random.

    Parameters
    ----------
    seed : int
        Seed of everything that the user does.
    """

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        controllers = self.random.choice([(RAPF,), (LLOYD, RAPF), (ControllerChoice("atlas"),)])
        conditions = [
            None,
            Conditions(position_noise=0.02, seed=seed),
            Conditions(delay=0.1, loss=0.2, seed=seed),
            Conditions(failures=(Failure(2, 0.4),), seed=seed),
        ]
        self.session = start_session(
            *controllers, robots=4, start="spread", conditions=self.random.choice(conditions)
        )
        self.actions = [
            self.drag_robot,
            self.drag_robot_without_release,
            self.draw_circle,
            self.fail_robot,
            self.revive_robot,
            self.add_robot,
            self.remove_robot,
            self.place_robot,
            self.set_gain,
            self.set_speed_limit,
            self.paint,
            self.show_past,
            self.branch,
            self.enter_branch,
            self.session.undo,
            self.session.redo,
            self.restart,
            self.add_pane,
            self.remove_pane,
        ]

    def act(self) -> None:
        """Perform a random action, which the session may reject."""
        self.session.playback.is_playing = True
        with suppress(RobocovError):
            self.random.choice(self.actions)()

    def play(self, steps: int) -> None:
        playback = self.session.playback
        playback.is_playing = True
        for _ in range(steps):
            playback.advance(self.session.timeline.scenario.dt)

    def choose_point(self) -> tuple[float, float]:
        return self.random.uniform(0.2, 5.8), self.random.uniform(0.2, 3.8)

    def choose_robot(self) -> int:
        return self.random.choice(self.session.displayed.numbers)

    def drag_robot_without_release(self) -> None:
        number = self.choose_robot()
        for _ in range(self.random.randint(1, 20)):
            self.session.drag_robot(number, self.choose_point())
            self.play(1)

    def drag_robot(self) -> None:
        self.drag_robot_without_release()
        self.session.release()

    def draw_circle(self) -> None:
        circle = CircleObstacle(self.choose_point(), 0.2)
        self.session.edit_map(add_obstacle(self.session.displayed.environment, circle), "drawn")

    def fail_robot(self) -> None:
        self.session.fail_robot(self.choose_robot())

    def revive_robot(self) -> None:
        setup = self.session.displayed.get_setup(self.session.timeline.panes[0])
        self.session.revive_robot(self.random.choice([*setup.failed, UNKNOWN_ROBOT]))

    def add_robot(self) -> None:
        self.session.add_robot(self.choose_point())

    def remove_robot(self) -> None:
        self.session.remove_robot(self.choose_robot())

    def place_robot(self) -> None:
        self.session.place_robot(self.choose_robot(), self.choose_point())

    def set_gain(self) -> None:
        pane = self.session.timeline.panes[0]
        controller = pane.controller.with_gain("k_rep", self.random.uniform(0, 2))
        self.session.set_controller(pane, controller)

    def set_speed_limit(self) -> None:
        self.session.set_properties(RobotProperties(max_speed=self.random.uniform(0.2, 2)))

    def paint(self) -> None:
        stroke = object()
        for _ in range(self.random.randint(1, 4)):
            lowers = self.random.random() < 0.5
            self.session.paint((self.choose_point(),), 0.7, lowers=lowers, stroke=stroke)
            self.play(1)

    def show_past(self) -> None:
        self.session.show_time(self.session.timeline.end_time * self.random.random())

    def branch(self) -> None:
        self.show_past()
        self.session.branch()

    def enter_branch(self) -> None:
        node = self.random.choice(self.session.timeline.document.list_branches()).node
        self.session.seek(node, self.random.randint(node.first_step, node.last_step))

    def restart(self) -> None:
        self.session.restart(seed=self.random.randint(0, 9))

    def add_pane(self) -> None:
        self.session.add_pane(LLOYD)

    def remove_pane(self) -> None:
        self.session.remove_pane(self.session.timeline.panes[-1])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_a_random_session_is_recomputed_bit_for_bit(seed: int) -> None:
    user = RandomUser(seed)
    session = user.session
    for _ in range(user.random.randint(3, 14)):
        user.act()
        user.play(user.random.randint(0, 12))
    timeline = session.timeline
    session.show_time(timeline.end_time)
    text = format_session(build_session_content(timeline.document, timeline.head, timeline.step, {}))
    recomputed = Session.open(parse_session(json.loads(text), "recomputed"))
    assert_same_state(session, recomputed)
    for branch in timeline.document.list_branches():
        timeline.seek(branch.node)
        recomputed.timeline.seek(recomputed.timeline.document.nodes[branch.node.number])
        assert_same_state(session, recomputed)


def assert_same_state(session: Session, other: Session) -> None:
    """Assert that two sessions are in the same state, bit for bit."""
    assert session.timeline.run.drag == other.timeline.run.drag
    assert len(session.timeline.panes) == len(other.timeline.panes)
    for positions, other_positions in zip(get_positions(session), get_positions(other), strict=True):
        np.testing.assert_array_equal(positions, other_positions)
