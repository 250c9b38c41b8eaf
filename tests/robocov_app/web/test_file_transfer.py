"""Files that pages upload to the folder of a served window, and download from it."""

import errno
import io
import json
import os
import time
import urllib.error
import urllib.request
import zipfile
from pathlib import Path

import numpy as np
import pygame
import pytest

from robocov_app.web.events import MAX_UPLOAD_BYTES, PointerMoved, Uploaded
from robocov_app.web.files import Upload, read_saved

pytest.importorskip("websockets")

from page_client import MAX_WAIT_S, POLL_INTERVAL_S

NOT_UNDERSTOOD = 1008


def wait_for_input(display, kind):
    """Return the next message of a kind that the window gets; drop the others."""
    messages = display.shared.window_input._messages
    deadline = time.monotonic() + MAX_WAIT_S
    while time.monotonic() < deadline:
        while messages:
            message = messages.popleft()
            if isinstance(message, kind):
                return message
        time.sleep(POLL_INTERVAL_S)
    raise AssertionError(f"the window got no {kind.__name__}")


def wait_for_upload(display):
    """Return the path of the file that the window is to open."""
    return Path(wait_for_input(display, Uploaded).path)


def send_empty_frame(display):
    display.send(pygame.Surface((20, 20), 0, 32))


def build_download_link(display, name):
    return display.link.replace("/?", f"/saved/{name}?")


# Downloads


def test_files_from_before_1980_are_archived(tmp_path):
    """Zip archives have no earlier dates; computers without a battery for their clock write such files."""
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "record.json").write_text("1")
    os.utime(folder / "record.json", (0, 0))
    name, content = read_saved(folder)
    assert name == "run.zip"
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.read("run/record.json") == b"1"


def test_saved_files_are_offered_but_neither_uploads_nor_foreign_files(display, folder, teacher):
    teacher.upload("hall.json", b"{}")
    assert wait_for_upload(display) == folder / "hall.json"
    assert (folder / "hall.json").read_bytes() == b"{}"
    (folder / "run").mkdir()
    (folder / "run/record.json").write_text("1")
    (folder / "run/.robocov.json").write_text("{}")
    (folder / "saved.json").write_text("{}")
    # Files of other programs
    (folder / "demo.log").write_text("")
    (folder / "other").mkdir()
    send_empty_frame(display)
    state = teacher.receive_message_until(lambda message: message.get("saved"))
    assert set(state["saved"]) == {"saved.json", "run"}
    for name, signature in (("saved.json", b"{}"), ("run", b"PK")):
        with urllib.request.urlopen(build_download_link(display, name)) as response:
            assert response.read().startswith(signature)
    for name in ("..%2fsecret", "%2e%2e/secret", "run/record.json", "other"):
        with pytest.raises(urllib.error.HTTPError) as error:
            urllib.request.urlopen(build_download_link(display, name))
        error.value.close()


def test_only_the_controlling_page_downloads_an_offered_file(display, folder, teacher, viewer):
    (folder / "hall-copy-1.robocov").write_text("{}")
    display.offer_file("hall-copy-1.robocov")
    send_empty_frame(display)
    state = teacher.receive_message_until(
        lambda message: message.get("offer") == {"number": 1, "name": "hall-copy-1.robocov"}
    )
    assert state["saved"] == ["hall-copy-1.robocov"]
    state = viewer.receive_message_until(lambda message: message.get("saved"))
    assert "offer" not in state


# Uploads


def test_an_upload_with_the_name_of_a_broken_link_gets_another_name(tmp_path):
    link = tmp_path / "plan.json"
    link.symlink_to(tmp_path / "gone" / "plan.json")
    upload = Upload("plan.json", 2, is_rejected=False)
    upload.add(b"{}")
    path = upload.save(tmp_path)
    assert (path.name, path.read_bytes()) == ("plan-1.json", b"{}")
    assert link.is_symlink()


INVALID_NAMES = [
    "../out.json",
    "/etc/x.json",
    "a\\b.json",
    "mine.py",
    ".hidden.json",
    "",
    "x" * 250 + ".json",
]


@pytest.mark.parametrize("name", INVALID_NAMES, ids=range(len(INVALID_NAMES)))
def test_uploads_with_invalid_names_are_rejected_with_a_notice(display, folder, teacher, name):
    teacher.upload(name, bytes(300_000))
    assert teacher.receive_notice()
    assert not list(folder.iterdir())
    teacher.upload("hall.json", b"{}")  # The connection is still open.
    assert wait_for_upload(display).read_bytes() == b"{}"


def test_control_characters_are_removed_from_the_names_of_uploads(display, teacher):
    teacher.upload("a\0b\x1b\n.json", b"{}")
    assert wait_for_upload(display).name == "ab.json"


def test_a_large_file_is_uploaded_in_pieces(display, teacher):
    content = np.random.default_rng(1).bytes(3_000_000)
    teacher.upload("large.png", content)
    assert wait_for_upload(display).read_bytes() == content


def test_an_upload_with_a_name_in_use_is_numbered(display, folder, teacher):
    (folder / "large.png").write_bytes(b"1")
    teacher.upload("large.png", b"")
    path = wait_for_upload(display)
    assert path.name == "large-1.png"
    assert path.read_bytes() == b""


@pytest.mark.parametrize(
    "message",
    [
        {"kind": "upload", "name": "a.json", "size": MAX_UPLOAD_BYTES + 1},
        {"kind": "upload", "name": "a.json", "size": -1},
        {"kind": "upload", "name": "a" * 301, "size": 1},
        b"a piece without a file",
    ],
    ids=["too large", "negative size", "long name", "piece without a file"],
)
def test_invalid_uploads_close_the_connection(folder, teacher, message):
    teacher.socket.send(json.dumps(message) if isinstance(message, dict) else message)
    code, _ = teacher.wait_for_close()
    assert code == NOT_UNDERSTOOD
    assert not list(folder.iterdir())


def test_an_upload_of_more_than_the_announced_size_closes_the_connection(folder, teacher):
    teacher.send(kind="upload", name="a.json", size=2)
    teacher.socket.send(b"{} ")
    code, _ = teacher.wait_for_close()
    assert code == NOT_UNDERSTOOD
    assert not list(folder.iterdir())


def test_viewers_cannot_upload_files(folder, teacher, viewer):
    teacher.receive_message()
    viewer.upload("mine.json", b"{}")
    assert "controls" in viewer.receive_notice()
    assert not list(folder.iterdir())


def fill_disk(monkeypatch, folder):
    def fail(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", fail)


def remove_folder(monkeypatch, folder):
    folder.rmdir()


def replace_folder_by_file(monkeypatch, folder):
    folder.rmdir()
    folder.write_text("")


@pytest.mark.parametrize(
    ("break_folder", "reason"),
    [
        (fill_disk, "no space left on device"),
        (remove_folder, "no such file or directory"),
        (replace_folder_by_file, "not a directory"),
    ],
)
def test_an_upload_that_cannot_be_written_is_reported_on_the_page_and_in_the_terminal(
    display, folder, teacher, monkeypatch, capfd, break_folder, reason
):
    break_folder(monkeypatch, folder)
    teacher.upload("hall.json", b"{}")
    assert teacher.receive_notice().lower() == f"hall.json: cannot be saved on the server: {reason}"
    teacher.send(kind="move", x=1, y=1)
    assert wait_for_input(display, PointerMoved).x == 1  # The connection is still open.
    printed = capfd.readouterr().err
    assert printed.lower() == f"robocov: hall.json: cannot be saved on the server: {reason}\n"
