"""The browser pages that show a window, and which of them controls it."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import log, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

from robocov.errors import RobocovError

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

    from robocov_app.web.events import PageChanged
    from robocov_app.web.files import Upload
    from robocov_app.web.frames import Frame

MAX_VIEWERS = 100
"""Maximum number of pages opened with the watch link."""
MAX_CONTROL_PAGES = 16
"""Maximum number of pages opened with the control link. If one more is opened, the oldest is closed."""
MAX_MAP_SIZES = 3
"""Maximum number of sizes in which the map is drawn for pages, in addition to that of the controlling page.

Other pages scale one of these pictures.
"""
MAX_MAP_PIXELS = 1_000_000
"""Maximum number of pixels of the map that is drawn for a page."""
MAX_ASPECT_RATIO = 1.2
"""A page whose aspect differs from that of the window by more than this factor shows the map instead."""
MAX_SHRINKAGE = 1.6
"""A page that would shrink the window by more than this factor also shows the map instead."""
MAX_NOTICES = 8
"""Maximum number of notices waiting to be sent to a page."""
MAX_FRAMES_IN_FLIGHT = 2
"""Maximum number of frames that were sent to a page but not shown yet."""


class MapSize(NamedTuple):
    """Size in which the map is drawn for a page that shows it instead of the window.

    Attributes
    ----------
    width, height : int, px
    scale : float
        Size of texts and symbols.
    is_controlling : bool
        Whether the page controls the window. It shows buttons, and a dialog that covers the map.
    """

    width: int
    height: int
    scale: float
    is_controlling: bool = False


class TooManyPagesError(RobocovError):
    """The maximum number of pages is open; the message is shown in the page."""


@dataclass(eq=False)
class Page:
    """A browser page that shows the window.

    Attributes
    ----------
    connection : ServerConnection
    number : int
        Number of the page, by which messages refer to it.
    may_control : bool
        Whether it was opened with the control link, so that it may take control at any time.
    name : str
        Name that other pages show.
    page_id : str
        Identity of the page, which it keeps when it reconnects.
    requests_control : bool
        Whether its user has asked for control.
    settings : PageChanged or None
        Its size and color scheme, once it has reported them.
    map_size : MapSize or None
        Size of the map that it should show instead of the window, which does not suit its screen.
    shown_map : MapSize or None
        Size of the map that it shows; None while it shows the window.
    upload : Upload or None
        The file that it is sending.
    base_number : int
        Number of the newest frame that was queued for it, on which the next one is based; 0 for none.
    in_flight : deque of int
        Numbers of the frames that were queued or sent but not shown yet, modulo 2**32.
    outbox : deque of bytes
        Encoded frames waiting to be sent.
    notices : deque of str
        Messages to the user waiting to be sent.
    sent_state : dict
        State of the window that was last sent to it.
    has_updates : asyncio.Event
        Set when there is something to send.
    """

    connection: ServerConnection
    number: int
    may_control: bool
    name: str
    page_id: str
    requests_control: bool = False
    settings: PageChanged | None = None
    map_size: MapSize | None = None
    shown_map: MapSize | None = None
    upload: Upload | None = None
    base_number: int = 0
    in_flight: deque[int] = field(default_factory=deque)
    outbox: deque[bytes] = field(default_factory=deque)
    notices: deque[str] = field(default_factory=lambda: deque(maxlen=MAX_NOTICES))
    sent_state: dict[str, Any] = field(default_factory=dict)
    has_updates: asyncio.Event = field(default_factory=asyncio.Event)

    def is_ready_for(self, frame: Frame | None) -> bool:
        """Return whether a frame is newer than the page's frame, and not too many frames are on their way."""
        if frame is None or len(self.in_flight) >= MAX_FRAMES_IN_FLIGHT:
            return False
        return self.base_number < frame.number

    def add_frame(self, number: int, message: bytes) -> None:
        """Queue an encoded frame."""
        self.base_number = number
        self.in_flight.append(number % 2**32)
        self.outbox.append(message)
        self.has_updates.set()

    def confirm_frame(self, number: int) -> None:
        """Remove a frame that the page has shown, and all earlier ones, from `in_flight`."""
        while self.in_flight and self.in_flight.popleft() != number:
            pass

    def notify(self, notice: str) -> None:
        """Queue a message for the page."""
        self.notices.append(notice)
        self.has_updates.set()


class Pages:
    """The pages that show a window. One page at a time controls it: initially, the first page that may.

    Parameters
    ----------
    on_control_change : callable
        Called with the previously controlling page and the new one; either may be None.

    Attributes
    ----------
    controlling : Page or None
        The page that controls the window.
    participants : list of dict
        Number, name, and control state of each page, for the list in the pages.
    """

    def __init__(self, on_control_change: Callable[[Page | None, Page | None], None]) -> None:
        self.controlling: Page | None = None
        self.participants: list[dict[str, Any]] = []
        self._on_control_change = on_control_change
        self._window_settings: PageChanged | None = None  # of the page to which the window was last fitted
        self._pages: list[Page] = []

    def __iter__(self) -> Iterator[Page]:
        return iter(self._pages)

    def __len__(self) -> int:
        return len(self._pages)

    def open(self, connection: ServerConnection, *, may_control: bool, page_id: str) -> Page:
        """Add the page of a new connection.

        If the same page is still listed because its earlier connection broke unnoticed, it keeps its number,
        name and role.

        Parameters
        ----------
        connection : ServerConnection
        may_control : bool
            Whether it was opened with the control link.
        page_id : str
            Identity of the page; empty if it has none.

        Returns
        -------
        Page

        Raises
        ------
        TooManyPagesError
            If all places for viewers are taken.
        """
        earlier = self._find(page_id, may_control=may_control)
        if earlier is None and not may_control and self._count_viewers() >= MAX_VIEWERS:
            raise TooManyPagesError(f"All {MAX_VIEWERS} places for viewers are taken. Trying again …")
        number = self._find_free_number()
        role = "Teacher" if may_control else "Viewer"
        page = Page(connection, number, may_control, f"{role} {number}", page_id)
        self._pages.append(page)
        if earlier is not None:
            self._replace(earlier, page)
        self.give_control(self.controlling)
        return page

    def close(self, page: Page) -> None:
        """Remove a page whose connection has ended; if it had control, the first page that may gets it."""
        if page in self._pages:
            self._pages.remove(page)
        self.give_control(self.controlling)

    def remove_surplus_control_page(self) -> Page | None:
        """Remove the oldest page without control if too many pages may take control.

        Returns
        -------
        Page or None
            The removed page, whose connection is still open.
        """
        control_pages = [page for page in self._pages if page.may_control]
        if len(control_pages) <= MAX_CONTROL_PAGES:
            return None
        oldest = next(page for page in control_pages if page is not self.controlling)
        self._pages.remove(oldest)
        self.give_control(self.controlling)
        return oldest

    def rename(self, page: Page, name: str) -> None:
        """Set the name of a page, unless it is blank."""
        printable = "".join(filter(str.isprintable, name)).strip()
        page.name = printable or page.name
        self._update_participants()

    def toggle_request(self, page: Page) -> None:
        """Record that a page requests control, or withdraws its request."""
        page.requests_control = not page.requests_control and page is not self.controlling
        self._update_participants()

    def pass_control(self, page: Page, number: int) -> None:
        """Give control to the page with a number, if the requesting `page` is allowed to."""
        if page is not self.controlling and not page.may_control:
            return
        receivers = (other for other in self._pages if other.number == number)
        self.give_control(next(receivers, self.controlling))

    def give_control(self, page: Page | None) -> None:
        """Give control to a page; if it is None or gone, to the first page that may have it."""
        if page not in self._pages:
            page = next((other for other in self._pages if other.may_control), None)
        if page is not self.controlling:
            previous = self.controlling
            self.controlling = page
            if page is not None:
                page.requests_control = False
            self._on_control_change(previous, page)
        self._update_participants()

    @property
    def display_settings(self) -> PageChanged | None:
        """Size and color scheme that the window adopts; None until the controlling page has reported its own.

        The controlling page determines them, with one exception: a phone must not shrink the window that a
        class sees on a projector. While a wide page is open, a controlling phone shows the map alone.
        """
        controlling = self.controlling
        if controlling is None or controlling.settings is None:
            return None
        wide = [page for page in self._pages if page.settings is not None and not page.settings.is_small]
        if not controlling.settings.is_small or not wide:
            return controlling.settings
        # Prefer pages that may control: they are more likely on the projector.
        return min(wide, key=lambda page: (not page.may_control, page.number)).settings

    def update_map_sizes(self) -> None:
        """Choose in which size each page shows the map; None for pages that show the window."""
        self._window_settings = self.display_settings or self._window_settings
        window = self._window_settings
        sizes: list[MapSize] = []
        for page in self._pages:
            page.map_size = None
            if window is None or page.settings is None or page.settings is window:
                continue
            if not _needs_own_picture(page.settings, window):
                continue
            if page is self.controlling:
                page.map_size = _compute_map_size(page.settings)._replace(is_controlling=True)
            else:
                page.map_size = _choose_map_size(page.settings, sizes)

    def wake(self) -> None:
        """Wake the senders of all pages, so that they send the changes."""
        for page in self._pages:
            page.has_updates.set()

    def _find(self, page_id: str, *, may_control: bool) -> Page | None:
        """Return the page with an identity that was opened with the same link; None if there is none."""
        for page in self._pages:
            if page_id and page.page_id == page_id and page.may_control == may_control:
                return page
        return None

    def _find_free_number(self) -> int:
        """Return the lowest unused number, so that a page usually keeps its number when it is reloaded."""
        used = {page.number for page in self._pages}
        number = 1
        while number in used:
            number += 1
        return number

    def _count_viewers(self) -> int:
        return sum(not page.may_control for page in self._pages)

    def _replace(self, earlier: Page, page: Page) -> None:
        """Pass number, name and control to a page from its earlier connection, and abort that one."""
        page.number = earlier.number
        page.name = earlier.name
        page.requests_control = earlier.requests_control
        had_control = earlier is self.controlling
        self._pages.remove(earlier)
        if had_control:
            self.give_control(page)
        earlier.connection.transport.abort()

    def _update_participants(self) -> None:
        """Rebuild `participants`, and wake the senders of all pages."""
        self.participants = [
            {
                "number": page.number,
                "name": page.name,
                "requests_control": page.requests_control,
                "controls": page is self.controlling,
            }
            for page in self._pages
        ]
        self.wake()


def _needs_own_picture(settings: PageChanged, window: PageChanged) -> bool:
    """Return whether a page shows the map in its own size, because the window does not suit its screen.

    Parameters
    ----------
    settings : PageChanged
        Size of the page.
    window : PageChanged
        Size of the page that determines the size of the window.
    """
    aspect_ratio = (settings.width / settings.height) / (window.width / window.height)
    if max(aspect_ratio, 1 / aspect_ratio) > MAX_ASPECT_RATIO:
        return True
    # Both widths are in CSS pixels, in which texts have the same size on all screens.
    shrinkage = (window.width / window.ratio) / (settings.width / settings.ratio)
    return shrinkage > MAX_SHRINKAGE


def _choose_map_size(settings: PageChanged, sizes: list[MapSize]) -> MapSize:
    """Return the map size for a page.

    A new size is added to `sizes`, up to `MAX_MAP_SIZES`; beyond that, the size with the closest aspect ratio
    is returned.
    """
    size = _compute_map_size(settings)
    if size in sizes:
        return size
    if len(sizes) < MAX_MAP_SIZES:
        sizes.append(size)
        return size
    aspect_ratio = size.width / size.height
    return min(sizes, key=lambda other: abs(log(other.width / other.height / aspect_ratio)))


def _compute_map_size(settings: PageChanged) -> MapSize:
    """Return the size of a page, reduced to `MAX_MAP_PIXELS`."""
    shrinkage = min(1.0, sqrt(MAX_MAP_PIXELS / (settings.width * settings.height)))
    width = round(shrinkage * settings.width)
    height = round(shrinkage * settings.height)
    return MapSize(width, height, shrinkage * settings.ratio)
