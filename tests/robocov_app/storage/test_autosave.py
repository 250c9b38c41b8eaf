"""Drafts are written in a thread, and recovered after their program was killed."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from robocov.errors import OutputError
from robocov_app.storage import autosave
from robocov_app.storage.autosave import (
    FOLDER_VARIABLE,
    Autosaver,
    find_draft_folder,
    find_drafts,
    is_open_elsewhere,
    remove_draft,
)
from robocov_app.web.confined import confine_files

KIND = "robocov-test"

PROGRAM = """
import sys
from pathlib import Path
from robocov_app.storage.autosave import Autosaver

path = None if sys.argv[2] == "none" else Path(sys.argv[2])
autosaver = Autosaver(Path(sys.argv[1]), "robocov-test", path)
for k in range(100_000):
    autosaver.save_draft(lambda k=k: {"work": k})
    if k == 4:
        assert autosaver.flush()
        print("saved", flush=True)
        sys.stdin.readline()
"""


def find_test_drafts(folder: Path | None) -> tuple[dict, ...]:
    return find_drafts(folder, KIND, lambda draft: draft if "work" in draft.content else None)


def list_works(folder: Path) -> list[object]:
    return [record.content["work"] for record in find_test_drafts(folder)]


def start_program(folder: Path, path: str) -> subprocess.Popen[str]:
    """Start a program that has saved its work 4, and continues after a line of input."""
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(folder), path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "saved\n"
    return process


def kill(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.wait()
    for stream in (process.stdin, process.stdout):
        assert stream is not None
        stream.close()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "drafts"


def test_the_work_of_a_killed_program_is_found_and_continued(folder, tmp_path):
    path = tmp_path / "hall.json"
    process = start_program(folder, str(path))
    try:
        assert find_test_drafts(folder) == (), "the program is running"
        assert is_open_elsewhere(folder, KIND, path)
        assert not is_open_elsewhere(folder, KIND, tmp_path / "other.json")
        assert not is_open_elsewhere(folder, "robocov-other", path)
    finally:
        kill(process)
    assert not is_open_elsewhere(folder, KIND, path)
    (record,) = find_test_drafts(folder)
    assert (record.path, record.content) == (path, {"work": 4})
    assert find_drafts(folder, "robocov-other", lambda draft: draft) == (), "the draft has another kind"
    # The work continues in the same folder, which is not offered to other programs.
    autosaver = Autosaver(folder, KIND, record.path, record.folder)
    assert find_test_drafts(folder) == ()
    with pytest.raises(OutputError, match="another process"):
        Autosaver(folder, KIND, None, record.folder)
    autosaver.save_draft(lambda: {"work": 5})
    assert autosaver.flush()
    autosaver.close(discard=False)
    (record,) = find_test_drafts(folder)
    assert (record.path, record.content) == (path, {"work": 5})
    remove_draft(record.folder)
    assert find_test_drafts(folder) == ()
    assert list(folder.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("delay_s", [0.0, 0.02, 0.1, 0.3])
def test_a_program_that_is_killed_while_it_writes_leaves_a_complete_draft(folder, delay_s):
    process = start_program(folder, "none")
    assert process.stdin is not None
    process.stdin.write("\n")
    process.stdin.flush()
    time.sleep(delay_s)
    kill(process)
    (record,) = find_test_drafts(folder)
    assert record.content["work"] >= 4
    assert record.path is None


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_the_draft_of_a_suspended_program_is_not_offered(folder):
    process = start_program(folder, "none")
    process.send_signal(signal.SIGSTOP)
    try:
        assert find_test_drafts(folder) == ()
    finally:
        process.send_signal(signal.SIGCONT)
        kill(process)
    assert len(find_test_drafts(folder)) == 1


def test_each_program_has_its_own_draft(folder):
    first = Autosaver(folder, KIND)
    second = Autosaver(folder, KIND)
    first.save_draft(lambda: {"work": 1})
    second.save_draft(lambda: {"work": 2})
    assert first.flush()
    assert second.flush()
    assert len(list(folder.iterdir())) == 2
    first.close(discard=False)
    assert list_works(folder) == [1]
    second.close(discard=True)
    assert len(list(folder.iterdir())) == 1


def test_saved_work_has_no_draft(folder, tmp_path):
    autosaver = Autosaver(folder, KIND)
    autosaver.save_draft(lambda: {"work": 1})
    assert autosaver.flush()
    autosaver.mark_saved(tmp_path / "hall.json")
    assert autosaver.flush()
    assert is_open_elsewhere(folder, KIND, tmp_path / "hall.json")
    autosaver.close(discard=False)
    assert list(folder.iterdir()) == []


def test_saving_a_draft_does_not_wait_and_only_the_newest_is_written(folder):
    was_opened = []
    gate = threading.Event()

    def build_content(number: int) -> dict[str, int]:
        was_opened.append(gate.wait(60.0))
        return {"work": number}

    autosaver = Autosaver(folder, KIND)
    for number in range(200):
        autosaver.save_draft(lambda number=number: build_content(number))
    assert len(was_opened) <= 1
    gate.set()
    assert autosaver.flush()
    assert all(was_opened), "no draft had to wait until the time limit"
    assert len(was_opened) <= 2
    autosaver.close(discard=False)
    assert list_works(folder) == [199]


def test_a_failed_draft_is_reported_and_retried(folder, monkeypatch):
    monkeypatch.setattr(autosave, "_RETRY_S", 0.05)
    autosaver = Autosaver(folder, KIND)
    is_full = threading.Event()
    is_full.set()

    def build_content() -> dict[str, int]:
        if is_full.is_set():
            raise OSError(28, "No space left on device")
        return {"work": 2}

    autosaver.save_draft(build_content)
    assert not autosaver.flush()
    assert "No space left" in autosaver.problem
    is_full.clear()
    end = time.monotonic() + 60.0
    while autosaver.problem and time.monotonic() < end:
        time.sleep(0.01)
    assert autosaver.flush()
    autosaver.close(discard=False)
    assert list_works(folder) == [2]


def test_without_a_folder_for_drafts_programs_still_work(tmp_path):
    (tmp_path / "file").write_text("")
    autosaver = Autosaver(tmp_path / "file" / "drafts", KIND)
    assert "cannot be saved" in autosaver.problem
    autosaver.save_draft(dict)
    assert not autosaver.flush()
    autosaver.close(discard=False)
    without_folder = Autosaver(None, KIND)
    without_folder.save_draft(dict)
    assert without_folder.problem == ""
    assert without_folder.flush()
    without_folder.mark_saved(None)
    without_folder.close(discard=True)
    assert find_test_drafts(None) == ()
    assert not is_open_elsewhere(None, KIND, tmp_path / "x")
    assert find_test_drafts(tmp_path / "none") == ()


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "[]",
        '{"format": "robocov-test"}',
        '{"format": "robocov-test", "version": 1, "path": 3, "when": "2030-05-17T12:00:00", "work": 1}',
        '{"format": "robocov-test", "version": 1, "path": null, "when": "x", "work": 1}',
        '{"format": "robocov-test", "version": 2, "path": null, "when": "2030-05-17T12:00:00", "work": 1}',
        '{"format": "robocov-test", "version": 1, "path": null, "when": "0001-01-01T00:00+14:00", "work": 1}',
        '{"format": "robocov-test", "version": 1, "path": {"bytes": "x"}, "when": "2030-05-17", "work": 1}',
    ],
)
def test_unreadable_drafts_are_left_alone(folder, content):
    draft_folder = folder / "broken"
    draft_folder.mkdir(parents=True)
    (draft_folder / "draft.json").write_text(content)
    os.utime(draft_folder, (0, 0))
    assert find_test_drafts(folder) == ()
    assert (draft_folder / "draft.json").read_text() == content


def test_a_draft_that_cannot_be_interpreted_is_left_alone(folder):
    autosaver = Autosaver(folder, KIND)
    autosaver.save_draft(lambda: {"work": 1})
    autosaver.close(discard=False)
    assert find_drafts(folder, KIND, lambda draft: draft.content["missing"]) == ()
    assert list_works(folder) == [1]


def test_content_that_cannot_be_written_does_not_stop_the_thread(folder):
    autosaver = Autosaver(folder, KIND)
    autosaver.save_draft(lambda: {"work": "\udcff"})
    assert not autosaver.flush() and "cannot be saved" in autosaver.problem
    autosaver.save_draft(lambda: {"work": 2})
    assert autosaver.flush() and autosaver.problem == ""
    autosaver.close(discard=False)
    assert list_works(folder) == [2]


def test_old_folders_without_a_draft_are_removed(folder):
    for name in ("young", "old"):
        (folder / name).mkdir(parents=True)
    (folder / "old" / ".lock").write_text("")
    os.utime(folder / "old", (0, 0))
    (folder / "a file").write_text("")
    assert find_test_drafts(folder) == ()
    assert sorted(path.name for path in folder.iterdir()) == ["a file", "young"]


def test_a_variable_selects_the_folder_of_drafts(monkeypatch, tmp_path):
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    assert find_draft_folder() == tmp_path
    monkeypatch.setenv(FOLDER_VARIABLE, "")
    assert find_draft_folder() is None
    monkeypatch.delenv(FOLDER_VARIABLE)
    assert find_draft_folder().name == "drafts"


def test_drafts_of_a_served_window_are_hidden_in_its_folder(monkeypatch, tmp_path):
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "elsewhere"))
    assert find_draft_folder(tmp_path) == tmp_path / ".drafts"
    monkeypatch.delenv(FOLDER_VARIABLE)
    assert find_draft_folder(tmp_path) == tmp_path / ".drafts"
    monkeypatch.setenv(FOLDER_VARIABLE, "")
    assert find_draft_folder(tmp_path) is None


def test_drafts_are_removed_while_files_are_confined(tmp_path, folder):
    autosaver = Autosaver(folder, KIND)
    autosaver.save_draft(lambda: {"work": 1})
    assert autosaver.flush()
    with confine_files(folder):
        autosaver.close(discard=True)
    assert list(folder.iterdir()) == []


def test_a_draft_is_a_documented_json_file(folder, tmp_path):
    autosaver = Autosaver(folder, KIND, tmp_path / "hall.json")
    autosaver.save_draft(lambda: {"work": "ø"})
    assert autosaver.flush()
    (file,) = folder.glob("*/draft.json")
    content = json.loads(file.read_text(encoding="utf-8"))
    content.pop("when")
    assert content == {"format": KIND, "version": 1, "path": str(tmp_path / "hall.json"), "work": "ø"}
    autosaver.close(discard=True)


def test_a_program_takes_another_folder_if_its_first_one_is_locked(folder, monkeypatch):
    attempted = []
    lock = autosave.lock_folder

    def fail_first(path):
        attempted.append(path)
        if len(attempted) == 1:
            raise OutputError(f"{path}: another process is using this folder")
        return lock(path)

    monkeypatch.setattr(autosave, "lock_folder", fail_first)
    autosaver = Autosaver(folder, KIND)
    assert autosaver.problem == ""
    assert autosaver.flush()
    assert len(attempted) == 2
    autosaver.close(discard=True)
