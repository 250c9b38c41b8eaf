import json
import os
import signal
import subprocess
import sys
import threading
import time
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from drawn_sketches import HALL

from robocov.environment import CircleObstacle
from robocov.errors import MapError, OutputError
from robocov_app.editor.model import autosave
from robocov_app.editor.model.autosave import (
    FOLDER,
    Autosave,
    Autosaver,
    autosave_folder,
    discard,
    opened_elsewhere,
    recoverable,
)
from robocov_app.editor.model.file import opened, saved, state_of
from robocov_app.editor.model.sketch import Sketch

SKETCH = Sketch("Hall", boundary=HALL)


def with_circles(count: int) -> Sketch:
    return SKETCH.added([CircleObstacle((k + 1.0, 1.0), 0.3) for k in range(count)])[0]


EDITOR = """
import sys, time
from pathlib import Path
from robocov.environment import CircleObstacle
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.model.autosave import Autosaver
from robocov_app.editor.model.file import opened

folder, path = Path(sys.argv[1]), Path(sys.argv[2])
sketch, disk = opened(path) if path.exists() else (Sketch("Hall"), None)
keeper = Autosaver(folder, path if path.exists() else None, disk)
for k in range(1000):
    sketch, _ = sketch.added([CircleObstacle((float(k), 1.0), 0.3)])
    keeper.keep(sketch)
    if k == 4:
        assert keeper.flush()
        print("kept", flush=True)
        sys.stdin.readline()
"""


def editor(folder: Path, path: Path) -> subprocess.Popen[str]:
    """Start an editor that has drawn five circles, and draws more when it is told to."""
    process = subprocess.Popen(
        [sys.executable, "-c", EDITOR, str(folder), str(path)],
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
def folder(tmp_path) -> Path:
    return tmp_path / "drafts"


def test_what_a_killed_editor_did_is_found_again(folder, tmp_path):
    path = tmp_path / "hall.json"
    disk = saved(SKETCH, path)
    process = editor(folder, path)
    assert recoverable(folder) == (), "it lives"
    assert opened_elsewhere(folder, path)
    assert not opened_elsewhere(folder, tmp_path / "other.json")
    killed(process)
    (draft,) = recoverable(folder)
    assert not opened_elsewhere(folder, path)
    assert (draft.path, draft.name, draft.obstacles, draft.disk) == (path, "Hall", 5, disk)
    assert len(draft.sketch().obstacles) == 5
    assert draft.words().startswith("“Hall”, 5 obstacles, today ")
    assert draft.words().endswith("not saved to hall.json")
    assert state_of(draft.disk) == "same"
    # it goes on in the same folder, and is offered to nobody else meanwhile
    keeper = Autosaver(folder, draft=draft)
    assert recoverable(folder) == ()
    with pytest.raises(OutputError, match="another process"):
        Autosaver(folder, draft=draft)
    keeper.keep(with_circles(6))
    assert keeper.flush()
    keeper.close(discard=False)
    (draft,) = recoverable(folder)
    assert draft.sketch() == with_circles(6)
    assert draft.path == path
    discard(draft)
    assert recoverable(folder) == ()
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("moment", [0.0, 0.02, 0.1, 0.3])
def test_killed_in_the_middle_of_writing_there_is_a_whole_draft(folder, tmp_path, moment):
    process = editor(folder, tmp_path / "none.json")
    assert process.stdin is not None
    process.stdin.write("\n")
    process.stdin.flush()
    time.sleep(moment)
    killed(process)
    (draft,) = recoverable(folder)
    assert 5 <= len(draft.sketch().obstacles) <= 1000
    assert draft.path is None
    assert draft.words().endswith("never saved")


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_a_stopped_editor_still_has_its_work(folder, tmp_path):
    process = editor(folder, tmp_path / "none.json")
    process.send_signal(signal.SIGSTOP)
    try:
        assert recoverable(folder) == ()
    finally:
        process.send_signal(signal.SIGCONT)
        killed(process)
    assert len(recoverable(folder)) == 1


def test_editors_do_not_meet(folder):
    first, second = Autosaver(folder), Autosaver(folder)
    first.keep(with_circles(1))
    second.keep(with_circles(2))
    assert first.flush()
    assert second.flush()
    assert len(list(folder.iterdir())) == 2
    first.close(discard=False)
    (draft,) = recoverable(folder)
    assert draft.obstacles == 1
    second.close(discard=True)
    assert len(list(folder.iterdir())) == 1


def test_what_was_saved_is_no_draft(folder, tmp_path):
    path = tmp_path / "hall.json"
    keeper = Autosaver(folder)
    keeper.keep(with_circles(3))
    assert keeper.flush()
    disk = saved(with_circles(3), path)
    keeper.settle(path, disk)
    assert keeper.flush()
    assert opened_elsewhere(folder, path)
    keeper.close(discard=False)
    assert recoverable(folder) == ()
    assert list(folder.iterdir()) == [], "nothing to keep"
    # and if it is killed between saving and settling
    keeper = Autosaver(folder, path, disk)
    keeper.keep(with_circles(3))
    keeper.close(discard=False)
    assert recoverable(folder) == (), "the file holds it already"
    saved(with_circles(4), path, disk)
    assert len(recoverable(folder)) == 1


def test_keeping_waits_for_nothing_and_only_the_newest_is_written(folder, monkeypatch):
    texts, waited = [], []
    gate = threading.Event()
    text = autosave._Job.text

    def held_up(job):
        texts.append(job)
        waited.append(gate.wait(60.0))
        return text(job)

    monkeypatch.setattr(autosave._Job, "text", held_up)
    keeper = Autosaver(folder)
    for count in range(200):
        keeper.keep(with_circles(count % 7))
    keeper.keep(with_circles(7))
    assert len(texts) <= 1
    gate.set()
    assert keeper.flush()
    assert all(waited), "nobody had to wait until the gate gave up"
    assert len(texts) <= 2
    keeper.close(discard=False)
    assert recoverable(folder)[0].obstacles == 7


def test_trouble_is_told_of_and_tried_again(folder, monkeypatch):
    monkeypatch.setattr(autosave, "_PATIENCE", 0.05)
    keeper = Autosaver(folder)
    assert keeper.flush()
    (place,) = folder.iterdir()
    text = autosave._Job.text

    def full(job):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(autosave._Job, "text", full)
    keeper.keep(with_circles(2))
    assert not keeper.flush()
    assert "No space left" in keeper.trouble
    monkeypatch.setattr(autosave._Job, "text", text)
    end = time.monotonic() + 60.0
    while keeper.trouble and time.monotonic() < end:
        time.sleep(0.01)
    assert keeper.trouble == ""
    assert keeper.flush()
    keeper.close(discard=False)
    assert recoverable(folder)[0].folder == place


def test_where_nothing_can_be_kept_work_goes_on(tmp_path):
    (tmp_path / "file").write_text("")
    keeper = Autosaver(tmp_path / "file" / "drafts")
    assert "not kept aside" in keeper.trouble
    keeper.keep(SKETCH)
    assert not keeper.flush()
    keeper.close(discard=False)
    nothing = Autosaver(None)
    nothing.keep(SKETCH)
    assert nothing.trouble == ""
    assert nothing.flush()
    nothing.settle(None, None)
    nothing.close(discard=True)
    assert recoverable(None) == ()
    assert not opened_elsewhere(None, tmp_path / "x")
    assert recoverable(tmp_path / "none") == ()


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "[]",
        '{"format": "robocov-draft"}',
        '{"format": "robocov-draft", "version": 1, "path": 3, "disk": 1, "when": "x",'
        ' "sketch": {"format": "robocov-map", "version": 1}}',
    ],
)
def test_what_cannot_be_read_is_left_alone(folder, content):
    place = folder / "broken"
    place.mkdir(parents=True)
    (place / "draft.json").write_text(content)
    os.utime(place, (0, 0))
    assert recoverable(folder) == ()
    assert (place / "draft.json").read_text() == content


def test_folders_without_work_are_removed_when_they_are_old(folder):
    for name in ("young", "old"):
        (folder / name).mkdir(parents=True)
    (folder / "old" / ".lock").write_text("")
    os.utime(folder / "old", (0, 0))
    (folder / "a file").write_text("")
    assert recoverable(folder) == ()
    assert sorted(place.name for place in folder.iterdir()) == ["a file", "young"]


def test_a_draft_that_vanishes_meanwhile_is_said(folder):
    keeper = Autosaver(folder)
    keeper.keep(SKETCH)
    keeper.close(discard=False)
    (draft,) = recoverable(folder)
    discard(draft)
    with pytest.raises(MapError, match="no such file"):
        draft.sketch()


def test_words_for_days():
    now = datetime(2030, 5, 17, 12, 0).astimezone()
    for when, words in [
        (now - timedelta(hours=2), "today 10:00"),
        (now - timedelta(hours=20), "yesterday 16:00"),
        (now - timedelta(days=9), "2030-05-08 12:00"),
    ]:
        draft = Autosave(Path("x"), Path("/maps/hall.json"), "Hall", when, 1, None)
        assert draft.words(now) == f"“Hall”, 1 obstacle, {words}, not saved to hall.json"


def test_the_folder_can_be_named(monkeypatch, tmp_path):
    monkeypatch.setenv(FOLDER, str(tmp_path))
    assert autosave_folder() == tmp_path
    monkeypatch.setenv(FOLDER, "")
    assert autosave_folder() is None
    monkeypatch.delenv(FOLDER)
    assert autosave_folder().name == "drafts"


def test_a_draft_says_what_it_is(folder, tmp_path):
    path = tmp_path / "hall.json"
    disk = saved(SKETCH, path)
    keeper = Autosaver(folder, path, disk)
    keeper.keep(opened(path)[0].added([CircleObstacle((1.0, 1.0), 0.5)])[0])
    assert keeper.flush()
    (file,) = folder.glob("*/draft.json")
    held = json.loads(file.read_text())
    assert held["format"] == "robocov-draft"
    assert held["path"] == str(path)
    assert held["disk"] == {"digest": disk.digest, "stamp": list(disk.stamp)}
    assert held["sketch"]["obstacles"] == [{"kind": "circle", "center": [1, 1], "radius": 0.5}]
    keeper.close(discard=True)


def test_an_editor_that_is_disturbed_while_it_begins_takes_another_folder(folder, monkeypatch):
    times = []
    lock = autosave.locked

    def disturbed(place):
        times.append(place)
        if len(times) == 1:
            raise OutputError(f"{place}: another process is at work in this folder")
        return lock(place)

    monkeypatch.setattr(autosave, "locked", disturbed)
    keeper = Autosaver(folder)
    assert keeper.trouble == ""
    keeper.keep(SKETCH)
    assert keeper.flush()
    assert len(times) == 2
    keeper.close(discard=True)
