"""A window in a browser: pictures arrive as they were, hands do what they did there, strangers do nothing."""

import json
import socket
import time
import urllib.error
import urllib.request
import zlib
from contextlib import suppress
from http.cookies import SimpleCookie
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.compiled import kernel
from robocov.errors import RobocovError
from robocov.files.atomic import locked
from robocov.mapfile import load_map
from robocov_app.toolkit import clipboard
from robocov_app.toolkit.input import key_of
from robocov_app.web.confined import OutsideError, confined
from robocov_app.web.events import MESSAGES, Hands, PageChanged, PictureShown, PointerMoved

pytest.importorskip("websockets")

from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from robocov_app.web.server import HEADER, Picture, WebDisplay, encoded


def decoded(data: bytes, before: np.ndarray | None) -> np.ndarray:
    """Return the picture of a page that showed another: what its script does."""
    _, wide, high, left, top, width, height = HEADER.unpack_from(data)
    same = before is not None and before.shape == (high, wide)
    picture = before.copy() if before is not None and same else np.zeros((high, wide), np.uint32)
    box = np.frombuffer(zlib.decompress(data[HEADER.size :]), np.uint32).reshape(height, width)
    picture[top : top + height, left : left + width] ^= box
    return picture


@given(
    st.lists(st.tuples(st.integers(1, 6), st.integers(1, 6), st.integers(0, 2**32)), min_size=1, max_size=6)
)
def test_pictures_arrive_as_they_were(sizes):
    before, shown = None, None
    for number, (wide, high, seed) in enumerate(sizes):
        pixels = np.random.default_rng(seed).integers(0, 3, (high, wide)).astype(np.uint32) * 0x10FF
        picture = Picture(number, pixels)
        shown = decoded(encoded(picture, before), shown)
        assert np.array_equal(shown, pixels)
        before = picture


def test_a_picture_without_a_change_is_empty():
    picture = Picture(1, np.ones((4, 5), np.uint32))
    assert HEADER.unpack_from(encoded(picture, picture))[3:] == (0, 0, 0, 0)


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
    event = next(Hands().events(MESSAGES.validate_json(told)))
    assert key_of(event) == name


SCRAPS = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=5,
)
FIELDS = st.sampled_from("x y held button down key text right up width height ratio dark number".split())
KINDS = st.sampled_from("move button wheel key text leave blur page shown what".split())


@given(st.builds(lambda kind, more: {**more, "kind": kind}, KINDS, st.dictionaries(FIELDS, SCRAPS)))
def test_whatever_a_page_tells_is_understood_or_refused(told):
    try:
        message = MESSAGES.validate_json(json.dumps(told))
    except ValueError:
        return
    if not isinstance(message, PageChanged | PictureShown):
        for event in Hands().events(message):
            assert event.type


@pytest.fixture
def display():
    with WebDisplay() as shown:
        yield shown


def socket_of(display, query="", **headers):
    address = f"ws://127.0.0.1:{display.port}/socket{query}"
    return connect(address, additional_headers=headers, proxy=None)


def cut_off(line):
    """Return the code with which the server closes a line."""
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            line.recv(5)
    return closed.value.rcvd.code


def cookie_of(display):
    with urllib.request.urlopen(display.link) as answer:
        morsels = SimpleCookie(answer.headers["Set-Cookie"])
    name, morsel = next(iter(morsels.items()))
    assert morsel["httponly"]
    assert morsel["samesite"] == "Strict"
    return f"{name}={morsel.value}"


def test_strangers_see_nothing_and_do_nothing(display):
    own, cookie = f"http://127.0.0.1:{display.port}", cookie_of(display)
    for path in ("/", "/?token=", "/?token=ä", "/?token=" + "x" * 24, "/socket", "/page.html", "//[x/"):
        with pytest.raises((urllib.error.HTTPError, UnicodeEncodeError)) as refused:
            urllib.request.urlopen(own + path)
        assert getattr(refused.value, "code", 403) == 403
        getattr(refused.value, "close", int)()
    elsewhere = ({"Cookie": cookie, "Origin": origin} for origin in ("http://elsewhere.example", "http://[x"))
    for headers in ({}, {"Origin": own}, *elsewhere):
        with pytest.raises(InvalidStatus, match="403"):
            socket_of(display, **headers)
    with socket_of(display, Cookie=cookie, Origin=own):
        pass


def test_who_controls_may_open_the_other_link_too(display):
    asked = urllib.request.Request(display.watch_link, headers={"Cookie": cookie_of(display)})
    with urllib.request.urlopen(asked) as answer:
        assert answer.headers["Set-Cookie"] is None
    with urllib.request.urlopen(display.watch_link) as answer:
        assert display.watch_token in answer.headers["Set-Cookie"]


def test_a_proxy_may_stand_before_it(display):
    headers = {"X-Forwarded-Host": "hub.example", "Origin": "https://hub.example"}
    with socket_of(display, Cookie=cookie_of(display), **headers):
        pass


NONSENSE = ("", "{}", "[" * 5000, '{"kind": "move", "x": 1e999, "y": 0}', b"\0\1", "9" * 99)


@pytest.mark.parametrize("message", NONSENSE, ids=range(len(NONSENSE)))
def test_who_tells_nonsense_is_cut_off(display, message):
    with socket_of(display, Cookie=cookie_of(display)) as line:
        line.send(message)
        assert cut_off(line) == 1008


TOO_LARGE = (("x" * 200_000, 1008), (b"a.json\n" + bytes(1 << 24), 1009))


@pytest.mark.parametrize(("message", "code"), TOO_LARGE, ids=("text", "file"))
def test_a_message_has_a_largest_size(display, message, code):
    with socket_of(display, Cookie=cookie_of(display)) as line:
        with suppress(ConnectionClosed):
            line.send(message)
        assert cut_off(line) == code


def test_a_slow_line_misses_pictures_and_nothing_is_sent_twice(display):
    surface = pygame.Surface((200, 200), 0, 32)
    with socket_of(display, Cookie=cookie_of(display)) as line:
        shown, pictures = None, 0
        for shade in range(0, 250, 5):
            surface.fill((shade, shade, 255), (shade // 2, 10, 40, 40))
            display.send(surface)
        display.send(surface)  # as it was
        while shown is None or not np.array_equal(shown, Picture.of(surface, 0).pixels):
            data = line.recv(5)
            if isinstance(data, bytes):
                shown, pictures = decoded(data, shown), pictures + 1
                line.send(json.dumps({"kind": "shown", "number": HEADER.unpack_from(data)[0]}))
        assert pictures <= 50
        with pytest.raises(TimeoutError):
            line.recv(0.1)


def told_to(line):
    """Return what a page is told next beside pictures."""
    while True:
        data = line.recv(5)
        if isinstance(data, str):
            return json.loads(data)


def watcher_of(display):
    return connect(f"ws://127.0.0.1:{display.port}/socket?token={display.watch_token}", proxy=None)


def controller(told):
    return next((each["number"] for each in told["people"] if each["controls"]), None)


def moved(display):
    """Return where the window's pointer has been meanwhile."""
    found = []
    while display._waiting:
        found.append(display._waiting.popleft())
    return [each.x for each in found if isinstance(each, PointerMoved)]


def test_one_controls_the_others_watch_and_control_is_handed_over(display):
    move = {"kind": "move", "y": 1}
    with watcher_of(display) as pupil:
        you = told_to(pupil)["you"]
        with socket_of(display, Cookie=cookie_of(display)) as teacher:
            told = told_to(teacher)
            assert controller(told) == told["you"]
            told_to(pupil)
            pupil.send(json.dumps({**move, "x": 1}))
            pupil.send(json.dumps({"kind": "control", "to": you}))  # is not theirs to take
            pupil.send(json.dumps({"kind": "control", "to": 0}))
            assert [each["asks"] for each in told_to(teacher)["people"]] == [True, False]
            teacher.send(json.dumps({**move, "x": 2}))
            teacher.send(json.dumps({"kind": "control", "to": you}))
            assert controller(told_to(teacher)) == you
            assert moved(display) == [2]
            teacher.send(json.dumps({**move, "x": 3}))
            teacher.send(json.dumps({"kind": "control", "to": told["you"]}))  # the teacher takes it back
            assert controller(told_to(teacher)) == told["you"]
            assert moved(display) == []
        while controller(told_to(pupil)) is not None:  # the teacher is gone: nobody controls
            pass


def test_a_page_that_lost_its_line_is_known_again(display):
    cookie = cookie_of(display)
    with socket_of(display, Cookie=cookie) as other, socket_of(display, "?page=a", Cookie=cookie) as before:
        told_to(other)
        own = told_to(before)["you"]
        other.send(json.dumps({"kind": "control", "to": own}))
        before.send(json.dumps({"kind": "name", "name": "Ada"}))
        with socket_of(display, "?page=a", Cookie=cookie) as again:  # nobody has noticed yet
            told = told_to(again)
            while len(told["people"]) > 2 or told["people"][1]["name"] != "Ada":
                told = told_to(again)
            assert told["you"] == controller(told) == own


def test_what_is_held_is_let_go_when_control_passes():
    hands, at = Hands(), {"kind": "button", "x": 5, "y": 6, "button": 1}
    told = ({**at, "down": True}, {"kind": "blur"}, {"kind": "blur"})
    found = [[each.type for each in hands.events(MESSAGES.validate_json(json.dumps(one)))] for one in told]
    assert found[1:] == [[pygame.MOUSEBUTTONUP, pygame.WINDOWFOCUSLOST], [pygame.WINDOWFOCUSLOST]]


def test_the_end_does_not_wait_for_lines_on_which_nothing_comes():
    with WebDisplay() as display:
        idle = socket.create_connection(("127.0.0.1", display.port))
        cookie_of(display)
        begun = time.monotonic()
    assert time.monotonic() - begun < 3.0
    idle.close()


def test_a_port_that_is_taken_is_told_in_a_line(display):
    taken = rf"^--port: 127.0.0.1:{display.port} cannot be listened to: address already in use; --port 0"
    with pytest.raises(RobocovError, match=taken), WebDisplay(port=display.port):
        pass


def test_only_who_controls_sees_the_clipboard(display):
    clipboard.put("a secret")
    surface = pygame.Surface((20, 20), 0, 32)
    with socket_of(display, Cookie=cookie_of(display)) as teacher, watcher_of(display) as pupil:
        display.send(surface)
        while "copied" not in (told := told_to(teacher)):
            pass
        assert told["copied"] == "a secret"
        pupil.send(json.dumps({"kind": "name", "name": "Ada\n"}))
        while (told := told_to(pupil))["people"][1]["name"] != "Ada":
            assert "copied" not in told
        assert "copied" not in told


def test_files_come_in_and_go_out_by_the_folder_alone(tmp_path):
    with WebDisplay(folder=tmp_path) as display:
        cookie = cookie_of(display)
        with socket_of(display, Cookie=cookie) as line:
            line.send(b"hall.json\n{}")
            while not display._waiting:
                time.sleep(0.01)
            assert display._waiting.popleft().path == str(tmp_path / "hall.json")
            assert (tmp_path / "hall.json").read_bytes() == b"{}"
            (tmp_path / "run").mkdir()
            (tmp_path / "run/record.json").write_text("1")
            (tmp_path / "run/.robocov.json").write_text("{}")
            # what others write there is not offered
            (tmp_path / "demo.log").write_text("")
            (tmp_path / "other").mkdir()
            display.send(pygame.Surface((20, 20), 0, 32))
            while not (saved := told_to(line).get("saved")):
                pass
        assert set(saved) == {"hall.json", "run"}
        for name, begins in (("hall.json", b"{}"), ("run", b"PK")):
            address = display.link.replace("/?", f"/saved/{name}?")
            with urllib.request.urlopen(address) as answer:
                assert answer.read().startswith(begins)
        for name in ("..%2fsecret", "%2e%2e/secret", "run/record.json", "other"):
            with pytest.raises(urllib.error.HTTPError) as missing:
                urllib.request.urlopen(display.link.replace("/?", f"/saved/{name}?"))
            missing.value.close()


@pytest.mark.parametrize(
    "name", ["../out.json", "/etc/x.json", "mine.py", ".hidden.json", "a\0.json", "", "x" * 200 + ".json"]
)
def test_no_other_names_are_taken(tmp_path, name):
    with WebDisplay(folder=tmp_path) as display, socket_of(display, Cookie=cookie_of(display)) as line:
        line.send(name.encode() + b"\n{}")
        assert cut_off(line) == 1008
        assert not list(tmp_path.iterdir())


def test_a_served_window_uses_the_caches_of_kernels_and_arrays(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    monkeypatch.setenv("ROBOCOV_CACHE", str(tmp_path / "arrays"))
    (tmp_path / "folder").mkdir()
    with confined(tmp_path / "folder"):
        for name in ("kernels", "arrays"):
            (tmp_path / name).mkdir()
            with locked(tmp_path / name, ".some.lock", remove=True):
                (tmp_path / name / "entry").write_text("")


def test_where_no_kernel_can_be_kept_nobody_waits_for_one(tmp_path, monkeypatch):
    """A folder that says it can be written to, and cannot: each kernel would be waited for for a minute."""
    monkeypatch.setattr("robocov.compiled._PATIENCE", 1e9)
    (tmp_path / "folder").mkdir()
    (tmp_path / "kernels").mkdir()
    with confined(tmp_path / "folder"):
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))

        @kernel
        def tripled(x):
            return 3.0 * x

        assert tripled(0.5) == 1.5


def test_a_served_window_reads_and_writes_below_its_folder_alone(tmp_path):
    folder, outside = tmp_path / "folder", tmp_path / "outside.json"
    folder.mkdir()
    outside.write_text("{}")
    (folder / "link.json").symlink_to(outside)
    (folder / "own.json").write_text("{}")
    with confined(folder):
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
                with pytest.raises(OutsideError, match="outside of the folder"):
                    act()
        for act in (lambda: list(tmp_path.iterdir()), lambda: (folder / "own.json").rename(tmp_path / "x")):
            with pytest.raises(OutsideError):
                act()
        with pytest.raises(RobocovError, match="outside"):
            load_map(outside)
    assert outside.read_text() == "{}"
