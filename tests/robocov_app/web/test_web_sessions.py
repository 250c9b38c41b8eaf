"""Windows of visitors: who gets a place, who gives one back, and which folder is whose."""

import asyncio
import json
from types import SimpleNamespace

import pytest

pytest.importorskip("websockets")

from robocov.errors import InputError
from robocov_app.web.visitor_server import MIN_IDLE_S, VisitorServer
from robocov_app.web.visitors import FILE_NAME, VisitorFolders, create_id, is_signed, read_id, sign
from robocov_app.web.window_process import WindowProcess


class Process:
    """A process that ends when it is asked to."""

    def __init__(self):
        self.lives = True

    def is_alive(self):
        return self.lives

    def terminate(self):
        self.lives = False

    kill = terminate


class FakeServer(VisitorServer):
    """Windows without processes."""

    def __init__(self, folder, max_windows, max_idle_s=600.0):
        super().__init__(lambda _: 0, SimpleNamespace(folder=folder), max_windows, max_idle_s)
        self.opened = []
        self.error = None

    async def _open(self, folder):
        await asyncio.sleep(0)
        if self.error is not None:
            raise self.error
        window = WindowProcess(Process(), folder, port=1, token="")
        self.opened.append(window)
        return window

    async def visit(self, visitor, *, leaves=True):
        """Open a page, and close it; return the window, or None without a place."""
        window = await self._find_or_open(visitor)
        if window is None:
            return None
        process = await asyncio.shield(window.opening)
        window.page_count += not leaves
        return process

    def pass_time(self, visitor, seconds):
        self._windows[visitor].idle_since -= seconds


ADA = 24 * "a"
BEN = 24 * "b"
CLEO = 24 * "c"


def test_a_visitor_comes_back_to_their_window(tmp_path):
    async def visits():
        server = FakeServer(tmp_path, 2)
        windows = await asyncio.gather(*(server.visit(ADA) for _ in range(5)))
        assert len({id(window) for window in windows}) == len(server.opened) == 1
        assert (await server.visit(BEN)).folder != windows[0].folder

    asyncio.run(visits())


def test_a_place_is_given_back_when_nobody_has_looked_for_a_minute_and_somebody_waits(tmp_path):
    async def visits():
        server = FakeServer(tmp_path, 2)
        hers = await server.visit(ADA)
        his = await server.visit(BEN, leaves=False)
        assert await server.visit(CLEO) is None
        server.pass_time(ADA, MIN_IDLE_S / 2)
        server.pass_time(BEN, 1e6)
        assert await server.visit(CLEO) is None
        server.pass_time(ADA, MIN_IDLE_S)
        assert await server.visit(CLEO) is not None
        assert (hers.process.lives, his.process.lives) == (False, True)
        server.pass_time(CLEO, 1e6)
        again = await server.visit(ADA)
        assert again is not hers
        assert again.folder == hers.folder

    asyncio.run(visits())


def test_a_window_that_nobody_looks_at_is_ended(tmp_path):
    async def visits():
        server = FakeServer(tmp_path, 3, max_idle_s=100.0)
        hers = await server.visit(ADA)
        his = await server.visit(BEN)
        for seconds, lives in ((99.0, True), (2.0, False)):
            server.pass_time(ADA, seconds)
            server._remove_idle_windows()
            await asyncio.sleep(0.1)
            assert (hers.process.lives, his.process.lives) == (lives, True)
        assert list(server._windows) == [BEN]

    asyncio.run(visits())


def test_a_window_that_ended_by_itself_gives_its_place_back_at_once(tmp_path):
    async def visits():
        server = FakeServer(tmp_path, 1)
        for visitor in (ADA, BEN, BEN, ADA):
            window = await server.visit(visitor, leaves=False)
            window.process.lives = False
        assert len(server.opened) == 4

    asyncio.run(visits())


def test_a_window_that_does_not_open_takes_no_place(tmp_path):
    async def visits():
        server = FakeServer(tmp_path, 1)
        server.error = InputError("no")
        for _ in range(3):
            with pytest.raises(InputError):
                await server.visit(ADA)
            server._remove_idle_windows()
        server.error = None
        assert await server.visit(BEN) is not None

    asyncio.run(visits())


def test_a_visitor_who_is_known_takes_the_place_of_the_window_that_is_kept_ready(tmp_path):
    async def visits():
        server = FakeServer(tmp_path, 1)
        folder = (await server.visit(ADA)).folder
        later = FakeServer(tmp_path, 1)
        later._spare = spare = await later._open(later._folders.create())
        assert (await later.visit(ADA)).folder == folder
        assert not spare.process.lives
        assert not spare.folder.exists()

    asyncio.run(visits())


def test_folders_are_of_one_visitor_each_also_after_a_restart(tmp_path):
    (tmp_path / "session-1").mkdir()  # that of nobody knows whom
    before = VisitorFolders(tmp_path)
    assert before.find(ADA) is None
    before.assign(ADA, before.create())
    again = VisitorFolders(tmp_path)
    assert again.cookie == before.cookie
    assert again.find(ADA) == tmp_path / "session-2"
    again.assign(BEN, again.create())
    assert again.find(BEN) == tmp_path / "session-3"
    before.assign(CLEO, before.create())  # both at the same time
    assert VisitorFolders(tmp_path).find(BEN) == tmp_path / "session-3"
    assert ADA not in (tmp_path / FILE_NAME).read_text()
    (tmp_path / "session-2").rmdir()
    assert VisitorFolders(tmp_path).find(ADA) is None


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "[]",
        "null",
        '{"cookie": 5, "visitors": []}',
        '{"cookie": "a\\r\\nb: c", "visitors": {"a": 5}}',
    ],
)
def test_a_broken_list_of_visitors_is_no_trouble(tmp_path, content):
    (tmp_path / FILE_NAME).write_text(content)
    folders = VisitorFolders(tmp_path)
    assert folders.cookie.removeprefix("robocov-").isalnum()
    folders.assign(ADA, folders.create())
    assert VisitorFolders(tmp_path).find(ADA)


@pytest.mark.parametrize("name", ["../elsewhere", "/etc", "session-1/..", "session-", "session-1/../..", ""])
def test_no_list_of_visitors_leads_elsewhere(tmp_path, name):
    folders = VisitorFolders(tmp_path)
    folders.assign(ADA, folders.create())
    content = json.loads((tmp_path / FILE_NAME).read_text())
    content["visitors"] = dict.fromkeys(content["visitors"], name)
    (tmp_path / FILE_NAME).write_text(json.dumps(content))
    assert VisitorFolders(tmp_path).find(ADA) is None


def test_tokens_of_visitors_are_known_by_the_server_that_let_them_in():
    visitor = create_id()
    token = sign(visitor, "key")
    assert read_id(token) == visitor
    assert is_signed(token, "key")
    for wrong in (sign(visitor, "other"), visitor, f"{visitor}.", token + "x", token[1:], "", ".", "ä." * 9):
        assert not is_signed(wrong, "key")
