"""A lesson at school: draw, fail, branch, compare, undo, redo, save, lose power, go on, hand on the file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from driven_window import Driver, open_viewer
from sample_sessions import RAPF, get_positions

from robocov.environment import Environment
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.viewer.session.files.session_file import load_session
from robocov_app.viewer.session.files.workspace import (
    SessionWorkspace,
    find_recoverable_drafts,
    recover_draft,
)
from robocov_app.viewer.session.session import Session

ROOM = Environment("room", ((0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0)))


def state(session: Session) -> tuple[list[np.ndarray], float, tuple[int, ...], int]:
    return (
        get_positions(session),
        session.timeline.end_time,
        session.displayed.numbers,
        len(session.displayed.environment.obstacles),
    )


def assert_same(one: tuple, other: tuple) -> None:
    assert one[1:] == other[1:]
    for mine, theirs in zip(one[0], other[0], strict=True):
        np.testing.assert_array_equal(mine, theirs)


def play(driver: Driver) -> None:
    driver.session.playback.is_playing = True
    driver.frames(10)
    driver.session.playback.is_playing = False


@pytest.mark.slow
def test_the_same_numbers_come_out_everywhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    left = tmp_path / "left"
    with open_viewer(tmp_path, RAPF, environment=ROOM, robots=4) as driver:
        driver.viewer.files.workspace = SessionWorkspace(driver.session, left)
        play(driver)
        driver.key("w")
        driver.click_at((3.0, 0.02))
        driver.click_at((3.0, 2.0))
        driver.key("return")
        driver.key("v")
        play(driver)
        driver.click(*driver.robot(2))
        driver.key("shift+d")
        play(driver)
        failed = state(driver.session)
        driver.viewer.playback.look_at(0.3)  # before it failed
        driver.key("b")
        play(driver)
        driver.key("k")  # compare: all begin anew
        play(driver)
        compared = state(driver.session)
        assert [
            len(driver.session.timeline.document.list_branches()),
            len(driver.session.timeline.panes),
        ] == [
            2,
            2,
        ]
        undone = 0
        while driver.session.timeline.head.parent is not None:
            driver.key("ctrl+z")
            undone += 1
        assert (
            undone == 2
            and driver.session.timeline.end_time == 0.2
            and not driver.session.displayed.environment.obstacles
        )
        for _ in range(undone):
            driver.key("ctrl+y")
        assert_same(state(driver.session), compared)
        driver.key("ctrl+s")
        file = driver.viewer.files.workspace.path
        assert file is not None
        play(driver)
        driver.click(*driver.robot(1))
        driver.key("shift+d")
        play(driver)
        last = state(driver.session)
        workspace = driver.viewer.files.workspace
        workspace._draft_time = -1e9
        workspace.save_draft({})
        assert workspace._autosaver.flush()
        workspace._autosaver._lock.close()  # kill -9
    (found,) = find_recoverable_drafts(left)
    again, _ = recover_draft(found, (), left)
    assert_same(state(again.session), last)
    branch = next(
        each
        for each in again.session.timeline.document.list_branches()
        if each.description == "robot 2 failed"
    )
    again.session.seek(branch.node)
    assert_same(state(again.session), failed)
    again.close()
    assert_same(state(Session.open(load_session(file))), compared)
    small = ["--lattice", "16", "--size", "320x240", "--fps", "5", "--video", "--json"]
    assert main(["run", str(file), "--all-branches", "--out", str(tmp_path / "told"), *small]) == 0
    stories = json.loads(capsys.readouterr().out)["stories"]
    assert [story["parts"][-1]["words"] for story in stories] == ["robot 2 failed", "RPF compared"]
    ends = [
        [Record.load(path.parent).positions[-1] for path in sorted(folder.glob("**/record.npz"))]
        for folder in (Path(story["out"]) / story["parts"][-1]["folder"] for story in stories)
    ]
    np.testing.assert_array_equal(ends[0][0], failed[0][0])
    for mine, theirs in zip(
        sorted(map(np.ndarray.tolist, ends[1])), sorted(map(np.ndarray.tolist, compared[0])), strict=True
    ):
        assert mine == theirs
    assert all(next(Path(story["out"]).glob("*.mp4")).stat().st_size > 1000 for story in stories)
