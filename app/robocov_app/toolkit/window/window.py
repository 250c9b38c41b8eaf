"""A window and its main loop, which handles events and draws a frame if something has changed."""

from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from time import perf_counter
from typing import Protocol

import pygame
from pygame import Surface

from robocov.files.writing import replace_file
from robocov_app.look.theme import LIGHT
from robocov_app.terminal.output import find_free_path
from robocov_app.toolkit.overlay import draw_message
from robocov_app.toolkit.window.display import collect_garbage_rarely, open_window
from robocov_app.toolkit.window.exceptions import ExceptionLog
from robocov_app.toolkit.window.input import clean_event, drop_late_repeats
from robocov_app.toolkit.window.layout import Box
from robocov_app.toolkit.window.mouse_cursor import MouseCursor
from robocov_app.toolkit.window.termination import is_ending

FPS = 60
"""Frames per second on a screen while something moves."""
IDLE_S = 0.8
"""Time without changes after which the loop waits for events; longer than the delay of tool tips."""
MAX_WAIT_S = 0.1
"""Maximum time between two checks for changes while the loop waits."""

_MIN_SURFACE_PX = (320, 240)
"""Minimum size of the surface that is drawn, however small the window is."""
_MAX_CONSECUTIVE_EXCEPTIONS = 5
"""Number of consecutive exceptions of an action after which it is tried only every `_RETRY_S` seconds."""
_RETRY_S = 1.0
_RATE_WEIGHT = 0.05
"""Weight of the last frame in the moving average of the frame rate."""
_MAX_RATE = 1000.0

RollBack = Callable[[], None]
"""A function that reverts all changes since it was created."""


class Remote(Protocol):
    """A place other than the screen where a window is displayed and used.

    Attributes
    ----------
    fps : int
        Frames per second while something moves.
    """

    fps: int

    @property
    def share_link(self) -> str:
        """Address at which others can watch the window; empty if there is none."""

    def offer_file(self, name: str) -> None:
        """Let the user in control download a file of the window's folder."""

    def wait(self, seconds: float) -> None:
        """Wait until a message arrives, at most for the given time."""

    def receive(self, window: "BaseWindow") -> None:
        """Give the window the size and appearance requested there, and post the input as events."""

    def send(self, surface: Surface, cursor: int) -> None:
        """Show the current frame and the shape of the cursor (a pygame constant)."""


@dataclass(frozen=True)
class WindowControls:
    """State of a window that the buttons of a phone's page show.

    Attributes
    ----------
    theme : str
        ``light`` or ``dark``.
    is_compact : bool
        Whether the window leaves its buttons to the page.
    is_playing : bool
    can_undo : bool
    tool : str
        Name of the tool in use.
    lesson : str
        ``shown`` while a lesson is shown, ``left`` while the user has taken over from it, or else empty.
    has_panel : bool
        Whether the panel is open.
    is_typing : bool
        Whether typed text goes to a text field.
    scroll_box : Box or None
        Part of the window that a vertical drag of a finger scrolls.
    """

    theme: str
    is_compact: bool
    is_playing: bool
    can_undo: bool
    tool: str
    lesson: str
    has_panel: bool
    is_typing: bool
    scroll_box: Box | None


class MapDrawing(Protocol):
    """Draws the map of a window without its controls, for small screens."""

    def draw(self, size: tuple[int, int], scale: float) -> Surface | None:
        """Draw the map.

        Parameters
        ----------
        size : (width, height), px
        scale : float
            Size of texts and symbols.

        Returns
        -------
        pygame.Surface or None
            None if the window itself must be seen now, because it shows a dialog, for example.
        """

    def find_window_pixel(self, size: tuple[int, int], pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the pixel of the window that shows the same point of the map.

        Parameters
        ----------
        size : (width, height), px
            Size of a picture that `draw` has returned.
        pixel : (x, y)
            Pixel of that picture.

        Returns
        -------
        (x, y)
        """


class BaseWindow:
    """A window that is redrawn while something moves, and otherwise only when something has changed.

    An unexpected exception does not end it. The exception is logged by `exceptions` and reported in the
    window, the changes made by the event are reverted, and the loop continues.

    Parameters
    ----------
    size : (width, height), px
    screen : pygame.Surface, optional
        Surface to draw on; by default a new window is opened.

    Attributes
    ----------
    catches_exceptions : bool
        Whether unexpected exceptions are reported instead of raised. Tests set it to False.
    screen : pygame.Surface
        Surface on which the window is drawn.
    windowed_size : tuple of int or None
        Size before full screen, px; None if the window does not fill the screen.
    closed : bool
        Whether the window is closed, which ends the loop.
    replacement : BaseWindow or None
        Window that is temporarily shown and used in its place.
    remote : Remote or None
        Where the window is displayed, if not on the screen.
    map_pictures : MapDrawing or None
        Draws the map alone; None if the window shows no map.
    cursor : MouseCursor
    exceptions : ExceptionLog
    frame_rate : float
        Mean number of frames per second.
    """

    catches_exceptions = True

    def __init__(self, size: tuple[int, int], screen: Surface | None = None) -> None:
        """Open a window of the given size, or draw on an existing surface."""
        self.screen = screen or open_window(size)
        self.windowed_size: tuple[int, int] | None = None
        self.closed = False
        self.replacement: BaseWindow | None = None
        self.remote: Remote | None = None
        self.map_pictures: MapDrawing | None = None
        self._held_keys: set[int] = set()
        self.cursor = MouseCursor()
        self.exceptions = ExceptionLog()
        self.frame_rate = float(FPS)
        self._exception_counts: dict[str, int] = {}
        self._retry_at_s: dict[str, float] = {}
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

    def set_appearance(self, scale: float, theme: str, *, panel: bool | None) -> None:
        """Adopt the appearance that suits the display of a `Remote`.

        Parameters
        ----------
        scale : float
            Size of texts and widgets.
        theme : str
        panel : bool or None
            Whether the panel is shown; None to leave it as it is.
        """

    def set_compact(self, *, is_compact: bool) -> None:
        """Leave the buttons of the bar and of the rail to the page of a phone, or show them again."""

    def reduce_motion(self, *, is_reduced: bool) -> None:
        """Adopt the setting of the user's system for reduced motion."""

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
            self._run_safely("closing", self.close)

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
            clock.tick(FPS)

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
        self._run_safely("drawing", lambda: self._draw_if_changed(seconds, was_idle=was_idle))
        remote = self.remote
        if remote is not None:
            self._run_safely("sending a picture", lambda: remote.send(self.screen, self.cursor.shape))

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
            self._run_safely("receiving messages of a page", lambda: remote.receive(self))
        events = drop_late_repeats(pygame.event.get(), self._held_keys)
        self._had_events = bool(events)
        for event in events:
            if event.type in (pygame.VIDEORESIZE, pygame.WINDOWSIZECHANGED):
                self.adopt_display()
            self._handle_safely(event)
        if self.closed:
            return
        if seconds > 0 and not self.is_idle:
            self.frame_rate += _RATE_WEIGHT * (min(1.0 / seconds, _MAX_RATE) - self.frame_rate)
        window = self.replacement or self
        self._run_safely("updating", lambda: self.update(seconds), create_save_point=window.create_save_point)

    # Exceptions

    def _handle_safely(self, event: pygame.event.Event) -> None:
        """Handle an event, and revert its changes if it raises; closing the window always succeeds."""
        cleaned_event = clean_event(event)
        if cleaned_event is None:
            return
        window = self.replacement or self
        succeeded = self._run_safely(
            f"handling {pygame.event.event_name(event.type)}",
            lambda: window.handle_event(cleaned_event),
            create_save_point=window.create_save_point,
        )
        if event.type == pygame.QUIT and not succeeded:
            self.closed = True  # Drafts are kept.

    def _run_safely(
        self,
        action: str,
        call: Callable[[], object],
        *,
        create_save_point: Callable[[], RollBack] | None = None,
    ) -> bool:
        """Run one part of a frame; log and report any exception, and revert the changes made before it.

        An action that keeps failing is tried only occasionally, so that the window stays usable. MemoryError,
        and any exception after the display was closed, is raised.

        Returns
        -------
        bool
            Whether the call succeeded.
        """
        if perf_counter() < self._retry_at_s.get(action, 0.0):
            return False
        if not self.catches_exceptions:
            call()
            return True
        roll_back: RollBack | None = None
        try:
            if create_save_point is not None:
                roll_back = create_save_point()
            call()
        except MemoryError:
            raise
        except Exception as error:
            if not pygame.display.get_init():
                raise
            self._handle_exception(error, action, roll_back)
            return False
        self._exception_counts.pop(action, None)
        self._retry_at_s.pop(action, None)
        return True

    def _handle_exception(self, error: Exception, action: str, roll_back: RollBack | None) -> None:
        """Log an exception, revert the changes before it, and report it in the window."""
        count = self._exception_counts.get(action, 0) + 1
        self._exception_counts[action] = count
        if count >= _MAX_CONSECUTIVE_EXCEPTIONS:
            self._retry_at_s[action] = perf_counter() + _RETRY_S
        message = self.exceptions.record(error, action)
        if roll_back is not None and self.exceptions.attempt("undoing an action", roll_back):
            message += " The action was undone."
        message += " Save your work."
        self.exceptions.attempt("reporting an error", lambda: self._show_exception(message, action))

    def _show_exception(self, message: str, action: str) -> None:
        """Show a message about an exception, over the incomplete frame if it was raised while drawing."""
        in_drawing = action == "drawing"
        (self.replacement or self).report_exception(message, in_drawing=in_drawing)
        if in_drawing:
            width, height = self.screen.get_size()
            draw_message(self.screen, message, Box(0, 0, width, height), LIGHT, 1.0, is_error=True)
            self.show_screen()

    # Display

    def adopt_display(self) -> None:
        """Draw on the display from now on; if it is tiny, on a larger surface that is partly shown.

        Tiling window managers may make a window as small as one pixel, for which there is no layout.
        """
        display = pygame.display.get_surface()
        if display is None:
            return
        width, height = display.get_size()
        min_width, min_height = _MIN_SURFACE_PX
        if width < min_width or height < min_height:
            self.screen = Surface((max(width, min_width), max(height, min_height)), 0, 32)
        else:
            self.screen = display

    def show_screen(self) -> None:
        """Show the frame that was drawn."""
        display = pygame.display.get_surface()
        if display is not None and display is not self.screen:
            display.blit(self.screen, (0, 0))
        pygame.display.flip()

    def toggle_fullscreen(self) -> None:
        """Switch to full screen, or back to the previous size."""
        if self.remote is not None:
            # The window has the size of a browser page, and the browser has a full-screen mode of its own.
            return
        # pygame.display.toggle_fullscreen keeps the size, so the rest of the screen would be black.
        size = self.windowed_size
        if size is None:
            self.windowed_size = self.screen.get_size()
            self.screen = pygame.display.set_mode((0, 0), pygame.FULLSCREEN)
        else:
            self.windowed_size = None
            self.screen = open_window(size)

    def save_screenshot(self, folder: Path) -> str:
        """Write the current frame to a new PNG file in a folder, and return a message."""
        target = find_free_path(folder, "robocov", ".png")
        image = BytesIO()
        pygame.image.save(self.screen, image, ".png")
        with replace_file(target) as part:
            part.write_bytes(image.getvalue())
        return f"screenshot saved: {target}"


def _revert_nothing() -> None:
    pass
