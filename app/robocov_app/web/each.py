"""A window of their own for everybody: a process for each visitor, all behind one port."""

import asyncio
import multiprocessing
import os
import secrets
from _thread import interrupt_main
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass, replace
from io import TextIOBase
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from threading import Thread
from time import monotonic
from typing import Any
from urllib.parse import urlsplit

from robocov.errors import InputError, RobocovError
from robocov_app.terminal.interruption import interruptible
from robocov_app.web.access import cookies_of, link_to, listening_failed, same, token_in

LONGEST_HEAD = 1 << 14  # bytes of a request's head
PATIENCE = 20.0  # seconds that a request's head may take
_START = 120.0  # seconds that a window may take to open


@dataclass
class _Session:
    process: SpawnProcess
    port: int
    token: str


class _Lines(TextIOBase):
    """Standard output to another process."""

    def __init__(self, to: Connection) -> None:
        self._to = to

    def write(self, text: str, /) -> int:
        with suppress(OSError):
            self._to.send(text)
        return len(text)


def _session(command: Callable[[Any], int], options: Any, to: Connection) -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None

    def end_with_it() -> None:
        parent.join()
        interrupt_main()

    Thread(target=end_with_it, daemon=True).start()
    with suppress(KeyboardInterrupt), redirect_stdout(_Lines(to)):
        try:
            command(options)
        except RobocovError as error:
            to.send(str(error))


class Sessions:
    """Starts a command for each visitor who has the link, and carries bytes to and fro.

    A visitor is known by the token of their own window, which their browser keeps as a cookie: whoever comes
    back comes back to that window. `most`: windows at a time. Each has a folder of its own.
    """

    def __init__(self, command: Callable[[Any], int], options: Any, most: int) -> None:
        self.token, self._most = secrets.token_urlsafe(18), most
        self._command, self._options = command, options
        self._sessions: list[_Session] = []
        self._processes: list[SpawnProcess] = []  # also those whose window is not open yet
        self._count = 0
        self._spare: _Session | None = None  # one that is there for the first visitor

    async def serve(self, tell: Callable[[str], object]) -> None:
        host, port = self._options.host, self._options.port
        try:
            server = await asyncio.start_server(self._carry, host, port, limit=LONGEST_HEAD)
        except OSError as error:
            raise listening_failed(host, port, error) from None
        try:
            self._spare = await self._opened()  # also tells at once what is wrong with the options
            tell(f"open {link_to(host, server.sockets[0].getsockname()[1], self.token)}")
            await asyncio.Event().wait()
        finally:
            server.close()
            for process in self._processes:
                process.terminate()
            end = monotonic() + 5.0
            for process in self._processes:
                process.join(max(end - monotonic(), 0.0))
                process.kill()

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        cut = OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError, asyncio.CancelledError
        with suppress(*cut, TimeoutError):
            head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), PATIENCE)
            found = await self._session_of(head)
            if isinstance(found, str):
                writer.write(found.encode())
            else:
                there, back = await asyncio.open_connection("127.0.0.1", found.port)
                back.write(head)
                await asyncio.gather(_copied(reader, back), _copied(there, writer))
        writer.close()

    async def _session_of(self, head: bytes) -> _Session | str:
        first, *lines = head.decode("latin-1").split("\r\n")
        given = token_in(first.partition(" ")[2].partition(" ")[0])
        cookies = cookies_of(line[7:].strip() for line in lines if line[:7].lower() == "cookie:")
        self._processes = [each for each in self._processes if each.is_alive()]
        self._sessions = [each for each in self._sessions if each.process in self._processes]
        for token in (given, *cookies.values()):
            for each in self._sessions:
                if same(token, each.token):
                    # with the link of all in the address: to the own window
                    return _answer("303 See Other", each.token) if same(given, self.token) else each
        if not same(given, self.token):
            return _answer("403 Forbidden")
        session, self._spare = self._spare, None
        if session is None or not session.process.is_alive():
            if len(self._processes) >= self._most:
                return _answer("503 Service Unavailable")
            try:
                session = await self._opened()
            except InputError:
                return _answer("500 Internal Server Error")
        self._sessions.append(session)
        return _answer("303 See Other", session.token)

    async def _opened(self) -> _Session:
        """Open a window in a process of its own; InputError with what it says if it does not open."""
        self._count += 1
        folder = self._options.folder / f"session-{self._count}"
        folder.mkdir(parents=True, exist_ok=True)
        own = replace(self._options, each=False, host="127.0.0.1", port=0, folder=folder)
        context = multiprocessing.get_context("spawn")
        said, says = context.Pipe(duplex=False)
        process = context.Process(target=_session, args=(self._command, own, says), daemon=False)
        if os.name == "posix":
            resource_tracker.ensure_running()  # which would unblock what is blocked here
        interruptible(False)
        process.start()
        interruptible(True)
        self._processes.append(process)
        says.close()
        words = "the window did not open"
        with suppress(EOFError):
            if await asyncio.to_thread(said.poll, _START):
                kind, _, link = (words := str(said.recv())).strip().partition(" ")
                if kind == "open":
                    return _Session(process, urlsplit(link).port or 0, token_in(link))
        process.terminate()
        raise InputError(words)


def _answer(status: str, token: str = "") -> str:
    words = {"303": "", "403": "This needs the whole link that robocov printed."}
    words |= {"500": "The window did not open.", "503": "All windows are taken."}
    body = words[status[:3]] + "\n"
    place = f"Location: ./?token={token}\r\n" if token else ""
    head = f"HTTP/1.1 {status}\r\n{place}Content-Type: text/plain\r\nContent-Length: {len(body)}\r\n"
    return f"{head}Cache-Control: no-store\r\nConnection: close\r\n\r\n{body}"


async def _copied(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Carry bytes one way until they end; a slow line holds up who sends."""
    with suppress(OSError):
        while data := await reader.read(1 << 16):
            writer.write(data)
            await writer.drain()
    with suppress(OSError):
        writer.close()
