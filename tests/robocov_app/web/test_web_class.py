"""A class: a teacher's window in a real browser, and many who watch it."""

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

import pytest
from driven_browser import CHROMIUM, DRIVER, Browser
from served_window import serve_window

from robocov_app.storage.autosave import FOLDER_VARIABLE, SERVED_FOLDER

pytest.importorskip("websockets")

from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect as connect_once

from robocov_app.web.frames import HEADER

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("web")]

PATIENCE_S = 60.0
DELETE = "\ue017"
ENTER = "\ue007"


def wait_until(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, "timed out"
        time.sleep(0.05)


class Watchers:
    """Pages that watch a window, without a browser; each takes some time for a frame."""

    def __init__(self, link, number, delays, *messages):
        self._messages = messages
        self._address = link.replace("http", "ws").replace("/?", "/socket?")
        self._number = number
        self._delays = delays
        self._ended = threading.Event()
        self.n_frames = [0] * number
        self.n_lost = 0
        self._thread = threading.Thread(target=lambda: asyncio.run(self._watch_all()), daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self._thread.join(PATIENCE_S)

    async def _watch_all(self):
        watching = [asyncio.create_task(self._watch(number)) for number in range(self._number)]
        while not self._ended.is_set() and not all(each.done() for each in watching):
            await asyncio.sleep(0.1)
        for each in watching:
            each.cancel()
        await asyncio.wait(watching)

    async def _watch(self, number):
        try:
            async with connect(self._address, proxy=None, max_size=None) as line:
                for message in self._messages:
                    await line.send(json.dumps(message))
                async for message in line:
                    if isinstance(message, bytes):
                        self.n_frames[number] += 1
                        await asyncio.sleep(self._delays[number % len(self._delays)])
                        shown = HEADER.unpack_from(message)[0]
                        await line.send(json.dumps({"kind": "shown", "number": shown}))
        except (OSError, ConnectionClosed):
            self.n_lost += 1


def watch_link_of(link):
    """Return the link for watchers, which is printed after that of the teacher."""
    return re.search(r"http://\S+", link.process.stdout.readline())[0]


def note(browser):
    return browser.find("#note").text


def is_shown(browser):
    return browser.run_script("return canvas.width > 500 && note.textContent === ''")


@pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and its driver")
@pytest.mark.skipif(sys.platform == "win32", reason="kill -9")
def test_a_class_watches_reloads_are_let_in_and_the_work_outlives_the_server(tmp_path, monkeypatch):
    monkeypatch.delenv(FOLDER_VARIABLE, raising=False)
    folder = tmp_path / "files"
    words = ("demo", "square", "--robots", "3", "--lattice", "8", "--paused", "--folder", str(folder))
    browser = Browser(tmp_path / "browser")
    try:
        with serve_window(*words, cwd=tmp_path) as link:
            port = urlsplit(link).port
            watch_link = watch_link_of(link)
            browser.driver.get(link)
            wait_until(lambda: is_shown(browser))
            teacher = browser.driver.current_window_handle
            browser.driver.switch_to.new_window("tab")
            browser.driver.get(watch_link)
            pupil = browser.driver.current_window_handle
            wait_until(lambda: is_shown(browser) and not browser.run_script("return controls"))
            with Watchers(watch_link, 59, (0.0, 0.05, 0.3)) as others:
                wait_until(lambda: all(others.n_frames))
                with Watchers(watch_link, 40, (0.0,)) as crowd:
                    wait_until(lambda: all(crowd.n_frames))
                    with (
                        connect_once(
                            watch_link.replace("http", "ws").replace("/?", "/socket?"), proxy=None
                        ) as line,
                        pytest.raises(ConnectionClosed, match="All 100 places for viewers are taken"),
                    ):
                        while True:
                            line.recv(PATIENCE_S)
                    browser.driver.switch_to.window(teacher)
                    for _ in range(3):
                        browser.driver.refresh()
                        wait_until(lambda: is_shown(browser) and browser.run_script("return controls"))
                assert others.n_lost == 0
                before = list(others.n_frames)
                browser.press_keys("i", DELETE)  # selects robot 1, and removes it
                wait_until(lambda: all(b > a for a, b in zip(before, others.n_frames, strict=True)))
                wait_until(
                    lambda: any(
                        json.loads(path.read_text()).get("session")
                        for path in (folder / SERVED_FOLDER).rglob("draft.json")
                    )
                )
                time.sleep(1.5)  # at most a second is lost
                os.kill(link.process.pid, signal.SIGKILL)
                wait_until(lambda: others.n_lost == 59)
            wait_until(lambda: "Connection lost" in note(browser))
        with serve_window(*words, port=port, cwd=tmp_path) as link:
            browser.driver.switch_to.window(pupil)
            wait_until(lambda: "This link is not valid any more" in note(browser))
            browser.driver.switch_to.window(teacher)
            browser.driver.get(link)
            wait_until(lambda: is_shown(browser))
            with Watchers(watch_link_of(link), 60, (0.0, 0.05, 0.3)) as others:
                wait_until(lambda: all(others.n_frames))
                browser.press_keys(ENTER)  # Recover
                time.sleep(1.0)
                script = "for (const down of [true, false]) tell({kind: 'key', key: 's', down, held: 2})"
                browser.run_script(script)
                wait_until(lambda: list(folder.glob("*.robocov")))
                assert others.n_lost == 0
    finally:
        browser.driver.quit()
    (saved,) = folder.glob("*.robocov")
    changes = [change["do"] for edit in json.loads(saved.read_text())["edits"] for change in edit["changes"]]
    assert changes[-1] == "leave"


def read_memory_mb(process):
    """Return the memory of a process that is in use."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024


@pytest.mark.skipif(sys.platform != "linux", reason="looks for memory in /proc")
def test_memory_is_bounded_and_given_back_when_pages_have_come_and_gone(tmp_path):
    words = ("demo", "rooms", "--robots", "20", "--start", "uniform", "--folder", str(tmp_path))
    page = {"kind": "page", "width": 1920, "height": 1080, "ratio": 1.0, "dark": False}
    slow = tuple(0.02 * number for number in range(50))
    with serve_window(*words, cwd=tmp_path) as link, Watchers(link, 1, (0.0,), page) as teacher:
        watch_link = watch_link_of(link)
        wait_until(lambda: teacher.n_frames[0] > 60)
        time.sleep(3.0)
        before = read_memory_mb(link.process)
        highest = before
        for _ in range(2):
            with Watchers(watch_link, 100, slow) as watchers:
                end = time.monotonic() + 8.0
                while time.monotonic() < end or not all(watchers.n_frames):
                    highest = max(highest, read_memory_mb(link.process))
                    time.sleep(0.2)
        wait_until(lambda: read_memory_mb(link.process) < before + 120)  # 30 MB is usual
    assert highest < before + 500  # 140 MB is usual
