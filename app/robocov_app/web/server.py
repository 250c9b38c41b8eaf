"""The server of a window: one page, its pictures and what hands do there, behind a token.

The window's loop stays in the main thread and knows a `Remote` and nothing of browsers; the server has a
thread of its own. (rendercanvas' ``http`` backend has none of tokens, origins, control, text and clipboard.)
"""

from __future__ import annotations

import asyncio
import json
import secrets
import struct
import threading
import zlib
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from hashlib import sha256
from http import HTTPStatus
from importlib.resources import files
from io import BytesIO
from itertools import count, islice
from pathlib import Path
from time import monotonic, time
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, unquote
from weakref import WeakSet
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pygame
from numpy.typing import NDArray

from robocov.files.atomic import written
from robocov.files.result_folder import MANIFEST
from robocov_app.terminal.output import free_name
from robocov_app.toolkit import clipboard
from robocov_app.toolkit.dialogs import MOST_LISTED
from robocov_app.toolkit.input import shown_cursor
from robocov_app.web import events
from robocov_app.web.access import cookies_of, link_to, listening_failed, query_of, same, token_in

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

    from robocov_app.toolkit.window import BaseWindow

LONGEST = 1 << 17  # letters of a message that comes in
LARGEST_UPLOAD = 1 << 24  # bytes of a file
_PICTURES = "png jpg jpeg bmp gif webp tif tiff pgm"
_MAPS = "json geojson wkt svg dxf yaml yml tmx osm map scen world argos xml"
UPLOADS = frozenset(f".{suffix}" for suffix in f"robocov {_PICTURES} {_MAPS}".split())
_OFFERED = UPLOADS | {".mp4", ".csv", ".html", ".pdf", ".zip"}  # what is saved is offered for download
_MOST_COPIED = 100_000
MOST_EVENTS = 400.0  # messages a second that are taken from one page; what is more waits in the line
MOST_WAITING = 5000  # messages that wait for the window
MOST_PAGES = 100
NARROW = 700  # width of a page, in pixels of CSS, below which the panel is hidden
IN_FLIGHT = 2  # pictures that are on their way to a page, at most
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
HEADER = struct.Struct("<I6H")
"""Number of the picture; its width and height; left, top, width and height of what is different."""


@dataclass(frozen=True, eq=False)
class Picture:
    """Pixels of the window at one moment; `number` grows from picture to picture."""

    number: int
    pixels: NDArray[np.uint32]  # (height, width), 0xRRGGBB

    @classmethod
    def of(cls, surface: pygame.Surface, number: int) -> Picture:
        high, wide = surface.get_height(), surface.get_pitch() // 4
        buffer: Any = surface.get_buffer()
        view = np.frombuffer(buffer, np.uint32).reshape(high, wide)
        return cls(number, view[:, : surface.get_width()] & np.uint32(0xFFFFFF))


def encoded(picture: Picture, before: Picture | None) -> bytes:
    """Return what a browser that shows `before` needs to show a picture: a header and deflated pixels.

    The pixels are those of the smallest box around all that is different, xor those that were there: what
    stays is 0, which deflate makes nothing of. Text stays as sharp as it is in the window, and all this is
    several times quicker than PNG. A picture of another size begins from black.
    """
    pixels = picture.pixels
    high, wide = pixels.shape
    change = pixels if before is None or before.pixels.shape != pixels.shape else pixels ^ before.pixels
    rows, columns = np.flatnonzero(change.any(axis=1)), np.flatnonzero(change.any(axis=0))
    left, top, right, bottom = 0, 0, 0, 0
    if len(rows):
        left, top, right, bottom = columns[0], rows[0], columns[-1] + 1, rows[-1] + 1
    box: Any = np.ascontiguousarray(change[top:bottom, left:right])
    head = HEADER.pack(picture.number % 2**32, wide, high, left, top, right - left, bottom - top)
    return head + zlib.compress(box, 1)


@dataclass(eq=False)
class Page:
    """A browser that shows the window."""

    line: ServerConnection
    number: int
    teacher: bool  # may take control at any time
    name: str
    own: str  # by which it is known again after its line broke
    asks: bool = False  # for control
    shown: Picture | None = None  # the picture that it has, or will have
    sent: deque[int] = field(default_factory=deque)  # numbers of pictures on their way
    told: dict[str, Any] = field(default_factory=dict)
    size: events.PageChanged | None = None
    changed: asyncio.Event = field(default_factory=asyncio.Event)


class WebDisplay:
    """A window's pictures to browsers, and their events to the window: a `Remote`.

    `host`, `port`: where it listens, 0 for any port that is free. `folder`: of what is saved and uploaded.
    Who has the `link` may take control of the window; who has `watch_link` sees it, and controls it once
    control is handed over. One page controls at a time: the first that may, until it hands over or is gone.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 0, folder: Path = Path()) -> None:
        self.host, self.port, self.folder = host, port, folder
        self.token, self.watch_token = secrets.token_urlsafe(18), secrets.token_urlsafe(18)
        self._numbers = count(1)
        self._control: Page | None = None
        self._saved: tuple[str, ...] = ()
        self._looked, self._since = 0.0, time()
        # browsers share cookies among all ports of a machine
        self._cookie = f"robocov-{sha256(self.token.encode()).hexdigest()[:12]}"
        self._waiting: deque[events.OfHands | events.Uploaded] = deque()
        self._wanted: events.PageChanged | None = None
        self._given: events.PageChanged | None = None
        self._hands = events.Hands()
        self._held, self._narrow = 0, False
        self._picture: Picture | None = None
        # also a page that is there before the first picture is told all of it
        self._told: dict[str, Any] = {"cursor": "default", "title": "robocov", "saved": ()}
        self._pages: list[Page] = []
        self._encoded: dict[tuple[int, int], bytes] = {}
        self._loop: asyncio.AbstractEventLoop
        self._ended = asyncio.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), name="web", daemon=True)
        self._begun, self._called = threading.Event(), threading.Event()
        self._trouble: OSError | None = None

    # the window's side

    def __enter__(self) -> WebDisplay:
        self._thread.start()
        self._begun.wait()
        if self._trouble is not None:
            raise listening_failed(self.host, self.port, self._trouble)
        self.link = link_to(self.host, self.port, self.token)
        self.watch_link = link_to(self.host, self.port, self.watch_token)
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
            self._given, size = wanted, (wanted.width, wanted.height)
            if window.screen.get_size() != size:
                pygame.display.set_mode(size, pygame.RESIZABLE)
                pygame.event.post(pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))
            narrow, before = wanted.width < NARROW * wanted.ratio, self._narrow
            self._narrow, theme = narrow, "dark" if wanted.dark else "light"
            window.suit(wanted.ratio, theme, panel=None if narrow == before else not narrow)
        posted = False
        while self._waiting:
            held = getattr(self._waiting[0], "held", self._held)
            if held != self._held:
                if posted:  # what was done with other keys held is taken first
                    self._called.set()
                    return
                self._held = held
                pygame.key.set_mods(events.modifiers(held))
            for event in self._hands.events(self._waiting.popleft()):
                pygame.event.post(event)
                posted = True

    def send(self, surface: pygame.Surface) -> None:
        before = self._picture
        picture = Picture.of(surface, 1 if before is None else before.number + 1)
        title = next(iter(pygame.display.get_caption()), "robocov")
        if monotonic() - self._looked >= 1.0:
            self._looked, self._saved = monotonic(), saved_since(self.folder, self._since)
        told = {"cursor": _CURSORS.get(shown_cursor(), "default"), "title": title, "saved": self._saved}
        told["copied"] = clipboard.get()[:_MOST_COPIED]
        changed = before is None or not np.array_equal(before.pixels, picture.pixels)
        if changed or told != self._told:
            self._told, self._picture = told, picture if changed else before
            self._loop.call_soon_threadsafe(self._wake)

    # the browsers' side, in the server's thread

    def _wake(self) -> None:
        for page in self._pages:
            page.changed.set()

    async def _serve(self) -> None:
        from websockets.asyncio.server import ServerConnection, serve

        lines = WeakSet[ServerConnection]()

        class Line(ServerConnection):
            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                lines.add(self)
                super().connection_made(transport)

        self._loop = asyncio.get_running_loop()
        how: dict[str, Any] = {"process_request": self._answer, "compression": None, "server_header": None}
        how["create_connection"] = Line
        how |= {"max_size": LARGEST_UPLOAD, "max_queue": 16, "write_limit": 1 << 16}
        try:
            server = await serve(self._talk, self.host, self.port, **how)
            self.port = server.sockets[0].getsockname()[1]
            self._begun.set()
            await self._ended.wait()
            server.close()
            closed = asyncio.ensure_future(server.wait_closed())
            pages = {page.line for page in self._pages}
            for line in {*lines} - pages:  # browsers open lines ahead of need, on which nothing comes
                line.transport.abort()
            await asyncio.wait([closed], timeout=1.0)
            for line in lines:
                line.transport.abort()
            await closed
        except OSError as error:
            self._trouble = error
        finally:
            self._begun.set()

    async def _answer(self, line: ServerConnection, request: Request) -> Response | None:
        """Answer a request for the page; None lets a socket be opened."""
        place = request.path.partition("?")[0]
        if not self._known(self._secret(request)):
            words = "This needs the whole link that robocov printed, with its token.\n"
            return line.respond(HTTPStatus.FORBIDDEN, words)
        if place.endswith("/socket"):
            # our own page opens it; what is no browser names no origin
            origins, headers = request.headers.get_all("Origin"), request.headers
            hosts = headers.get_all("Host") + headers.get_all("X-Forwarded-Host")
            if len(origins) > 1 or any(origin.partition("://")[2] not in hosts for origin in origins):
                return line.respond(HTTPStatus.FORBIDDEN, "Another page may not drive this window.\n")
            if len(self._pages) >= MOST_PAGES:
                return line.respond(HTTPStatus.SERVICE_UNAVAILABLE, "Too many pages show this window.\n")
            return None
        folder, _, name = place.rpartition("/")
        if folder.endswith("/saved") and unquote(name) in self._saved:
            return await asyncio.to_thread(self._download, line, unquote(name))
        if not place.endswith("/"):
            return line.respond(HTTPStatus.NOT_FOUND, "Nothing is there.\n")
        kept = cookies_of(request.headers.get_all("Cookie")).get(self._cookie, "")
        return self._page(line, token_in(request.path), kept)

    def _page(self, line: ServerConnection, given: str, kept: str) -> Response:
        nonce = secrets.token_urlsafe(12)
        page = files("robocov_app.web").joinpath("page.html").read_text("utf-8").replace("{nonce}", nonce)
        framed = "*" if self._known(given) else "'none'"  # notebooks frame it: who does knows the token
        headers = {"Referrer-Policy": "no-referrer", "Cache-Control": "no-store"}
        headers["Content-Security-Policy"] = (
            f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; img-src data:; "
            f"connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors {framed}"
        )
        # of no path: it is that of the page, also behind a proxy; who controls may look at what others see
        if self._known(given) and not same(kept, self.token):
            headers["Set-Cookie"] = f"{self._cookie}={given}; HttpOnly; SameSite=Strict"
        return _answer(line, page.encode(), "text/html; charset=utf-8", headers)

    def _download(self, line: ServerConnection, name: str) -> Response:
        path = self.folder / name
        try:
            body = zipped(path) if path.is_dir() else path.read_bytes()
        except OSError:
            return line.respond(HTTPStatus.NOT_FOUND, "It is not there any more.\n")
        name += ".zip" * path.is_dir()
        headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(name)}"}
        return _answer(line, body, "application/octet-stream", headers)

    def _secret(self, request: Request) -> str:
        return token_in(request.path) or cookies_of(request.headers.get_all("Cookie")).get(self._cookie, "")

    def _known(self, token: str) -> bool:
        return same(token, self.token) or same(token, self.watch_token)

    async def _talk(self, line: ServerConnection) -> None:
        assert line.request is not None
        number, teacher = next(self._numbers), same(self._secret(line.request), self.token)
        own = query_of(line.request.path).get("page", "")
        page = Page(line, number, teacher, f"{'Teacher' if teacher else 'Viewer'} {number}", own)
        self._pages.append(page)
        for one in self._pages[:-1]:
            if (
                own and one.own == own and one.teacher == teacher
            ):  # its line broke, which nobody has noticed yet
                page.number, page.name, page.asks = one.number, one.name, one.asks
                self._control = page if one is self._control else self._control
                one.line.transport.abort()
        self._give_control(self._control)
        sender = asyncio.ensure_future(self._send_all(page))
        try:
            await self._take_all(page)
        finally:
            sender.cancel()
            self._pages.remove(page)
            self._give_control(self._control)

    def _give_control(self, page: Page | None) -> None:
        """Let a page control the window; the first that may where that one is gone."""
        if page not in self._pages:
            page = next((each for each in self._pages if each.teacher), None)
        if page is not self._control:
            before, self._control = self._control, page
            if page is not None:
                page.asks = False
                self._wanted = page.size or self._wanted
                self._called.set()
            if before is not None:
                self._waiting.append(
                    events.Left(kind="blur")
                )  # keys and buttons that the one before has held
        self._wake()

    async def _take_all(self, page: Page) -> None:
        from websockets.exceptions import ConnectionClosed

        allowed, before = MOST_EVENTS, monotonic()
        with suppress(ConnectionClosed):
            async for text in page.line:
                now = monotonic()
                allowed, before = min(allowed + (now - before) * MOST_EVENTS, MOST_EVENTS) - 1.0, now
                while allowed < 0.0 or len(self._waiting) > MOST_WAITING:
                    await asyncio.sleep(0.05)  # what is more waits in the line; nothing is lost
                    allowed += 0.05 * MOST_EVENTS
                try:
                    if isinstance(text, bytes):
                        allowed -= MOST_EVENTS  # a file a second
                        await asyncio.to_thread(self._upload, page, text)
                    elif len(text) > LONGEST:
                        raise ValueError
                    else:
                        self._take(page, events.MESSAGES.validate_json(text))
                except ValueError:
                    await page.line.close(1008, "not understood")

    def _take(self, page: Page, message: events.Message) -> None:
        if isinstance(message, events.PictureShown):
            while page.sent and page.sent.popleft() != message.number:
                pass
            page.changed.set()
        elif isinstance(message, events.Control):
            if message.to == 0:
                page.asks = not page.asks and page is not self._control
                self._wake()
            elif page is self._control or page.teacher:
                named = (each for each in self._pages if each.number == message.to)
                self._give_control(next(named, self._control))
        elif isinstance(message, events.Named):
            page.name = "".join(filter(str.isprintable, message.name)).strip() or page.name
            self._wake()
        elif isinstance(message, events.PageChanged):
            if message.width * message.height > events.MOST_PIXELS:
                raise ValueError
            page.size = message
            if page is self._control:
                self._wanted = message
                self._called.set()
        elif page is self._control:  # the others only watch
            self._waiting.append(message)
            self._called.set()

    def _upload(self, page: Page, data: bytes) -> None:
        """Put a file into the folder, under a name that is free, and let the window open it."""
        name, _, content = data.partition(b"\n")
        path = Path(name.decode("utf-8"))
        if page is not self._control or path.suffix.lower() not in UPLOADS or path.name != str(path):
            raise ValueError
        if len(path.name) > 100 or not path.name.isprintable() or path.name.startswith("."):
            raise ValueError
        target = self.folder / path
        if target.exists():
            target = free_name(self.folder, path.stem, path.suffix)
        with written(target) as part:
            part.write_bytes(content)
        self._waiting.append(events.Uploaded(path=str(target)))
        self._called.set()

    async def _send_all(self, page: Page) -> None:
        from websockets.exceptions import ConnectionClosed

        with suppress(ConnectionClosed):
            while True:
                await page.changed.wait()
                page.changed.clear()
                picture = self._picture  # before what is told, which is never older then
                first = self._control
                people = [
                    {"number": one.number, "name": one.name, "asks": one.asks, "controls": one is first}
                    for one in self._pages
                ]
                told = self._told | {"people": people, "you": page.number, "teacher": page.teacher}
                if page is not first:
                    told.pop("copied", None)  # the clipboard is of the one who controls alone
                if told != page.told:
                    page.told = told
                    await page.line.send(json.dumps(told))
                if picture is not None and picture is not page.shown and len(page.sent) < IN_FLIGHT:
                    before, page.shown = page.shown, picture
                    page.sent.append(picture.number)
                    await page.line.send(await self._bytes(picture, before))

    async def _bytes(self, picture: Picture, before: Picture | None) -> bytes:
        """Return a picture as a page needs it that shows another; those who watch in step share it."""
        key = picture.number, 0 if before is None else before.number
        if key not in self._encoded:
            self._encoded[key] = await asyncio.to_thread(encoded, picture, before)
            for old in list(self._encoded)[:-8]:
                del self._encoded[old]
        return self._encoded[key]


def _answer(line: ServerConnection, body: bytes, kind: str, headers: dict[str, str]) -> Response:
    answer = line.respond(HTTPStatus.OK, "")
    answer.body = body
    for name in ("Content-Type", "Content-Length"):
        del answer.headers[name]
    answer.headers.update({"Content-Type": kind, "Content-Length": str(len(body)), **headers})
    answer.headers["X-Content-Type-Options"] = "nosniff"
    return answer


def saved_since(folder: Path, since: float) -> tuple[str, ...]:
    """Return the names of what windows save that was written to a folder since a time, the newest first."""
    try:
        seen = [each for each in islice(folder.iterdir(), MOST_LISTED) if _is_saved(each)]
        found = [(changed, each.name) for each in seen if (changed := each.stat().st_mtime) >= since]
    except OSError:
        return ()
    return tuple(name for _, name in sorted(found, reverse=True)[:20])


def _is_saved(path: Path) -> bool:
    if path.name.startswith("."):
        return False
    return (path / MANIFEST).exists() if path.is_dir() else path.suffix.lower() in _OFFERED


def zipped(folder: Path) -> bytes:
    """Return a folder as a zip; links in it are left out."""
    archive = BytesIO()
    with ZipFile(archive, "w", ZIP_DEFLATED) as into:
        for path in sorted(folder.rglob("*")):
            if path.is_file() and not path.is_symlink():
                into.write(path, path.relative_to(folder.parent))
    return archive.getvalue()
