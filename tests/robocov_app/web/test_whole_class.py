"""A whole class: the window of a teacher in a real browser, and many viewers."""

import asyncio
import json
import os
import re
import signal
import sys
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from driven_browser import CHROMIUM, DRIVER, Browser
from served_window import serve_window

from robocov_app.storage.autosave import FOLDER_VARIABLE, SERVED_FOLDER

pytest.importorskip("websockets")

from page_client import MAX_WAIT_S, build_socket_address, connect_page, wait_until
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from robocov_app.web.frames import HEADER

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("web")]

TRY_AGAIN_LATER = 1013
DELETE = "\ue017"
ENTER = "\ue007"


class Viewers:
    """Pages that show a window, without a browser. They run in a thread of their own.

    Parameters
    ----------
    link : str
    n_pages : int
    delays : tuple of float
        Times that pages take to show a frame, s. Page i uses the delay with the index i modulo their number.
    first_messages : dict
        Messages that each page sends first.

    Attributes
    ----------
    n_frames : list of int
        Number of frames that each page has received.
    n_lost : int
        Number of pages that have lost their connection.
    """

    def __init__(self, link, n_pages, delays, *first_messages):
        self._first_messages = first_messages
        self._address = build_socket_address(link)
        self._delays = delays
        self._stop_requested = threading.Event()
        self.n_frames = [0] * n_pages
        self.n_lost = 0
        self._thread = threading.Thread(target=lambda: asyncio.run(self._watch_all()), daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop_requested.set()
        self._thread.join(MAX_WAIT_S)

    async def _watch_all(self):
        tasks = [asyncio.create_task(self._watch(page)) for page in range(len(self.n_frames))]
        while not self._stop_requested.is_set() and not all(task.done() for task in tasks):
            await asyncio.sleep(0.1)
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)

    async def _watch(self, page):
        try:
            async with connect(self._address, proxy=None, max_size=None) as socket:
                for message in self._first_messages:
                    await socket.send(json.dumps(message))
                async for message in socket:
                    if isinstance(message, bytes):
                        self.n_frames[page] += 1
                        await asyncio.sleep(self._delays[page % len(self._delays)])
                        number = HEADER.unpack_from(message)[0]
                        await socket.send(json.dumps({"kind": "shown", "number": number}))
        except (OSError, ConnectionClosed):
            self.n_lost += 1


def read_watch_link(link):
    """Return the link for viewers, which is printed after that of the teacher."""
    return re.search(r"http://\S+", link.process.stdout.readline())[0]


def read_note(browser):
    return browser.find("#note").text


def has_draft_of_session(folder):
    drafts = (json.loads(path.read_text()) for path in (folder / SERVED_FOLDER).rglob("draft.json"))
    return any(draft.get("session") for draft in drafts)


def shows_window(browser):
    return browser.run_script("return canvas.width > 500 && note.textContent === ''")


@pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and its driver")
@pytest.mark.skipif(sys.platform == "win32", reason="kill -9")
def test_a_class_watches_while_the_teacher_reloads_and_recovers_after_a_crash(tmp_path, monkeypatch):
    monkeypatch.delenv(FOLDER_VARIABLE, raising=False)
    folder = tmp_path / "files"
    arguments = ("demo", "square", "--robots", "3", "--lattice", "8", "--paused", "--folder", str(folder))
    browser = Browser(tmp_path / "browser")
    try:
        with serve_window(*arguments, cwd=tmp_path) as link:
            port = urlsplit(link).port
            watch_link = read_watch_link(link)
            browser.driver.get(link)
            wait_until(lambda: shows_window(browser))
            teacher = browser.driver.current_window_handle
            browser.driver.switch_to.new_window("tab")
            browser.driver.get(watch_link)
            viewer = browser.driver.current_window_handle
            wait_until(lambda: shows_window(browser) and not browser.run_script("return controls"))
            with Viewers(watch_link, 59, (0.0, 0.05, 0.3)) as others:
                wait_until(lambda: all(others.n_frames))
                with Viewers(watch_link, 40, (0.0,)) as crowd:
                    wait_until(lambda: all(crowd.n_frames))
                    with connect_page(watch_link) as rejected_page:
                        code, reason = rejected_page.wait_for_close()
                    assert code == TRY_AGAIN_LATER
                    assert reason.startswith("All 100 places for viewers are taken")
                    browser.driver.switch_to.window(teacher)
                    for _ in range(3):
                        browser.driver.refresh()
                        wait_until(lambda: shows_window(browser) and browser.run_script("return controls"))
                assert others.n_lost == 0
                n_frames_before = list(others.n_frames)
                browser.press_keys("i", DELETE)  # Select and remove robot 1.
                wait_until(lambda: all(np.greater(others.n_frames, n_frames_before)))
                wait_until(lambda: has_draft_of_session(folder))
                os.kill(link.process.pid, signal.SIGKILL)
                wait_until(lambda: others.n_lost == 59)
            wait_until(lambda: "Connection lost" in read_note(browser))
        with serve_window(*arguments, port=port, cwd=tmp_path) as link:
            browser.driver.switch_to.window(viewer)
            wait_until(lambda: "This link is not valid any more" in read_note(browser))
            browser.driver.switch_to.window(teacher)
            browser.driver.get(link)
            wait_until(lambda: shows_window(browser))
            with Viewers(read_watch_link(link), 60, (0.0, 0.05, 0.3)) as others:
                wait_until(lambda: all(others.n_frames))
                browser.press_keys(ENTER)  # Recover
                script = "for (const down of [true, false]) send({kind: 'key', key: 's', down, held: 2})"
                browser.run_script(script)
                wait_until(lambda: list(folder.glob("*.robocov")))
                assert others.n_lost == 0
    finally:
        browser.driver.quit()
    (saved,) = folder.glob("*.robocov")
    changes = [change["do"] for edit in json.loads(saved.read_text())["edits"] for change in edit["changes"]]
    assert changes[-1] == "leave"


def read_memory_mb(process):
    """Return the resident memory of a process, MB."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_memory_is_bounded_and_freed_after_viewers_have_left(tmp_path):
    arguments = ("demo", "rooms", "--robots", "20", "--start", "uniform", "--folder", str(tmp_path))
    page = {"kind": "page", "width": 1920, "height": 1080, "ratio": 1.0, "dark": False}
    delays = tuple(0.02 * page for page in range(50))
    with serve_window(*arguments, cwd=tmp_path) as link, Viewers(link, 1, (0.0,), page) as teacher:
        watch_link = read_watch_link(link)
        wait_until(lambda: teacher.n_frames[0] > 60)
        time.sleep(3.0)
        initial_mb = read_memory_mb(link.process)
        highest_mb = initial_mb
        for _ in range(2):
            with Viewers(watch_link, 100, delays) as viewers:
                end_time = time.monotonic() + 4.0
                while time.monotonic() < end_time or not all(viewers.n_frames):
                    highest_mb = max(highest_mb, read_memory_mb(link.process))
                    time.sleep(0.2)
        wait_until(lambda: read_memory_mb(link.process) < initial_mb + 120)  # usually 30 MB more
    assert highest_mb < initial_mb + 500  # usually 140 MB more
