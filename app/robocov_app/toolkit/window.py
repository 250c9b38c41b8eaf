"""A window and its loop: display, size and scale; events in, and a picture where something is different."""

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from time import perf_counter
from typing import Protocol

import pygame
from pygame import Surface

from robocov.files.writing import replace_file
from robocov_app.look.theme import LIGHT
from robocov_app.terminal.output import find_free_path
from robocov_app.toolkit.display import collect_garbage_rarely, open_window
from robocov_app.toolkit.faults import FaultLog
from robocov_app.toolkit.input import clean_event
from robocov_app.toolkit.overlay import draw_message
from robocov_app.toolkit.termination import is_ending

FPS = 60  # frames per second while something moves
CALM = 0.8  # seconds of peace after which the loop waits for events; tool tips appear earlier
PAUSE = 0.1  # seconds between two looks for something new, at most, while it waits
_LEAST_SIZE = (320, 240)  # pixels, of what is drawn, however small the window is
_MAX_FAULTS_IN_A_ROW = 5  # of updating or drawing; after that it is tried again only now and then:
_RETRY_S = 1.0


class Remote(Protocol):
    """Another place than a screen where a window is seen and touched."""

    def wait(self, seconds: float) -> None:
        """Wait until something comes in, and so many seconds at most."""

    def receive(self, window: "BaseWindow") -> None:
        """Give the window the size and look that are wanted there, and post what was done there."""

    def send(self, surface: Surface) -> None:
        """Show what is in the window now."""


class BaseWindow:
    """A window that is drawn while something moves, and otherwise only when something is different.

    An unexpected exception never ends it. It is logged by `faults` and reported in the window, what an event
    has half changed is taken back, and the loop goes on.
    """

    contains_faults = True  # tests set it to False on their windows, to see what is raised

    def __init__(self, size: tuple[int, int], screen: Surface | None = None) -> None:
        self.screen = screen or open_window(size)
        self.windowed: tuple[int, int] | None = None  # the size before full screen
        self.closed = False
        self.inner: BaseWindow | None = None  # one that is shown in its place for a while
        self.remote: Remote | None = None
        self.faults = FaultLog()
        self._faults_in_a_row: dict[str, int] = {}
        self._retry_at: dict[str, float] = {}
        self.rate, self._calm, self._touched = float(FPS), 0.0, False
        self._drawn: object = None

    def take(self, event: pygame.event.Event) -> None:
        """Take one event."""

    def update(self, seconds: float) -> None:
        """Let so many seconds pass."""

    def draw(self) -> None:
        """Draw everything, and show it."""

    def look(self) -> object:
        """Return all that changes the picture without an event; None while something moves."""
        return None

    def close(self) -> None:
        """End what is going on beside the window."""

    def suit(self, scale: float, theme: str, *, panel: bool | None) -> None:
        """Take the look of where the window is shown; `panel`: to show or hide it, None to leave it."""

    def save_point(self) -> Callable[[], None]:
        """Return a function that takes back all changes since now; it is called if an event raises."""
        return lambda: None

    def report_fault(self, message: str, *, in_drawing: bool) -> None:
        """Show a message on an unexpected exception; if drawing raised it, close what may be the cause."""

    def run(self) -> None:
        clock, before = pygame.time.Clock(), perf_counter()
        try:
            with collect_garbage_rarely():
                while not (self.closed or is_ending()):
                    now = perf_counter()
                    self.frame(now - before)
                    before = now
                    if self.remote is not None:
                        self.remote.wait(now + (PAUSE if self.resting else 1.0 / FPS) - perf_counter())
                        continue
                    clock.tick(FPS)
                    # SDL's own way to wait for events looks for them a thousand times a second
                    while self.resting and perf_counter() - now < PAUSE and not pygame.event.peek():
                        clock.tick(FPS)
        finally:
            self._run_contained("closing", self.close)

    @property
    def resting(self) -> bool:
        return self._calm >= CALM

    def frame(self, seconds: float) -> None:
        rested = self.resting
        self.advance(seconds)
        if self.closed:
            return
        self._run_contained("drawing", lambda: self._draw_if_changed(seconds, rested=rested))
        if self.remote is not None:
            remote = self.remote
            self._run_contained("sending a picture", lambda: remote.send(self.screen))

    def _draw_if_changed(self, seconds: float, *, rested: bool) -> None:
        shown = self.inner or self
        look = shown.look()
        self._calm = 0.0 if self._touched or look is None else self._calm + seconds
        if not (rested and self.resting and look == self._drawn):
            self._drawn = None  # if drawing fails, it is done again
            shown.draw()
        self._drawn = look

    def advance(self, seconds: float) -> None:
        """Take all events that have come, and let `seconds` pass."""
        if self.remote is not None:
            remote = self.remote
            self._run_contained("taking messages of a page", lambda: remote.receive(self))
        events = pygame.event.get()
        self._touched = bool(events)
        for event in events:
            if event.type in (pygame.VIDEORESIZE, pygame.WINDOWSIZECHANGED):
                self.adopt_display()
            self._take_safely(event)
        if self.closed:
            return
        if seconds > 0 and not self.resting:
            self.rate += 0.05 * (min(1.0 / seconds, 1000.0) - self.rate)
        self._run_contained("updating", lambda: self.update(seconds), save_point=self._save_point_of_update)

    def _take_safely(self, event: pygame.event.Event) -> None:
        cleaned = clean_event(event)
        if cleaned is None:
            return
        target = self.inner or self
        action = f"handling {pygame.event.event_name(event.type)}"
        succeeded = self._run_contained(action, lambda: target.take(cleaned), save_point=target.save_point)
        if event.type == pygame.QUIT and not succeeded:
            self.closed = True  # the draft stays

    def _save_point_of_update(self) -> Callable[[], None]:
        return (self.inner or self).save_point()

    def _run_contained(
        self,
        action: str,
        call: Callable[[], object],
        *,
        save_point: Callable[[], Callable[[], None]] | None = None,
    ) -> bool:
        """Do one part of a frame; log and report what it raises, and take back what it has half changed.

        What fails again and again is done only now and then, so that the window stays usable. Running out of
        memory, and the end of the display, are passed on.

        Returns
        -------
        bool
            Whether it was done.
        """
        if perf_counter() < self._retry_at.get(action, 0.0):
            return False
        if not self.contains_faults:
            call()
            return True
        take_back: Callable[[], None] | None = None
        try:
            take_back = save_point() if save_point is not None else None
            call()
        except MemoryError:
            raise
        except Exception as error:
            if not pygame.display.get_init():
                raise
            self._handle_fault(error, action, take_back)
            return False
        self._faults_in_a_row.pop(action, None)
        self._retry_at.pop(action, None)
        return True

    def _handle_fault(self, error: Exception, action: str, take_back: Callable[[], None] | None) -> None:
        count = self._faults_in_a_row.get(action, 0) + 1
        self._faults_in_a_row[action] = count
        if count >= _MAX_FAULTS_IN_A_ROW:
            self._retry_at[action] = perf_counter() + _RETRY_S
        message = self.faults.record(error, action)
        if take_back is not None:
            try:
                take_back()
                message += " The action was taken back."
            except Exception as another:
                self.faults.record(another, "taking an action back")
        message += " Save your work."
        in_drawing = action == "drawing"
        try:
            (self.inner or self).report_fault(message, in_drawing=in_drawing)
            if in_drawing:
                self._draw_fault(message)
        except Exception as another:
            self.faults.record(another, "reporting an error")

    def _draw_fault(self, message: str) -> None:
        """Draw a message alone, over what was drawn before drawing failed."""
        width, height = self.screen.get_size()
        draw_message(self.screen, message, (0, 0, width, height), LIGHT, 1.0, trouble=True)
        self.show_screen()

    def adopt_display(self) -> None:
        """Draw on the display from now on; if that is tiny, on a larger surface of which it shows a part.

        Window managers that tile may make a window as small as a pixel, in which nothing can be laid out.
        """
        found = pygame.display.get_surface()
        if found is None:
            return
        width, height = found.get_size()
        least_width, least_height = _LEAST_SIZE
        if width < least_width or height < least_height:
            self.screen = Surface((max(width, least_width), max(height, least_height)), 0, 32)
        else:
            self.screen = found

    def show_screen(self) -> None:
        """Show what was drawn."""
        shown = pygame.display.get_surface()
        if shown is not None and shown is not self.screen:
            shown.blit(self.screen, (0, 0))
        pygame.display.flip()

    def toggle_fullscreen(self) -> None:
        if self.remote is not None:  # it has the size of a page, which can do this by itself
            return
        # pygame's own toggle keeps the size: the window would stand in the middle of a black screen
        before, self.windowed = self.windowed, None if self.windowed else self.screen.get_size()
        self.screen = open_window(before) if before else pygame.display.set_mode((0, 0), pygame.FULLSCREEN)

    def save_screenshot(self, folder: Path) -> str:
        target, picture = find_free_path(folder, "robocov", ".png"), BytesIO()
        pygame.image.save(self.screen, picture, ".png")
        with replace_file(target) as part:
            part.write_bytes(picture.getvalue())
        return f"screenshot saved: {target}"
