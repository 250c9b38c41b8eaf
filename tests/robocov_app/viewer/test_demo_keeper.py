from __future__ import annotations

import io
import threading
from pathlib import Path

import pytest
from kept_run import COUNTING, said_by
from touched_run import RAPF, RPF, begun, stepped

from robocov.errors import OutputError, ParameterError
from robocov_app.viewer.session import keep_process, keeping
from robocov_app.viewer.session.keep_process import kept
from robocov_app.viewer.session.keeping import Keeper, tell, wanted_of
from robocov_app.viewer.session.kept import Kept, NotKept
from robocov_app.viewer.session.scenario import Law


@pytest.fixture
def counting(tmp_path: Path) -> Law:
    path = tmp_path / "mine.py"
    path.write_text(COUNTING)
    return Law(f"{path}:Counting")


def test_folders_have_names_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Keeper, "_work", lambda self: None)
    keeper = Keeper()
    one, two = begun(), begun(RAPF, RPF)
    (tmp_path / "hall-rapf-1").write_text("in the way")
    names = ["", "hall", "a/b/My map!.json", ".."]
    said = [keeper.save(one, tmp_path / "new", name) for name in names]
    said += [keeper.save(two, tmp_path, "hall"), keeper.save(one, tmp_path, "hall")]
    folders = [words.removeprefix(f"saving the run: {tmp_path}/") for words in said]
    assert folders == [
        *("new/hall-rapf-1/", "new/hall-rapf-2/", "new/My-map-rapf-1/", "new/map-rapf-1/"),
        *("hall-comparison-1/", "hall-rapf-2/"),
    ]


def test_a_folder_that_cannot_be_made_is_said_at_once(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="file/hall-rapf-1: cannot be made"):
        Keeper().save(begun(), tmp_path / "file", "hall")


def test_a_controller_that_is_gone_is_said_at_once(tmp_path: Path, counting: Law) -> None:
    session = stepped(begun(counting), 5)
    (tmp_path / "mine.py").unlink()
    with pytest.raises(ParameterError, match="there is no file"):
        Keeper().save(session, tmp_path / "runs")
    assert not (tmp_path / "runs").exists()


def test_a_process_that_ends_too_early_is_said(tmp_path: Path, monkeypatch, capfd) -> None:
    started = keeping.started
    monkeypatch.setattr(keeping, "started", lambda module: started("robocov_app.nothing"))
    keeper = Keeper()
    keeper.save(stepped(begun(), 5), tmp_path)
    words, trouble = said_by(keeper)
    assert words == f"run not saved: {tmp_path}/hall-rapf-1/: the process that saves it has ended"
    assert trouble
    assert list(tmp_path.iterdir()) == [], "no empty folder is left"
    keeper.finish()


def test_no_process_at_all_is_said_too(tmp_path: Path, monkeypatch) -> None:
    def fails(module):
        raise OSError(12, "Cannot allocate memory")

    monkeypatch.setattr(keeping, "started", fails)
    keeper = Keeper()
    keeper.save(begun(), tmp_path)
    assert said_by(keeper).words.endswith("Cannot allocate memory")
    keeper.finish()


def test_finishing_waits_for_what_is_being_saved(tmp_path: Path, monkeypatch, capfd) -> None:
    gate = threading.Event()

    def slowly(self, wanted):
        gate.wait(10.0)
        return Kept(("remark",))

    monkeypatch.setattr(Keeper, "_saved", slowly)
    keeper = Keeper()
    for _ in range(2):
        keeper.save(begun(), tmp_path)
    assert keeper.poll() == []
    threading.Timer(0.7, gate.set).start()
    keeper.finish()
    assert [said.words.rpartition("; ")[2] for said in keeper.poll()] == ["remark", "remark"]
    assert capfd.readouterr().err == "saving runs; Ctrl-C gives up\n"
    keeper.finish()
    keeper.save(begun(), tmp_path)
    keeper.finish()
    assert len(keeper.poll()) == 1


def test_who_does_not_want_to_wait_gets_no_empty_folders(tmp_path: Path, monkeypatch, capfd) -> None:
    """Ctrl-C while the first of two is being saved."""
    begins = threading.Event()
    send = keeping.send

    def slowly(stream, message):
        begins.set()
        send(stream, message)

    def interrupted(self, timeout=None):
        begins.wait(10.0)
        raise KeyboardInterrupt

    monkeypatch.setattr(keeping, "send", slowly)
    keeper = Keeper()
    session = stepped(begun(), 5)
    keeper.save(session, tmp_path)
    keeper.save(session, tmp_path)
    thread = keeper._thread
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(threading.Thread, "join", interrupted)
        keeper.finish()
    thread.join(10.0)
    assert not thread.is_alive()
    assert not (tmp_path / "hall-rapf-2").exists()


def test_half_a_message_writes_nothing(tmp_path: Path) -> None:
    stream = io.BytesIO()
    tell(stream, wanted_of(stepped(begun(), 5), tmp_path / "run"))
    whole = stream.getvalue()
    for length in (0, 20, len(whole) - 5):
        (tmp_path / "run").mkdir()
        assert kept(io.BytesIO(whole[:length])) is None
        if length > 20:
            assert not (tmp_path / "run").exists()
        else:
            (tmp_path / "run").rmdir()


def test_what_goes_wrong_in_the_process_is_one_line(tmp_path: Path, monkeypatch, capfd) -> None:
    def fault(*_):
        raise ZeroDivisionError("a fault of ours")

    session, folder = stepped(begun(), 5), tmp_path / "run"
    stream = io.BytesIO()
    tell(stream, wanted_of(session, folder, 16))
    stream.seek(0)
    folder.touch()
    assert kept(stream) == NotKept(f"{folder}: cannot be used for results: File exists")
    folder.unlink()
    monkeypatch.setattr(keep_process, "_save_run", fault)
    folder.mkdir()
    stream.seek(0)
    assert kept(stream) == NotKept("ZeroDivisionError: a fault of ours")
    assert "Traceback" in capfd.readouterr().err
    assert not folder.exists()
