"""Messages between the server and one page: input, requests and files in; states and frames out."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Any

from robocov_app.web import events
from robocov_app.web.connections import NOT_UNDERSTOOD, SEND_TIMEOUT_S, report
from robocov_app.web.files import TransferError, Upload, check_name
from robocov_app.web.frame_delivery import FrameDelivery
from robocov_app.web.pages import Page, Pages
from robocov_app.web.window_input import WindowInput

MAX_EVENTS_PER_S = 400.0
"""Maximum rate of events from one page. Excess events wait in the connection; none are lost."""
EVENTS_PER_UPLOAD = 200.0
"""Number of events that an upload counts as."""
EVENTS_PER_PIECE = 8.0
"""Number of events that a piece of an upload counts as."""
_PAUSE_S = 0.05
"""Interval at which the server checks whether more messages may be read."""


@dataclass
class SharedWindow:
    """State that all pages of a served window share.

    Attributes
    ----------
    pages : Pages
    delivery : FrameDelivery
    window_input : WindowInput
    folder : Path
        Folder for uploaded files.
    file_executor : Executor
        Runs the reading and writing of files in a thread.
    state : dict
        State of the window that pages get in addition to its frames: cursor, title, status, saved files,
        clipboard.
    uploads : dict
        Modification time of each uploaded file by its name, s since the epoch.
    invitation : dict
        Link for others and its QR code, for pages opened with the control link; see `build_invitation`.
    """

    pages: Pages
    delivery: FrameDelivery
    window_input: WindowInput
    folder: Path
    file_executor: Executor
    state: dict[str, Any] = field(
        default_factory=lambda: {
            "cursor": "default",
            "title": "robocov",
            "saved": (),
            "status": "",
            "controls": None,
        }
    )
    uploads: dict[str, float] = field(default_factory=dict)
    invitation: dict[str, str | bool] = field(default_factory=dict)

    def update_sizes(self) -> None:
        """Pass the sizes that the window and the map should have to the window."""
        self.pages.update_map_sizes()
        sizes = (page.map_size for page in self.pages)
        self.delivery.maps.requested_sizes = frozenset(size for size in sizes if size is not None)
        controlling = self.pages.controlling
        map_size = None if controlling is None else controlling.map_size
        self.window_input.set_page(self.pages.display_settings, map_size)
        self.delivery.has_work.set()


class _EventBudget:
    """The number of events that a page may still send; it is replenished at a constant rate."""

    def __init__(self) -> None:
        self._remaining = MAX_EVENTS_PER_S
        self._refilled_at = monotonic()

    @property
    def is_exceeded(self) -> bool:
        """Whether the page has sent more events than it may."""
        return self._remaining < 0.0

    def refill(self) -> None:
        """Add the events that the time since the last call allows."""
        now = monotonic()
        gained = (now - self._refilled_at) * MAX_EVENTS_PER_S
        self._remaining = min(self._remaining + gained, MAX_EVENTS_PER_S)
        self._refilled_at = now

    def spend(self, event_count: float) -> None:
        """Subtract events that the page has sent."""
        self._remaining -= event_count


class PageConnection:
    """The exchange of messages with a page, as long as its connection lasts.

    Parameters
    ----------
    page : Page
    shared : SharedWindow
    """

    def __init__(self, page: Page, shared: SharedWindow) -> None:
        self._page = page
        self._shared = shared
        self._handlers: dict[type[Any], Callable[[Any], None]] = {
            events.FrameShown: self._handle_shown_frame,
            events.ControlPassed: self._handle_passed_control,
            events.NameEntered: self._handle_name,
            events.PageChanged: self._handle_page,
        }

    async def run(self) -> None:
        """Exchange messages until the connection ends."""
        sender = asyncio.create_task(self._send_updates())
        try:
            await self._receive_messages()
        finally:
            sender.cancel()

    # Messages from the page.

    async def _receive_messages(self) -> None:
        """Handle the messages of the page; pause while it sends too many, or the window cannot keep up."""
        from websockets.exceptions import ConnectionClosed

        budget = _EventBudget()
        with suppress(ConnectionClosed):
            async for message in self._page.connection:
                budget.refill()
                try:
                    budget.spend(await self._handle(message))
                except ValueError:
                    await self._page.connection.close(NOT_UNDERSTOOD, "not understood")
                while budget.is_exceeded or self._shared.window_input.is_full:
                    await asyncio.sleep(_PAUSE_S)
                    budget.refill()

    async def _handle(self, message: str | bytes) -> float:
        """Handle a message; return the number of events that it counts as.

        Raises
        ------
        ValueError
            If the message is invalid.
        """
        if isinstance(message, bytes):
            await self._add_piece(message)
            return EVENTS_PER_PIECE
        checked = events.MESSAGES.validate_json(message)
        if isinstance(checked, events.UploadStarted):
            await self._start_upload(checked)
            return EVENTS_PER_UPLOAD
        handler = self._handlers.get(type(checked))
        if handler is not None:
            handler(checked)
        elif self._is_controlling:
            assert isinstance(checked, events.InputMessage)
            self._shared.window_input.put(checked)
        return 1.0

    @property
    def _is_controlling(self) -> bool:
        return self._page is self._shared.pages.controlling

    def _handle_shown_frame(self, message: events.FrameShown) -> None:
        self._page.confirm_frame(message.number)
        self._shared.delivery.has_work.set()

    def _handle_passed_control(self, message: events.ControlPassed) -> None:
        """Pass control to another page; 0 makes or withdraws a request for control."""
        if message.to == 0:
            self._shared.pages.toggle_request(self._page)
        else:
            self._shared.pages.pass_control(self._page, message.to)

    def _handle_name(self, message: events.NameEntered) -> None:
        self._shared.pages.rename(self._page, message.name)

    def _handle_page(self, message: events.PageChanged) -> None:
        """Adopt the size and the preferences of the page; raise ValueError if it has too many pixels."""
        if message.width * message.height > events.MAX_PAGE_PIXELS:
            raise ValueError("page too large")
        self._page.settings = message
        self._shared.update_sizes()

    # Files from the page.

    async def _start_upload(self, message: events.UploadStarted) -> None:
        """Prepare to receive a file; notify the page if it cannot be opened."""
        problem = "" if self._is_controlling else "Only the page that controls the window can open files."
        try:
            check_name(message.name)
        except TransferError as error:
            problem = problem or str(error)
        if problem:
            self._page.notify(problem)
        self._page.upload = Upload(message.name, message.size, is_rejected=bool(problem))
        await self._finish_upload()

    async def _add_piece(self, piece: bytes) -> None:
        """Add a piece to the current upload; raise ValueError if there is none or the piece is too large."""
        if self._page.upload is None:
            raise ValueError("a piece without a file")
        self._page.upload.add(piece)
        await self._finish_upload()

    async def _finish_upload(self) -> None:
        """Save a file once all of it has arrived, and open it in the window."""
        upload = self._page.upload
        if upload is None or not upload.is_complete:
            return
        self._page.upload = None
        if upload.is_rejected:
            return
        if not self._is_controlling:
            self._page.notify(f"{upload.name}: not opened, another page controls the window now.")
            return
        loop = asyncio.get_running_loop()
        try:
            path = await loop.run_in_executor(self._shared.file_executor, upload.save, self._shared.folder)
        except TransferError as error:
            self._page.notify(str(error))
            report(str(error))
            return
        with suppress(OSError):
            self._shared.uploads[path.name] = path.stat().st_mtime
        self._shared.window_input.put(events.Uploaded(path=str(path)))

    # Messages to the page.

    async def _send_updates(self) -> None:
        """Send state, notices and frames to the page whenever there are new ones."""
        from websockets.exceptions import ConnectionClosed

        page = self._page
        with suppress(ConnectionClosed):
            while True:
                await page.has_updates.wait()
                page.has_updates.clear()
                # Read the frames before the state: then the state is never older than the frames.
                frames = list(page.outbox)
                page.outbox.clear()
                await self._send_state()
                while page.notices:
                    notice = {"kind": "notice", "text": page.notices.popleft()}
                    await self._send(json.dumps(notice))
                for frame in frames:
                    await self._send(frame)

    async def _send_state(self) -> None:
        """Send the state of the window and the list of participants if they have changed."""
        page = self._page
        state = {
            **self._shared.state,
            "kind": "state",
            "participants": self._shared.pages.participants,
            "you": page.number,
            "may_control": page.may_control,
            "shows_map": page.shown_map is not None,
        }
        if page.may_control:
            state["invitation"] = self._shared.invitation
        if not self._is_controlling:
            # Only the controlling page may see the clipboard, and downloads what its user saves.
            state.pop("copied", None)
            state.pop("offer", None)
        if state != page.sent_state:
            page.sent_state = state
            await self._send(json.dumps(state))

    async def _send(self, message: str | bytes) -> None:
        """Send a message; abort the connection if the page does not read it in time."""
        try:
            async with asyncio.timeout(SEND_TIMEOUT_S):
                await self._page.connection.send(message)
        except TimeoutError:
            self._page.connection.transport.abort()
