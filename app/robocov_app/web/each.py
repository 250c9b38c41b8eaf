"""A window of their own for everybody: a process for each visitor, all behind one port."""

import asyncio
import multiprocessing
import secrets
from _thread import interrupt_main
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass, replace
from io import TextIOBase
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from threading import Thread
from typing import Any
from urllib.parse import urlsplit

from robocov.errors import InputError
from robocov_app.web.access import cookies_of, link_to, same, token_in

LONGEST_HEAD = 1 << 14  # bytes of a request's head
PATIENCE = 20.0  # seconds that a request's head may take
_START = 60.0  # seconds that a window may take to open


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
        command(options)


class Sessions:
    """Starts a command for each visitor who has the link, and carries bytes to and fro.

    A visitor is known by the token of their own window, which their browser keeps as a cookie: whoever comes
    back comes back to that window. `most`: windows at a time. Each has a folder of its own.
    """

    def __init__(self, command: Callable[[Any], int], options: Any, most: int) -> None:
        self.token, self._most = secrets.token_urlsafe(18), most
        self._command, self._options = command, options
        self._sessions: list[_Session] = []
        self._count = 0
        self._starting = asyncio.Lock()

    async def serve(self, tell: Callable[[str], object]) -> None:
        host, port = self._options.host, self._options.port
        try:
            server = await asyncio.start_server(self._carry, host, port, limit=LONGEST_HEAD)
        except OSError as error:
            raise InputError(f"--port: {host}:{port} cannot be listened to: {error.strerror}") from None
        tell(f"open {link_to(host, server.sockets[0].getsockname()[1], self.token)}")
        try:
            async with server:
                await server.serve_forever()
        finally:
            for each in self._sessions:
                each.process.terminate()
            for each in self._sessions:
                each.process.join(5.0)

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError, TimeoutError):
            head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), PATIENCE)
            found = await self._session_of(head)
            if isinstance(found, str):
                writer.write(found.encode())
            else:
                there, back = await asyncio.open_connection("127.0.0.1", found.port)
                back.write(head)
                await asyncio.gather(_copied(reader, back), _copied(there, writer))
        with suppress(OSError):
            writer.close()
            await writer.wait_closed()

    async def _session_of(self, head: bytes) -> _Session | str:
        first, *lines = head.decode("latin-1").split("\r\n")
        given = token_in(first.partition(" ")[2].partition(" ")[0])
        cookies = cookies_of(line[7:].strip() for line in lines if line[:7].lower() == "cookie:")
        self._sessions = [each for each in self._sessions if each.process.is_alive()]
        for token in (given, *cookies.values()):
            for each in self._sessions:
                if same(token, each.token):
                    # with the link of all in the address: to the own window
                    return _answer("303 See Other", each.token) if same(given, self.token) else each
        if not same(given, self.token):
            return _answer("403 Forbidden")
        async with self._starting:
            if len(self._sessions) >= self._most:
                return _answer("503 Service Unavailable")
            session = await asyncio.to_thread(self._started)
            self._sessions.append(session)
        return _answer("303 See Other", session.token)

    def _started(self) -> _Session:
        self._count += 1
        folder = self._options.folder / f"session-{self._count}"
        folder.mkdir(parents=True, exist_ok=True)
        own = replace(self._options, each=False, host="127.0.0.1", port=0, folder=folder)
        context = multiprocessing.get_context("spawn")
        said, says = context.Pipe(duplex=False)
        process = context.Process(target=_session, args=(self._command, own, says), daemon=False)
        process.start()
        says.close()
        with suppress(EOFError):
            if said.poll(_START):
                link = said.recv().removeprefix("open ").strip()
                return _Session(process, urlsplit(link).port or 0, token_in(link))
        process.terminate()
        raise OSError("the window did not open")


def _answer(status: str, token: str = "") -> str:
    words = {"3": "", "4": "This needs the whole link that robocov printed.", "5": "All windows are taken."}
    body = words[status[0]] + "\n"
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
