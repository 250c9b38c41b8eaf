"""Delivery of the newest frame to each page that is ready for it."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from time import monotonic
from typing import NamedTuple

from robocov_app.web.frames import BaseFrames, Frame, encode_frame
from robocov_app.web.map_frames import MapFrames
from robocov_app.web.pages import Page, Pages

SERVED_FPS = 60
"""Frames per second of a served window while something moves."""
MAX_INDIVIDUAL_PAGES = 3
"""With at most this many other pages, each gets every frame that it can show."""
SHARED_FRAME_INTERVAL_S = 1 / 15
"""Time between frames if there are more pages. They share frames, which are encoded only once."""
_MIN_TIMEOUT_S = 0.001


class _Delivery(NamedTuple):
    """A frame, and the page to which it is sent next."""

    page: Page
    frame: Frame


class FrameDelivery:
    """Encodes and queues frames; the controlling page and the other pages take turns.

    Parameters
    ----------
    pages : Pages

    Attributes
    ----------
    newest : Frame or None
        The newest frame of the window; set by the window's thread.
    maps : MapFrames
        The map in the sizes of the pages that show it instead of the window.
    has_work : asyncio.Event
        Set when there is a newer frame, or when a page has connected, disconnected, or shown a frame.
    bases : BaseFrames
        Frames that pages show now; only the differences of newer frames from them are sent.
    """

    def __init__(self, pages: Pages) -> None:
        self.newest: Frame | None = None
        self.maps = MapFrames()
        self.has_work = asyncio.Event()
        self.bases = BaseFrames()
        self._pages = pages
        self._shared_frame: Frame | None = None
        self._next_shared_time = 0.0
        self._controlling_was_last = False
        self._encoder = ThreadPoolExecutor(1, thread_name_prefix="web-encoder")

    async def run(self) -> None:
        """Deliver frames until the task is canceled."""
        while True:
            self.has_work.clear()
            self._switch_pages()
            delivery = self._choose_delivery()
            if delivery is None:
                await self._wait_for_work()
            else:
                await self._deliver(delivery.page, delivery.frame)
            self.bases.keep_only({page.base_number for page in self._pages})

    def close(self) -> None:
        """End the thread that encodes frames."""
        self._encoder.shutdown(wait=False, cancel_futures=True)

    def _choose_delivery(self) -> _Delivery | None:
        """Return the next frame to send, and the page that gets it; None if no page is ready.

        The controlling page and the others take turns. Among the others, the page that shows the oldest frame
        comes first.
        """
        controlling = self._pages.controlling
        to_controlling: _Delivery | None = None
        if controlling is not None:
            newest = self._find_frame(controlling)
            if newest is not None and controlling.is_ready_for(newest):
                to_controlling = _Delivery(controlling, newest)
        if to_controlling is not None and not self._controlling_was_last:
            return to_controlling
        watching = [page for page in self._pages if page is not controlling]
        self._update_shared_frame(sum(page.shown_map is None for page in watching))
        for page in sorted(watching, key=lambda page: page.base_number):
            frame = self._find_frame(page)
            if frame is not None and page.is_ready_for(frame):
                return _Delivery(page, frame)
        return to_controlling

    def _switch_pages(self) -> None:
        """Switch pages between the map and the window, whose frames are not based on each other."""
        for page in self._pages:
            shown_map = page.map_size if page.map_size in self.maps.frames else None
            if shown_map != page.shown_map:
                page.shown_map = shown_map
                page.base_number = 0
                page.has_updates.set()

    def _find_frame(self, page: Page) -> Frame | None:
        """Return the newest frame of the map in a page's size, or of the window; None before the first."""
        if page.shown_map is not None:
            return self.maps.frames.get(page.shown_map)
        if page is self._pages.controlling:
            return self.newest
        return self._shared_frame

    def _update_shared_frame(self, page_count: int) -> None:
        """Update the frame for the other pages; with many of them, only every `SHARED_FRAME_INTERVAL_S`."""
        if page_count > MAX_INDIVIDUAL_PAGES and monotonic() < self._next_shared_time:
            return
        if self.newest is not self._shared_frame:
            self._next_shared_time = monotonic() + SHARED_FRAME_INTERVAL_S
        self._shared_frame = self.newest

    async def _deliver(self, page: Page, frame: Frame) -> None:
        """Encode a frame for a page, and queue it for all pages that now show the same frame as that page."""
        base_number = page.base_number
        shown_map = page.shown_map
        base = self.bases.get(base_number)
        loop = asyncio.get_running_loop()
        message = await loop.run_in_executor(self._encoder, encode_frame, frame, base)
        self.bases.add(frame)
        controlling = self._pages.controlling
        self._controlling_was_last = page is controlling
        for receiver in self._pages:
            # The controlling page only gets frames on its own turn; those of other pages may be older.
            is_due = receiver is page or receiver is not controlling
            has_same_base = receiver.base_number == base_number and receiver.shown_map == shown_map
            if has_same_base and is_due and receiver.is_ready_for(frame):
                receiver.add_frame(frame.number, message)

    async def _wait_for_work(self) -> None:
        """Wait until there is something to do, or until the next frame for the other pages is due."""
        timeout = None
        if self._shared_frame is not self.newest and len(self._pages) > 1:
            timeout = max(self._next_shared_time - monotonic(), _MIN_TIMEOUT_S)
        with suppress(TimeoutError):
            async with asyncio.timeout(timeout):
                await self.has_work.wait()
