"""A server that opens a separate window for each visitor, all at one port."""

from __future__ import annotations

import asyncio
import secrets
import signal
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from multiprocessing.context import SpawnProcess
from pathlib import Path
from time import monotonic, time
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, unquote, urlencode

from robocov.errors import InputError, OutputError, RobocovError, describe_error
from robocov_app.toolkit.window.share_link import ShareLink
from robocov_app.web.access import are_equal, build_link, get_token, parse_cookies, parse_query
from robocov_app.web.connections import (
    INTERNAL_ERROR,
    TRY_AGAIN_LATER,
    Listener,
    is_from_own_page,
    report,
    respond,
    respond_with,
    respond_with_page,
)
from robocov_app.web.files import TransferError, list_saved, read_saved
from robocov_app.web.visitor_relay import relay_messages
from robocov_app.web.visitors import VisitorFolders, create_id, is_signed, read_id, sign
from robocov_app.web.window_process import (
    ENDING_TIMEOUT_S,
    WindowCommand,
    WindowProcess,
    start_window_process,
    wait_until_open,
)

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

MAX_OPENING = 4
"""Maximum number of windows that open at the same time."""
MIN_IDLE_S = 60.0
"""Time without a page after which a window may be ended to make room for another visitor."""
CHECK_INTERVAL_S = 1.0
"""Interval at which windows that have ended or have been idle for too long are removed."""
MAX_REASON_BYTES = 120
"""Maximum length of the reason for closing a socket; WebSocket allows 123 bytes."""
_TOKEN_BYTES = 18
_NOT_FOUND = "This page does not exist.\n"


@dataclass(eq=False)
class VisitorWindow:
    """The window of a visitor, which may still be opening.

    Attributes
    ----------
    opening : asyncio.Task
        The task that opens it.
    page_count : int
        Number of pages that show it.
    idle_since : float
        Time at which the last page was closed, on the monotonic clock, s.
    ending : asyncio.Task or None
        The task that ends it.
    has_closed : bool
        Whether its user has closed it. It no longer counts as open, although its process takes some seconds
        to end.
    """

    opening: asyncio.Task[WindowProcess]
    page_count: int = 0
    idle_since: float = field(default_factory=monotonic)
    ending: asyncio.Task[None] | None = None
    has_closed: bool = False

    @property
    def process(self) -> WindowProcess | None:
        """The process of the window; None until it is open, or if opening failed."""
        if self.opening.done() and not self.opening.cancelled() and self.opening.exception() is None:
            return self.opening.result()
        return None

    @property
    def has_ended(self) -> bool:
        """Whether its process has ended, or is about to end."""
        process = self.process
        if self.has_closed or self.ending is not None:
            return True
        return process is not None and not process.is_alive

    @property
    def idle_time(self) -> float:
        """Time for which no page has shown it, s."""
        return 0.0 if self.page_count else monotonic() - self.idle_since


class VisitorServer:
    """Opens a window for each visitor who follows the link, and relays the messages of its pages.

    A visitor gets a cookie with the page, and a window only when that page opens a socket, which link
    previews and programs that merely fetch the page do not do. Returning visitors get their window back. If
    it has ended, they get a new one with their old folder, which offers to recover their draft.

    Parameters
    ----------
    command : callable
        Command that shows the window.
    options : WindowOptions
        Options of the command.
    max_windows : int
        Maximum number of windows at the same time.
    max_idle_s : float
        Time without a page after which a window is ended.
    """

    def __init__(self, command: WindowCommand, options: Any, max_windows: int, max_idle_s: float) -> None:
        """Prepare the server; `serve` starts it."""
        self.token = secrets.token_urlsafe(_TOKEN_BYTES)
        self._command = command
        self._options = options
        self._max_windows = max_windows
        self._max_idle_s = max_idle_s
        self._folders = VisitorFolders(options.folder)
        self._windows: dict[str, VisitorWindow] = {}  # by the visitor's identity
        self._spare: WindowProcess | None = None  # already open, for the next new visitor
        self._processes: list[SpawnProcess] = []
        self._is_ending = False
        self._link: ShareLink  # set by `serve`
        self._admission = asyncio.Lock()
        self._openings = asyncio.Semaphore(MAX_OPENING)

    async def serve(self, print_line: Callable[[str], object]) -> None:
        """Serve until the task is canceled.

        Parameters
        ----------
        print_line : callable
            Called with each line to print: the link, and how to stop the server.

        Raises
        ------
        InputError
            If the server cannot listen, or the first window does not open.
        """
        listener = Listener(self._answer, self._talk)
        host = self._options.host
        port = await listener.listen(host, self._options.port)
        self._link = ShareLink(build_link(host, port, self.token), host, opens_own_window=True)
        _cancel_on_signals()
        try:
            # Open the first window now, so that errors in the options are reported at once.
            self._spare = await self._open(self._folders.create())
            print_line(f"For everyone: {self._link.address}")
            print_line("Press Ctrl+C to stop.")
            while True:
                await asyncio.sleep(CHECK_INTERVAL_S)
                self._remove_idle_windows()
        finally:
            await self._end_all(listener)

    async def _end_all(self, listener: Listener) -> None:
        """End all windows and connections, and kill processes that do not end in time."""
        self._is_ending = True
        for process in self._processes:
            process.terminate()
        await listener.close()
        deadline = monotonic() + ENDING_TIMEOUT_S
        for process in self._processes:
            process.join(max(deadline - monotonic(), 0.0))
            process.kill()
        if self._spare is not None:
            self._spare.remove_folder()

    # Requests.

    async def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for the page or a file; return None to let it open a socket."""
        path = request.path.partition("?")[0]
        link_token = get_token(request.path)
        cookie_token = self._read_cookie(request)
        if are_equal(link_token, self.token) and path.endswith("/"):
            return self._admit(connection, cookie_token)
        token = self._read_token(request)
        if not token:
            text = "Open the complete link that robocov printed.\n"
            return respond(connection, HTTPStatus.FORBIDDEN, text)
        if path.endswith("/socket"):
            if is_from_own_page(request):
                return None
            return respond(connection, HTTPStatus.FORBIDDEN, "Another page may not control this window.\n")
        folder, _, name = path.rpartition("/")
        if folder.endswith("/saved"):
            return await self._download(connection, read_id(token), unquote(name))
        if not path.endswith("/"):
            return respond(connection, HTTPStatus.NOT_FOUND, _NOT_FOUND)
        has_link = token == link_token
        cookie = ""
        if has_link and token != cookie_token:
            cookie = f"{self._folders.cookie}={token}"
        return respond_with_page(connection, may_be_framed=has_link, cookie=cookie)

    def _admit(self, connection: ServerConnection, cookie_token: str) -> Response:
        """Redirect a browser that opens the common link to the visitor's own link; open no window yet."""
        visitor = read_id(cookie_token)
        if not (is_signed(cookie_token, self.token) or self._folders.find(visitor)):
            visitor = create_id()
        response = respond(connection, HTTPStatus.SEE_OTHER, "")
        response.headers["Location"] = f"./?{urlencode({'token': sign(visitor, self.token)})}"
        return response

    def _read_cookie(self, request: Request) -> str:
        """Return the token in the visitors' cookie; empty if the request has none."""
        return parse_cookies(request.headers.get_all("Cookie")).get(self._folders.cookie, "")

    def _read_token(self, request: Request) -> str:
        """Return the token of the visitor who sends a request; empty if this server has not signed it."""
        for token in (get_token(request.path), self._read_cookie(request)):
            if is_signed(token, self.token):
                return token
        return ""

    async def _download(self, connection: ServerConnection, visitor: str, name: str) -> Response:
        """Return a saved file from the folder of a visitor's window."""
        window = self._windows.get(visitor)
        process = None if window is None else window.process
        if process is None or name not in list_saved(process.folder, process.opened_at):
            return respond(connection, HTTPStatus.NOT_FOUND, _NOT_FOUND)
        path = process.folder / name
        if not path.resolve().is_relative_to(process.folder.resolve()):
            return respond(connection, HTTPStatus.NOT_FOUND, _NOT_FOUND)
        try:
            file_name, body = await asyncio.to_thread(read_saved, path)
        except TransferError as error:
            return respond(connection, HTTPStatus.NOT_FOUND, f"{error}\n")
        headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(file_name)}"}
        return respond_with(connection, HTTPStatus.OK, body, "application/octet-stream", headers)

    # Sockets.

    async def _talk(self, connection: ServerConnection) -> None:
        """Relay messages between a page and its visitor's window; open the window if there is none."""
        request = connection.request
        assert request is not None
        visitor = read_id(self._read_token(request))
        window = await self._find_or_open(visitor)
        if window is None:
            await connection.close(TRY_AGAIN_LATER, self._explain_waiting())
            return
        window.page_count += 1
        try:
            process = await asyncio.shield(window.opening)
            page_id = parse_query(request.path).get("page", "")
            if await relay_messages(connection, process, page_id):
                window.has_closed = True
        except RobocovError as error:
            if self._windows.get(visitor) is window and not self._is_ending:
                del self._windows[visitor]
                report(f"a visitor's window did not open: {error}")
            await connection.close(INTERNAL_ERROR, _shorten_reason(f"The window did not open: {error}"))
        finally:
            window.page_count -= 1
            window.idle_since = monotonic()

    def _explain_waiting(self) -> str:
        if self._max_windows == 1:
            return "The only window is in use. Trying again …"
        return f"All {self._max_windows} windows are in use. Trying again …"

    async def _find_or_open(self, visitor: str) -> VisitorWindow | None:
        """Return a visitor's window, which may still be opening; None if `max_windows` are in use."""
        async with self._admission:
            window = self._windows.get(visitor)
            if window is not None and window.has_ended:
                await self._end(visitor, window)
                window = None
            if window is None:
                window = await self._start_opening(visitor)
            return window

    async def _start_opening(self, visitor: str) -> VisitorWindow | None:
        """Start opening a window for a visitor; return None if `max_windows` are in use."""
        folder = self._folders.find(visitor)
        spare = self._spare
        if folder is None and spare is not None and spare.is_alive:
            self._spare = None
            window = VisitorWindow(asyncio.create_task(self._assign(spare, visitor)))
        elif await self._make_room():
            window = VisitorWindow(asyncio.create_task(self._open_for(visitor, folder)))
        else:
            return None
        self._windows[visitor] = window
        return window

    async def _assign(self, process: WindowProcess, visitor: str) -> WindowProcess:
        """Assign the spare window, which is already open, to a visitor."""
        # If the folder cannot be recorded, a later server just will not recognize the visitor.
        with suppress(OSError, OutputError):
            self._folders.assign(visitor, process.folder)
        process.opened_at = time()
        return process

    async def _open_for(self, visitor: str, folder: Path | None) -> WindowProcess:
        """Open a window for a visitor, in the folder that they had before or in a new one."""
        try:
            if folder is None:
                folder = self._folders.create()
                self._folders.assign(visitor, folder)
        except OSError as error:
            text = f"{self._options.folder}: cannot be written to: {describe_error(error)}"
            raise OutputError(text) from error
        return await self._open(folder)

    async def _open(self, folder: Path) -> WindowProcess:
        """Open a window in a process of its own; raise InputError with its error message if that fails."""
        async with self._openings:
            if self._is_ending:
                raise InputError("the server is ending")
            process, receiver = start_window_process(self._command, self._options, folder, self._link)
            self._processes.append(process)
            return await wait_until_open(process, receiver, folder)

    # Places.

    async def _make_room(self) -> bool:
        """Make room for another window; return False if `max_windows` are in use.

        If necessary, the spare window is ended. If there is no spare window, a window that has already ended
        is removed, or the one that has been idle longest is ended.
        """
        spare = self._spare
        taken = sum(not window.has_closed for window in self._windows.values())
        if spare is not None:
            taken += 1
        if taken < self._max_windows:
            return True
        if spare is not None:
            self._spare = None
            await spare.end()
            spare.remove_folder()
            return True
        visitor = self._choose_window_to_end()
        if visitor is None:
            return False
        await self._end(visitor, self._windows[visitor])
        return True

    def _choose_window_to_end(self) -> str | None:
        """Return the visitor whose window can be ended to make room; None if all windows are in use."""
        for visitor, window in self._windows.items():
            if window.has_ended and not window.has_closed:
                return visitor
        idle = [visitor for visitor, window in self._windows.items() if window.idle_time >= MIN_IDLE_S]
        return max(idle, key=lambda visitor: self._windows[visitor].idle_time, default=None)

    def _remove_idle_windows(self) -> None:
        """Remove windows that have ended, and end those that have been idle for too long."""
        self._processes = [child for child in self._processes if child.is_alive()]
        for visitor, window in list(self._windows.items()):
            if window.ending is not None or not window.opening.done():
                continue
            if window.process is None or not window.process.is_alive:
                del self._windows[visitor]
            elif window.idle_time >= self._max_idle_s:
                window.ending = asyncio.create_task(self._end(visitor, window))

    async def _end(self, visitor: str, window: VisitorWindow) -> None:
        """End a visitor's window, which writes a draft, and remove it."""
        if window.ending is not None and window.ending is not asyncio.current_task():
            await asyncio.shield(window.ending)
        if window.process is not None:
            await window.process.end()
        if self._windows.get(visitor) is window:
            del self._windows[visitor]


def _cancel_on_signals() -> None:
    """Make SIGINT and SIGTERM cancel the current task.

    By default, Ctrl+C raises KeyboardInterrupt in the running task, which need not be this one.
    """
    task = asyncio.current_task()
    assert task is not None
    loop = asyncio.get_running_loop()
    # Signal handlers need a POSIX system and the main thread.
    with suppress(NotImplementedError, ValueError):
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, task.cancel)


def _shorten_reason(text: str) -> str:
    """Shorten the reason for closing a socket to `MAX_REASON_BYTES` without splitting a character."""
    return text.encode()[:MAX_REASON_BYTES].decode(errors="ignore")
