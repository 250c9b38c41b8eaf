"""The server of a window: one page, its frames and what hands do there, behind a token.

The window's loop stays in the main thread and knows a `Remote` and nothing of browsers; the server has a
thread of its own. (rendercanvas' ``http`` backend has none of tokens, origins, control, text and clipboard.)
"""

from __future__ import annotations

import asyncio
import json
import secrets
import threading
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from hashlib import sha256
from http import HTTPStatus
from itertools import count
from pathlib import Path
from time import monotonic, time
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, unquote

import numpy as np
import pygame

from robocov.errors import InputError
from robocov_app.toolkit import clipboard
from robocov_app.toolkit.input import shown_cursor
from robocov_app.web import events
from robocov_app.web.access import are_equal, build_link, get_token, parse_cookies, parse_query
from robocov_app.web.connections import (
    NOT_UNDERSTOOD,
    REPLACED,
    SEND_TIMEOUT_S,
    TRY_AGAIN_LATER,
    Listener,
    is_from_own_page,
    report,
    respond,
    respond_with,
    respond_with_page,
)
from robocov_app.web.files import TransferError, Upload, check_name, list_saved, read_saved
from robocov_app.web.frames import BaseFrames, Frame, encode_frame

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

    from robocov_app.toolkit.window import BaseWindow

MAX_WATCHERS = 100
MAX_CONTROLLERS = 16  # pages with the controlling link; the oldest one has to go for one more
MAX_EVENTS_PER_S = 400.0  # that are taken from one page; what is more waits in its connection
EVENTS_PER_UPLOAD = 200.0  # an upload counts as that many events
EVENTS_PER_PIECE = 8.0  # and each piece of it
MAX_WAITING_EVENTS = 5000  # for the window
MAX_NOTICES = 8  # that wait for a page
MAX_COPIED_CHARACTERS = 100_000
NARROW_PX = 700  # width of a page, in pixels of CSS, below which the panel is hidden
MAX_IN_FLIGHT = 2  # frames that are on their way to a page
FEW_WATCHERS = 3
WATCHERS_INTERVAL_S = 1 / 15  # between two frames for watchers, if there are more than a few
SAVED_INTERVAL_S = 1.0  # between two looks for new files
_CURSORS = {
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


@dataclass(eq=False)
class Page:
    """A browser that shows the window."""

    connection: ServerConnection
    number: int
    is_teacher: bool  # may take control at any time
    name: str
    page_id: str  # by which it is known again when its connection broke
    asks: bool = False  # for control
    size: events.PageChanged | None = None
    upload: Upload | None = None
    base: int = 0  # number of the frame that it has, or will have; 0 for none
    in_flight: deque[int] = field(default_factory=deque)  # numbers of frames on their way
    outbox: deque[bytes] = field(default_factory=deque)  # frames to be sent
    notices: deque[str] = field(default_factory=lambda: deque(maxlen=MAX_NOTICES))
    state: dict[str, Any] = field(default_factory=dict)  # that it was sent last
    changed: asyncio.Event = field(default_factory=asyncio.Event)

    def is_ready_for(self, frame: Frame | None) -> bool:
        """Return whether a frame is newer than what the page has, and can be sent."""
        return frame is not None and self.base < frame.number and len(self.in_flight) < MAX_IN_FLIGHT

    def notify(self, notice: str) -> None:
        """Show a message in the page."""
        self.notices.append(notice)
        self.changed.set()


class WebDisplay:
    """A window's frames to browsers, and their events to the window: a `Remote`.

    Whoever has `link` may take control of the window. Whoever has `watch_link` sees it, and controls it once
    control is handed over. One page controls at a time: the first that may, until it hands over or is gone.

    Parameters
    ----------
    host : str
        Address to listen at.
    port : int
        Port to listen at; 0 for any port that is free.
    folder : Path
        Folder for files that are saved and uploaded.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 0, folder: Path = Path()) -> None:
        self.host = host
        self.port = port
        self.folder = folder
        self.token = secrets.token_urlsafe(18)
        self.watch_token = secrets.token_urlsafe(18)
        # browsers share cookies among all ports of a machine
        self._cookie = f"robocov-{sha256(self.token.encode()).hexdigest()[:12]}"
        # the window's side
        self._wanted: events.PageChanged | None = None
        self._given: events.PageChanged | None = None
        self._translator = events.EventTranslator()
        self._held = 0
        self._narrow = False
        self._saved: tuple[str, ...] = ()
        self._saved_looked_at = 0.0
        self._started_at = time()
        # what both sides use
        self._waiting: deque[events.InputMessage | events.Uploaded] = deque()
        self._frame: Frame | None = None
        # also a page that is there before the first frame gets all of it
        self._state: dict[str, Any] = {"cursor": "default", "title": "robocov", "saved": ()}
        self._called = threading.Event()
        # the browsers' side
        self._numbers = count(1)
        self._pages: list[Page] = []
        self._people: list[dict[str, Any]] = []
        self._control: Page | None = None
        self._bases = BaseFrames()
        self._watchers_frame: Frame | None = None
        self._watchers_due = 0.0
        self._control_was_served = False
        self._background: set[asyncio.Task[None]] = set()
        self._loop: asyncio.AbstractEventLoop
        self._stirred = asyncio.Event()
        self._ended = asyncio.Event()
        self._encoder = ThreadPoolExecutor(1, thread_name_prefix="web-encoder")
        self._file_thread = ThreadPoolExecutor(1, thread_name_prefix="web-files")
        self._thread = threading.Thread(target=self._run, name="web", daemon=True)
        self._started = threading.Event()
        self._trouble: InputError | None = None

    # The window's side.

    def __enter__(self) -> WebDisplay:
        self._thread.start()
        self._started.wait()
        if self._trouble is not None:
            raise self._trouble
        self.link = build_link(self.host, self.port, self.token)
        self.watch_link = build_link(self.host, self.port, self.watch_token)
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join(5.0)

    def wait(self, seconds: float) -> None:
        if self._called.wait(max(seconds, 0.001)):  # other threads get their turn in any case
            self._called.clear()

    def receive(self, window: BaseWindow) -> None:
        """Give the window the size and look of the page, and post what hands did there."""
        wanted = self._wanted
        if wanted is not None and wanted is not self._given:
            self._given = wanted
            self._fit(window, wanted)
        posted = False
        while self._waiting:
            held = getattr(self._waiting[0], "held", self._held)
            if held != self._held:
                if posted:  # what was done with other keys held is taken first
                    self._called.set()
                    return
                self._held = held
                pygame.key.set_mods(events.get_modifiers(held))
            for event in self._translator.translate(self._waiting.popleft()):
                pygame.event.post(event)
                posted = True

    def _fit(self, window: BaseWindow, wanted: events.PageChanged) -> None:
        size = (wanted.width, wanted.height)
        if window.screen.get_size() != size:
            pygame.display.set_mode(size, pygame.RESIZABLE)
            pygame.event.post(pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))
        was_narrow = self._narrow
        self._narrow = wanted.width < NARROW_PX * wanted.ratio
        panel = None if self._narrow == was_narrow else not self._narrow
        window.suit(wanted.ratio, "dark" if wanted.dark else "light", panel=panel)

    def send(self, surface: pygame.Surface) -> None:
        """Show what is in the window now."""
        before = self._frame
        frame = Frame.from_surface(surface, 1 if before is None else before.number + 1)
        if before is None or not np.array_equal(before.pixels, frame.pixels):
            self._frame = frame
            self._loop.call_soon_threadsafe(self._stirred.set)
        if monotonic() - self._saved_looked_at >= SAVED_INTERVAL_S:
            self._saved_looked_at = monotonic()
            self._saved = list_saved(self.folder, self._started_at)
        state = {
            "cursor": _CURSORS.get(shown_cursor(), "default"),
            "title": next(iter(pygame.display.get_caption()), "robocov"),
            "saved": self._saved,
            "copied": clipboard.get()[:MAX_COPIED_CHARACTERS],
        }
        if state != self._state:
            self._state = state
            self._loop.call_soon_threadsafe(self._wake_pages)

    # The browsers' side, in the server's thread.

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        finally:
            self._started.set()
            self._encoder.shutdown(wait=False, cancel_futures=True)
            self._file_thread.shutdown(wait=False, cancel_futures=True)

    async def _serve(self) -> None:
        self._loop = asyncio.get_running_loop()
        listener = Listener(self._answer, self._talk)
        try:
            self.port = await listener.listen(self.host, self.port)
        except InputError as error:
            self._trouble = error
            return
        distributing = asyncio.create_task(self._distribute_frames())
        self._started.set()
        await self._ended.wait()
        await listener.close()
        distributing.cancel()

    async def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for the page or a file; None lets a socket be opened."""
        path = request.path.partition("?")[0]
        if not self._is_known(self._token_of(request)):
            text = "This needs the whole link that robocov printed, with its token.\n"
            return respond(connection, HTTPStatus.FORBIDDEN, text)
        if path.endswith("/socket"):
            if is_from_own_page(request):
                return None
            return respond(connection, HTTPStatus.FORBIDDEN, "Another page may not drive this window.\n")
        folder, _, name = path.rpartition("/")
        name = unquote(name)
        if folder.endswith("/saved") and name in self._saved:
            return await self._download(connection, name)
        if not path.endswith("/"):
            return respond(connection, HTTPStatus.NOT_FOUND, "Nothing is there.\n")
        given = get_token(request.path)
        kept = parse_cookies(request.headers.get_all("Cookie")).get(self._cookie, "")
        is_given = self._is_known(given)
        # who controls may look at what others see
        replaces = is_given and not are_equal(kept, self.token)
        cookie = f"{self._cookie}={given}" if replaces else ""
        return respond_with_page(connection, may_be_framed=is_given, cookie=cookie)

    async def _download(self, connection: ServerConnection, name: str) -> Response:
        try:
            name, body = await self._loop.run_in_executor(self._file_thread, read_saved, self.folder / name)
        except TransferError as error:
            return respond(connection, HTTPStatus.NOT_FOUND, f"{error}\n")
        headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(name)}"}
        return respond_with(connection, HTTPStatus.OK, body, "application/octet-stream", headers)

    def _start_in_background(self, work: Any) -> None:
        task = asyncio.create_task(work)
        self._background.add(task)
        task.add_done_callback(self._background.discard)

    def _token_of(self, request: Request) -> str:
        cookies = parse_cookies(request.headers.get_all("Cookie"))
        return get_token(request.path) or cookies.get(self._cookie, "")

    def _is_known(self, token: str) -> bool:
        return are_equal(token, self.token) or are_equal(token, self.watch_token)

    # Pages come, take control, and go.

    async def _talk(self, connection: ServerConnection) -> None:
        """Exchange messages with a page as long as its connection lasts."""
        assert connection.request is not None
        is_teacher = are_equal(self._token_of(connection.request), self.token)
        page_id = parse_query(connection.request.path).get("page", "")
        earlier = self._find_page(page_id, is_teacher)
        if earlier is None and not is_teacher:
            watchers = [page for page in self._pages if not page.is_teacher]
            if len(watchers) >= MAX_WATCHERS:
                text = f"All {MAX_WATCHERS} places for watchers are taken. Trying again …"
                await connection.close(TRY_AGAIN_LATER, text)
                return
        number = next(self._numbers)
        name = f"{'Teacher' if is_teacher else 'Viewer'} {number}"
        page = Page(connection, number, is_teacher, name, page_id)
        self._pages.append(page)
        if earlier is not None:  # its connection broke, which nobody has noticed yet
            self._take_over(page, earlier)
        elif is_teacher:
            self._make_room_for_teacher()
        self._give_control(self._control)
        self._stirred.set()  # the page has no frame yet
        sender = asyncio.create_task(self._send_all(page))
        try:
            await self._take_all(page)
        finally:
            sender.cancel()
            self._remove_page(page)

    def _find_page(self, page_id: str, is_teacher: bool) -> Page | None:
        for page in self._pages:
            if page_id and page.page_id == page_id and page.is_teacher == is_teacher:
                return page
        return None

    def _take_over(self, page: Page, earlier: Page) -> None:
        page.number = earlier.number
        page.name = earlier.name
        page.asks = earlier.asks
        had_control = earlier is self._control
        self._pages.remove(earlier)
        if had_control:
            self._give_control(page)
        earlier.connection.transport.abort()

    def _make_room_for_teacher(self) -> None:
        """End the oldest page with the controlling link that does not control, if there are too many."""
        teachers = [page for page in self._pages if page.is_teacher]
        if len(teachers) <= MAX_CONTROLLERS:
            return
        oldest = next(page for page in teachers if page is not self._control)
        self._pages.remove(oldest)
        text = "This window was opened in too many other pages."
        self._start_in_background(oldest.connection.close(REPLACED, text))

    def _remove_page(self, page: Page) -> None:
        if page in self._pages:
            self._pages.remove(page)
        self._give_control(self._control)
        self._stirred.set()  # the frame that it had need not be kept

    def _give_control(self, page: Page | None) -> None:
        """Let a page control the window; the first that may if that one is gone."""
        if page not in self._pages:
            page = next((each for each in self._pages if each.is_teacher), None)
        if page is not self._control:
            before = self._control
            self._control = page
            if page is not None:
                page.asks = False
                self._wanted = page.size or self._wanted
                self._called.set()
            if before is not None:
                # keys and buttons that the one before has held are let go
                self._waiting.append(events.Left(kind="blur"))
        self._update_people()

    def _update_people(self) -> None:
        self._people = [
            {
                "number": page.number,
                "name": page.name,
                "asks": page.asks,
                "controls": page is self._control,
            }
            for page in self._pages
        ]
        self._wake_pages()

    def _wake_pages(self) -> None:
        for page in self._pages:
            page.changed.set()

    # What comes in.

    async def _take_all(self, page: Page) -> None:
        from websockets.exceptions import ConnectionClosed

        allowed = MAX_EVENTS_PER_S
        before = monotonic()
        with suppress(ConnectionClosed):
            async for message in page.connection:
                now = monotonic()
                allowed = min(allowed + (now - before) * MAX_EVENTS_PER_S, MAX_EVENTS_PER_S)
                before = now
                try:
                    allowed -= await self._take_any(page, message)
                except ValueError:
                    await page.connection.close(NOT_UNDERSTOOD, "not understood")
                while allowed < 0.0 or len(self._waiting) > MAX_WAITING_EVENTS:
                    await asyncio.sleep(0.05)  # what is more waits in the connection; nothing is lost
                    allowed += 0.05 * MAX_EVENTS_PER_S

    async def _take_any(self, page: Page, message: str | bytes) -> float:
        """Take a message, and return as how many events it counts; raises `ValueError`."""
        if isinstance(message, bytes):
            await self._take_piece(page, message)
            return EVENTS_PER_PIECE
        checked = events.MESSAGES.validate_json(message)
        if isinstance(checked, events.UploadStarted):
            await self._start_upload(page, checked)
            return EVENTS_PER_UPLOAD
        self._take(page, checked)
        return 1.0

    def _take(self, page: Page, message: events.Message) -> None:
        if isinstance(message, events.FrameShown):
            while page.in_flight and page.in_flight.popleft() != message.number:
                pass
            self._stirred.set()
        elif isinstance(message, events.Control):
            self._take_control(page, message.to)
        elif isinstance(message, events.Named):
            page.name = "".join(filter(str.isprintable, message.name)).strip() or page.name
            self._update_people()
        elif isinstance(message, events.PageChanged):
            if message.width * message.height > events.MAX_PAGE_PIXELS:
                raise ValueError("page too large")
            page.size = message
            if page is self._control:
                self._wanted = message
                self._called.set()
        elif page is self._control and not isinstance(message, events.UploadStarted):
            self._waiting.append(message)  # the others only watch
            self._called.set()

    def _take_control(self, page: Page, to: int) -> None:
        if to == 0:
            page.asks = not page.asks and page is not self._control
            self._update_people()
        elif page is self._control or page.is_teacher:
            named = (each for each in self._pages if each.number == to)
            self._give_control(next(named, self._control))

    async def _start_upload(self, page: Page, message: events.UploadStarted) -> None:
        problem = "" if page is self._control else "Only the page that controls the window can open files."
        try:
            check_name(message.name)
        except TransferError as error:
            problem = problem or str(error)
        if problem:
            page.notify(problem)
        page.upload = Upload(message.name, message.size, is_refused=bool(problem))
        await self._finish_upload(page)

    async def _take_piece(self, page: Page, piece: bytes) -> None:
        if page.upload is None:
            raise ValueError("a piece of no file")
        page.upload.add(piece)
        await self._finish_upload(page)

    async def _finish_upload(self, page: Page) -> None:
        """Save a file once it has come in, and let the window open it."""
        upload = page.upload
        if upload is None or not upload.is_complete:
            return
        page.upload = None
        if upload.is_refused:
            return
        if page is not self._control:
            page.notify(f"{upload.name}: not opened, another page controls the window now.")
            return
        try:
            path = await self._loop.run_in_executor(self._file_thread, upload.save, self.folder)
        except TransferError as error:
            page.notify(str(error))
            report(str(error))
            return
        self._waiting.append(events.Uploaded(path=str(path)))
        self._called.set()

    # What goes out.

    async def _send_all(self, page: Page) -> None:
        from websockets.exceptions import ConnectionClosed

        with suppress(ConnectionClosed):
            while True:
                await page.changed.wait()
                page.changed.clear()
                frames = list(page.outbox)  # before the state, which is never older then
                page.outbox.clear()
                await self._send_state(page)
                while page.notices:
                    notice = {"kind": "notice", "text": page.notices.popleft()}
                    await self._send(page, json.dumps(notice))
                for frame in frames:
                    await self._send(page, frame)

    async def _send_state(self, page: Page) -> None:
        state = {
            **self._state,
            "kind": "state",
            "people": self._people,
            "you": page.number,
            "teacher": page.is_teacher,
        }
        if page is not self._control:
            state.pop("copied", None)  # only the page that controls sees the clipboard
        if state != page.state:
            page.state = state
            await self._send(page, json.dumps(state))

    async def _send(self, page: Page, message: str | bytes) -> None:
        try:
            async with asyncio.timeout(SEND_TIMEOUT_S):
                await page.connection.send(message)
        except TimeoutError:  # it does not read
            page.connection.transport.abort()

    async def _distribute_frames(self) -> None:
        """Encode frames for pages that are ready for them, for all that have the same one at once."""
        while True:
            self._stirred.clear()
            page, frame = self._choose_delivery()
            if page is None or frame is None:
                await self._wait_for_work()
            else:
                await self._deliver(page, frame)
            self._bases.keep_only({page.base for page in self._pages})

    async def _deliver(self, page: Page, frame: Frame) -> None:
        number = page.base
        base = self._bases.get(number)
        message = await self._loop.run_in_executor(self._encoder, encode_frame, frame, base)
        self._bases.add(frame)
        self._control_was_served = page is self._control
        for each in self._pages:
            is_due = each is page or each is not self._control
            if each.base == number and is_due and each.is_ready_for(frame):
                each.base = frame.number
                each.in_flight.append(frame.number % 2**32)
                each.outbox.append(message)
                each.changed.set()

    def _choose_delivery(self) -> tuple[Page | None, Frame | None]:
        """Return a page, and the frame that it gets next: the page that controls by turns with the others."""
        newest = self._frame
        control = self._control
        control_is_ready = control is not None and control.is_ready_for(newest)
        if control_is_ready and not self._control_was_served:
            return control, newest
        watchers = [page for page in self._pages if page is not control]
        if len(watchers) <= FEW_WATCHERS or monotonic() >= self._watchers_due:
            # if there are many, they get the same frames, and what is encoded for one serves others, too
            if newest is not self._watchers_frame:
                self._watchers_due = monotonic() + WATCHERS_INTERVAL_S
            self._watchers_frame = newest
        ready = [page for page in watchers if page.is_ready_for(self._watchers_frame)]
        if ready:
            return min(ready, key=lambda page: page.base), self._watchers_frame
        if control_is_ready:
            return control, newest
        return None, None

    async def _wait_for_work(self) -> None:
        timeout = None
        if self._watchers_frame is not self._frame and len(self._pages) > 1:
            timeout = max(self._watchers_due - monotonic(), 0.001)
        with suppress(TimeoutError):
            async with asyncio.timeout(timeout):
                await self._stirred.wait()
