"""The file of a session, what is kept aside of it, and a start that offers it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from driven_window import opened
from sample_sessions import advance_session, build_presenter, get_positions, start_session

from robocov.errors import MapError
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.workspace import (
    DRAFT_KIND,
    SessionWorkspace,
    describe_draft,
    find_recoverable_drafts,
    recover_draft,
)


def kept(workspace: SessionWorkspace) -> None:
    """Keep a copy now, and end without a word, as kill -9 does."""
    workspace._when = -1e9
    workspace.save_draft({"theme": "light"})
    assert workspace._autosaver.flush()
    workspace._autosaver._lock.close()


def test_what_was_not_saved_is_offered_and_gone_on_with(tmp_path: Path) -> None:
    session = start_session()
    workspace = SessionWorkspace(session, tmp_path)
    workspace.save_draft({})
    assert not workspace.has_unsaved_edits
    advance_session(session, 20).fail_robot(2)
    advance_session(session, 10)
    kept(workspace)
    (found,) = find_recoverable_drafts(tmp_path)
    assert "1 edit, " in describe_draft(found) and describe_draft(found).endswith("never saved")
    again, view = recover_draft(found, (), tmp_path)
    assert view == {"theme": "light"} and again.has_unsaved_edits
    assert (
        again.session.displayed.numbers == (1, 3)
        and again.session.timeline.end_time == session.timeline.end_time
    )
    for mine, theirs in zip(get_positions(again.session), get_positions(session), strict=True):
        assert (mine == theirs).all()
    again.save(tmp_path, {}, tmp_path / "story.robocov")
    assert not again.has_unsaved_edits
    again.close()
    assert find_recoverable_drafts(tmp_path) == ()


@pytest.mark.parametrize("session", [None, [], {}, {"touches": 3}])
def test_a_broken_draft_is_not_offered(session: object, tmp_path: Path) -> None:
    place = tmp_path / "broken"
    place.mkdir()
    head = {"format": DRAFT_KIND, "version": 1, "path": None, "when": "2030-05-17T12:00:00"}
    (place / "draft.json").write_text(json.dumps(head | {"session": session}))
    assert find_recoverable_drafts(tmp_path) == ()
    assert (place / "draft.json").exists()


def test_a_session_that_was_saved_and_closed_leaves_nothing(tmp_path: Path) -> None:
    session = advance_session(start_session(), 5)
    workspace = SessionWorkspace(session, tmp_path / "kept")
    session.fail_robot(1)
    path = workspace.save(tmp_path, {})
    assert path == tmp_path / "hall-1.robocov" and not workspace.has_unsaved_edits
    session.fail_robot(2)
    assert workspace.has_unsaved_edits and workspace.save(tmp_path, {}) == path
    workspace.close()
    assert find_recoverable_drafts(tmp_path / "kept") == ()


def test_ctrl_q_with_work_that_is_not_saved_keeps_it(tmp_path: Path) -> None:
    session = advance_session(start_session(), 5)
    workspace = SessionWorkspace(session, tmp_path)
    session.fail_robot(1)
    workspace.save_draft({})
    workspace.close()
    assert len(find_recoverable_drafts(tmp_path)) == 1


def test_a_session_is_saved_opened_and_its_branches_walked_in_the_window(tmp_path: Path) -> None:
    with opened(tmp_path) as driver:
        advance_session(driver.session, 10).fail_robot(2)
        advance_session(driver.session, 10)
        driver.key("ctrl+z")
        assert driver.viewer.message.startswith("undone: robot 2 failed; back at 0.2 s")
        driver.session.fail_robot(1)
        driver.key("ctrl+s")
        (path,) = tmp_path.glob("*.robocov")
        assert str(path) in driver.viewer.message
        driver.key("alt+left")
        assert (
            driver.viewer.message == "branch 1 of 2: robot 2 failed"
            and driver.session.displayed.numbers == (1, 3)
        )
        driver.key("alt+right")
        assert driver.session.displayed.numbers == (2, 3)
        driver.window.commands.typed(f"open {path}")
        driver.frames(2)
        assert (
            driver.viewer.session.displayed.numbers == (2, 3)
            and len(driver.viewer.session.timeline.document.list_branches()) == 2
        )
        driver.window.commands.typed("branch 1")
        assert driver.viewer.session.displayed.numbers == (1, 3)


def test_a_file_that_is_none_is_refused_and_all_stays(tmp_path: Path) -> None:
    viewer: Presenter = build_presenter(folder=tmp_path)
    (tmp_path / "no.robocov").write_text("{}")
    before = viewer.session
    with pytest.raises(MapError, match="format: missing"):
        viewer.files.open_session(tmp_path / "no.robocov")
    assert viewer.session is before


@pytest.mark.slow
def test_a_click_on_a_ghost_curve_enters_its_branch(tmp_path: Path) -> None:
    with opened(tmp_path) as driver:
        driver.session.playback.is_playing = True
        driver.frames(90)
        driver.session.fail_robot(2)
        driver.frames(90)
        driver.key("ctrl+z")
        driver.frames(30)
        ((node, points),) = driver.window.chart._ghosts
        x, y = points[-1].tolist()
        driver.click(x, y + driver.window.layout.chart[1])
        assert (
            driver.viewer.message == "branch 1 of 2: robot 2 failed"
            or "robot 2 failed" in driver.viewer.message
        )
        assert driver.session.timeline.head.number == node and driver.session.displayed.numbers == (1, 3)
