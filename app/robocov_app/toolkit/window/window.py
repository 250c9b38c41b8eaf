"""A window and its main loop, which handles events and draws a frame if something has changed."""

from pathlib import Path
from time import perf_counter
from typing import Protocol

import pygame
from pygame import Surface

from robocov_app.look.theme import LIGHT
from robocov_app.toolkit.overlay import draw_message
from robocov_app.toolkit.window.display import collect_garbage_rarely
from robocov_app.toolkit.window.exception_guard import ExceptionGuard, RollBack
from robocov_app.toolkit.window.input import clean_event, drop_late_repeats
from robocov_app.toolkit.window.layout import Box
from robocov_app.toolkit.window.mouse_cursor import MouseCursor
from robocov_app.toolkit.window.page_view import MapDrawing, PageAppearance, WindowControls
from robocov_app.toolkit.window.share_link import ShareLink
from robocov_app.toolkit.window.termination import is_ending
from robocov_app.toolkit.window.window_display import WindowDisplay

FPS = 60
"""Frames per second on a screen while something moves."""
IDLE_S = 0.8
"""Time without changes after which the loop waits for events; longer than the delay of tooltips."""
MAX_WAIT_S = 0.2
"""Maximum time between two checks for changes while the loop waits."""
_EVENT_CHECKS_PER_S = 30
"""Number of checks per second for events, which end the wait."""

_RATE_WEIGHT = 0.05
"""Weight of the last frame in the moving average of the frame rate."""
_MAX_RATE = 1000.0


class Remote(Protocol):
    """A place other than the screen where a window is displayed and used.

    Attributes
    ----------
    fps : int
        Frames per second while something moves.
    share_link : ShareLink
        The link with which others open the window.
    """

    fps: int
    share_link: ShareLink

    def offer_file(self, name: str) -> None:
        """Let the user in control download a file of the window's folder."""

    def wait(self, seconds: float) -> None:
        """Wait until a message arrives, at most for the given time."""

    def receive(self, window: "BaseWindow") -> None:
        """Give the window the size and appearance that the display requests, and post its input as events."""

    def send(self, surface: Surface, cursor: int) -> None:
        """Show the current frame and the shape of the cursor (a pygame constant)."""


class BaseWindow:
    """A window that is redrawn while something moves, and otherwise only when something has changed.

    An unexpected exception does not end it. The exception is logged and reported in the window, the changes
    made by the event are reverted, and the loop continues.

    Parameters
    ----------
    size : (width, height), px
    display : WindowDisplay, optional
        Display of another window, which this one temporarily replaces; by default a new window is opened.

    Attributes
    ----------
    display : WindowDisplay
        The surface on which the window is drawn, full screen, and screenshots.
    closed : bool
        Whether the window is closed, which ends the loop.
    replacement : BaseWindow or None
        Window that is temporarily shown and used in its place.
    remote : Remote or None
        Where the window is displayed, if not on the screen.
    map_pictures : MapDrawing or None
        Draws the map alone; None if the window shows no map.
    cursor : MouseCursor
    guard : ExceptionGuard
        Logs and reports unexpected exceptions.
    frame_rate : float
        Mean number of frames per second.
    """

    def __init__(self, size: tuple[int, int], display: WindowDisplay | None = None) -> None:
        """Open a window of the given size, or draw on the display of another one."""
        self.display = display or WindowDisplay(size)
        self.closed = False
        self.replacement: BaseWindow | None = None
        self.remote: Remote | None = None
        self.map_pictures: MapDrawing | None = None
        self._held_keys: set[int] = set()
        self.cursor = MouseCursor()
        self.guard = ExceptionGuard(self._show_exception)
        self.frame_rate = float(FPS)
        self._idle_s = 0.0
        self._had_events = False
        self._drawn_state: object = None

    # Methods that windows override

    def handle_event(self, event: pygame.event.Event) -> None:
        """Handle an event."""

    def update(self, seconds: float) -> None:
        """Advance everything that moves by a time, s."""

    def draw(self) -> None:
        """Draw everything, and show it."""

    def build_frame_key(self) -> object:
        """Return a value that changes whenever the frame must be redrawn; None while something moves."""
        return None

    @property
    def status_text(self) -> str:
        """Text that a screen reader announces when it changes."""
        return ""

    @property
    def controls(self) -> WindowControls | None:
        """State that the buttons of a phone's page show; None if the page has no buttons for this window."""
        return None

    def close(self) -> None:
        """Stop threads and processes that the window has started."""

    def set_appearance(self, appearance: PageAppearance) -> None:
        """Adopt the appearance that suits the browser page that shows the window."""

    def hide_folder(self, folder: Path) -> None:
        """Omit a folder from the paths in messages, because a browser's user cannot open it."""

    def create_save_point(self) -> RollBack:
        """Return a function that reverts all later changes; it is called if handling an event raises."""
        return _revert_nothing

    def report_exception(self, message: str, *, in_drawing: bool) -> None:
        """Show a message about an unexpected exception; close what may have caused it in drawing."""

    # Loop

    def run(self) -> None:
        """Run the window until it is closed or the process has to end."""
        clock = pygame.time.Clock()
        previous_s = perf_counter()
        try:
            with collect_garbage_rarely():
                while not (self.closed or is_ending()):
                    now_s = perf_counter()
                    self.run_frame(now_s - previous_s)
                    previous_s = now_s
                    self._wait(clock, now_s)
        finally:
            self.guard.run("closing", self.close)

    def _wait(self, clock: pygame.time.Clock, frame_start_s: float) -> None:
        """Wait until the next frame is due; while the window is idle, until an event arrives."""
        if self.remote is not None:
            wait_s = 1.0 / self.remote.fps
            if self.is_idle:
                wait_s = MAX_WAIT_S
            self.remote.wait(frame_start_s + wait_s - perf_counter())
            return
        clock.tick(FPS)
        # SDL's own function for this polls a thousand times per second.
        while self.is_idle and perf_counter() - frame_start_s < MAX_WAIT_S and not pygame.event.peek():
            clock.tick(_EVENT_CHECKS_PER_S)

    @property
    def is_idle(self) -> bool:
        """Whether nothing has changed for a while."""
        return self._idle_s >= IDLE_S

    def run_frame(self, seconds: float) -> None:
        """Handle all events, advance by a time, s, and draw the window if something has changed."""
        was_idle = self.is_idle
        self.advance(seconds)
        if self.closed:
            return
        self.guard.run("drawing", lambda: self._draw_if_changed(seconds, was_idle=was_idle))
        remote = self.remote
        if remote is not None:
            self.guard.run("sending a picture", lambda: remote.send(self.screen, self.cursor.shape))

    def _draw_if_changed(self, seconds: float, *, was_idle: bool) -> None:
        """Draw the window unless its visible state is unchanged, and measure how long nothing has changed."""
        window = self.replacement or self
        state = window.build_frame_key()
        if self._had_events or state is None:
            self._idle_s = 0.0
        else:
            self._idle_s += seconds
        is_unchanged = was_idle and self.is_idle and state == self._drawn_state
        if not is_unchanged:
            self._drawn_state = None  # If drawing raises, the next frame draws again.
            window.draw()
        self._drawn_state = state

    def advance(self, seconds: float) -> None:
        """Handle all events that have arrived, and update the window for a time, s."""
        remote = self.remote
        if remote is not None:
            self.guard.run("receiving messages of a page", lambda: remote.receive(self))
        events = drop_late_repeats(pygame.event.get(), self._held_keys)
        self._had_events = bool(events)
        for event in events:
            if event.type in (pygame.VIDEORESIZE, pygame.WINDOWSIZECHANGED):
                self.display.adopt_size()
            self._handle_safely(event)
        if self.closed:
            return
        if seconds > 0 and not self.is_idle:
            self.frame_rate += _RATE_WEIGHT * (min(1.0 / seconds, _MAX_RATE) - self.frame_rate)
        window = self.replacement or self
        self.guard.run("updating", lambda: self.update(seconds), create_save_point=window.create_save_point)

    # Exceptions

    def _handle_safely(self, event: pygame.event.Event) -> None:
        """Handle an event, and revert its changes if it raises; closing the window always succeeds."""
        cleaned_event = clean_event(event)
        if cleaned_event is None:
            return
        window = self.replacement or self
        succeeded = self.guard.run(
            f"handling {pygame.event.event_name(event.type)}",
            lambda: window.handle_event(cleaned_event),
            create_save_point=window.create_save_point,
        )
        if event.type == pygame.QUIT and not succeeded:
            self.closed = True  # Drafts are kept.

    def _show_exception(self, message: str, action: str) -> None:
        """Show a message about an exception, over the incomplete frame if it was raised while drawing."""
        in_drawing = action == "drawing"
        (self.replacement or self).report_exception(message, in_drawing=in_drawing)
        if in_drawing:
            width, height = self.screen.get_size()
            draw_message(self.screen, message, Box(0, 0, width, height), LIGHT, 1.0, is_error=True)
            self.display.show()

    # Display

    @property
    def screen(self) -> Surface:
        """Surface on which the window is drawn."""
        return self.display.surface

    def toggle_fullscreen(self) -> None:
        """Switch to full screen, or back to the previous size.

        In a browser, nothing happens: the window has the size of the page, and the browser has a full-screen
        mode of its own.
        """
        if self.remote is None:
            self.display.toggle_fullscreen()


def _revert_nothing() -> None:
    pass
