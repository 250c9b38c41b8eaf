"""Connections of browsers: requests, sockets, and limits on the resources that strangers can occupy."""

from __future__ import annotations

import asyncio
import logging
import secrets
import traceback
from collections.abc import Awaitable, Callable
from contextlib import suppress
from http import HTTPStatus
from importlib.resources import files
from typing import TYPE_CHECKING

from robocov_app.terminal.output import echo
from robocov_app.web.access import build_listen_error

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection
    from websockets.http11 import Request, Response

MAX_MESSAGE_BYTES = 1 << 20  # the longest pasted text with JSON escapes; files arrive in pieces
MAX_QUEUED_MESSAGES = 4  # from one page, before reading from it pauses
WRITE_LIMIT_BYTES = 1 << 16
MAX_UNANSWERED = 256  # connections without an open WebSocket; if there are more, the oldest is closed
REQUEST_TIMEOUT_S = 10.0  # for a request to arrive
MAX_FILES_BYTES = 1 << 29  # of files that browsers are downloading at the same time
RESPONSE_TIMEOUT_S = 600.0  # for a browser to download a file
SEND_TIMEOUT_S = 30.0  # for a page to receive a message
CLOSE_TIMEOUT_S = 5.0
MIN_FILES = 2048  # open files that the process needs; each connection is one
END_TIMEOUT_S = 1.0  # for all pages to close their sockets at the end of the server

# WebSocket close codes, which page.html interprets.
WINDOW_CLOSED = 1001
NOT_UNDERSTOOD = 1008
INTERNAL_ERROR = 1011
WINDOW_ENDED = 1012  # the page connects again by itself
TRY_AGAIN_LATER = 1013
REPLACED = 4001  # the page does not connect again by itself

Answer = Callable[["ServerConnection", "Request"], Awaitable["Response | None"]]
ServePage = Callable[["ServerConnection"], Awaitable[None]]


def report_exception(message: str) -> None:
    """Print a message and the traceback of the current exception on stderr."""
    report(f"{message}\n{traceback.format_exc()}")


def report(message: str) -> None:
    """Print a message on stderr."""
    echo(f"robocov: {message}", to_stderr=True, flush=True)


class Listener:
    """HTTP and WebSocket server: answers requests, and hands over the sockets that browsers open.

    Parameters
    ----------
    answer : callable
        Coroutine that returns the response to a request; None if the request may open a socket.
    serve_page : callable
        Coroutine that exchanges messages with a page as long as its socket is open.
    """

    def __init__(self, answer: Answer, serve_page: ServePage) -> None:
        self._answer = answer
        self._serve_page = serve_page
        self._connections: set[ServerConnection] = set()
        self._unanswered: dict[ServerConnection, asyncio.TimerHandle] = {}  # oldest first
        self._files: dict[ServerConnection, int] = {}  # bytes of the files that browsers are downloading
        self._server: Server | None = None

    async def listen(self, host: str, port: int) -> int:
        """Start listening, and return the actual port.

        Parameters
        ----------
        host : str
        port : int
            0 for any free port.

        Raises
        ------
        InputError
            If the server cannot listen at this address.
        """
        from websockets.asyncio.server import ServerConnection, serve

        listener = self

        class Connection(ServerConnection):
            """A connection that reports its beginning and its end to the listener."""

            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                """Limit the time until a request arrives."""
                super().connection_made(transport)
                listener._add_connection(self)

            def connection_lost(self, error: Exception | None) -> None:
                """Forget the connection."""
                listener._remove_connection(self)
                super().connection_lost(error)

        _raise_file_limit()
        # Otherwise, invalid requests from strangers would fill the terminal.
        logger = logging.getLogger("robocov.web")
        logger.propagate = False
        logger.addHandler(logging.NullHandler())
        try:
            self._server = await serve(
                self._handle_socket,
                host,
                port,
                process_request=self._handle_request,
                create_connection=Connection,
                compression=None,
                server_header=None,
                max_size=MAX_MESSAGE_BYTES,
                max_queue=MAX_QUEUED_MESSAGES,
                write_limit=WRITE_LIMIT_BYTES,
                open_timeout=None,  # see `_add_connection`: the answer may be a large file
                close_timeout=CLOSE_TIMEOUT_S,
                logger=logger,
            )
        except OSError as error:
            raise build_listen_error(host, port, error) from None
        actual_port: int = self._server.sockets[0].getsockname()[1]
        return actual_port

    async def close(self) -> None:
        """Close the sockets of all pages, and end all connections."""
        if self._server is None:
            return
        self._server.close(code=WINDOW_CLOSED)
        closed = asyncio.ensure_future(self._server.wait_closed())
        # Browsers open connections in advance, without sending a request.
        for connection in list(self._unanswered):
            connection.transport.abort()
        await asyncio.wait([closed], timeout=END_TIMEOUT_S)
        for connection in list(self._connections):
            connection.transport.abort()
        await closed

    def _add_connection(self, connection: ServerConnection) -> None:
        """Limit the time until a request arrives, and the number of connections that wait for one."""
        self._connections.add(connection)
        timer = asyncio.get_running_loop().call_later(REQUEST_TIMEOUT_S, self._abort_silent, connection)
        self._unanswered[connection] = timer
        if len(self._unanswered) > MAX_UNANSWERED:
            next(iter(self._unanswered)).transport.abort()

    def _abort_silent(self, connection: ServerConnection) -> None:
        """Abort a connection that has not sent a request."""
        if connection.request is None:
            connection.transport.abort()

    def _remove_connection(self, connection: ServerConnection) -> None:
        """Forget a connection that has ended."""
        self._connections.discard(connection)
        self._files.pop(connection, None)
        self._stop_request_timer(connection)

    def _stop_request_timer(self, connection: ServerConnection) -> None:
        """Cancel the timer of a connection whose request has been answered or that has ended."""
        timer = self._unanswered.pop(connection, None)
        if timer is not None:
            timer.cancel()

    async def _handle_request(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request; reject other methods than GET and HEAD, and too many downloads at a time."""
        # Versions of websockets before 17 accept only GET, and requests lack this attribute.
        method = getattr(request, "method", "GET")
        if method not in ("GET", "HEAD"):
            return respond(connection, HTTPStatus.METHOD_NOT_ALLOWED, "Expected GET or HEAD.\n")
        try:
            response = await self._answer(connection, request)
        except Exception:
            report_exception("a request of a browser failed")
            return respond(connection, HTTPStatus.INTERNAL_SERVER_ERROR, "The request failed.\n")
        if response is None:
            return None
        if method == "HEAD":
            response.body = b""
        if len(response.body) > WRITE_LIMIT_BYTES:
            if sum(self._files.values()) + len(response.body) > MAX_FILES_BYTES:
                text = "Too many files are being downloaded; try again in a minute.\n"
                return respond(connection, HTTPStatus.SERVICE_UNAVAILABLE, text)
            self._extend_timeout(connection, len(response.body))
        return response

    def _extend_timeout(self, connection: ServerConnection, n_bytes: int) -> None:
        """Give a browser with a slow connection enough time to download a file."""
        self._stop_request_timer(connection)
        self._files[connection] = n_bytes
        connection.close_timeout = RESPONSE_TIMEOUT_S
        asyncio.get_running_loop().call_later(RESPONSE_TIMEOUT_S, connection.transport.abort)

    async def _handle_socket(self, connection: ServerConnection) -> None:
        """Serve a page until its socket is closed; report unexpected errors."""
        self._stop_request_timer(connection)
        try:
            await self._serve_page(connection)
        except Exception:
            report_exception("the connection to a page failed")
            with suppress(Exception):
                await connection.close(INTERNAL_ERROR, "Internal server error.")


def _raise_file_limit() -> None:
    """Raise the limit of open files toward `MIN_FILES` if the system allows it; the default may be 256."""
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    target = MIN_FILES if hard == resource.RLIM_INFINITY else min(MIN_FILES, hard)
    if soft != resource.RLIM_INFINITY and soft < target:
        with suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (target, hard))


def respond(connection: ServerConnection, status: HTTPStatus, text: str) -> Response:
    """Build a plain text response."""
    return respond_with(connection, status, text.encode(), "text/plain; charset=utf-8", {})


def respond_with(
    connection: ServerConnection,
    status: HTTPStatus,
    body: bytes,
    content_type: str,
    headers: dict[str, str],
) -> Response:
    """Build a response with a body of any content type, which browsers must not cache."""
    response = connection.respond(status, "")
    response.body = body
    for name in ("Content-Type", "Content-Length"):
        del response.headers[name]
    response.headers.update({"Content-Type": content_type, "Content-Length": str(len(body)), **headers})
    response.headers["X-Content-Type-Options"] = "nosniff"
    response.headers["Cache-Control"] = "no-store"
    return response


def respond_with_page(connection: ServerConnection, *, may_be_framed: bool, cookie: str = "") -> Response:
    """Build the response with the HTML page that shows a window.

    Parameters
    ----------
    connection : ServerConnection
        The connection that requests it.
    may_be_framed : bool
        Whether other sites may frame it, as notebooks do.
    cookie : str
        Cookie to set in the browser, as ``name=value``; empty for none.
    """
    nonce = secrets.token_urlsafe(12)
    page = files("robocov_app.web").joinpath("page.html").read_text("utf-8").replace("{nonce}", nonce)
    ancestors = "*" if may_be_framed else "'none'"
    headers = {"Referrer-Policy": "no-referrer"}
    headers["Content-Security-Policy"] = (
        f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; img-src data:; "
        f"connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors {ancestors}"
    )
    if cookie:
        # Without a path, the cookie belongs to the path of the page, even behind a proxy. With Lax, visitors
        # who follow a link from an email or a course page keep it.
        headers["Set-Cookie"] = f"{cookie}; HttpOnly; SameSite=Lax"
    return respond_with(connection, HTTPStatus.OK, page.encode(), "text/html; charset=utf-8", headers)


def is_from_own_page(request: Request) -> bool:
    """Return whether a request comes from the server's own page or a program that is not a browser."""
    # Browsers always send the origin of the page that opens a socket.
    origins = request.headers.get_all("Origin")
    if not origins:
        return True
    hosts = request.headers.get_all("Host") + request.headers.get_all("X-Forwarded-Host")
    return len(origins) == 1 and origins[0].partition("://")[2] in hosts
