"""The server of a window: it serves the page, sends frames and receives input; a token grants access.

The main loop of the window stays in the main thread and only uses the `Remote` interface; the server runs in
a thread of its own. (The ``http`` backend of rendercanvas lacks tokens, origin checks, passing of control,
text input and the clipboard.)
"""

from __future__ import annotations

import asyncio
import secrets
import threading
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from hashlib import sha256
from http import HTTPStatus
from pathlib import Path
from time import monotonic, time
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, unquote

import numpy as np
import pygame

from robocov.errors import InputError
from robocov_app.toolkit.window.clipboard import Clipboard
from robocov_app.toolkit.window.share_link import ShareLink
from robocov_app.web import events
from robocov_app.web.access import are_equal, build_link, get_token, parse_cookies, parse_query
from robocov_app.web.connections import (
    REPLACED,
    TRY_AGAIN_LATER,
    Listener,
    is_from_own_page,
    respond,
    respond_with,
    respond_with_page,
)
from robocov_app.web.files import TransferError, list_saved, read_saved
from robocov_app.web.frame_delivery import SERVED_FPS, FrameDelivery
from robocov_app.web.frames import Frame
from robocov_app.web.invitations import build_invitation
from robocov_app.web.page_connection import PageConnection, SharedWindow
from robocov_app.web.pages import Page, Pages, TooManyPagesError
from robocov_app.web.window_input import WindowInput

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

    from robocov_app.toolkit.window.window import BaseWindow

MAX_COPIED_CHARACTERS = 100_000
"""Maximum length of copied text that is sent to the controlling page."""
SAVED_FILES_INTERVAL_S = 1.0
"""Time between two searches for new files."""
_STOP_TIMEOUT_S = 5.0
_TOKEN_BYTES = 18
_COOKIE_HASH_CHARACTERS = 12
_CSS_CURSORS = {
    pygame.SYSTEM_CURSOR_HAND: "pointer",
    pygame.SYSTEM_CURSOR_CROSSHAIR: "crosshair",
    pygame.SYSTEM_CURSOR_IBEAM: "text",
    pygame.SYSTEM_CURSOR_SIZEALL: "move",
    pygame.SYSTEM_CURSOR_SIZEWE: "ew-resize",
    pygame.SYSTEM_CURSOR_SIZENS: "ns-resize",
    pygame.SYSTEM_CURSOR_SIZENESW: "nesw-resize",
    pygame.SYSTEM_CURSOR_SIZENWSE: "nwse-resize",
    pygame.SYSTEM_CURSOR_WAIT: "wait",
    pygame.SYSTEM_CURSOR_NO: "not-allowed",
}


class WebDisplay:
    """A `Remote` that shows a window in browsers.

    Users with `link` may take control of the window. Users with `watch_link` see the window, and control it
    only if control is passed to them. One page at a time controls the window.

    Parameters
    ----------
    host : str
        Address to listen at.
    port : int
        Port to listen at; 0 for any free port.
    folder : Path
        Folder for saved and uploaded files.
    visitor_link : ShareLink or None
        Link of the visitor server, which gives each visitor a window, if this window is one of them. Pages
        then connect through that server, and this link is the `share_link`. None if pages connect directly.

    Attributes
    ----------
    link, watch_link : str
        Addresses of the page for controlling and for watching, set while the server runs.
    share_link : ShareLink
        The link that invites others, set while the server runs.
    fps : int
        Frames per second of the window while something moves.
    shared : SharedWindow
        What all pages share.
    clipboard : Clipboard
        Text copied in the window, or pasted in the controlling page.
    saved_files : tuple of str
        Names of the files that pages may download.
    """

    link: str
    watch_link: str
    share_link: ShareLink
    fps = SERVED_FPS

    def __init__(
        self,
        host: str = "127.0.0.1",
        port: int = 0,
        folder: Path = Path(),
        visitor_link: ShareLink | None = None,
    ) -> None:
        """Prepare the server; it starts when the context is entered."""
        self.host = host
        self.port = port
        self.token = secrets.token_urlsafe(_TOKEN_BYTES)
        self.watch_token = secrets.token_urlsafe(_TOKEN_BYTES)
        # Browsers share cookies among all ports of a host, so each server needs a cookie name of its own.
        token_hash = sha256(self.token.encode()).hexdigest()
        self._cookie_name = f"robocov-{token_hash[:_COOKIE_HASH_CHARACTERS]}"
        self._file_executor = ThreadPoolExecutor(1, thread_name_prefix="web-files")
        self.clipboard = Clipboard()
        pages = Pages(self._handle_control_change)
        self.shared = SharedWindow(
            pages=pages,
            delivery=FrameDelivery(pages),
            window_input=WindowInput(self.clipboard),
            folder=folder,
            file_executor=self._file_executor,
        )
        self.saved_files: tuple[str, ...] = ()
        self._visitor_link = visitor_link
        # The file that was last offered for download. A new number tells the page that it is a new offer.
        self._offer: dict[str, Any] = {"number": 0, "name": ""}
        self._status = ""
        self._controls: dict[str, Any] | None = None
        self._window: BaseWindow | None = None
        self._last_frame_number = 0
        self._files_listed_at = 0.0
        self._created_at = time()
        self._background: set[asyncio.Task[None]] = set()
        self._loop: asyncio.AbstractEventLoop
        self._stop_requested = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="web", daemon=True)
        self._has_started = threading.Event()
        self._start_error: InputError | None = None

    # Called in the window's thread.

    def __enter__(self) -> WebDisplay:
        self._thread.start()
        self._has_started.wait()
        if self._start_error is not None:
            raise self._start_error
        self.link = build_link(self.host, self.port, self.token)
        self.watch_link = build_link(self.host, self.port, self.watch_token)
        self.share_link = self._visitor_link or ShareLink(self.watch_link, self.host)
        self.shared.invitation = build_invitation(self.share_link)
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._stop_requested.set)
        self._thread.join(_STOP_TIMEOUT_S)

    def wait(self, seconds: float) -> None:
        """Wait until a page sends input, at most for the given time."""
        self.shared.window_input.wait(seconds)

    def receive(self, window: BaseWindow) -> None:
        """Post the input of the controlling page as events, and fit the window to that page.

        The status and the controls of the window are kept, because `send` sends them to the pages.
        """
        self._window = window
        self._status = window.status_text
        # In play mode, another window replaces this one.
        controls = (window.replacement or window).controls
        self._controls = None if controls is None else asdict(controls)
        self.shared.window_input.post(window)

    def offer_file(self, name: str) -> None:
        """Let the page in control download a file of the folder."""
        self._offer = {"number": self._offer["number"] + 1, "name": name}
        self._files_listed_at = 0.0

    def send(self, surface: pygame.Surface, cursor: int = pygame.SYSTEM_CURSOR_ARROW) -> None:
        """Send the frame and the state of the window to the pages, if they have changed."""
        delivery = self.shared.delivery
        # The server's thread reads `newest`; it is woken only if the frame differs.
        previous = delivery.newest
        frame = Frame.from_surface(surface, self._last_frame_number + 1)
        if previous is None or not np.array_equal(previous.pixels, frame.pixels):
            self._last_frame_number += 1
            delivery.newest = frame
            self._loop.call_soon_threadsafe(delivery.has_work.set)
        self._send_maps()
        if monotonic() - self._files_listed_at >= SAVED_FILES_INTERVAL_S:
            self._files_listed_at = monotonic()
            self.saved_files = list_saved(self.shared.folder, self._created_at, self.shared.uploads)
        state = {
            "cursor": _CSS_CURSORS.get(cursor, "default"),
            "title": next(iter(pygame.display.get_caption()), "robocov"),
            "status": self._status,
            "controls": self._controls,
            "saved": self.saved_files,
            "copied": self.clipboard.get()[:MAX_COPIED_CHARACTERS],
            "offer": self._offer,
        }
        if state != self.shared.state:
            self.shared.state = state
            self._loop.call_soon_threadsafe(self.shared.pages.wake)

    def _send_maps(self) -> None:
        """Send the map to the phones that show it instead of the window."""
        delivery = self.shared.delivery
        window = self._window
        if window is None or delivery.newest is None:
            return
        if delivery.maps.update(window.replacement or window, delivery.newest, self._create_frame_number):
            self._loop.call_soon_threadsafe(delivery.has_work.set)

    def _create_frame_number(self) -> int:
        """Return a number that no frame of the window or the map has."""
        self._last_frame_number += 1
        return self._last_frame_number

    # Called in the server's thread.

    def _run(self) -> None:
        """Run the server; the target of its thread."""
        try:
            asyncio.run(self._serve())
        finally:
            self._has_started.set()
            self.shared.delivery.close()
            self._file_executor.shutdown(wait=False, cancel_futures=True)

    async def _serve(self) -> None:
        """Run the server until it is asked to stop.

        If the port cannot be opened, keep the error for the window's thread.
        """
        self._loop = asyncio.get_running_loop()
        listener = Listener(self._answer, self._talk)
        try:
            self.port = await listener.listen(self.host, self.port)
        except InputError as error:
            self._start_error = error
            return
        delivery = asyncio.create_task(self.shared.delivery.run())
        self._has_started.set()
        await self._stop_requested.wait()
        await listener.close()
        delivery.cancel()

    async def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for the page or a file; return None to let it open a socket."""
        path = request.path.partition("?")[0]
        if not self._is_known(self._read_token(request)):
            text = "Open the complete link that robocov printed, including its token.\n"
            return respond(connection, HTTPStatus.FORBIDDEN, text)
        if path.endswith("/socket"):
            if is_from_own_page(request):
                return None
            return respond(connection, HTTPStatus.FORBIDDEN, "Another page may not control this window.\n")
        folder, _, quoted_name = path.rpartition("/")
        name = unquote(quoted_name)
        if folder.endswith("/saved") and name in self.saved_files:
            return await self._download(connection, name)
        if not path.endswith("/"):
            return respond(connection, HTTPStatus.NOT_FOUND, "This page does not exist.\n")
        link_token = get_token(request.path)
        has_link = self._is_known(link_token)
        # A page that may control keeps that right if it is reopened with the watch link.
        keeps_cookie = are_equal(self._read_cookie(request), self.token)
        cookie = ""
        if has_link and not keeps_cookie:
            cookie = f"{self._cookie_name}={link_token}"
        return respond_with_page(connection, may_be_framed=has_link, cookie=cookie)

    async def _download(self, connection: ServerConnection, name: str) -> Response:
        """Return a saved file, or a result folder as a zip archive."""
        path = self.shared.folder / name
        try:
            file_name, body = await self._loop.run_in_executor(self._file_executor, read_saved, path)
        except TransferError as error:
            return respond(connection, HTTPStatus.NOT_FOUND, f"{error}\n")
        headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(file_name)}"}
        return respond_with(connection, HTTPStatus.OK, body, "application/octet-stream", headers)

    def _read_cookie(self, request: Request) -> str:
        """Return the token in this server's cookie; empty if the request has none."""
        return parse_cookies(request.headers.get_all("Cookie")).get(self._cookie_name, "")

    def _read_token(self, request: Request) -> str:
        """Return the token in the address of a request or, if there is none, the one in its cookie."""
        return get_token(request.path) or self._read_cookie(request)

    def _is_known(self, token: str) -> bool:
        """Return whether a token grants access."""
        return are_equal(token, self.token) or are_equal(token, self.watch_token)

    async def _talk(self, connection: ServerConnection) -> None:
        """Exchange messages with a page as long as its connection lasts."""
        request = connection.request
        assert request is not None
        pages = self.shared.pages
        may_control = are_equal(self._read_token(request), self.token)
        page_id = parse_query(request.path).get("page", "")
        try:
            page = pages.open(connection, may_control=may_control, page_id=page_id)
        except TooManyPagesError as error:
            await connection.close(TRY_AGAIN_LATER, str(error))
            return
        surplus = pages.remove_surplus_control_page()
        if surplus is not None:
            text = "This window was opened in too many other pages."
            self._start_in_background(surplus.connection.close(REPLACED, text))
        # The page has no frame yet, so the delivery must send it one.
        self.shared.delivery.has_work.set()
        try:
            await PageConnection(page, self.shared).run()
        finally:
            pages.close(page)
            # This also lets the delivery drop the page's base frame.
            self.shared.update_sizes()

    def _handle_control_change(self, previous: Page | None, page: Page | None) -> None:
        """Fit the window to the new controlling page, and release the keys held in the previous one."""
        self.shared.update_sizes()
        if previous is not None:
            self.shared.window_input.put(events.FocusLost(kind="blur"))

    def _start_in_background(self, work: Coroutine[Any, Any, None]) -> None:
        """Start a coroutine, and keep a reference to its task until it has ended."""
        task = asyncio.create_task(work)
        self._background.add(task)
        task.add_done_callback(self._background.discard)
