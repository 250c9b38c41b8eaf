"""Every visitor gets a window of their own, and comes back to it."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from contextlib import contextmanager, suppress
from http.cookiejar import CookieJar
from pathlib import Path

import pytest
from served_window import serve_window

from robocov_app.storage.autosave import FOLDER_VARIABLE, SERVED_FOLDER

pytest.importorskip("websockets")

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("web")]

PATIENCE_S = 120.0


class Visitor:
    """A browser with cookies of its own."""

    def __init__(self):
        self.cookies = CookieJar()
        self._opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(self.cookies))

    def get(self, address, method="GET"):
        """Return the status, where the address led, and the page."""
        try:
            with self._opener.open(urllib.request.Request(address, method=method)) as answer:
                return answer.status, answer.url, answer.read()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, address, error.read()

    @contextmanager
    def page(self, link):
        """Open the page of a link, and its socket, as a browser does."""
        status, address, _ = self.get(link)
        assert status == 200
        with connect(address.replace("http", "ws").replace("/?", "/socket?"), proxy=None) as line:
            yield line


def read_first_frame(line):
    line.send('{"kind": "page", "width": 1000, "height": 700, "ratio": 1.0, "dark": false}')
    while not isinstance(frame := line.recv(PATIENCE_S), bytes):
        pass
    return frame


def press(line, key, held=0):
    for down in (True, False):
        line.send(json.dumps({"kind": "key", "key": key, "down": down, "held": held}))


def close_of(line):
    """Return the code and the reason with which a page's socket is closed; None without a goodbye."""
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            line.recv(PATIENCE_S)
    received = closed.value.rcvd
    return received and (received.code, received.reason)


def wait_until(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def list_children(process):
    """Return the processes of windows."""
    found = subprocess.run(
        ["pgrep", "-P", str(process.pid), "-f", "spawn_main"], capture_output=True, text=True
    )
    return [int(each) for each in found.stdout.split()]


def is_alive(pid):
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


def test_each_visitor_has_a_window_of_their_own(tmp_path):
    options = ("--paused", "--each", "--max-sessions", "2", "--folder", str(tmp_path))
    with serve_window("demo", "rooms", *options) as link:
        ada = Visitor()
        ben = Visitor()
        cleo = Visitor()
        status, own, page = ada.get(link)
        assert status == 200
        assert b"<canvas" in page
        assert ben.get(link)[:2] != (status, own)
        assert ada.get(link)[1] == own
        assert ada.get(link.partition("?")[0])[0] == 200  # by her cookie alone
        strange = (link[:-3], link.partition("?")[0], link.replace("/?", "//[?") + "x", own[:-1])
        assert [cleo.get(address)[0] for address in strange] == [403] * 4
        with ada.page(link) as hers, ben.page(link) as his:
            read_first_frame(hers), read_first_frame(his)
            with ada.page(link) as second:  # another tab
                read_first_frame(second)
            with cleo.page(link) as refused:
                assert close_of(refused) == (1013, "All 2 windows are in use. Trying again …")
            (tmp_path / "session-1/mine.json").write_text("{}")
            wait_until(lambda: "mine.json" in hers.recv(PATIENCE_S).__str__())
            saved = link.partition("?")[0] + "saved/mine.json"
            assert [each.get(saved)[0] for each in (ada, ben, cleo)] == [200, 404, 404]
        folders = [each.name for each in tmp_path.iterdir() if each.is_dir()]
        assert sorted(folders) == ["session-1", "session-2"]


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
def test_who_only_fetches_the_page_takes_no_window(tmp_path):
    options = ("--each", "--max-sessions", "2", "--folder", str(tmp_path))
    with serve_window("demo", "rooms", "--paused", *options) as link:
        (spare,) = list_children(link.process)
        for _ in range(10):
            status, address, page = Visitor().get(link)
            assert status == 200
            assert b"<canvas" in page
            assert Visitor().get(address, "HEAD") == (200, address, b"")
        assert list_children(link.process) == [spare]
        with Visitor().page(link) as ada, Visitor().page(link) as ben:
            read_first_frame(ada), read_first_frame(ben)
            assert len(list_children(link.process)) == 2


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
def test_a_window_that_nobody_looks_at_is_ended_and_its_work_is_offered(tmp_path, monkeypatch):
    monkeypatch.delenv(FOLDER_VARIABLE, raising=False)
    options = ("--each", "--max-sessions", "1", "--idle-minutes", "0.05", "--folder", str(tmp_path))
    ada = Visitor()
    ben = Visitor()
    with serve_window("edit", *options, cwd=tmp_path) as link:
        with ada.page(link) as line:
            read_first_frame(line)
            press(line, "c")  # the tool for circles
            line.send(json.dumps({"kind": "button", "button": 1, "down": True, "x": 300, "y": 300}))
            line.send(json.dumps({"kind": "move", "button": 1, "x": 350, "y": 300}))
            line.send(json.dumps({"kind": "button", "button": 1, "down": False, "x": 350, "y": 300}))
            (window,) = list_children(link.process)
            time.sleep(5.0)
            assert is_alive(window)  # somebody looks
        wait_until(lambda: not list_children(link.process))
        assert len(list((tmp_path / "session-1" / SERVED_FOLDER).rglob("draft.json"))) == 1
        with ben.page(link) as line:  # the place was given back
            read_first_frame(line)
        wait_until(lambda: not list_children(link.process))
        with ada.page(link) as line:
            read_first_frame(line)
            press(line, "Enter")  # Recover
            press(line, "s", held=2)
            press(line, "Enter")
            wait_until(lambda: list((tmp_path / "session-1").glob("*.json")))
    (saved,) = (tmp_path / "session-1").glob("*.json")
    assert [each["kind"] for each in json.loads(saved.read_text())["obstacles"]] == ["circle"]
    # also the next server knows her
    with serve_window("edit", *options, cwd=tmp_path) as link:
        assert ada.get(link.partition("?")[0])[0] == 403  # but not without its link
        with ada.page(link) as line:
            read_first_frame(line)
            (tmp_path / "session-1/new.json").write_text("{}")
            wait_until(lambda: "new.json" in line.recv(PATIENCE_S).__str__())


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
def test_a_window_that_dies_is_opened_again_by_its_page(tmp_path):
    with serve_window("demo", "rooms", "--paused", "--each", "--folder", str(tmp_path)) as link:
        ada = Visitor()
        with ada.page(link) as line:
            read_first_frame(line)
            pid = list_children(link.process)[0]
            os.kill(pid, signal.SIGKILL)
            assert close_of(line)[0] == 1012
        # The sockets of a process are closed shortly before it has ended.
        wait_until(lambda: not is_alive(pid))
        with ada.page(link) as line:
            read_first_frame(line)
            press(line, "q", held=2)
            press(line, "Enter")
        assert sorted(each.name for each in tmp_path.iterdir() if each.is_dir()) == ["session-1"]


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
@pytest.mark.parametrize("starting", [False, True])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_all_windows_without_a_traceback(tmp_path, starting, number):
    how = {"stderr": subprocess.PIPE, "start_new_session": True}
    with serve_window("demo", "rooms", "--paused", "--each", "--folder", str(tmp_path), **how) as link:
        with Visitor().page(link) as line:
            read_first_frame(line)
            with Visitor().page(link) as second:
                if starting:
                    wait_until((tmp_path / "session-2").exists)
                else:
                    read_first_frame(second)
                pids = list_children(link.process)
                assert pids
                if number == signal.SIGINT:
                    os.killpg(link.process.pid, number)  # as a terminal does
                else:
                    link.process.send_signal(number)
                assert link.process.wait(10) == 130
        assert link.process.stderr.read() == "robocov: stopped\n"
        link.process.stderr.close()
        wait_until(lambda: not any(map(is_alive, pids)))


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
def test_windows_do_not_outlive_a_server_that_is_killed(tmp_path):
    options = ("--paused", "--each", "--folder", str(tmp_path))
    with (
        serve_window("demo", "rooms", *options, start_new_session=True) as link,
        Visitor().page(link) as line,
    ):
        read_first_frame(line)
        pids = list_children(link.process)
        link.process.kill()
        assert close_of(line) is None
        wait_until(lambda: not any(map(is_alive, pids)))


def test_what_is_wrong_is_told_before_anybody_comes(tmp_path):
    call = [sys.executable, "-m", "robocov_app", "demo", "nowhere", "--serve", "--each", "--port", "0"]
    ended = subprocess.run([*call, "--folder", str(tmp_path)], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr.startswith("robocov: error: unknown map 'nowhere'")
    assert not list(tmp_path.iterdir())
