"""Everybody gets a window of their own, and comes back to it."""

import os
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from contextlib import suppress
from http.cookiejar import CookieJar
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from served_window import served

pytest.importorskip("websockets")

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("web")]


def visitor():
    """Return hands of a browser with cookies of its own: from an address to status, where it led, page."""
    browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))

    def opened(address):
        try:
            with browser.open(address) as answer:
                return answer.status, answer.url, answer.read()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, address, error.read()

    return opened


def test_each_visitor_has_a_window_of_their_own(tmp_path):
    from websockets.sync.client import connect

    with served("demo", "rooms", "--paused", "--each", "--most", "2", "--folder", str(tmp_path)) as link:
        ada, ben, cleo = visitor(), visitor(), visitor()
        status, own, page = ada(link)
        assert status == 200
        assert b"<canvas" in page
        assert ben(link)[:2] != (status, own)
        assert ada(link)[1] == own  # she comes back to it
        assert ada(link.partition("?")[0])[0] == 200  # by her cookie alone
        strange = (link, link[:-3], link.partition("?")[0], link.replace("/?", "//[?") + "x")
        assert [cleo(address)[0] for address in strange] == [503, 403, 403, 403]
        with connect(own.replace("http", "ws").replace("/?", "/socket?"), proxy=None) as line:
            line.send('{"kind": "page", "width": 900, "height": 600, "ratio": 1.0, "dark": false}')
            while not isinstance(line.recv(10), bytes):
                pass
        assert sorted(each.name for each in tmp_path.iterdir()) == ["session-1", "session-2"]


def wait_until(condition):
    end = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def alive(pid):
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
@pytest.mark.parametrize("starting", [False, True])
def test_ctrl_c_ends_all_windows_without_a_traceback(tmp_path, starting):
    how = {"stderr": subprocess.PIPE, "start_new_session": True}
    with served("demo", "rooms", "--paused", "--each", "--folder", str(tmp_path), **how) as link:
        visitor()(link)
        if starting:
            second = socket.create_connection(("127.0.0.1", urlsplit(link).port))
            second.sendall(f"GET /?{urlsplit(link).query} HTTP/1.1\r\n\r\n".encode())
            wait_until((tmp_path / "session-2").exists)
        pids = subprocess.run(["pgrep", "-P", str(link.process.pid)], capture_output=True, text=True).stdout
        os.killpg(link.process.pid, signal.SIGINT)  # as a terminal does
        assert link.process.wait(10) == 130
        assert link.process.stderr.read() == "robocov: stopped\n"
        link.process.stderr.close()
        wait_until(lambda: not any(map(alive, pids.split())))
        if starting:
            second.close()


def test_what_is_wrong_is_told_before_anybody_comes(tmp_path):
    call = [sys.executable, "-m", "robocov_app", "demo", "nowhere", "--serve", "--each", "--port", "0"]
    ended = subprocess.run([*call, "--folder", str(tmp_path)], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr.startswith("robocov: error: unknown map 'nowhere'")
