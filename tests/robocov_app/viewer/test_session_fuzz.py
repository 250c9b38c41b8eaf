"""Random stories, longer and nastier than the suite's: whatever was done is made again bit for bit."""

from __future__ import annotations

import json
import random
from contextlib import suppress

import numpy as np
import pytest
from touched_run import LLOYD, RAPF, begun, positions_of

from robocov.conditions import Conditions, Failure
from robocov.environment import CircleObstacle
from robocov.errors import RobocovError
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.file import build_session_content, format_session, parse_session
from robocov_app.viewer.session.map_edits import add_obstacle
from robocov_app.viewer.session.robot_properties import RobotProperties
from robocov_app.viewer.session.session import Session

KINDS = (
    *("drag", "hold", "draw", "fail", "revive", "join", "leave", "place", "gain", "limits", "paint", "past"),
    *("branch", "enter", "undo", "redo", "restart", "pane", "drop"),
)


class Monkey:
    """Does random things to a session, by their names."""

    def __init__(self, seed: int) -> None:
        self.random = r = random.Random(seed)
        laws = r.choice([(RAPF,), (LLOYD, RAPF), (ControllerChoice("atlas"),)])
        conditions = [
            *(None, Conditions(position_noise=0.02, seed=seed), Conditions(delay=0.1, loss=0.2, seed=seed)),
            Conditions(failures=(Failure(2, 0.4),), seed=seed),
        ]
        self.session = begun(*laws, robots=4, start="spread", conditions=r.choice(conditions))

    def point(self) -> tuple[float, float]:
        return self.random.uniform(0.2, 5.8), self.random.uniform(0.2, 3.8)

    def play(self, steps: int) -> None:
        self.session.playback.is_playing = True
        for _ in range(steps):
            self.session._play_on()

    def hold(self) -> None:
        number = self.random.choice(self.session.displayed.numbers)
        for _ in range(self.random.randint(1, 20)):
            self.session.drag_robot(number, self.point())
            self.play(1)

    def paint(self) -> None:
        stroke = object()
        for _ in range(self.random.randint(1, 4)):
            self.session.paint((self.point(),), 0.7, lowers=self.random.random() < 0.5, stroke=stroke)
            self.play(1)

    def act(self, kind: str) -> None:
        r, s = self.random, self.session
        s.playing = True
        if kind in ("drag", "hold"):  # what is held is never let go of
            self.hold()
            if kind == "drag":
                s.release()
        elif kind == "draw":
            s.edit(add_obstacle(s.environment, CircleObstacle(self.point(), 0.2)), "drawn")
        elif kind == "revive":
            s.revive_robot(r.choice([*s.setup(s.panes[0]).failed, 9]))
        elif kind == "enter":
            branch = r.choice(s.document.list_branches())
            s.enter(branch.node, r.randint(branch.node.first_step, branch.node.last_step))
        elif kind in ("past", "branch"):
            s.look_at(s.end * r.random())
            if kind == "branch":
                s.branch()
        else:
            deeds = {
                "fail": lambda: s.fail_robot(r.choice(s.numbers)),
                "join": lambda: s.add_robot(self.point()),
                "leave": lambda: s.remove_robot(r.choice(s.numbers)),
                "place": lambda: s.place(r.choice(s.numbers), self.point()),
                "gain": lambda: s.set_law(
                    s.panes[0], s.panes[0].controller.with_gain("k_rep", r.uniform(0, 2))
                ),
                "limits": lambda: s.set_limits(RobotProperties(max_speed=r.uniform(0.2, 2))),
                "paint": self.paint,
                "undo": s.undo,
                "redo": s.redo,
                "restart": lambda: s.restart(seed=r.randint(0, 9)),
                "pane": lambda: s.add_pane(LLOYD),
                "drop": lambda: s.remove_pane(s.panes[-1]),
            }
            deeds[kind]()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_a_random_story_is_made_again_bit_for_bit(seed: int) -> None:
    monkey = Monkey(seed)
    session = monkey.session
    for _ in range(monkey.random.randint(3, 14)):
        with suppress(RobocovError):
            monkey.act(monkey.random.choice(KINDS))
        monkey.play(monkey.random.randint(0, 12))
    session.show_time(session.timeline.end_time)
    text = format_session(
        build_session_content(session.timeline.document, session.timeline.head, session.timeline.step, {})
    )
    twin = Session.open(parse_session(json.loads(text), "twin"))
    compare(session, twin)
    for branch in session.timeline.document.list_branches():
        for one, node in ((session, branch.node), (twin, twin.timeline.document.nodes[branch.node.number])):
            one.seek(node)
            one.timeline.finish_seek()
        compare(session, twin)


def compare(one: Session, other: Session) -> None:
    assert one.timeline.drag == other.timeline.drag and len(one.timeline.panes) == len(other.timeline.panes)
    for mine, theirs in zip(positions_of(one), positions_of(other), strict=True):
        np.testing.assert_array_equal(mine, theirs)
