"""Windows of visitors: each visitor has a window of their own, and comes back to it."""

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

from page_client import connect_page, wait_until

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("web")]

TRY_AGAIN_LATER = 1013
SERVICE_RESTART = 1012


class Visitor:
    """A user with a browser and its cookies."""

    def __init__(self):
        self.cookies = CookieJar()
        self._opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(self.cookies))

    def get(self, address, method="GET"):
        """Request an address; return the status, the final address after redirects, and the body."""
        try:
            with self._opener.open(urllib.request.Request(address, method=method)) as response:
                return response.status, response.url, response.read()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, address, error.read()

    @contextmanager
    def page(self, link):
        """Open the page of a link, and its socket, as a browser does."""
        status, address, _ = self.get(link)
        assert status == 200
        with connect_page(address) as page:
            yield page


def wait_for_window(page):
    """Report the size of a page, and wait for the first frame of its window."""
    page.report_page(1000, 700)
    page.receive_frame()


def list_window_processes(server):
    """Return the ids of the processes of a server's windows."""
    result = subprocess.run(
        ["pgrep", "-P", str(server.pid), "-f", "spawn_main"], capture_output=True, text=True
    )
    return [int(line) for line in result.stdout.splitlines()]


def is_running(pid):
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


def list_session_folders(folder):
    return sorted(path.name for path in folder.iterdir() if path.is_dir())


def test_each_visitor_has_a_window_of_their_own(tmp_path):
    options = ("--paused", "--each", "--max-sessions", "2", "--folder", str(tmp_path))
    with serve_window("demo", "rooms", *options) as link:
        ada = Visitor()
        ben = Visitor()
        cleo = Visitor()
        link_without_token = link.partition("?")[0]
        status, address_of_ada, page = ada.get(link)
        assert status == 200
        assert b"<canvas" in page
        status, address_of_ben, _ = ben.get(link)
        assert status == 200
        assert address_of_ben != address_of_ada
        assert ada.get(link)[1] == address_of_ada
        assert ada.get(link_without_token)[0] == 200  # by her cookie alone
        invalid_links = (link[:-3], link_without_token, link.replace("/?", "//[?") + "x", address_of_ada[:-1])
        for invalid_link in invalid_links:
            assert cleo.get(invalid_link)[0] == 403
        with ada.page(link) as page_of_ada, ben.page(link) as page_of_ben:
            wait_for_window(page_of_ada)
            wait_for_window(page_of_ben)
            with ada.page(link) as second_tab:
                wait_for_window(second_tab)
            with cleo.page(link) as rejected_page:
                reason = "All 2 windows are in use. Trying again …"
                assert rejected_page.wait_for_close() == (TRY_AGAIN_LATER, reason)
            (tmp_path / "session-1/mine.json").write_text("{}")
            page_of_ada.receive_message_until(lambda message: "mine.json" in message.get("saved", ()))
            download_link = link_without_token + "saved/mine.json"
            assert [visitor.get(download_link)[0] for visitor in (ada, ben, cleo)] == [200, 404, 404]
        assert list_session_folders(tmp_path) == ["session-1", "session-2"]


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_requests_without_a_socket_open_no_windows(tmp_path):
    options = ("--each", "--max-sessions", "2", "--folder", str(tmp_path))
    with serve_window("demo", "rooms", "--paused", *options) as link:
        (spare_window,) = list_window_processes(link.process)
        for _ in range(10):
            status, address, page = Visitor().get(link)
            assert status == 200
            assert b"<canvas" in page
            assert Visitor().get(address, "HEAD") == (200, address, b"")
        assert list_window_processes(link.process) == [spare_window]
        with Visitor().page(link) as first_page, Visitor().page(link) as second_page:
            wait_for_window(first_page)
            wait_for_window(second_page)
            assert len(list_window_processes(link.process)) == 2


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_window_without_pages_is_closed_and_its_work_is_recovered_later(tmp_path, monkeypatch):
    monkeypatch.delenv(FOLDER_VARIABLE, raising=False)
    options = ("--each", "--max-sessions", "1", "--idle-minutes", "0.05", "--folder", str(tmp_path))
    ada = Visitor()
    ben = Visitor()
    with serve_window("edit", *options, cwd=tmp_path) as link:
        with ada.page(link) as page:
            wait_for_window(page)
            page.press_key("c")  # the circle tool
            page.drag((300, 300), (350, 300))
            (window,) = list_window_processes(link.process)
            time.sleep(4.0)
            assert is_running(window)  # A page is open.
        wait_until(lambda: not list_window_processes(link.process))
        assert len(list((tmp_path / "session-1" / SERVED_FOLDER).rglob("draft.json"))) == 1
        with ben.page(link) as page:  # The only window is free again.
            wait_for_window(page)
        wait_until(lambda: not list_window_processes(link.process))
        with ada.page(link) as page:
            wait_for_window(page)
            page.press_key("Enter")  # Recover
            page.press_key("s", held=2)
            page.press_key("Enter")
            wait_until(lambda: list((tmp_path / "session-1").glob("*.json")))
    (saved,) = (tmp_path / "session-1").glob("*.json")
    assert [obstacle["kind"] for obstacle in json.loads(saved.read_text())["obstacles"]] == ["circle"]
    # After a restart of the server, the visitor has the same window.
    with serve_window("edit", *options, cwd=tmp_path) as link:
        assert ada.get(link.partition("?")[0])[0] == 403  # Its link is new.
        with ada.page(link) as page:
            wait_for_window(page)
            (tmp_path / "session-1/new.json").write_text("{}")
            page.receive_message_until(lambda message: "new.json" in message.get("saved", ()))


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_page_opens_its_window_again_after_a_crash(tmp_path):
    with serve_window("demo", "rooms", "--paused", "--each", "--folder", str(tmp_path)) as link:
        ada = Visitor()
        with ada.page(link) as page:
            wait_for_window(page)
            pid = list_window_processes(link.process)[0]
            os.kill(pid, signal.SIGKILL)
            code, _ = page.wait_for_close()
            assert code == SERVICE_RESTART
        # The sockets of a process are closed shortly before it has ended.
        wait_until(lambda: not is_running(pid))
        with ada.page(link) as page:
            wait_for_window(page)
            page.press_key("q", held=2)
            page.press_key("Enter")
        assert list_session_folders(tmp_path) == ["session-1"]


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize(("signal_number", "is_starting"), [(signal.SIGINT, True), (signal.SIGTERM, False)])
def test_a_signal_stops_all_windows_without_a_traceback(tmp_path, is_starting, signal_number):
    process_options = {"stderr": subprocess.PIPE, "start_new_session": True}
    with serve_window(
        "demo", "rooms", "--paused", "--each", "--folder", str(tmp_path), **process_options
    ) as link:
        with Visitor().page(link) as page:
            wait_for_window(page)
            with Visitor().page(link) as second:
                if is_starting:
                    wait_until((tmp_path / "session-2").exists)
                else:
                    wait_for_window(second)
                pids = list_window_processes(link.process)
                assert pids
                if signal_number == signal.SIGINT:
                    os.killpg(link.process.pid, signal_number)  # as a terminal does
                else:
                    link.process.send_signal(signal_number)
                assert link.process.wait(10) == 130
        assert link.process.stderr.read() == "robocov: stopped\n"
        link.process.stderr.close()
        wait_until(lambda: not any(is_running(pid) for pid in pids))


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_windows_end_when_their_server_is_killed(tmp_path):
    options = ("--paused", "--each", "--folder", str(tmp_path))
    with (
        serve_window("demo", "rooms", *options, start_new_session=True) as link,
        Visitor().page(link) as page,
    ):
        wait_for_window(page)
        pids = list_window_processes(link.process)
        link.process.kill()
        assert page.wait_for_close() is None
        wait_until(lambda: not any(is_running(pid) for pid in pids))


def test_wrong_arguments_are_reported_when_the_server_starts(tmp_path):
    command = [sys.executable, "-m", "robocov_app", "demo", "nowhere", "--serve", "--each", "--port", "0"]
    result = subprocess.run([*command, "--folder", str(tmp_path)], capture_output=True, text=True, timeout=60)
    assert result.returncode == 2
    assert result.stdout == ""
    assert result.stderr.startswith("robocov: error: unknown map 'nowhere'")
    assert not list(tmp_path.iterdir())
