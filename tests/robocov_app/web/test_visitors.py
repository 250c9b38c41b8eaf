"""Visitors of a server: windows within a limit, their folders, and their tokens."""

import asyncio
import json
from types import SimpleNamespace

import pytest

pytest.importorskip("websockets")

from robocov.errors import InputError
from robocov_app.web.visitor_server import MIN_IDLE_S, VisitorServer, VisitorWindow
from robocov_app.web.visitors import FILE_NAME, VisitorFolders, create_id, is_signed, read_id, sign
from robocov_app.web.window_process import WindowAddress, WindowProcess

ADDRESS = WindowAddress(port=1, token="")


class FakeProcess:
    """A process that ends as soon as it is terminated."""

    def __init__(self):
        self.is_running = True

    def is_alive(self):
        return self.is_running

    def terminate(self):
        self.is_running = False

    kill = terminate


class FakeServer(VisitorServer):
    """A server of windows without processes."""

    def __init__(self, folder, max_windows, max_idle_s=600.0):
        super().__init__(lambda _: 0, SimpleNamespace(folder=folder), max_windows, max_idle_s)
        self.opened = []
        self.error = None

    async def _open(self, folder):
        await asyncio.sleep(0)
        if self.error is not None:
            raise self.error
        window = WindowProcess(FakeProcess(), folder, ADDRESS)
        self.opened.append(window)
        return window

    async def visit(self, visitor, *, stays=False):
        """Open a page, and close it unless the visitor stays.

        Returns
        -------
        WindowProcess or None
            The window of the visitor; None if there are too many windows.
        """
        window = await self._find_or_open(visitor)
        if window is None:
            return None
        process = await asyncio.shield(window.opening)
        window.page_count += stays
        return process

    def pass_time(self, visitor, seconds):
        self._windows[visitor].idle_since -= seconds


ADA = 24 * "a"
BEN = 24 * "b"
CLEO = 24 * "c"


def test_a_visitor_gets_the_same_window_each_time(tmp_path):
    async def run():
        server = FakeServer(tmp_path, 2)
        windows = await asyncio.gather(*(server.visit(ADA) for _ in range(5)))
        assert len({id(window) for window in windows}) == len(server.opened) == 1
        assert (await server.visit(BEN)).folder != windows[0].folder

    asyncio.run(run())


def test_a_waiting_visitor_replaces_one_who_has_been_away_for_a_minute(tmp_path):
    async def run():
        server = FakeServer(tmp_path, 2)
        window_of_ada = await server.visit(ADA)
        window_of_ben = await server.visit(BEN, stays=True)
        assert await server.visit(CLEO) is None
        server.pass_time(ADA, MIN_IDLE_S / 2)
        server.pass_time(BEN, 1e6)
        assert await server.visit(CLEO) is None
        server.pass_time(ADA, MIN_IDLE_S)
        assert await server.visit(CLEO) is not None
        assert (window_of_ada.process.is_running, window_of_ben.process.is_running) == (False, True)
        server.pass_time(CLEO, 1e6)
        new_window_of_ada = await server.visit(ADA)
        assert new_window_of_ada is not window_of_ada
        assert new_window_of_ada.folder == window_of_ada.folder

    asyncio.run(run())


def test_a_window_without_pages_is_closed(tmp_path):
    async def run():
        server = FakeServer(tmp_path, 3, max_idle_s=100.0)
        window_of_ada = await server.visit(ADA)
        window_of_ben = await server.visit(BEN)
        for seconds, is_running in ((99.0, True), (2.0, False)):
            server.pass_time(ADA, seconds)
            server._remove_idle_windows()
            await asyncio.sleep(0.1)
            assert (window_of_ada.process.is_running, window_of_ben.process.is_running) == (is_running, True)
        assert list(server._windows) == [BEN]

    asyncio.run(run())


def test_a_window_whose_process_has_ended_is_replaced_at_once(tmp_path):
    async def run():
        server = FakeServer(tmp_path, 1)
        for visitor in (ADA, BEN, BEN, ADA):
            window = await server.visit(visitor, stays=True)
            window.process.is_running = False
        assert len(server.opened) == 4

    asyncio.run(run())


def test_a_window_that_fails_to_open_does_not_count(tmp_path):
    async def run():
        server = FakeServer(tmp_path, 1)
        server.error = InputError("no")
        for _ in range(3):
            with pytest.raises(InputError):
                await server.visit(ADA)
            server._remove_idle_windows()
        server.error = None
        assert await server.visit(BEN) is not None

    asyncio.run(run())


def test_a_returning_visitor_replaces_the_spare_window(tmp_path):
    async def run():
        server = FakeServer(tmp_path, 1)
        folder = (await server.visit(ADA)).folder
        restarted = FakeServer(tmp_path, 1)
        spare = await restarted._open(restarted._folders.create())
        restarted._spare = spare
        assert (await restarted.visit(ADA)).folder == folder
        assert not spare.process.is_running
        assert not spare.folder.exists()

    asyncio.run(run())


@pytest.mark.parametrize("has_closed", [False, True])
def test_a_window_that_its_user_has_closed_does_not_count(tmp_path, has_closed):
    """Its process takes some seconds to end."""

    async def build_window(*, has_closed):
        process = WindowProcess(FakeProcess(), tmp_path, ADDRESS)
        opening = asyncio.create_task(asyncio.sleep(0, process))
        await opening
        return VisitorWindow(opening, has_closed=has_closed)

    async def make_room():
        server = FakeServer(tmp_path, 2)
        server._windows = {
            ADA: await build_window(has_closed=False),
            BEN: await build_window(has_closed=has_closed),
        }
        has_room = await server._make_room()
        assert list(server._windows) == [ADA, BEN]
        return has_room

    assert asyncio.run(make_room()) == has_closed


def test_each_visitor_has_a_folder_also_after_a_restart(tmp_path):
    (tmp_path / "session-1").mkdir()  # Its visitor is unknown.
    first = VisitorFolders(tmp_path)
    assert first.find(ADA) is None
    first.assign(ADA, first.create())
    restarted = VisitorFolders(tmp_path)
    assert restarted.cookie == first.cookie
    assert restarted.find(ADA) == tmp_path / "session-2"
    restarted.assign(BEN, restarted.create())
    assert restarted.find(BEN) == tmp_path / "session-3"
    first.assign(CLEO, first.create())  # Both servers use the same file.
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
def test_a_broken_list_of_visitors_is_replaced(tmp_path, content):
    (tmp_path / FILE_NAME).write_text(content)
    folders = VisitorFolders(tmp_path)
    assert folders.cookie.removeprefix("robocov-").isalnum()
    folders.assign(ADA, folders.create())
    assert VisitorFolders(tmp_path).find(ADA)


@pytest.mark.parametrize("name", ["../elsewhere", "/etc", "session-1/..", "session-", "session-1/../..", ""])
def test_the_list_of_visitors_cannot_lead_to_other_folders(tmp_path, name):
    folders = VisitorFolders(tmp_path)
    folders.assign(ADA, folders.create())
    content = json.loads((tmp_path / FILE_NAME).read_text())
    content["visitors"] = dict.fromkeys(content["visitors"], name)
    (tmp_path / FILE_NAME).write_text(json.dumps(content))
    assert VisitorFolders(tmp_path).find(ADA) is None


def test_only_tokens_signed_with_the_servers_key_are_valid():
    visitor = create_id()
    token = sign(visitor, "key")
    assert read_id(token) == visitor
    assert is_signed(token, "key")
    invalid_tokens = (
        sign(visitor, "other"),
        visitor,
        f"{visitor}.",
        token + "x",
        token[1:],
        "",
        ".",
        "ä." * 9,
    )
    for invalid_token in invalid_tokens:
        assert not is_signed(invalid_token, "key")
