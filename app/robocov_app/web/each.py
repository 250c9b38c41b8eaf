"""A window for each visitor: a process each, all behind one port."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import secrets
import signal
from _thread import interrupt_main
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass, field, replace
from http import HTTPStatus
from io import TextIOBase
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from threading import Thread
from time import monotonic, time
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, unquote, urlencode, urlsplit

from robocov.errors import InputError, OutputError, RobocovError, describe_error
from robocov_app.terminal.interruption import block_interrupts, unblock_interrupts
from robocov_app.web.access import are_equal, build_link, get_token, parse_cookies, parse_query
from robocov_app.web.connections import (
    FAULT,
    NOT_UNDERSTOOD,
    TRY_AGAIN_LATER,
    WINDOW_CLOSED,
    WINDOW_ENDED,
    WRITE_LIMIT_BYTES,
    Listener,
    is_from_own_page,
    report,
    respond,
    respond_with,
    respond_with_page,
)
from robocov_app.web.files import TransferError, list_saved, read_saved
from robocov_app.web.visitors import VisitorFolders, create_id, is_signed, read_id, sign

if TYPE_CHECKING:
    from websockets.asyncio.connection import Connection as Socket
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

OPENING_TIMEOUT_S = 120.0
ENDING_TIMEOUT_S = 5.0  # to write a draft; then the process is killed
MAX_OPENING = 4  # windows that open at the same time
MIN_IDLE_S = 60.0  # without a page, before a window may be ended because another visitor waits
LOOKING_INTERVAL_S = 1.0  # between two looks for windows that have ended, or that nobody looks at
MAX_QUEUED_FRAMES = 4
MAX_FRAME_BYTES = 1 << 27
MAX_REASON_BYTES = 120  # of a close frame's reason, which has at most 123 of them


class _Output(TextIOBase):
    """Standard output of a window's process to the server, which reads until the window is open."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe

    def write(self, text: str, /) -> int:
        with suppress(OSError):
            self._pipe.send(text)
        return len(text)


def _run_window(command: Callable[[Any], int], options: Any, pipe: Connection) -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None

    def end_with_parent() -> None:
        parent.join()
        interrupt_main()

    Thread(target=end_with_parent, daemon=True).start()
    with suppress(KeyboardInterrupt), redirect_stdout(_Output(pipe)):
        try:
            command(options)
        except RobocovError as error:
            pipe.send(str(error))


@dataclass(eq=False)
class Window:
    """A window that is open in a process of its own."""

    process: SpawnProcess
    folder: Path
    port: int
    token: str
    opened_at: float = field(default_factory=time)


@dataclass(eq=False)
class Session:
    """A visitor with a window, or with one that is being opened."""

    opening: asyncio.Task[Window]
    n_pages: int = 0
    unwatched_since: float = field(default_factory=monotonic)
    ending: asyncio.Task[None] | None = None

    @property
    def window(self) -> Window | None:
        """The window, once it is open."""
        if self.opening.done() and not self.opening.cancelled() and self.opening.exception() is None:
            return self.opening.result()
        return None

    @property
    def idle_s(self) -> float:
        """For how long nobody has looked at the window, in seconds."""
        return 0.0 if self.n_pages else monotonic() - self.unwatched_since


class Sessions:
    """Opens a window for each visitor who follows the link, and carries messages to and fro.

    A visitor gets a cookie with the page, and a window when that page opens a socket, which link previews
    and programs that fetch a page do not. Whoever comes back finds their window; if it was ended meanwhile,
    a new one with their folder, which offers their draft.

    Parameters
    ----------
    command : callable
        Command that shows the window.
    options : WindowOptions
        Its options.
    max_sessions : int
        Maximum number of concurrent windows.
    max_idle_s : float
        A window that no page has shown for that long is ended.
    """

    def __init__(
        self, command: Callable[[Any], int], options: Any, max_sessions: int, max_idle_s: float
    ) -> None:
        self.token = secrets.token_urlsafe(18)
        self._command = command
        self._options = options
        self._max_sessions = max_sessions
        self._max_idle_s = max_idle_s
        self._folders = VisitorFolders(options.folder)
        self._sessions: dict[str, Session] = {}  # by the identity of the visitor
        self._spare: Window | None = None  # for the first new visitor
        self._processes: list[SpawnProcess] = []
        self._is_ending = False
        self._admission = asyncio.Lock()
        self._openings = asyncio.Semaphore(MAX_OPENING)

    async def serve(self, tell: Callable[[str], object]) -> None:
        """Serve until the task is canceled; `tell` is called with the line that names the link."""
        listener = Listener(self._answer, self._talk)
        host = self._options.host
        port = await listener.listen(host, self._options.port)
        loop = asyncio.get_running_loop()
        task = asyncio.current_task()
        assert task is not None
        with suppress(NotImplementedError, ValueError):  # not on Windows, and only in the main thread
            # Raised as a KeyboardInterrupt, Ctrl-C could end whatever task is running, instead of this one.
            for number in (signal.SIGINT, signal.SIGTERM):
                loop.add_signal_handler(number, task.cancel)
        try:
            self._spare = await self._open(self._folders.create())  # reports at once what is wrong
            tell(f"open {build_link(host, port, self.token)}")
            while True:
                await asyncio.sleep(LOOKING_INTERVAL_S)
                self._look_after()
        finally:
            await self._end_all(listener)

    async def _end_all(self, listener: Listener) -> None:
        self._is_ending = True
        for process in self._processes:
            process.terminate()
        await listener.close()
        deadline = monotonic() + ENDING_TIMEOUT_S
        for process in self._processes:
            process.join(max(deadline - monotonic(), 0.0))
            process.kill()
        if self._spare is not None:
            with suppress(OSError):
                self._spare.folder.rmdir()  # nobody had it

    # Requests.

    async def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for the page or a file; None lets a socket be opened."""
        path = request.path.partition("?")[0]
        given = get_token(request.path)
        kept = self._kept_token(request)
        if are_equal(given, self.token) and path.endswith("/"):
            return self._admit(connection, kept)
        token = self._visitor_token(request)
        if not token:
            return respond(
                connection, HTTPStatus.FORBIDDEN, "This needs the whole link that robocov printed.\n"
            )
        if path.endswith("/socket"):
            if is_from_own_page(request):
                return None
            return respond(connection, HTTPStatus.FORBIDDEN, "Another page may not drive this window.\n")
        folder, _, name = path.rpartition("/")
        if folder.endswith("/saved"):
            return await self._download(connection, read_id(token), unquote(name))
        if not path.endswith("/"):
            return respond(connection, HTTPStatus.NOT_FOUND, "Nothing is there.\n")
        is_given = token == given
        cookie = f"{self._folders.cookie}={token}" if is_given and token != kept else ""
        return respond_with_page(connection, may_be_framed=is_given, cookie=cookie)

    def _admit(self, connection: ServerConnection, kept: str) -> Response:
        """Send whoever has the link to an address of their own; nothing is started for them yet."""
        visitor = read_id(kept)
        if not (is_signed(kept, self.token) or self._folders.find(visitor)):
            visitor = create_id()
        response = respond(connection, HTTPStatus.SEE_OTHER, "")
        response.headers["Location"] = f"./?{urlencode({'token': sign(visitor, self.token)})}"
        return response

    def _kept_token(self, request: Request) -> str:
        return parse_cookies(request.headers.get_all("Cookie")).get(self._folders.cookie, "")

    def _visitor_token(self, request: Request) -> str:
        """Return the token of the visitor who sends a request; empty if this server let in nobody such."""
        for token in (get_token(request.path), self._kept_token(request)):
            if is_signed(token, self.token):
                return token
        return ""

    async def _download(self, connection: ServerConnection, visitor: str, name: str) -> Response:
        session = self._sessions.get(visitor)
        window = None if session is None else session.window
        if window is None or name not in list_saved(window.folder, window.opened_at):
            return respond(connection, HTTPStatus.NOT_FOUND, "Nothing is there.\n")
        path = window.folder / name
        if not path.resolve().is_relative_to(window.folder.resolve()):
            return respond(connection, HTTPStatus.NOT_FOUND, "Nothing is there.\n")
        try:
            name, body = await asyncio.to_thread(read_saved, path)
        except TransferError as error:
            return respond(connection, HTTPStatus.NOT_FOUND, f"{error}\n")
        headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(name)}"}
        return respond_with(connection, HTTPStatus.OK, body, "application/octet-stream", headers)

    # Sockets.

    async def _talk(self, connection: ServerConnection) -> None:
        """Carry messages between a page and its visitor's window, which is opened if there is none."""
        request = connection.request
        assert request is not None
        visitor = read_id(self._visitor_token(request))
        session = await self._find_or_start(visitor)
        if session is None:
            taken = (
                f"All {self._max_sessions} windows are" if self._max_sessions > 1 else "The only window is"
            )
            text = f"{taken} in use. Trying again …"
            await connection.close(TRY_AGAIN_LATER, text)
            return
        session.n_pages += 1
        try:
            window = await asyncio.shield(session.opening)
            await self._carry(connection, window, parse_query(request.path).get("page", ""))
        except RobocovError as error:
            if self._sessions.get(visitor) is session and not self._is_ending:
                del self._sessions[visitor]
                report(f"a visitor's window did not open: {error}")
            await connection.close(FAULT, _cut_reason(f"The window did not open: {error}"))
        finally:
            session.n_pages -= 1
            session.unwatched_since = monotonic()

    async def _find_or_start(self, visitor: str) -> Session | None:
        """Return a visitor's session, which is started if there is none; None if all places are taken."""
        async with self._admission:
            session = self._sessions.get(visitor)
            if session is not None and self._has_ended(session):
                await self._end(visitor, session)
                session = None
            if session is None:
                session = await self._start(visitor)
            return session

    async def _start(self, visitor: str) -> Session | None:
        folder = self._folders.find(visitor)
        spare = self._spare
        if folder is None and spare is not None and spare.process.is_alive():
            self._spare = None
            session = Session(asyncio.create_task(self._give(spare, visitor)))
        elif await self._make_room():
            session = Session(asyncio.create_task(self._open_for(visitor, folder)))
        else:
            return None
        self._sessions[visitor] = session
        return session

    def _has_ended(self, session: Session) -> bool:
        window = session.window
        return session.ending is not None or (window is not None and not window.process.is_alive())

    async def _give(self, window: Window, visitor: str) -> Window:
        """Give the window that is open already to a visitor."""
        with suppress(OSError, OutputError):  # they are not known again after the end of the server
            self._folders.assign(visitor, window.folder)
        window.opened_at = time()
        return window

    async def _open_for(self, visitor: str, folder: Path | None) -> Window:
        """Open a window for a visitor, in the folder that they had before."""
        try:
            if folder is None:
                folder = self._folders.create()
                self._folders.assign(visitor, folder)
        except OSError as error:
            text = f"{self._options.folder}: cannot be written to: {describe_error(error)}"
            raise OutputError(text) from error
        return await self._open(folder)

    async def _make_room(self) -> bool:
        """End the window that nobody has looked at for longest if all places are taken."""
        if len(self._sessions) + (self._spare is not None) < self._max_sessions:
            return True
        if self._spare is not None:
            spare = self._spare
            self._spare = None
            await self._stop(spare.process)
            with suppress(OSError):
                spare.folder.rmdir()
            return True
        ended = [visitor for visitor, session in self._sessions.items() if self._has_ended(session)]
        idle = [visitor for visitor, session in self._sessions.items() if session.idle_s >= MIN_IDLE_S]
        if ended:
            chosen = ended[0]
        elif idle:
            chosen = max(idle, key=lambda visitor: self._sessions[visitor].idle_s)
        else:
            return False
        await self._end(chosen, self._sessions[chosen])
        return True

    async def _carry(self, connection: ServerConnection, window: Window, page_id: str) -> None:
        from websockets.asyncio.client import connect
        from websockets.exceptions import WebSocketException

        query = urlencode({"token": window.token, "page": page_id})
        code = None
        text = "The window has ended."
        with suppress(OSError, WebSocketException):
            async with connect(
                f"ws://127.0.0.1:{window.port}/socket?{query}",
                max_size=MAX_FRAME_BYTES,
                max_queue=MAX_QUEUED_FRAMES,
                write_limit=WRITE_LIMIT_BYTES,
                compression=None,
                ping_interval=None,  # the process ends with its socket
                proxy=None,
            ) as socket:
                await _copy_both_ways(connection, socket)
                code = socket.close_code
                text = socket.close_reason or text
        if code is None or (code < NOT_UNDERSTOOD and code != WINDOW_CLOSED):
            code = WINDOW_ENDED
        await connection.close(code, text)

    # Processes.

    def _look_after(self) -> None:
        """Forget windows that have ended, and end those that nobody has looked at for long."""
        self._processes = [process for process in self._processes if process.is_alive()]
        for visitor, session in list(self._sessions.items()):
            if session.ending is not None or not session.opening.done():
                continue
            window = session.window
            if window is None or not window.process.is_alive():
                del self._sessions[visitor]
            elif session.idle_s >= self._max_idle_s:
                session.ending = asyncio.create_task(self._end(visitor, session))

    async def _end(self, visitor: str, session: Session) -> None:
        """End a visitor's window, which writes a draft, and give its place back."""
        if session.ending is not None and session.ending is not asyncio.current_task():
            await asyncio.shield(session.ending)
        window = session.window
        if window is not None:
            await self._stop(window.process)
        if self._sessions.get(visitor) is session:
            del self._sessions[visitor]

    async def _stop(self, process: SpawnProcess) -> None:
        process.terminate()
        deadline = monotonic() + ENDING_TIMEOUT_S
        while process.is_alive() and monotonic() < deadline:
            await asyncio.sleep(0.02)
        process.kill()

    async def _open(self, folder: Path) -> Window:
        """Open a window in a process of its own; raises `InputError` with its message if it does not open."""
        async with self._openings:
            if self._is_ending:
                raise InputError("the server is ending")
            options = replace(self._options, each=False, host="127.0.0.1", port=0, folder=folder)
            context = multiprocessing.get_context("spawn")
            receiver, sender = context.Pipe(duplex=False)
            process = context.Process(target=_run_window, args=(self._command, options, sender), daemon=False)
            if os.name == "posix":
                resource_tracker.ensure_running()  # which would unblock what is blocked here
            block_interrupts()
            process.start()
            unblock_interrupts()
            self._processes.append(process)
            sender.close()
            with receiver:
                text = await asyncio.to_thread(_receive_line, receiver)
            word, _, link = text.strip().partition(" ")
            if word == "open":
                return Window(process, folder, urlsplit(link).port or 0, get_token(link))
            process.terminate()
            with suppress(OSError):
                folder.rmdir()  # only if it is empty
            raise InputError(text)


def _receive_line(receiver: Connection) -> str:
    """Return what a window's process prints first."""
    with suppress(EOFError, OSError):
        if receiver.poll(OPENING_TIMEOUT_S):
            return str(receiver.recv())
    return "the window did not open"


async def _copy_both_ways(one: Socket, other: Socket) -> None:
    """Carry messages both ways until either end is closed."""
    copying = {
        asyncio.create_task(_copy_messages(one, other)),
        asyncio.create_task(_copy_messages(other, one)),
    }
    _, pending = await asyncio.wait(copying, return_when=asyncio.FIRST_COMPLETED)
    for task in pending:
        task.cancel()
    await asyncio.wait(copying)


async def _copy_messages(source: Socket, target: Socket) -> None:
    """Carry messages one way until either end is closed; a slow target holds up who sends."""
    from websockets.exceptions import ConnectionClosed

    with suppress(ConnectionClosed):
        async for message in source:
            await target.send(message)


def _cut_reason(text: str) -> str:
    return text.encode()[:MAX_REASON_BYTES].decode(errors="ignore")
