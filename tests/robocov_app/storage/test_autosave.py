"""Work that is kept aside in a thread, and found again after its program was killed."""

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
keeper = Autosaver(Path(sys.argv[1]), "robocov-test", path)
for k in range(100_000):
    keeper.save_draft(lambda k=k: {"work": k})
    if k == 4:
        assert keeper.flush()
        print("kept", flush=True)
        sys.stdin.readline()
"""


def found(folder: Path | None) -> tuple[dict, ...]:
    return find_drafts(folder, KIND, lambda record: record if "work" in record.content else None)


def works(folder: Path) -> list[object]:
    return [record.content["work"] for record in found(folder)]


def program(folder: Path, path: str) -> subprocess.Popen[str]:
    """Start a program that has kept its work 4, and goes on when it is told to."""
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(folder), path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "kept\n"
    return process


def killed(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.wait()
    for stream in (process.stdin, process.stdout):
        assert stream is not None
        stream.close()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "drafts"


def test_what_a_killed_program_did_is_found_again_and_goes_on(folder, tmp_path):
    path = tmp_path / "hall.json"
    process = program(folder, str(path))
    try:
        assert found(folder) == (), "it lives"
        assert is_open_elsewhere(folder, KIND, path)
        assert not is_open_elsewhere(folder, KIND, tmp_path / "other.json")
        assert not is_open_elsewhere(folder, "robocov-other", path)
    finally:
        killed(process)
    assert not is_open_elsewhere(folder, KIND, path)
    (record,) = found(folder)
    assert (record.path, record.content) == (path, {"work": 4})
    assert find_drafts(folder, "robocov-other", lambda record: record) == (), "that is for others"
    # it goes on in the same folder, and is offered to nobody else meanwhile
    keeper = Autosaver(folder, KIND, record.path, record.folder)
    assert found(folder) == ()
    with pytest.raises(OutputError, match="another process"):
        Autosaver(folder, KIND, None, record.folder)
    keeper.save_draft(lambda: {"work": 5})
    assert keeper.flush()
    keeper.close(discard=False)
    (record,) = found(folder)
    assert (record.path, record.content) == (path, {"work": 5})
    remove_draft(record.folder)
    assert found(folder) == ()
    assert list(folder.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("moment", [0.0, 0.02, 0.1, 0.3])
def test_killed_in_the_middle_of_writing_there_is_whole_work(folder, moment):
    process = program(folder, "none")
    assert process.stdin is not None
    process.stdin.write("\n")
    process.stdin.flush()
    time.sleep(moment)
    killed(process)
    (record,) = found(folder)
    assert record.content["work"] >= 4
    assert record.path is None


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_a_stopped_program_still_has_its_work(folder):
    process = program(folder, "none")
    process.send_signal(signal.SIGSTOP)
    try:
        assert found(folder) == ()
    finally:
        process.send_signal(signal.SIGCONT)
        killed(process)
    assert len(found(folder)) == 1


def test_programs_do_not_meet(folder):
    first, second = Autosaver(folder, KIND), Autosaver(folder, KIND)
    first.save_draft(lambda: {"work": 1})
    second.save_draft(lambda: {"work": 2})
    assert first.flush()
    assert second.flush()
    assert len(list(folder.iterdir())) == 2
    first.close(discard=False)
    assert works(folder) == [1]
    second.close(discard=True)
    assert len(list(folder.iterdir())) == 1


def test_what_was_saved_is_forgotten(folder, tmp_path):
    keeper = Autosaver(folder, KIND)
    keeper.save_draft(lambda: {"work": 1})
    assert keeper.flush()
    keeper.mark_saved(tmp_path / "hall.json")
    assert keeper.flush()
    assert is_open_elsewhere(folder, KIND, tmp_path / "hall.json")
    keeper.close(discard=False)
    assert list(folder.iterdir()) == []


def test_keeping_waits_for_nothing_and_only_the_newest_is_written(folder):
    asked = []
    gate = threading.Event()

    def work(number: int) -> dict[str, int]:
        asked.append(gate.wait(60.0))
        return {"work": number}

    keeper = Autosaver(folder, KIND)
    for number in range(200):
        keeper.save_draft(lambda number=number: work(number))
    assert len(asked) <= 1
    gate.set()
    assert keeper.flush()
    assert all(asked), "nobody had to wait until the gate gave up"
    assert len(asked) <= 2
    keeper.close(discard=False)
    assert works(folder) == [199]


def test_trouble_is_told_of_and_tried_again(folder, monkeypatch):
    monkeypatch.setattr(autosave, "_RETRY_S", 0.05)
    keeper = Autosaver(folder, KIND)
    full = threading.Event()
    full.set()

    def work() -> dict[str, int]:
        if full.is_set():
            raise OSError(28, "No space left on device")
        return {"work": 2}

    keeper.save_draft(work)
    assert not keeper.flush()
    assert "No space left" in keeper.problem
    full.clear()
    end = time.monotonic() + 60.0
    while keeper.problem and time.monotonic() < end:
        time.sleep(0.01)
    assert keeper.flush()
    keeper.close(discard=False)
    assert works(folder) == [2]


def test_where_nothing_can_be_kept_work_goes_on(tmp_path):
    (tmp_path / "file").write_text("")
    keeper = Autosaver(tmp_path / "file" / "drafts", KIND)
    assert "cannot be saved" in keeper.problem
    keeper.save_draft(dict)
    assert not keeper.flush()
    keeper.close(discard=False)
    nothing = Autosaver(None, KIND)
    nothing.save_draft(dict)
    assert nothing.problem == ""
    assert nothing.flush()
    nothing.mark_saved(None)
    nothing.close(discard=True)
    assert found(None) == ()
    assert not is_open_elsewhere(None, KIND, tmp_path / "x")
    assert found(tmp_path / "none") == ()


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
def test_what_cannot_be_read_is_left_alone(folder, content):
    place = folder / "broken"
    place.mkdir(parents=True)
    (place / "draft.json").write_text(content)
    os.utime(place, (0, 0))
    assert found(folder) == ()
    assert (place / "draft.json").read_text() == content


def test_a_draft_for_which_reading_raises_anything_is_left_alone(folder):
    keeper = Autosaver(folder, KIND)
    keeper.save_draft(lambda: {"work": 1})
    keeper.close(discard=False)
    assert find_drafts(folder, KIND, lambda record: record.content["missing"]) == ()
    assert works(folder) == [1]


def test_work_that_cannot_be_written_does_not_stop_the_thread(folder):
    keeper = Autosaver(folder, KIND)
    keeper.save_draft(lambda: {"work": "\udcff"})
    assert not keeper.flush() and "cannot be saved" in keeper.problem
    keeper.save_draft(lambda: {"work": 2})
    assert keeper.flush() and keeper.problem == ""
    keeper.close(discard=False)
    assert works(folder) == [2]


def test_folders_without_work_are_removed_when_they_are_old(folder):
    for name in ("young", "old"):
        (folder / name).mkdir(parents=True)
    (folder / "old" / ".lock").write_text("")
    os.utime(folder / "old", (0, 0))
    (folder / "a file").write_text("")
    assert found(folder) == ()
    assert sorted(place.name for place in folder.iterdir()) == ["a file", "young"]


def test_the_folder_can_be_named(monkeypatch, tmp_path):
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


def test_drafts_are_removed_where_only_one_folder_may_be_used(tmp_path, folder):
    keeper = Autosaver(folder, KIND)
    keeper.save_draft(lambda: {"work": 1})
    assert keeper.flush()
    with confine_files(folder):
        keeper.close(discard=True)
    assert list(folder.iterdir()) == []


def test_a_record_says_what_it_is(folder, tmp_path):
    keeper = Autosaver(folder, KIND, tmp_path / "hall.json")
    keeper.save_draft(lambda: {"work": "ø"})
    assert keeper.flush()
    (file,) = folder.glob("*/draft.json")
    held = json.loads(file.read_text(encoding="utf-8"))
    held.pop("when")
    assert held == {"format": KIND, "version": 1, "path": str(tmp_path / "hall.json"), "work": "ø"}
    keeper.close(discard=True)


def test_a_program_that_is_disturbed_while_it_begins_takes_another_folder(folder, monkeypatch):
    times = []
    lock = autosave.lock_folder

    def disturbed(place):
        times.append(place)
        if len(times) == 1:
            raise OutputError(f"{place}: another process is using this folder")
        return lock(place)

    monkeypatch.setattr(autosave, "lock_folder", disturbed)
    keeper = Autosaver(folder, KIND)
    assert keeper.problem == ""
    assert keeper.flush()
    assert len(times) == 2
    keeper.close(discard=True)
