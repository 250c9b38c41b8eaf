"""Relay of messages between a visitor's page and the server of the visitor's window."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import TYPE_CHECKING
from urllib.parse import urlencode

from robocov_app.web.connections import NOT_UNDERSTOOD, WINDOW_CLOSED, WINDOW_ENDED, WRITE_LIMIT_BYTES
from robocov_app.web.window_process import WindowProcess

if TYPE_CHECKING:
    from websockets.asyncio.connection import Connection
    from websockets.asyncio.server import ServerConnection

MAX_QUEUED_FRAMES = 4
MAX_FRAME_BYTES = 1 << 27


async def relay_messages(connection: ServerConnection, window: WindowProcess, page_id: str) -> bool:
    """Copy messages between a page and a window until either closes its socket; then close the page's.

    Parameters
    ----------
    connection : ServerConnection
        The socket of the page.
    window : WindowProcess
    page_id : str
        Identity of the page.

    Returns
    -------
    bool
        Whether the window was closed by its user.
    """
    from websockets.asyncio.client import connect
    from websockets.exceptions import WebSocketException

    query = urlencode({"token": window.address.token, "page": page_id})
    code = None
    reason = "The window has ended."
    with suppress(OSError, WebSocketException):
        async with connect(
            f"ws://127.0.0.1:{window.address.port}/socket?{query}",
            max_size=MAX_FRAME_BYTES,
            max_queue=MAX_QUEUED_FRAMES,
            write_limit=WRITE_LIMIT_BYTES,
            compression=None,
            ping_interval=None,  # If the process ends, its socket closes, too.
            proxy=None,
        ) as socket:
            await _copy_both_ways(connection, socket)
            code = socket.close_code
            reason = socket.close_reason or reason
    # Only a window that its user has closed, or a code that the page interprets, is passed on as it is.
    if code is None or (code < NOT_UNDERSTOOD and code != WINDOW_CLOSED):
        code = WINDOW_ENDED
    await connection.close(code, reason)
    return code == WINDOW_CLOSED


async def _copy_both_ways(first: Connection, second: Connection) -> None:
    """Copy messages both ways until either end is closed."""
    copying = {
        asyncio.create_task(_copy_messages(first, second)),
        asyncio.create_task(_copy_messages(second, first)),
    }
    _, pending = await asyncio.wait(copying, return_when=asyncio.FIRST_COMPLETED)
    for task in pending:
        task.cancel()
    await asyncio.wait(copying)


async def _copy_messages(source: Connection, target: Connection) -> None:
    """Copy messages one way until either end is closed. A slow target slows down the source."""
    from websockets.exceptions import ConnectionClosed

    with suppress(ConnectionClosed):
        async for message in source:
            await target.send(message)
