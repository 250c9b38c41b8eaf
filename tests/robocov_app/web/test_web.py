"""A window in a browser: pictures arrive as they were, hands do what they did there, strangers do nothing."""

import errno
import json
import socket
import tempfile
import time
import unicodedata
import urllib.error
import urllib.request
import zlib
from contextlib import ExitStack, suppress
from http.cookies import SimpleCookie
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.compiled import open_cache_folder
from robocov.errors import InputError, RobocovError
from robocov.mapfile import load_map
from robocov_app.cli import main
from robocov_app.toolkit.window.clipboard import Clipboard
from robocov_app.toolkit.window.display import open_display
from robocov_app.toolkit.window.input import get_key_name
from robocov_app.web.confined import OutsideError, confine_files
from robocov_app.web.events import (
    MAX_UPLOAD_BYTES,
    MESSAGES,
    ControlPassed,
    EventTranslator,
    FrameShown,
    NameEntered,
    PageChanged,
    PointerMoved,
    Uploaded,
    UploadStarted,
)
from robocov_app.web.files import prepare_folder

pytest.importorskip("websockets")

from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from robocov_app.web.frames import HEADER, BaseFrames, Frame, encode_frame
from robocov_app.web.server import WebDisplay


def decode_picture(data: bytes, before: np.ndarray | None) -> np.ndarray:
    """Return the picture of a page that showed another: what its script does."""
    _, wide, high, left, top, width, height, from_black = HEADER.unpack_from(data)
    same = before is not None and before.shape == (high, wide) and not from_black
    picture = before.copy() if before is not None and same else np.zeros((high, wide), np.uint32)
    box = np.frombuffer(zlib.decompress(data[HEADER.size :]), np.uint32).reshape(height, width)
    picture[top : top + height, left : left + width] ^= box
    return picture


@given(
    st.lists(st.tuples(st.integers(1, 6), st.integers(1, 6), st.integers(0, 2**32)), min_size=1, max_size=6)
)
def test_pictures_arrive_as_they_were(sizes):
    before = None
    shown = None
    for number, (wide, high, seed) in enumerate(sizes):
        pixels = np.random.default_rng(seed).integers(0, 3, (high, wide)).astype(np.uint32) * 0x10FF
        picture = Frame(number, pixels)
        shown = decode_picture(encode_frame(picture, before), shown)
        assert np.array_equal(shown, pixels)
        before = picture


def test_a_picture_without_a_change_is_empty():
    picture = Frame(1, np.ones((4, 5), np.uint32))
    assert HEADER.unpack_from(encode_frame(picture, picture))[3:] == (0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("key", "held", "name"),
    [
        *(("z", 2, "ctrl+z"), ("Z", 3, "ctrl+shift+z"), ("?", 1, "shift+/"), ("ArrowLeft", 0, "left")),
        *(("PageUp", 0, "page up"), ("F5", 0, "f5"), (" ", 0, "space"), ("+", 0, "+"), ("+", 1, "shift+=")),
        *(("Enter", 0, "return"), ("Escape", 0, "escape"), ("k", 8, "ctrl+k"), ("!", 1, "shift+1")),
    ],
)
def test_keys_have_the_names_that_the_window_knows(key, held, name):
    told = json.dumps({"kind": "key", "key": key, "down": True, "held": held})
    event = next(EventTranslator(Clipboard()).translate(MESSAGES.validate_json(told)))
    assert get_key_name(event) == name


SCRAPS = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=5,
)
FIELDS = st.sampled_from(
    "x y held button down key text right up width height ratio dark number to name size".split()
)
KINDS = st.sampled_from(
    "move button wheel key text paste leave blur page shown control name upload what".split()
)


@given(st.builds(lambda kind, more: {**more, "kind": kind}, KINDS, st.dictionaries(FIELDS, SCRAPS)))
def test_whatever_a_page_tells_is_understood_or_refused(told):
    try:
        message = MESSAGES.validate_json(json.dumps(told))
    except ValueError:
        return
    if not isinstance(message, PageChanged | FrameShown | ControlPassed | NameEntered | UploadStarted):
        for event in EventTranslator(Clipboard()).translate(message):
            assert event.type


@pytest.fixture
def display():
    with WebDisplay() as shown:
        yield shown


def open_socket(display, query="", **headers):
    address = f"ws://127.0.0.1:{display.port}/socket{query}"
    return connect(address, additional_headers=headers, proxy=None)


def cut_off(line):
    """Return the code with which the server closes a line."""
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            line.recv(5)
    return closed.value.rcvd.code


def read_cookie(display):
    with urllib.request.urlopen(display.link) as answer:
        morsels = SimpleCookie(answer.headers["Set-Cookie"])
    name, morsel = next(iter(morsels.items()))
    assert morsel["httponly"]
    assert morsel["samesite"] == "Lax"
    return f"{name}={morsel.value}"


def test_strangers_see_nothing_and_do_nothing(display):
    own = f"http://127.0.0.1:{display.port}"
    cookie = read_cookie(display)
    for path in ("/", "/?token=", "/?token=ä", "/?token=" + "x" * 24, "/socket", "/page.html", "//[x/"):
        with pytest.raises((urllib.error.HTTPError, UnicodeEncodeError)) as refused:
            urllib.request.urlopen(own + path)
        assert getattr(refused.value, "code", 403) == 403
        getattr(refused.value, "close", int)()
    elsewhere = ({"Cookie": cookie, "Origin": origin} for origin in ("http://elsewhere.example", "http://[x"))
    for headers in ({}, {"Origin": own}, *elsewhere):
        with pytest.raises(InvalidStatus, match="403"):
            open_socket(display, **headers)
    with open_socket(display, Cookie=cookie, Origin=own):
        pass


def test_who_controls_may_open_the_other_link_too(display):
    asked = urllib.request.Request(display.watch_link, headers={"Cookie": read_cookie(display)})
    with urllib.request.urlopen(asked) as answer:
        assert answer.headers["Set-Cookie"] is None
    with urllib.request.urlopen(display.watch_link) as answer:
        assert display.watch_token in answer.headers["Set-Cookie"]


def test_a_proxy_may_stand_before_it(display):
    headers = {"X-Forwarded-Host": "hub.example", "Origin": "https://hub.example"}
    with open_socket(display, Cookie=read_cookie(display), **headers):
        pass


NONSENSE = ("", "{}", "[" * 5000, '{"kind": "move", "x": 1e999, "y": 0}', b"\0\1", "9" * 99)


@pytest.mark.parametrize("message", NONSENSE, ids=range(len(NONSENSE)))
def test_who_tells_nonsense_is_cut_off(display, message):
    with open_socket(display, Cookie=read_cookie(display)) as line:
        line.send(message)
        assert cut_off(line) == 1008


@pytest.mark.parametrize("message", ["x" * (2 << 20), bytes(2 << 20)], ids=("text", "file"))
def test_a_message_has_a_largest_size(display, message):
    with open_socket(display, Cookie=read_cookie(display)) as line:
        with suppress(ConnectionClosed):
            line.send(message)
        assert cut_off(line) == 1009


def test_the_longest_text_that_a_page_pastes_is_taken(display):
    text = "\N{SNOWMAN}\n" * 50_000
    with open_socket(display, Cookie=read_cookie(display)) as line:
        line.send(json.dumps({"kind": "paste", "text": text}))
        while not display.shared.window_input._messages:
            time.sleep(0.01)
        assert display.shared.window_input._messages.popleft().text == text


def test_a_slow_line_misses_pictures_and_nothing_is_sent_twice(display):
    surface = pygame.Surface((200, 200), 0, 32)
    with open_socket(display, Cookie=read_cookie(display)) as line:
        shown = None
        pictures = 0
        for shade in range(0, 250, 5):
            surface.fill((shade, shade, 255), (shade // 2, 10, 40, 40))
            display.send(surface)
        display.send(surface)  # as it was
        while shown is None or not np.array_equal(shown, Frame.from_surface(surface, 0).pixels):
            data = line.recv(5)
            if isinstance(data, bytes):
                shown = decode_picture(data, shown)
                pictures = pictures + 1
                line.send(json.dumps({"kind": "shown", "number": HEADER.unpack_from(data)[0]}))
        assert pictures <= 50
        with pytest.raises(TimeoutError):
            line.recv(0.1)


def read_message(line):
    """Return what a page is told next beside pictures."""
    while True:
        data = line.recv(5)
        if isinstance(data, str):
            return json.loads(data)


def open_watcher(display):
    return connect(f"ws://127.0.0.1:{display.port}/socket?token={display.watch_token}", proxy=None)


def find_controller(told):
    return next((each["number"] for each in told["participants"] if each["controls"]), None)


def list_pointer_columns(display):
    """Return where the window's pointer has been meanwhile."""
    found = []
    while display.shared.window_input._messages:
        found.append(display.shared.window_input._messages.popleft())
    return [each.x for each in found if isinstance(each, PointerMoved)]


def test_one_controls_the_others_watch_and_control_is_handed_over(display):
    move = {"kind": "move", "y": 1}
    with open_watcher(display) as pupil:
        you = read_message(pupil)["you"]
        with open_socket(display, Cookie=read_cookie(display)) as teacher:
            told = read_message(teacher)
            assert find_controller(told) == told["you"]
            read_message(pupil)
            pupil.send(json.dumps({**move, "x": 1}))
            pupil.send(json.dumps({"kind": "control", "to": you}))  # is not theirs to take
            pupil.send(json.dumps({"kind": "control", "to": 0}))
            assert [each["requests_control"] for each in read_message(teacher)["participants"]] == [
                True,
                False,
            ]
            teacher.send(json.dumps({**move, "x": 2}))
            teacher.send(json.dumps({"kind": "control", "to": you}))
            assert find_controller(read_message(teacher)) == you
            assert list_pointer_columns(display) == [2]
            teacher.send(json.dumps({**move, "x": 3}))
            teacher.send(json.dumps({"kind": "control", "to": told["you"]}))  # the teacher takes it back
            assert find_controller(read_message(teacher)) == told["you"]
            assert list_pointer_columns(display) == []
        while find_controller(read_message(pupil)) is not None:  # the teacher is gone: nobody controls
            pass


def test_a_page_that_lost_its_line_is_known_again(display):
    cookie = read_cookie(display)
    with (
        open_socket(display, Cookie=cookie) as other,
        open_socket(display, "?page=a", Cookie=cookie) as before,
    ):
        read_message(other)
        own = read_message(before)["you"]
        other.send(json.dumps({"kind": "control", "to": own}))
        before.send(json.dumps({"kind": "name", "name": "Ada"}))
        with open_socket(display, "?page=a", Cookie=cookie) as again:  # nobody has noticed yet
            told = read_message(again)
            while len(told["participants"]) > 2 or told["participants"][1]["name"] != "Ada":
                told = read_message(again)
            assert told["you"] == find_controller(told) == own


def test_what_is_held_is_let_go_when_control_passes():
    hands = EventTranslator(Clipboard())
    at = {"kind": "button", "x": 5, "y": 6, "button": 1}
    told = ({**at, "down": True}, {"kind": "blur"}, {"kind": "blur"})
    found = [[each.type for each in hands.translate(MESSAGES.validate_json(json.dumps(one)))] for one in told]
    assert found[1:] == [[pygame.MOUSEBUTTONUP, pygame.WINDOWFOCUSLOST], [pygame.WINDOWFOCUSLOST]]


def test_the_end_does_not_wait_for_lines_on_which_nothing_comes():
    with WebDisplay() as display:
        idle = socket.create_connection(("127.0.0.1", display.port))
        read_cookie(display)
        begun = time.monotonic()
    assert time.monotonic() - begun < 3.0
    idle.close()


def test_a_port_that_is_taken_is_told_in_a_line(display):
    taken = rf"^--port: cannot listen at 127.0.0.1:{display.port}: address already in use. Use --port 0"
    with pytest.raises(RobocovError, match=taken), WebDisplay(port=display.port):
        pass


def test_only_who_controls_sees_the_clipboard(display):
    display.clipboard.put("a secret")
    surface = pygame.Surface((20, 20), 0, 32)
    with open_socket(display, Cookie=read_cookie(display)) as teacher, open_watcher(display) as pupil:
        display.send(surface)
        while "copied" not in (told := read_message(teacher)):
            pass
        assert told["copied"] == "a secret"
        pupil.send(json.dumps({"kind": "name", "name": "Ada\n"}))
        while (told := read_message(pupil))["participants"][1]["name"] != "Ada":
            assert "copied" not in told
        assert "copied" not in told


def test_the_page_in_control_downloads_a_file_that_is_offered(tmp_path):
    with WebDisplay(folder=tmp_path) as display:
        (tmp_path / "hall-copy-1.robocov").write_text("{}")
        display.offer_file("hall-copy-1.robocov")
        display.send(pygame.Surface((20, 20), 0, 32))
        cookie = read_cookie(display)
        with open_socket(display, Cookie=cookie) as teacher, open_watcher(display) as pupil:
            while "offer" not in (told := read_message(teacher)):
                pass
            assert told["offer"] == {"number": 1, "name": "hall-copy-1.robocov"}
            assert told["saved"] == ["hall-copy-1.robocov"]
            assert "offer" not in read_message(pupil)


def test_a_link_to_watch_is_shared_unless_another_server_stands_before_it():
    with WebDisplay() as display:
        assert display.share_link == display.watch_link
    with WebDisplay(is_relayed=True) as display:
        assert display.share_link == ""


def test_files_come_in_and_go_out_by_the_folder_alone(tmp_path):
    with WebDisplay(folder=tmp_path) as display:
        cookie = read_cookie(display)
        with open_socket(display, Cookie=cookie) as line:
            upload(line, "hall.json", b"{}")
            assert read_upload(display) == tmp_path / "hall.json"
            assert (tmp_path / "hall.json").read_bytes() == b"{}"
            (tmp_path / "run").mkdir()
            (tmp_path / "run/record.json").write_text("1")
            (tmp_path / "run/.robocov.json").write_text("{}")
            # what others write there is not offered
            (tmp_path / "demo.log").write_text("")
            (tmp_path / "other").mkdir()
            (tmp_path / "saved.json").write_text("{}")
            display.send(pygame.Surface((20, 20), 0, 32))
            while not (saved := read_message(line).get("saved")):
                pass
        assert set(saved) == {"saved.json", "run"}, "what was uploaded was not saved"
        for name, begins in (("saved.json", b"{}"), ("run", b"PK")):
            address = display.link.replace("/?", f"/saved/{name}?")
            with urllib.request.urlopen(address) as answer:
                assert answer.read().startswith(begins)
        for name in ("..%2fsecret", "%2e%2e/secret", "run/record.json", "other"):
            with pytest.raises(urllib.error.HTTPError) as missing:
                urllib.request.urlopen(display.link.replace("/?", f"/saved/{name}?"))
            missing.value.close()


def upload(line, name, content, piece=1 << 17):
    line.send(json.dumps({"kind": "upload", "name": name, "size": len(content)}))
    for at in range(0, len(content), piece):
        line.send(content[at : at + piece])


def read_upload(display):
    """Return the path of the file that the window is to open."""
    end = time.monotonic() + 5.0
    while time.monotonic() < end:
        while display.shared.window_input._messages:
            event = display.shared.window_input._messages.popleft()
            if isinstance(event, Uploaded):
                return Path(event.path)
        time.sleep(0.01)
    raise AssertionError("nothing was uploaded")


def notice_to(line):
    """Return the next message that a page shows."""
    while (told := read_message(line))["kind"] != "notice":
        pass
    return told["text"]


REFUSED_NAMES = [
    "../out.json",
    "/etc/x.json",
    "a\\b.json",
    "mine.py",
    ".hidden.json",
    "",
    "x" * 250 + ".json",
]


@pytest.mark.parametrize("name", REFUSED_NAMES, ids=range(len(REFUSED_NAMES)))
def test_files_of_other_names_are_refused_with_a_message(tmp_path, name):
    with WebDisplay(folder=tmp_path) as display, open_socket(display, Cookie=read_cookie(display)) as line:
        upload(line, name, bytes(300_000))
        assert notice_to(line)
        assert not list(tmp_path.iterdir())
        upload(line, "hall.json", b"{}")  # the connection stays
        assert read_upload(display).read_bytes() == b"{}"


def test_control_characters_are_no_part_of_a_file_name(tmp_path):
    with WebDisplay(folder=tmp_path) as display, open_socket(display, Cookie=read_cookie(display)) as line:
        upload(line, "a\0b\x1b\n.json", b"{}")
        assert read_upload(display).name == "ab.json"


def test_a_large_file_comes_in_pieces_and_an_empty_one_too(tmp_path):
    content = np.random.default_rng(1).bytes(3_000_000)
    with WebDisplay(folder=tmp_path) as display, open_socket(display, Cookie=read_cookie(display)) as line:
        upload(line, "large.png", content)
        assert read_upload(display).read_bytes() == content
        upload(line, "large.png", b"")
        assert read_upload(display).name == "large-1.png"


@pytest.mark.parametrize(
    "broken",
    [
        {"kind": "upload", "name": "a.json", "size": MAX_UPLOAD_BYTES + 1},
        {"kind": "upload", "name": "a.json", "size": -1},
        {"kind": "upload", "name": "a" * 301, "size": 1},
        b"a piece of no file",
    ],
)
def test_an_upload_that_no_page_would_send_ends_the_connection(tmp_path, broken):
    with WebDisplay(folder=tmp_path) as display, open_socket(display, Cookie=read_cookie(display)) as line:
        line.send(json.dumps(broken) if isinstance(broken, dict) else broken)
        assert cut_off(line) == 1008
        assert not list(tmp_path.iterdir())


def test_more_than_was_announced_ends_the_connection(tmp_path):
    with WebDisplay(folder=tmp_path) as display, open_socket(display, Cookie=read_cookie(display)) as line:
        line.send(json.dumps({"kind": "upload", "name": "a.json", "size": 2}))
        line.send(b"{} ")
        assert cut_off(line) == 1008
        assert not list(tmp_path.iterdir())


def test_only_who_controls_uploads(tmp_path):
    with WebDisplay(folder=tmp_path) as display, open_socket(display, Cookie=read_cookie(display)) as teacher:
        read_message(teacher)
        with open_watcher(display) as pupil:
            upload(pupil, "mine.json", b"{}")
            assert "controls" in notice_to(pupil)
        assert not list(tmp_path.iterdir())


def fill_disk(monkeypatch, tmp_path):
    def fail(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", fail)


def remove_folder(monkeypatch, tmp_path):
    tmp_path.rmdir()


def put_a_file_there(monkeypatch, tmp_path):
    tmp_path.rmdir()
    tmp_path.write_text("")


@pytest.mark.parametrize(
    ("break_folder", "reason"),
    [
        (fill_disk, "no space left on device"),
        (remove_folder, "no such file or directory"),
        (put_a_file_there, "not a directory"),
    ],
)
def test_an_upload_that_cannot_be_written_is_a_message_and_the_connection_stays(
    tmp_path, monkeypatch, capfd, break_folder, reason
):
    folder = tmp_path / "files"
    folder.mkdir()
    with WebDisplay(folder=folder) as display, open_socket(display, Cookie=read_cookie(display)) as line:
        break_folder(monkeypatch, folder)
        upload(line, "hall.json", b"{}")
        assert notice_to(line).lower() == f"hall.json: cannot be saved on the server: {reason}"
        line.send(json.dumps({"kind": "move", "x": 1, "y": 1}))
        while not list_pointer_columns(display):
            time.sleep(0.01)
    printed = capfd.readouterr().err
    assert printed.lower() == f"robocov: hall.json: cannot be saved on the server: {reason}\n"


def test_the_folder_is_created_or_refused(tmp_path):
    prepare_folder(tmp_path / "a/b")
    assert list((tmp_path / "a/b").iterdir()) == []
    (tmp_path / "file").write_text("")
    for wrong in (tmp_path / "file", tmp_path / "file/inside"):
        with pytest.raises(InputError, match=r"^--folder: .*file.*: not a folder; choose another --folder$"):
            prepare_folder(wrong)
    with pytest.raises(InputError, match=r"^--folder: /proc/robocov.*cannot be written to: "):
        prepare_folder(Path("/proc/robocov"))


@pytest.mark.parametrize("command", ["demo", "edit"])
@pytest.mark.parametrize("each", [[], ["--each"]])
def test_a_folder_that_cannot_be_used_is_one_line_at_the_start(tmp_path, capsys, command, each):
    (tmp_path / "file").write_text("")
    assert main([command, "--serve", *each, "--folder", str(tmp_path / "file")]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("robocov: error: --folder: ")
    assert printed.err.count("\n") == 1


CONTROLS = "a\0b\x1b[31m\x7f\x85\r\nc\td"


@pytest.mark.parametrize(
    ("message", "key", "text"),
    [
        ({"kind": "paste", "text": CONTROLS}, "text", "ab[31m\nc\td"),
        ({"kind": "text", "text": CONTROLS}, "text", "ab[31m\nc\td"),
        ({"kind": "name", "name": CONTROLS}, "name", "ab[31mcd"),
        ({"kind": "key", "key": "\0", "down": True}, "key", ""),
        ({"kind": "key", "key": "a\0", "down": True}, "key", "a"),
        ({"kind": "upload", "name": "\0a.json", "size": 1}, "name", "a.json"),
    ],
)
def test_control_characters_do_not_come_in(message, key, text):
    assert getattr(MESSAGES.validate_json(json.dumps(message)), key) == text


CONTROL_CHARACTERS = st.text(
    st.characters(categories=["Cc", "Zl", "Zp", "Cf", "Ll"]), min_size=1, max_size=20
)


@given(CONTROL_CHARACTERS, st.sampled_from(["paste", "text", "key"]))
def test_events_of_a_window_have_no_control_characters(text, kind):
    told = {"kind": kind, "key": text, "down": True} if kind == "key" else {"kind": kind, "text": text}
    message = MESSAGES.validate_json(json.dumps(told))
    clipboard = Clipboard()
    for event in EventTranslator(clipboard).translate(message):
        written = getattr(event, "unicode", "") + getattr(event, "text", "")
        assert all(unicodedata.category(each) != "Cc" for each in written)
    if kind == "paste":
        assert all(unicodedata.category(each) != "Cc" or each in "\n\t" for each in clipboard.get())


def test_a_telephones_line_break_is_enter():
    message = MESSAGES.validate_json(json.dumps({"kind": "text", "text": "7\n"}))
    keys = [
        event.key for event in EventTranslator(Clipboard()).translate(message) if event.type == pygame.KEYDOWN
    ]
    assert keys == [pygame.K_7, pygame.K_RETURN]


def close_reason(line):
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            line.recv(5)
    return closed.value.rcvd.code, closed.value.rcvd.reason


def test_watchers_never_lock_the_teacher_out(display, monkeypatch):
    monkeypatch.setattr("robocov_app.web.pages.MAX_VIEWERS", 3)
    cookie = read_cookie(display)
    with ExitStack() as stack:
        watchers = [stack.enter_context(open_watcher(display)) for _ in range(3)]
        with open_watcher(display) as refused:
            code, reason = close_reason(refused)
        assert code == 1013
        assert reason.startswith("All 3 places for viewers are taken")
        for _ in range(5):  # reloads
            with open_socket(display, Cookie=cookie) as teacher:
                told = read_message(teacher)
                assert find_controller(told) == told["you"]
        watchers[0].close()
        with open_watcher(display) as other:
            assert read_message(other)["participants"]


def test_a_watcher_whose_connection_broke_comes_back_to_a_full_house(display, monkeypatch):
    monkeypatch.setattr("robocov_app.web.pages.MAX_VIEWERS", 1)
    address = f"ws://127.0.0.1:{display.port}/socket?token={display.watch_token}&page=a"
    with connect(address, proxy=None) as before:
        read_message(before)
        with connect(address, proxy=None) as again:
            assert read_message(again)["you"] == 1


def test_the_newest_of_too_many_pages_with_the_controlling_link_stays(display, monkeypatch):
    monkeypatch.setattr("robocov_app.web.pages.MAX_CONTROL_PAGES", 2)
    cookie = read_cookie(display)
    with ExitStack() as stack:
        first = stack.enter_context(open_socket(display, Cookie=cookie))
        second = stack.enter_context(open_socket(display, Cookie=cookie))
        read_message(first)
        third = stack.enter_context(open_socket(display, Cookie=cookie))
        assert close_reason(second)[0] == 4001  # the first one controls
        told = read_message(third)
        while len(told["participants"]) != 2:
            told = read_message(third)
        first.ping().wait(5)


def test_frames_that_pages_have_are_bounded():
    bases = BaseFrames(max_bytes=3 * 400)
    for number in range(1, 9):
        bases.add(Frame(number, np.zeros((10, 10), np.uint32)))
    assert bases.n_bytes <= 1200
    assert [bases.get(number) is None for number in (5, 6, 7, 8)] == [True, False, False, False]
    bases.keep_only({7})
    assert len(bases) == 1


def test_a_page_whose_frame_was_given_up_gets_the_next_one_from_black(display, monkeypatch):
    monkeypatch.setattr(display.shared.delivery, "bases", BaseFrames(max_bytes=1))
    surface = pygame.Surface((40, 30), 0, 32)
    with open_socket(display, Cookie=read_cookie(display)) as ahead, open_watcher(display) as behind:
        read_message(ahead), read_message(behind)
        shown = {ahead: None, behind: None}
        for shade in (10, 20, 30):
            surface.fill((shade, 0, 0), (shade, 0, 5, 5))
            display.send(surface)
            for line in (ahead, behind) if shade != 20 else (ahead,):
                while not isinstance(data := line.recv(5), bytes):
                    pass
                shown[line] = decode_picture(data, shown[line])
                line.send(json.dumps({"kind": "shown", "number": HEADER.unpack_from(data)[0]}))
        assert np.array_equal(shown[ahead], Frame.from_surface(surface, 0).pixels)


def test_who_comes_to_a_window_at_rest_sees_it(display):
    surface = pygame.Surface((40, 30), 0, 32)
    surface.fill((1, 2, 3))
    display.send(surface)
    for _ in range(5):
        with open_watcher(display) as line:
            while not isinstance(data := line.recv(5), bytes):
                pass
        assert np.array_equal(decode_picture(data, None), Frame.from_surface(surface, 0).pixels)


class FakeWindow:
    """A window whose map is all of one color, unless a dialog covers it."""

    replacement = None
    controls = None
    status_text = ""

    def __init__(self):
        self.screen = pygame.Surface((1280, 720), 0, 32)
        self.map_pictures = self
        self.has_dialog = False
        self.shade = 0

    def set_appearance(self, appearance):
        self.is_motion_reduced = appearance.is_motion_reduced

    def draw(self, size, scale):
        if self.has_dialog:
            return None
        picture = pygame.Surface(size, 0, 32)
        picture.fill((self.shade, 0, 0))
        return picture

    def find_window_pixel(self, size, pixel):
        return pixel if self.has_dialog else (pixel[0] + 1000, pixel[1])


def receive_frame(socket, before):
    """Return the picture of a page after the next frame that it receives."""
    while not isinstance(data := socket.recv(5), bytes):
        pass
    socket.send(json.dumps({"kind": "shown", "number": HEADER.unpack_from(data)[0]}))
    return decode_picture(data, before)


def send_until(display, window, condition):
    """Send frames of a window, until a condition is true."""
    deadline = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < deadline
        display.receive(window)
        display.send(window.screen)
        time.sleep(0.02)


def test_a_phone_that_watches_gets_the_map_and_sees_dialogs(display):
    window = FakeWindow()
    delivery = display.shared.delivery
    wide = {"kind": "page", "width": 1280, "height": 720, "ratio": 1.0, "dark": False}
    with open_socket(display, Cookie=read_cookie(display)) as projector, open_watcher(display) as phone:
        projector.send(json.dumps(wide))
        phone.send(json.dumps({**wide, "width": 390, "height": 800}))
        send_until(display, window, lambda: delivery.maps.frames)
        shown = None
        while shown is None or shown.shape != (800, 390):
            shown = receive_frame(phone, shown)
        window.shade = 7
        window.screen.fill((1, 2, 3))
        send_until(display, window, lambda: delivery.maps.frames and window.shade == 7)
        time.sleep(0.1)
        send_until(display, window, lambda: True)
        display.send(window.screen)
        while shown[0, 0] != 7 << 16:
            shown = receive_frame(phone, shown)
        assert receive_frame(projector, None).shape == (720, 1280)
        window.has_dialog = True
        window.screen.fill((4, 5, 6))
        send_until(display, window, lambda: not delivery.maps.frames)
        while shown.shape != (720, 1280):
            shown = receive_frame(phone, shown)


def test_a_phone_in_control_points_at_the_map(display):
    window = FakeWindow()
    wide = {"kind": "page", "width": 1280, "height": 720, "ratio": 1.0, "dark": False, "reduced_motion": True}
    pages = display.shared.pages
    with (
        open_display(headless=True),
        open_socket(display, Cookie=read_cookie(display)) as projector,
        open_watcher(display) as phone,
    ):
        projector.send(json.dumps(wide))
        phone.send(json.dumps({**wide, "width": 390, "height": 800}))
        send_until(display, window, lambda: display.shared.delivery.maps.frames)
        projector.send(json.dumps({"kind": "control", "to": 2}))
        send_until(display, window, lambda: pages.controlling is not None and pages.controlling.number == 2)
        pygame.event.clear()
        phone.send(json.dumps({"kind": "move", "x": 30.0, "y": 40.0}))
        send_until(display, window, lambda: pygame.event.peek(pygame.MOUSEMOTION))
        assert pygame.event.get(pygame.MOUSEMOTION)[-1].pos == (1030, 40)
        assert window.is_motion_reduced


def test_a_program_that_asks_for_heads_alone_gets_them(display):
    for method, status in (("HEAD", 200), ("POST", 405), ("DELETE", 405)):
        request = urllib.request.Request(display.link, method=method)
        try:
            with urllib.request.urlopen(request) as answer:
                assert (answer.status, answer.read()) == (status, b"")
        except urllib.error.HTTPError as error:
            with error:
                assert error.code == status


def test_served_window_uses_the_caches_of_kernels_and_arrays(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    monkeypatch.setenv("ROBOCOV_CACHE", str(tmp_path / "arrays"))
    open_cache_folder.cache_clear()
    try:
        kernels = open_cache_folder()
        (tmp_path / "folder").mkdir()
        with confine_files(tmp_path / "folder"):
            (tmp_path / "arrays").mkdir()
            for folder in (kernels, tmp_path / "arrays"):
                (folder / "entry").write_text("")
    finally:
        open_cache_folder.cache_clear()


def test_a_served_window_reads_and_writes_below_its_folder_alone(tmp_path):
    folder = tmp_path / "folder"
    outside = tmp_path / "outside.json"
    folder.mkdir()
    outside.write_text("{}")
    (folder / "link.json").symlink_to(outside)
    (folder / "own.json").write_text("{}")
    with confine_files(folder):
        assert (folder / "own.json").read_text() == "{}"
        (folder / "new").mkdir()
        (folder / "new/other.json").write_text("{}")
        load_map("rooms")
        with TemporaryDirectory() as own:
            (Path(own) / "part").write_text("")
        for path in (outside, folder / "link.json", folder / "../outside.json", Path.home() / "x"):
            for act in (path.read_text, lambda path=path: path.write_text("1"), path.unlink, path.mkdir):
                if path.name == "link.json" and act == path.unlink:
                    continue
                with pytest.raises(OutsideError, match="outside the served folder"):
                    act()
        for act in (lambda: list(tmp_path.iterdir()), lambda: (folder / "own.json").rename(tmp_path / "x")):
            with pytest.raises(OutsideError):
                act()
        with pytest.raises(RobocovError, match="outside"):
            load_map(outside)
    assert outside.read_text() == "{}"


def test_after_a_confinement_files_and_the_temporary_folder_are_as_before(tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    previous = tempfile.gettempdir()
    with confine_files(folder):
        temporary_folder = Path(tempfile.gettempdir())
        assert temporary_folder != Path(previous)
        with confine_files(folder), pytest.raises(OutsideError):
            (tmp_path / "inner").mkdir()
        with pytest.raises(OutsideError):
            (tmp_path / "outer").mkdir()
    assert tempfile.gettempdir() == previous
    assert not temporary_folder.exists()
    (tmp_path / "later").mkdir()
