"""The display: SDL's video driver, size and scale of the window, and its title."""

import gc
import math
import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import pygame
from pygame import Surface

from robocov.errors import InputError
from robocov.text import remove_controls
from robocov_app.toolkit.window.icon import render_icon
from robocov_app.toolkit.window.input import KEY_REPEAT_MS
from robocov_app.toolkit.window.layout import MIN_SIZE_PX

_DRIVER_VARIABLE = "SDL_VIDEODRIVER"
_ACCELERATION_VARIABLE = "SDL_FRAMEBUFFER_ACCELERATION"
_DISPLAY_VARIABLES = ("DISPLAY", "WAYLAND_DISPLAY", _DRIVER_VARIABLE)
"""Environment variables. On Linux, one of them must be set for a visible window."""
_INVISIBLE_DRIVERS = ("offscreen", "dummy", "evdev")
"""Drivers that SDL silently falls back to without a display; the program would run forever, unseen."""
REDUCED_MOTION_VARIABLE = "ROBOCOV_REDUCED_MOTION"
"""Environment variable: if it is neither empty nor 0, windows on the screen show no animations."""
_FULL_HD_HEIGHT_PX = 1080
_USUAL_WINDOW_PX = (1280, 720)
"""Size of a window that is shown at scale 1."""
_MAX_SCALE = 3.0
_SCALE_STEP = 0.25
_COLLECTION_THRESHOLD = 50_000
"""Allocations between garbage collections: about one collection per frame (Python's default is 700)."""


def prefers_reduced_motion() -> bool:
    """Return whether the user wants no animations; SDL does not know the setting of the system.

    Returns
    -------
    bool
    """
    return os.environ.get(REDUCED_MOTION_VARIABLE, "") not in ("", "0")


@contextmanager
def open_display(*, headless: bool, missing_message: str = "no display") -> Iterator[None]:
    """Start pygame's display for the duration of a context.

    Parameters
    ----------
    headless : bool
        Whether windows are drawn in memory only, without a display.
    missing_message : str
        Error message if a visible window is not possible.

    Raises
    ------
    InputError
        If a visible window is not possible.
    """
    previous_driver = os.environ.get(_DRIVER_VARIABLE)
    if headless:
        os.environ[_DRIVER_VARIABLE] = "dummy"
    try:
        _start_display(missing_message, may_be_invisible=headless)
        pygame.font.init()
        pygame.key.set_repeat(*KEY_REPEAT_MS)
        try:
            yield
        finally:
            pygame.display.quit()
    finally:
        # Otherwise, later windows of this process would be invisible, too.
        if previous_driver is None:
            os.environ.pop(_DRIVER_VARIABLE, None)
        else:
            os.environ[_DRIVER_VARIABLE] = previous_driver


def _start_display(missing_message: str, *, may_be_invisible: bool) -> None:
    """Start pygame's display; raise an InputError if only an invisible one is available but not allowed."""
    has_display = sys.platform != "linux" or any(os.environ.get(name) for name in _DISPLAY_VARIABLES)
    if not has_display:
        raise InputError(missing_message)
    try:
        pygame.display.init()
    except pygame.error:
        raise InputError(missing_message) from None
    driver = pygame.display.get_driver()
    if driver == "x11":
        # By default, SDL opens a window, closes it, and opens it again for OpenGL. Keys pressed meanwhile are
        # lost, and without a graphics processor each frame takes longer.
        os.environ.setdefault(_ACCELERATION_VARIABLE, "0")
    is_requested = may_be_invisible or driver == os.environ.get(_DRIVER_VARIABLE, "")
    if driver in _INVISIBLE_DRIVERS and not is_requested:
        pygame.display.quit()
        raise InputError(missing_message)


def get_screen_scale() -> float:
    """Return the scale at which text is readable on the largest display: 1 up to full HD, 2 for 4K."""
    height = max((size[1] for size in pygame.display.get_desktop_sizes()), default=_FULL_HD_HEIGHT_PX)
    return _round_scale(height / _FULL_HD_HEIGHT_PX)


def _round_scale(scale: float) -> float:
    """Round a scale to a multiple of `_SCALE_STEP` from 1 to `_MAX_SCALE`."""
    return min(max(round(scale / _SCALE_STEP) * _SCALE_STEP, 1.0), _MAX_SCALE)


def choose_scale(requested: float | None, *, has_display: bool) -> float | None:
    """Return the scale of a window: the requested one, or None if the scale follows the window's size.

    Parameters
    ----------
    requested : float or None
        Scale from an option or the settings.
    has_display : bool
        Whether the window is visible. An invisible window has scale 1 by default.
    """
    if requested is None and not has_display:
        return 1.0
    return requested


def find_suitable_scale(size: tuple[int, int]) -> float:
    """Return the scale that suits a window: that of the screen, or more if the window is large.

    Text grows with the square root of the size, so that a large window shows both more and larger text.
    The scale is 1 at 1280 x 720, and 1.5 at 2560 x 1440.

    Parameters
    ----------
    size : (width, height), px
    """
    width, height = size
    usual_width, usual_height = _USUAL_WINDOW_PX
    growth = math.sqrt(min(width / usual_width, height / usual_height))
    return max(_round_scale(growth), get_screen_scale())


def fit_to_screen(size: tuple[int, int]) -> tuple[int, int]:
    """Return a window size reduced to the size of the screen, px."""
    max_width, max_height = max(pygame.display.get_desktop_sizes(), default=size)
    width, height = size
    return min(width, max_width), min(height, max_height)


def open_window(size: tuple[int, int]) -> Surface:
    """Open a window that the user can resize, and return its surface.

    Parameters
    ----------
    size : (width, height), px

    Returns
    -------
    pygame.Surface
    """
    # Some systems ignore an icon that is set later.
    pygame.display.set_icon(render_icon())
    screen = pygame.display.set_mode(size, pygame.RESIZABLE)
    with suppress(AttributeError, pygame.error), warnings.catch_warnings():
        # The display module offers no other way yet to set the minimum size of its window.
        warnings.simplefilter("ignore", DeprecationWarning)
        pygame.Window.from_display_module().minimum_size = MIN_SIZE_PX
    return screen


def leave_full_screen() -> None:
    """Leave full-screen mode."""
    with suppress(AttributeError, pygame.error), warnings.catch_warnings():
        # As in `open_window`.
        warnings.simplefilter("ignore", DeprecationWarning)
        pygame.Window.from_display_module().set_windowed()


def set_title(title: str) -> None:
    """Set the title of the window if it has changed; control characters are removed."""
    title = remove_controls(title, single_line=True)
    if title != pygame.display.get_caption()[0]:
        pygame.display.set_caption(title)


@contextmanager
def collect_garbage_rarely() -> Iterator[None]:
    """Collect garbage less often, and exempt existing objects, which would delay a frame by 25 ms."""
    previous_threshold = gc.get_threshold()
    gc.collect()
    gc.freeze()
    gc.set_threshold(_COLLECTION_THRESHOLD, *previous_threshold[1:])
    try:
        yield
    finally:
        gc.set_threshold(*previous_threshold)
        gc.unfreeze()
