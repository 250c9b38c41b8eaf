"""A long use of the viewer: draw, fail, branch, compare, undo, redo, save, crash, recover and run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from driven_window import Driver, open_viewer
from sample_sessions import RAPF, get_positions

from robocov.environment import Environment
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.viewer.session.files.drafts import find_recoverable_drafts
from robocov_app.viewer.session.files.session_file import load_session
from robocov_app.viewer.session.files.workspace import SessionWorkspace, recover_draft
from robocov_app.viewer.session.session import Session

ROOM = Environment("room", ((0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0)))


class SessionSummary(NamedTuple):
    """Positions in each pane, time, robots and number of obstacles of a session."""

    positions: list[np.ndarray]
    end_time: float
    numbers: tuple[int, ...]
    obstacles: int


def summarize(session: Session) -> SessionSummary:
    return SessionSummary(
        get_positions(session),
        session.timeline.end_time,
        session.displayed.numbers,
        len(session.displayed.environment.obstacles),
    )


def assert_equal(first: SessionSummary, second: SessionSummary) -> None:
    assert first[1:] == second[1:]
    for first_positions, second_positions in zip(first.positions, second.positions, strict=True):
        np.testing.assert_array_equal(first_positions, second_positions)


def play(driver: Driver) -> None:
    driver.session.playback.is_playing = True
    driver.run_frames(10)
    driver.session.playback.is_playing = False


@pytest.mark.slow
def test_a_session_is_the_same_after_undo_recovery_loading_and_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drafts = tmp_path / "drafts"
    with open_viewer(tmp_path, RAPF, environment=ROOM, robots=4) as driver:
        driver.viewer.files.workspace = SessionWorkspace(driver.session, drafts)
        play(driver)
        driver.press_key("w")
        driver.click_at((3.0, 0.02))
        driver.click_at((3.0, 2.0))
        driver.press_key("return")
        driver.press_key("v")
        play(driver)
        driver.click(*driver.find_robot_pixel(2))
        driver.press_key("shift+d")
        play(driver)
        failed = summarize(driver.session)
        driver.viewer.playback.show_time(0.3)  # before the failure
        driver.press_key("b")
        play(driver)
        driver.press_key("k")
        driver.press_key("return")  # adds a pane, and restarts
        play(driver)
        compared = summarize(driver.session)
        assert len(driver.session.timeline.document.list_branches()) == 2
        assert len(driver.session.timeline.panes) == 2
        undone = 0
        while driver.session.timeline.head.parent is not None:
            driver.press_key("ctrl+z")
            undone += 1
        assert undone == 2
        assert driver.session.timeline.end_time == 0.2
        assert not driver.session.displayed.environment.obstacles
        for _ in range(undone):
            driver.press_key("ctrl+y")
        assert_equal(summarize(driver.session), compared)
        driver.press_key("ctrl+s")
        file = driver.viewer.files.workspace.path
        assert file is not None
        play(driver)
        driver.click(*driver.find_robot_pixel(1))
        driver.press_key("shift+d")
        play(driver)
        last = summarize(driver.session)
        workspace = driver.viewer.files.workspace
        workspace._draft_time = -1e9
        workspace.save_draft({})
        assert workspace._autosaver.flush()
        workspace._autosaver._lock.close()  # simulates that the process is killed
    (draft,) = find_recoverable_drafts(drafts)
    recovered, _ = recover_draft(draft, (), drafts)
    assert_equal(summarize(recovered.session), last)
    branches = recovered.session.timeline.document.list_branches()
    (branch,) = [branch for branch in branches if branch.description == "robot 2 failed"]
    recovered.session.seek(branch.node)
    assert_equal(summarize(recovered.session), failed)
    recovered.close()
    assert_equal(summarize(Session.open(load_session(file))), compared)
    options = ["--lattice", "16", "--size", "320x240", "--fps", "5", "--video", "--json"]
    assert main(["run", str(file), "--all-branches", "--out", str(tmp_path / "runs"), *options]) == 0
    saved_branches = json.loads(capsys.readouterr().out)["branches"]
    descriptions = [branch["parts"][-1]["description"] for branch in saved_branches]
    assert descriptions == ["robot 2 failed", "RPF compared"]
    for branch, expected in zip(saved_branches, (failed, compared), strict=True):
        folder = Path(branch["out"]) / branch["parts"][-1]["folder"]
        ends = [Record.load(path.parent).positions[-1].tolist() for path in folder.glob("**/record.npz")]
        # The folders of the controllers are in another order than the panes.
        assert sorted(ends) == sorted(positions.tolist() for positions in expected.positions)
        (video,) = Path(branch["out"]).glob("*.mp4")
        assert video.stat().st_size > 1000
