"""The session as a document: made again bit for bit, in a file and out of it, branch by branch."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_sessions import (
    HALL,
    LLOYD,
    RAPF,
    advance_session,
    advance_with_costs,
    get_positions,
    start_session,
)

from robocov.conditions import Conditions, Failure, Join
from robocov.density import Gaussian, Gaussians
from robocov.environment import CircleObstacle, ObstaclePath
from robocov.errors import InputError, MapError, RobocovError
from robocov.mapfile import load_map
from robocov_app.cli import main
from robocov_app.viewer.session import playback as module
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.edits import SetDensity
from robocov_app.viewer.session.file import build_session_content, format_session, load_session, save_session
from robocov_app.viewer.session.file_models import build_session_schema
from robocov_app.viewer.session.map_edits import add_obstacle
from robocov_app.viewer.session.robot_properties import RobotProperties
from robocov_app.viewer.session.session import Session

ATLAS = ControllerChoice("atlas")
points = st.tuples(st.floats(0.2, 5.8), st.floats(0.2, 3.8))
touches = st.lists(
    st.tuples(
        st.sampled_from(
            [
                "drag",
                "draw",
                "fail",
                "join",
                "leave",
                "gain",
                "limits",
                "paint",
                "past",
                "undo",
                "redo",
                "restart",
            ]
        ),
        points,
        st.integers(1, 9),
    ),
    min_size=1,
    max_size=6,
)


def touched(session: Session, kind: str, point: tuple[float, float], k: int) -> None:
    """Do something with a session, as far as it can be done."""
    numbers = session.displayed.numbers
    with suppress(RobocovError):
        if kind == "drag":
            session.playback.is_playing = True
            for _ in range(k):
                session.drag_robot(numbers[k % len(numbers)], point)
                session.playback.advance(1 / 60)
            session.release()
        elif kind == "draw":
            session.edit_map(
                add_obstacle(session.displayed.environment, CircleObstacle(point, 0.2)), "circle drawn"
            )
        elif kind == "fail":
            session.fail_robot(numbers[k % len(numbers)])
        elif kind == "join":
            session.add_robot(point)
        elif kind == "leave":
            session.remove_robot(numbers[k % len(numbers)])
        elif kind == "gain":
            session.set_controller(
                session.timeline.panes[0], session.timeline.panes[0].controller.with_gain("k_rep", k / 5)
            )
        elif kind == "limits":
            session.set_properties(RobotProperties(max_speed=k / 5))
        elif kind == "paint":
            session.paint((point,), 0.7, lowers=k % 2 == 0, stroke=k)
        elif kind == "past":
            session.show_time(session.timeline.end_time * k / 10)
        elif kind == "restart":
            session.restart(seed=k)
        else:
            (session.undo if kind == "undo" else session.redo)()
    advance_session(session, k)


def again(session: Session) -> Session:
    """Return a session made of what a file of it holds, at the same moment, with nothing else known."""
    text = format_session(
        build_session_content(
            session.timeline.document, session.timeline.head, session.timeline.step, {"theme": "dark"}
        )
    )
    path = Path("again.robocov")
    from robocov_app.viewer.session.file import parse_session

    saved = parse_session(json.loads(text), str(path))
    assert saved.view == {"theme": "dark"}
    return Session.open(saved)


@pytest.mark.slow
@given(touches, st.sampled_from([(RAPF,), (LLOYD, RAPF), (ATLAS,)]), st.booleans())
@settings(max_examples=40)
def test_every_story_is_made_again_bit_for_bit(story, laws, moving):
    """Through undo, branches, restarts and contacts; with memory, and obstacles that move."""
    environment = HALL
    if moving:
        door = CircleObstacle((3.4, 2.0), 0.2, "cart", ObstaclePath(((3.4, 2.0), (3.4, 3.0)), 0.4))
        environment = replace(HALL, obstacles=(*HALL.obstacles, door))
    session = advance_session(start_session(*laws, environment=environment, robots=4, start="spread"), 5)
    for touch in story:
        touched(session, *touch)
    session.show_time(session.timeline.end_time)
    twin = again(session)
    assert twin.timeline.end_time == session.timeline.end_time
    assert twin.timeline.events == session.timeline.events
    for mine, theirs in zip(get_positions(twin), get_positions(session), strict=True):
        np.testing.assert_array_equal(mine, theirs)
    here = session.timeline.head, session.timeline.step
    for branch in session.timeline.document.list_branches():
        session.seek(branch.node)
        twin.seek(twin.timeline.document.nodes[branch.node.number])
        for mine, theirs in zip(get_positions(twin), get_positions(session), strict=True):
            np.testing.assert_array_equal(mine, theirs)
    session.seek(*here)


@pytest.mark.parametrize("how", ["undo", "branch", "touch"])
def test_a_run_that_goes_on_amid_a_drag_is_made_again_bit_for_bit(how: str) -> None:
    """What is left of the drag is played as it was; who touches something there has let go."""
    session = advance_session(start_session(RAPF), 5)
    session.playback.is_playing = True
    for k in range(60):
        session.drag_robot(2, (1.0 + k / 20, 2.0))
        session.playback.advance(1 / 60)
    session.release()
    session.show_time(0.5)
    if how == "branch":
        session.branch()
    else:
        session.fail_robot(1)
        advance_session(session, 5)
    if how == "undo":
        session.undo()
    advance_session(session, 80)
    assert session.timeline.drag is None
    twin = again(session)
    for mine, theirs in zip(get_positions(twin), get_positions(session), strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_all_of_a_gesture_while_paused_is_kept() -> None:
    """Dabs add up; robots that were slowed down by a limit do not become faster with the next."""
    session = advance_session(start_session(RAPF), 25)
    for speed in (1.0, 0.05, 1.0):
        session.set_properties(RobotProperties(max_speed=speed, radius=0.11))
    for x in (1.0, 2.0, 3.0):
        session.paint(((x, 2.0),), 0.7, lowers=False, stroke=1)
    advance_session(session, 20)
    for mine, theirs in zip(get_positions(again(session)), get_positions(session), strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_any_density_is_in_the_file_and_out_of_it() -> None:
    session = advance_session(start_session(RAPF), 5)
    for density in (Gaussians((Gaussian((2.0, 2.0), 0.5, 3.0),), 0.2), None):
        session.apply(SetDensity(density), "density", "density changed")
        advance_session(session, 5)
        twin = again(session)
        assert twin.displayed.environment.density == density
        np.testing.assert_array_equal(get_positions(twin)[0], get_positions(session)[0])


def test_limits_hold_for_controllers_without_memory_also_when_a_moment_is_resumed() -> None:
    session = advance_session(start_session(LLOYD), 5)
    session.set_properties(RobotProperties(max_speed=0.5))
    advance_session(session, 10)
    session.show_time(7 / 60)
    session.branch()
    advance_session(session, 20)
    for mine, theirs in zip(get_positions(again(session)), get_positions(session), strict=True):
        np.testing.assert_array_equal(mine, theirs)


@pytest.mark.slow
def test_it_is_the_same_with_conditions_and_in_another_process(tmp_path: Path) -> None:
    conditions = Conditions(
        loss=0.2,
        delay=0.1,
        position_noise=0.02,
        failures=(Failure(2, 0.5),),
        joins=(Join(4, 0.8, (3.0, 3.0)),),
        seed=3,
    )
    session = advance_session(start_session(RAPF, robots=4, conditions=conditions), 40)
    session.edit_map(add_obstacle(HALL, CircleObstacle((2.0, 3.0), 0.3)), "circle drawn")
    advance_session(session, 40)
    assert [event.text for event in session.timeline.events] == [
        "robot 2 failed",
        "circle drawn",
        "robot 4 joined",
    ]
    path = tmp_path / "story.robocov"
    save_session(path, session.timeline.document, session.timeline.head, session.timeline.step, {})
    script = (
        "import sys; from pathlib import Path\n"
        "from robocov_app.viewer.session.file import load_session\n"
        "from robocov_app.viewer.session.session import Session\n"
        "session = Session.open(load_session(Path(sys.argv[1])))\n"
        "sys.stdout.write(session.timeline.panes[0].simulation.positions.tobytes().hex())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(path)], capture_output=True, text=True, check=True
    )
    assert done.stdout.endswith(session.timeline.panes[0].simulation.positions.tobytes().hex())


def test_branches_are_a_tree_that_can_be_walked() -> None:
    session = advance_session(start_session(RAPF), 10)
    session.fail_robot(1)
    advance_with_costs(session, 20)
    failed = session.timeline.head
    assert session.undo() == "robot 1 failed" and session.displayed.time == 10 / 60
    session.add_robot((3.0, 3.0))
    advance_with_costs(session, 30)
    assert [branch.description for branch in session.timeline.document.list_branches()] == [
        "robot 1 failed",
        "robot 4 joined",
    ]
    (ghost,) = session.timeline.ghosts
    assert ghost.node == failed.number and ghost.times[-1] == pytest.approx(29 / 60)
    session.seek(session.timeline.document.nodes[ghost.node])
    assert session.displayed.numbers == (2, 3) and session.displayed.time == 30 / 60
    assert session.timeline.panes[0].distance_curve.last_time == pytest.approx(29 / 60), (
        "its curve is there again"
    )
    assert [ghost.node for ghost in session.timeline.ghosts] == [2]
    session.show_time(5 / 60)
    session.set_controller(session.timeline.panes[0], LLOYD)
    assert len(session.timeline.document.list_branches()) == 3, "nothing is lost by a touch in the past"


def test_branches_of_a_file_are_told_before_anybody_has_been_there(tmp_path: Path) -> None:
    session = advance_session(start_session(RAPF), 10)
    session.fail_robot(1)
    advance_with_costs(session, 20)
    session.undo()
    session.add_robot((3.0, 3.0))
    advance_with_costs(session, 20)
    path = tmp_path / "story.robocov"
    save_session(path, session.timeline.document, session.timeline.head, session.timeline.step, {})
    opened = Session.open(load_session(path))
    branches = opened.timeline.document.list_branches()
    told = [branch.describe_end(opened.timeline.scenario.dt) for branch in branches]
    assert sorted(told) == ["0.5 s", "0.5 s · 2.517 m"]


def test_a_long_way_back_is_made_in_slices(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SEEK_SLICE_S", 0.0)
    session = advance_session(start_session(RAPF), 400)
    session.fail_robot(1)
    advance_session(session, 5)
    for node in session.timeline.document.nodes:
        node.cached_states = []
    last, session.timeline.history = session.timeline.history.last, session.timeline.history.copy_until(0)
    session.timeline.history.append(last)
    before = session.displayed.time
    session.playback.clock.budget = 0.008
    session.seek(session.timeline.document.nodes[0], 390)
    slices = 0
    while session.displayed.time == before and session.displayed.numbers == (2, 3):
        session.playback.advance(1 / 60)
        slices += 1
    assert slices > 300
    assert session.displayed.time == pytest.approx(390 / 60) and session.displayed.numbers == (1, 2, 3)


def test_a_file_is_small_and_says_what_it_is(tmp_path: Path) -> None:
    rooms = load_map("rooms")
    session = advance_session(start_session(RAPF, environment=rooms, robots=6), 30)
    session.playback.is_playing = True
    for k in range(60):
        session.drag_robot(2, (3.0 + 0.01 * k, 2.0))
        session.playback.advance(1 / 60)
    session.release()
    path = tmp_path / "story.robocov"
    save_session(path, session.timeline.document, session.timeline.head, session.timeline.step, {})
    assert path.stat().st_size < 3000
    content = json.loads(path.read_text())
    assert content["maps"][0]["bundled"] == "rooms" and content["format"] == "robocov-session"
    import jsonschema

    jsonschema.Draft202012Validator(build_session_schema()).validate(content)
    (tmp_path / "changed.robocov").write_text(path.read_text().replace(content["maps"][0]["digest"], "0"))
    with pytest.raises(MapError, match=r'maps\[0\]\.digest: expected that of the map as it is now, got "0"'):
        load_session(tmp_path / "changed.robocov")


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (("head",), 9, "head: expected the number of a touch, 0 to 1, got 9"),
        (("step",), 999, "step: expected a step of the head, 10 to 30, got 999"),
        (("touches", 1, "parent"), 1, "touches[1].parent: expected null for the first"),
        (("touches", 1, "at"), 999, "touches[1].at: expected a step of touch 0, 0 to 10, got 999"),
        (("touches", 1, "changes", 0, "robot"), "two", 'changes[0].robot: expected an integer, got "two"'),
        (("touches", 1, "changes", 0, "do"), "fly", "touches[1].changes[0].do: expected one of 'drag', "),
        (("touches", 1, "changes"), [], "touches[1].changes: expected at least 1 item, got []"),
        (
            ("touches", 0, "changes", 0, "scenario", "robots"),
            0,
            "touches[0].changes[0].scenario.robots: expected greater than or equal to 1, got 0",
        ),
        (("touches", 0, "changes", 0, "scenario", "map"), 7, "scenario.map: expected the number of a map"),
        (("maps", 0, "boundary"), [], "maps[0]: boundary: "),
        (("version",), 2, "version: expected 1, got 2; it was written by a newer robocov"),
        (("nonsense",), 1, "nonsense: unknown key"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_with_its_place(tmp_path: Path, place, value, words) -> None:
    session = advance_session(start_session(RAPF), 10)
    session.fail_robot(1)
    advance_session(session, 20)
    content = json.loads(
        format_session(
            build_session_content(session.timeline.document, session.timeline.head, session.timeline.step, {})
        )
    )
    at = content
    for key in place[:-1]:
        at = at[key]
    at[place[-1]] = value
    path = tmp_path / "story.robocov"
    path.write_text(json.dumps(content))
    with pytest.raises(MapError) as caught:
        load_session(path)
    assert words in str(caught.value) and str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_what_cannot_be_done_again_is_said_with_the_file_and_the_touch(tmp_path: Path, capsys) -> None:
    session = advance_session(start_session(RAPF), 10)
    session.fail_robot(1)
    advance_session(session, 20)
    content = json.loads(
        format_session(
            build_session_content(session.timeline.document, session.timeline.head, session.timeline.step, {})
        )
    )
    content["touches"][1]["changes"][0]["robot"] = 77
    path = tmp_path / "story.robocov"
    path.write_text(json.dumps(content))
    assert main(["run", str(path), "--out", str(tmp_path / "told")]) == 2
    assert f"{path}: touches[1], “robot 1 failed”: there is no robot 77\n" in capsys.readouterr().err
    assert not (tmp_path / "told").exists()


def test_a_controller_of_ones_own_is_never_run_because_a_file_says_so(tmp_path: Path) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text(
        "import robocov as rc\nfrom dataclasses import dataclass\n\n@dataclass(frozen=True)\n"
        "class Mine(rc.Lloyd):\n    label = 'Mine'\n"
    )
    name = f"{mine}:Mine"
    session = advance_session(start_session(ControllerChoice(name)), 5)
    path = tmp_path / "story.robocov"
    save_session(path, session.timeline.document, session.timeline.head, session.timeline.step, {})
    with pytest.raises(InputError, match=f"open the session with --controller .*{mine.name}:Mine"):
        load_session(path)
    assert Session.open(load_session(path, [name])).timeline.end_time == session.timeline.end_time
