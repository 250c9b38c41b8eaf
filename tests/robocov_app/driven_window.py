"""A viewer window without a display, and a driver that presses, drags and types in it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pygame
from sample_sessions import HALL, RAPF, start_session

from robocov.environment import Environment
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.toolkit.commands.command import CommandTable
from robocov_app.toolkit.widgets.page import Widget
from robocov_app.toolkit.window.display import open_display
from robocov_app.toolkit.window.input import split_key_name
from robocov_app.viewer.commands.viewer_commands import list_parameter_commands, list_viewer_commands
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.clock import SPEEDS
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.window.screen_video import copy_pixels
from robocov_app.viewer.window.window import ViewerWindow

SIZE = (900, 600)
FRAME_S = 1 / 50

MAX_NOTCHES = 40
"""Maximum number of notches of the wheel to reach the end of the panel."""
MIN_VISIBLE_PX = 12

MIDDLE = (0.6, 3.6)
"""A free position in the hall, m."""

KEYS = {
    "space": pygame.K_SPACE,
    "return": pygame.K_RETURN,
    "escape": pygame.K_ESCAPE,
    "tab": pygame.K_TAB,
    "delete": pygame.K_DELETE,
    "backspace": pygame.K_BACKSPACE,
    "home": pygame.K_HOME,
    "end": pygame.K_END,
    "left": pygame.K_LEFT,
    "right": pygame.K_RIGHT,
    "up": pygame.K_UP,
    "down": pygame.K_DOWN,
    **{f"f{number}": pygame.K_F1 + number - 1 for number in range(1, 13)},
    "page up": pygame.K_PAGEUP,
    "page down": pygame.K_PAGEDOWN,
    "enter": pygame.K_KP_ENTER,
}
MODIFIERS = {"ctrl": pygame.KMOD_LCTRL, "shift": pygame.KMOD_LSHIFT, "alt": pygame.KMOD_LALT}


@contextmanager
def open_viewer(
    folder: Path,
    *controllers: ControllerChoice,
    environment: Environment = HALL,
    map_name: str = "hall",
    robots: int = 3,
    size: tuple[int, int] = SIZE,
    scale: float | None = 1.0,
    shown: set[str] | None = None,
    lattice: int = 16,
    **changes: Any,
) -> Iterator[Driver]:
    """Open a window without a display, paused at time 0."""
    with open_display(headless=True):
        session = start_session(*(controllers or (RAPF,)), robots=robots, environment=environment, **changes)
        if shown is None:
            shown = {layer.name for layer in build_standard_layers() if layer.is_default}
        viewer = Presenter(session, Costs(lattice, direct=True), shown, folder, map_name)
        driver = Driver(ViewerWindow(viewer, size, scale, is_unattended=True))
        driver.settle()
        # The height of the legend is known only after the first frame.
        driver.settle()
        yield driver
        driver.window.close()
        driver.window.run_saver.finish()


def build_key_event(name: str) -> dict[str, Any]:
    """Return the attributes of the event of a key, by its name in the list of commands."""
    *modifiers, key = split_key_name(name)
    text = key if len(key) == 1 and "ctrl" not in modifiers else ""
    mod = sum(MODIFIERS[modifier] for modifier in modifiers)
    code = KEYS.get(key) or pygame.key.key_code(key)
    return {"key": code, "mod": mod, "unicode": text, "scancode": 0}


def build_command_table(viewer: Presenter) -> CommandTable:
    """Build the table of the commands that need no window."""
    titles = {layer.name: layer.title for layer in build_standard_layers()}
    commands = list_viewer_commands(viewer, titles)
    return CommandTable(commands, viewer.attempt, lambda: list_parameter_commands(viewer))


def run_command(viewer: Presenter, name: str) -> None:
    build_command_table(viewer).run(name)


def run_text(viewer: Presenter, text: str) -> None:
    build_command_table(viewer).run_text(text)


class Driver:
    """Uses a window with mouse and keys; each action takes one or more frames.

    Attributes
    ----------
    pixel : tuple of int
        Position of the pointer.
    """

    def __init__(self, window: ViewerWindow) -> None:
        self.window = window
        window.guard.is_enabled = False
        self.viewer = window.viewer
        self.pixel = (5, 5)

    @property
    def session(self) -> Session:
        return self.viewer.session

    def run_frames(self, count: int = 1, seconds: float = FRAME_S) -> None:
        for _ in range(count):
            self.window.run_frame(seconds)

    def settle(self) -> None:
        """Handle the posted events, and those that they post."""
        for _ in range(3):
            self.window.advance(0.0)
        self.window.run_frame(0.0)

    def post(self, kind: int, **attributes: Any) -> None:
        pygame.event.post(pygame.event.Event(kind, **attributes))

    # Mouse

    def move(self, x: float, y: float, *, held: int = 0, settled: bool = True) -> None:
        """Move the pointer to a pixel, with a button held down if `held` is not 0."""
        pixel = (round(x), round(y))
        shift = (pixel[0] - self.pixel[0], pixel[1] - self.pixel[1])
        buttons = tuple(int(held == button) for button in (1, 2, 3))
        pygame.mouse.set_pos(pixel)
        pygame.event.clear(pygame.MOUSEMOTION)  # Setting the position has posted an event, too.
        self.post(pygame.MOUSEMOTION, pos=pixel, rel=shift, buttons=buttons)
        self.pixel = pixel
        if settled:
            self.settle()

    def press(self, x: float, y: float, button: int = 1) -> None:
        self.move(x, y)
        self.post(pygame.MOUSEBUTTONDOWN, pos=self.pixel, button=button)
        self.settle()

    def release(self, button: int = 1) -> None:
        self.post(pygame.MOUSEBUTTONUP, pos=self.pixel, button=button)
        self.settle()

    def click(self, x: float, y: float, button: int = 1) -> None:
        self.press(x, y, button)
        self.release(button)

    def drag(self, *path: tuple[float, float], button: int = 1) -> None:
        """Press the button at the first pixel, and release it at the last."""
        self.press(*path[0], button)
        for x, y in path[1:]:
            self.move(x, y, held=button)
        self.release(button)

    def turn_wheel(self, x: float, y: float, amount: int) -> None:
        self.move(x, y)
        self.post(pygame.MOUSEWHEEL, x=0, y=amount, precise_x=0.0, precise_y=float(amount), flipped=False)
        self.settle()

    # Positions on the map

    def find_pixel(self, point: tuple[float, float], pane: int = 0) -> tuple[float, float]:
        return self.window.canvas.to_pixel(point, pane)

    def find_robot_pixel(self, number: int, pane: int = 0) -> tuple[float, float]:
        """Return the pixel at which a robot is drawn."""
        x, y = get_position(self, number, pane).tolist()
        return self.find_pixel((x, y), pane)

    def click_at(self, point: tuple[float, float], pane: int = 0, button: int = 1) -> None:
        self.click(*self.find_pixel(point, pane), button)

    def drag_at(self, *points: tuple[float, float], pane: int = 0) -> None:
        self.drag(*(self.find_pixel(point, pane) for point in points))

    # Keys

    def press_key(self, name: str, times: int = 1) -> None:
        """Press a key by its name in the list of commands, as in ``ctrl+shift+z``."""
        attributes = build_key_event(name)
        for _ in range(times):
            self.post(pygame.KEYDOWN, **attributes)
            if attributes["unicode"]:
                self.post(pygame.TEXTINPUT, text=attributes["unicode"])
            self.post(pygame.KEYUP, **attributes)
            self.settle()

    def type(self, text: str) -> None:
        for character in text:
            code = ord(character) if character.isascii() else 0
            self.post(pygame.KEYDOWN, key=code, mod=0, unicode=character, scancode=0)
            self.post(pygame.TEXTINPUT, text=character)
            self.post(pygame.KEYUP, key=code, mod=0, unicode=character, scancode=0)
        self.settle()

    # Panel

    def get_widget(self, kind: str, name: str) -> Widget:
        """Return a widget; if it is in the closed section or out of sight, first open that or scroll."""
        self.window.draw()
        widget = self.find_widget(kind, name)
        advanced = self.find_widget("section", "section:advanced")
        if widget is None and advanced is not None and not advanced.value:
            self.scroll_to(advanced)
            self.click(*self.find_rect("section", "section:advanced").center)
            widget = self.find_widget(kind, name)
        assert widget is not None, f"no {kind} {name}"
        return self.scroll_to(widget)

    def find_rect(self, kind: str, name: str) -> pygame.Rect:
        widget = self.find_widget(kind, name)
        assert widget is not None, f"no {kind} {name}"
        return widget.rect

    def scroll_to(self, widget: Widget) -> Widget:
        """Scroll the panel down until a widget is visible, and return the widget as it is then."""
        for _ in range(MAX_NOTCHES):
            if widget.rect.height >= MIN_VISIBLE_PX:
                break
            left, _, width, height = self.window.layout.panel
            self.turn_wheel(left + width / 2, height - 20, -1)
            self.window.draw()
            scrolled = self.find_widget(widget.kind, widget.key)
            assert scrolled is not None
            widget = scrolled
        return widget

    def find_widget(self, kind: str, name: str) -> Widget | None:
        for part in self.window.parts:
            widget = part.ui.find(kind, name)
            if widget is not None and not part.hidden:
                return widget
        return None

    def push_button(self, name: str) -> None:
        """Press a button of the panel."""
        self.click(*self.get_widget("button", name).rect.center)

    def add_pane(self) -> None:
        """Compare with the first controller that is offered."""
        self.push_button("pane:add")
        self.press_key("return")

    def open_tab(self, tab: str) -> None:
        self.push_button(f"tab:{tab}")

    def toggle_check_box(self, name: str) -> None:
        self.click(*self.get_widget("check", name).rect.center)

    def choose_option(self, menu: str, option: str) -> None:
        """Open a menu of the panel, scroll to an option, and choose it."""
        self.click(*self.get_widget("menu", menu).rect.center)
        open_list = self.window.panel.ui.open_list
        assert open_list is not None
        assert option in open_list.options, f"no {option} in {menu}"
        item = open_list.get_item_rect(open_list.options.index(option))
        for _ in range(100):
            if open_list.rect.contains(item):
                break
            self.turn_wheel(*open_list.rect.center, 1 if item.top < open_list.rect.top else -1)
            item = open_list.get_item_rect(open_list.options.index(option))
        self.click(*item.center)

    def type_into(self, field: str, text: str) -> None:
        """Click into a field, and type."""
        self.click(*self.get_widget("entry", field).rect.center)
        self.type(text)

    def drag_slider(self, name: str, fraction: float) -> None:
        """Drag a slider's knob to a fraction of its range."""
        knob, free_width = self.find_knob(name)
        x = self.get_widget("slider", name).rect.left + knob.width / 2 + fraction * free_width
        self.drag(knob.center, ((knob.centerx + x) / 2, knob.centery), (x, knob.centery))

    def find_knob(self, name: str) -> tuple[pygame.Rect, float]:
        """Return the rectangle of a slider's knob, and the length by which it can move, px."""
        slider = self.get_widget("slider", name)
        high = len(SPEEDS) - 1.0 if name == "speed" else 1.0
        width = round(12 * self.window.layout.scale)
        free_width = slider.rect.width - width
        left = slider.rect.left + round(free_width * slider.value / high)
        return pygame.Rect(left, slider.rect.top, width, slider.rect.height), free_width

    def copy_frame(self) -> Any:
        """Return the pixels of the window."""
        return copy_pixels(self.window.screen).astype(int)

    def shows_frame(self, other: Any) -> bool:
        return bool(np.array_equal(self.copy_frame(), other))


def get_position(driver: Driver, number: int, pane: int = 0) -> np.ndarray:
    """Return the displayed position of a robot, (2,) m."""
    shown_pane = driver.session.timeline.panes[pane]
    row = shown_pane.numbers.index(number)
    return driver.session.displayed.get_positions(shown_pane)[row]


def resize_window(driver: Driver, size: tuple[int, int]) -> None:
    """Change the size of the window."""
    pygame.display.set_mode(size, pygame.RESIZABLE)
    driver.post(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1])
    driver.settle()
