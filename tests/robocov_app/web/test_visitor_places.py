"""Places for windows of visitors, without processes."""

import asyncio
from types import SimpleNamespace

import pytest

pytest.importorskip("websockets")

from robocov_app.web.visitor_server import VisitorServer, VisitorWindow


def build_server(folder, *windows: VisitorWindow) -> VisitorServer:
    server = VisitorServer(lambda options: 0, SimpleNamespace(folder=folder), len(windows), 600.0)
    server._windows = {f"visitor {number}": window for number, window in enumerate(windows)}
    return server


async def build_window(*, has_closed: bool) -> VisitorWindow:
    """Build a window whose process is alive."""

    async def open_window():
        return SimpleNamespace(is_alive=True)

    opening = asyncio.create_task(open_window())
    await opening
    return VisitorWindow(opening, has_closed=has_closed)


@pytest.mark.parametrize("has_closed", [False, True])
def test_a_window_that_its_user_has_closed_takes_no_place(tmp_path, has_closed):
    """Its process takes some seconds to end."""

    async def make_room() -> bool:
        windows = [await build_window(has_closed=False), await build_window(has_closed=has_closed)]
        server = build_server(tmp_path, *windows)
        has_room = await server._make_room()
        assert list(server._windows) == ["visitor 0", "visitor 1"]
        return has_room

    assert asyncio.run(make_room()) == has_closed
