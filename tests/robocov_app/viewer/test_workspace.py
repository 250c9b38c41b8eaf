"""The file of a session, its drafts, and the recovery of unsaved work."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from driven_window import open_viewer
from sample_sessions import HALL, advance_session, build_presenter, get_positions, start_session

from robocov.errors import MapError
from robocov.mapfile import load_map
from robocov_app.viewer.session.files.drafts import DRAFT_KIND, describe_draft, find_recoverable_drafts
from robocov_app.viewer.session.files.workspace import SessionWorkspace, recover_draft


def crash_after_draft(workspace: SessionWorkspace) -> None:
    """Save a draft, and release its lock without closing the workspace, as when the process is killed."""
    workspace.save_draft({"theme": "light"}, at_once=True)
    assert workspace._autosaver.flush()
    workspace._autosaver._lock.close()


def test_unsaved_work_is_recovered(tmp_path: Path) -> None:
    session = start_session()
    workspace = SessionWorkspace(session, tmp_path)
    workspace.save_draft({})
    assert not workspace.has_unsaved_edits
    advance_session(session, 20).fail_robot(2)
    advance_session(session, 10)
    crash_after_draft(workspace)
    (draft,) = find_recoverable_drafts(tmp_path)
    description = describe_draft(draft)
    assert re.match(r"Unsaved session of \w+, \d\d:\d\d, 1 edit", description)
    recovered, view = recover_draft(draft, (), tmp_path)
    assert view == {"theme": "light"}
    assert recovered.has_unsaved_edits
    assert recovered.session.displayed.numbers == (1, 3)
    assert recovered.session.timeline.end_time == session.timeline.end_time
    for positions, expected in zip(get_positions(recovered.session), get_positions(session), strict=True):
        np.testing.assert_array_equal(positions, expected)
    recovered.save(tmp_path, {}, tmp_path / "session.robocov")
    assert not recovered.has_unsaved_edits
    recovered.close()
    assert find_recoverable_drafts(tmp_path) == ()


@pytest.mark.parametrize("session", [None, [], {}, {"edits": 3}, {"touches": 3}])
def test_a_damaged_draft_is_not_offered(session: object, tmp_path: Path) -> None:
    folder = tmp_path / "damaged"
    folder.mkdir()
    header = {"format": DRAFT_KIND, "version": 1, "path": None, "when": "2030-05-17T12:00:00"}
    (folder / "draft.json").write_text(json.dumps(header | {"session": session}))
    assert find_recoverable_drafts(tmp_path) == ()
    assert (folder / "draft.json").exists()


def test_a_session_that_was_saved_and_closed_leaves_no_draft(tmp_path: Path) -> None:
    session = advance_session(start_session(), 5)
    workspace = SessionWorkspace(session, tmp_path / "drafts")
    session.fail_robot(1)
    path = workspace.save(tmp_path, {})
    assert path == tmp_path / "hall-1.robocov"
    assert not workspace.has_unsaved_edits
    session.fail_robot(2)
    assert workspace.has_unsaved_edits
    assert workspace.save(tmp_path, {}) == path
    workspace.close()
    assert find_recoverable_drafts(tmp_path / "drafts") == ()


@pytest.mark.parametrize(
    ("map_name", "stem"), [("Floor 1/A", "floor-1-a"), ("../escaped", "escaped"), (" ", "session")]
)
def test_any_name_of_a_map_gives_a_file_in_the_folder(tmp_path: Path, map_name: str, stem: str) -> None:
    folder = tmp_path / "sessions"
    folder.mkdir()
    viewer = build_presenter(environment=replace(HALL, name=map_name), folder=folder)
    assert viewer.files.save_copy() == folder / f"{stem}-copy-1.robocov"
    assert viewer.files.workspace.save(folder, {}) == folder / f"{stem}-1.robocov"


def test_a_session_that_is_closed_with_unsaved_edits_leaves_a_draft(tmp_path: Path) -> None:
    session = advance_session(start_session(), 5)
    workspace = SessionWorkspace(session, tmp_path)
    session.fail_robot(1)
    workspace.save_draft({})
    workspace.close()
    assert len(find_recoverable_drafts(tmp_path)) == 1


def test_drafts_are_not_saved_at_each_frame(tmp_path: Path) -> None:
    session = advance_session(start_session(), 5)
    workspace = SessionWorkspace(session, tmp_path)
    session.fail_robot(1)
    workspace.save_draft({})
    drafted_state = workspace._drafted_state
    advance_session(session, 1)
    workspace.save_draft({})
    assert workspace._drafted_state == drafted_state
    workspace.save_draft({}, at_once=True)
    assert workspace._drafted_state != drafted_state
    workspace.close()


def test_a_draft_contains_an_undo_at_the_same_step(tmp_path: Path) -> None:
    session = advance_session(start_session(), 5)
    workspace = SessionWorkspace(session, tmp_path)
    session.fail_robot(2)
    workspace.save_draft({}, at_once=True)
    session.undo()
    crash_after_draft(workspace)
    (draft,) = find_recoverable_drafts(tmp_path)
    recovered, _ = recover_draft(draft, (), tmp_path)
    assert recovered.session.displayed.numbers == (1, 2, 3)
    recovered.close()


def test_a_session_is_saved_and_opened_in_the_window(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        advance_session(driver.session, 10).fail_robot(2)
        advance_session(driver.session, 10)
        driver.press_key("ctrl+z")
        assert driver.viewer.message.startswith("Undone: robot 2 failed; back at 0.2 s")
        driver.session.fail_robot(1)
        driver.press_key("ctrl+s")
        (path,) = tmp_path.glob("*.robocov")
        assert str(path) in driver.viewer.message
        driver.window.commands.run_text(f"open {path}")
        driver.run_frames(2)
        session = driver.viewer.session
        assert session.displayed.numbers == (2, 3)
        assert len(session.timeline.document.list_branches()) == 2
        driver.window.commands.run_text("branch 1")
        assert session.displayed.numbers == (1, 3)


def test_branches_are_entered_by_keys(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        advance_session(driver.session, 10).fail_robot(2)
        advance_session(driver.session, 10)
        driver.session.undo()
        driver.session.fail_robot(1)
        driver.press_key("alt+left")
        assert driver.viewer.message == "Branch 1 of 2: robot 2 failed"
        assert driver.session.displayed.numbers == (1, 3)
        driver.press_key("alt+right")
        assert driver.session.displayed.numbers == (2, 3)


def test_a_file_that_is_not_a_session_is_rejected(tmp_path: Path) -> None:
    viewer = build_presenter(folder=tmp_path)
    (tmp_path / "invalid.robocov").write_text("{}")
    session = viewer.session
    with pytest.raises(MapError, match="format: missing"):
        viewer.files.open_session(tmp_path / "invalid.robocov")
    assert viewer.session is session


@pytest.mark.slow
def test_a_click_on_a_ghost_curve_enters_its_branch(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.session.playback.is_playing = True
        driver.run_frames(90)
        driver.session.fail_robot(2)
        driver.run_frames(90)
        driver.press_key("ctrl+z")
        driver.run_frames(30)
        ((node, points),) = driver.window.chart.ghosts
        x, y = points[-1].tolist()
        driver.click(x, y + driver.window.layout.chart.top)
        assert "robot 2 failed" in driver.viewer.message
        assert driver.session.timeline.head.number == node
        assert driver.session.displayed.numbers == (1, 3)


def test_a_draft_of_a_file_names_the_file(tmp_path: Path) -> None:
    workspace = SessionWorkspace(start_session(), tmp_path, tmp_path / "story.robocov")
    advance_session(workspace.session, 5).fail_robot(2)
    crash_after_draft(workspace)
    (draft,) = find_recoverable_drafts(tmp_path)
    assert re.match(r"Unsaved changes to story\.robocov, \d\d:\d\d, 1 edit", describe_draft(draft))


def test_a_session_that_another_one_replaces_can_be_recovered(tmp_path: Path) -> None:
    viewer = build_presenter(folder=tmp_path, draft_folder=tmp_path / "drafts")
    other = tmp_path / "other.robocov"
    viewer.files.save_session(other)
    viewer.session.fail_robot(2)
    viewer.files.open_session(other)
    assert viewer.message.endswith("Your unsaved session is kept: Ctrl+Shift+O opens it.")
    assert viewer.session.displayed.numbers == (1, 2, 3)
    viewer.session.fail_robot(3)
    message = viewer.files.recover()
    assert viewer.session.displayed.numbers == (1, 3)
    assert message.startswith("recovered: unsaved changes to other.robocov, ")
    assert message.endswith(
        "It is paused: press Space or Play to continue. Your unsaved session is kept: Ctrl+Shift+O opens it."
    )
    viewer.view.is_compact = True
    assert "It is paused: tap Play to continue." in viewer.files.recover()
    assert viewer.session.displayed.numbers == (1, 2)
    viewer.files.workspace.close()


def test_the_title_is_the_name_of_the_map_for_people(tmp_path: Path) -> None:
    viewer = build_presenter(environment=load_map("rooms"))
    viewer.files.map_name = "rooms"
    assert viewer.files.title == "Rooms • robocov"
    viewer.files.map_name = "folder/hall-2.json"
    assert viewer.files.title == "hall-2.json • robocov"
