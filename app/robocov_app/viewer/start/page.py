"""The start page: a window with examples that move, maps as thumbnails, and recent sessions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal, TypeAlias

import pygame
from pygame import Rect

from robocov.errors import RobocovError
from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import Theme, get_theme
from robocov_app.render.fonts import measure_text, render_text, shorten_to_width
from robocov_app.storage.regular_files import require_regular_file
from robocov_app.toolkit.commands.command import Command, CommandTable
from robocov_app.toolkit.commands.help_page import draw_help_page
from robocov_app.toolkit.dialogs import Dialogs, create_file_choice
from robocov_app.toolkit.overlay import draw_message, draw_rounded_box, get_accent_ink, wrap_text
from robocov_app.toolkit.window.input import get_wheel_notches
from robocov_app.toolkit.window.layout import Box, find_max_scale
from robocov_app.toolkit.window.window import BaseWindow
from robocov_app.toolkit.window.window_model import WindowModel
from robocov_app.viewer.start.cards import (
    START_CARDS,
    StartCard,
    StartChoice,
    choose_map,
    choose_session,
)
from robocov_app.viewer.start.layout import RECENT_ROW_PX, StartLayout, build_start_layout
from robocov_app.viewer.start.previews import draw_outline, draw_run, fit_outline, load_previews
from robocov_app.viewer.start.sketch import draw_sketch

ThemeName: TypeAlias = Literal["light", "dark"]
"""Name of a theme."""
SUFFIXES = (".robocov", ".json")
"""Suffixes of the files that can be opened."""
ANIMATION_S = 30.0
"""Time after the last event for which the examples move."""
ANIMATION_FPS = 10.0
"""Pictures per second of the examples."""
MAX_RECENT_ROWS = 7

_TITLE = "robocov"
_TAGLINE = "Robots share out a building that they do not know. Pick an example and play."
_GROUPS = ("Start page",)
_HINT = "F1 or Esc closes"
_LIGHT_NAME: ThemeName = "light"

# Lengths in pixels at scale 1.
_TITLE_PX = 22
_TAGLINE_PX = 13
_HEADING_PX = 12
_CARD_TITLE_PX = 14
_SMALL_CARD_TITLE_PX = 12
_CARD_TEXT_PX = 12
_CARD_LINE_PX = 16
_NAME_PX = 11
_BUTTON_TEXT_PX = 13
_RADIUS_PX = 8
_PADDING_PX = 10


@dataclass(frozen=True)
class StartItem:
    """Something on the page that can be clicked, or chosen by arrow keys and Enter.

    Attributes
    ----------
    name : str
        Unique name.
    box : Rect
        Position and size, px.
    action : callable
        Called when the item is chosen.
    draw : callable
        Draws it; called with whether it is highlighted.
    """

    name: str
    box: Rect
    action: Callable[[], object]
    draw: Callable[[bool], None]


class StartPage(BaseWindow):
    """The first window of `robocov demo`, which closes when the user has chosen something.

    Parameters
    ----------
    size : (width, height), px
    scale : float
        Size of texts and widgets.
    theme_name : str
        ``light`` or ``dark``.
    recent : sequence of Path
        Sessions used recently, newest first.
    folder : Path
        Folder in which files are opened.
    is_ready : callable
        Returns whether the viewer can be opened. Until then, the page shows that it is loading.

    Attributes
    ----------
    choice : StartChoice or None
        The user's choice, or None until there is one.
    model : WindowModel
        Status message.
    theme_name : str
    items : list of StartItem
        Everything that can be chosen, in the order of Tab.
    focus : str
        Name of the highlighted item; empty if there is none.
    """

    def __init__(
        self,
        size: tuple[int, int],
        scale: float,
        *,
        theme_name: ThemeName = _LIGHT_NAME,
        recent: Sequence[Path] = (),
        folder: Path = Path(),
        is_ready: Callable[[], bool] = lambda: True,
    ) -> None:
        super().__init__(size)
        pygame.display.set_caption(_TITLE)
        self.scale = scale
        self.theme_name: ThemeName = theme_name
        self.choice: StartChoice | None = None
        self.model = WindowModel()
        self.dialogs = Dialogs()
        self.items: list[StartItem] = []
        self.focus = ""
        self.is_help_open = False
        self._recent = list(recent)
        self._folder = folder
        self._is_ready = is_ready
        self._previews = load_previews()
        self._map_names = list(self._previews.outlines)
        self._first_map = 0  # index of the first thumbnail that is shown
        self._animated_until_s = ANIMATION_S
        self._commands = CommandTable(self._list_commands(), self.model.attempt)
        self._arrange()
        self.draw()

    # Commands

    def _list_commands(self) -> list[Command]:
        (group,) = _GROUPS
        commands = [
            Command(
                f"card:{number}", card.choice.title, group, partial(self.choose, card.choice), (str(number),)
            )
            for number, card in enumerate(START_CARDS, 1)
        ]
        commands += [
            Command("next", "Next", group, partial(self._step_focus, 1), ("tab",)),
            Command(
                "previous", "Previous", group, partial(self._step_focus, -1), ("shift+tab",), repeats=True
            ),
            Command("left", "Left", group, partial(self._move_focus, -1, 0), ("left",), repeats=True),
            Command("right", "Right", group, partial(self._move_focus, 1, 0), ("right",), repeats=True),
            Command("up", "Up", group, partial(self._move_focus, 0, -1), ("up",), repeats=True),
            Command("down", "Down", group, partial(self._move_focus, 0, 1), ("down",), repeats=True),
            Command(
                "open", "Open the highlighted one", group, self._open_focus, ("return", "space", "enter")
            ),
            Command("file", "Open a file", group, self.open_dialog, ("ctrl+o",)),
            Command("theme", "Light or dark", group, self.toggle_theme, ("t",)),
            Command("help", "Keys", group, self.toggle_help, ("f1",)),
            Command("cancel", "Close help", group, self._close_help, ("escape",), hidden=True),
            Command("quit", "Quit", group, self._quit, ("ctrl+q",)),
        ]
        return commands

    def choose(self, choice: StartChoice) -> None:
        """Choose what to open. The page closes as soon as the viewer can be opened."""
        self.choice = choice
        self.model.revision += 1

    def open_dialog(self) -> None:
        """Let the user choose a file."""
        title = "Open a session or a map"
        self.dialogs.ask(
            create_file_choice(title, self._folder, self.open_file, suffixes=SUFFIXES, recent=self._recent)
        )

    def open_file(self, path: Path) -> None:
        """Choose a file, or report why it cannot be opened."""
        if path.suffix.lower() not in SUFFIXES:
            text = (
                f"{path.name}: expected a session (.robocov) or a map (.json). robocov edit imports others."
            )
            self.model.show_message(text, is_error=True)
            return
        if not path.exists():
            self.model.show_message(f"{path}: no such file", is_error=True)
            return
        try:
            require_regular_file(path)
        except RobocovError as error:
            self.model.show_message(str(error), is_error=True)
            return
        self.choose(choose_session(path))

    def toggle_theme(self) -> None:
        """Switch between light and dark."""
        self.theme_name = "dark" if self.theme_name == _LIGHT_NAME else _LIGHT_NAME

    def toggle_help(self) -> None:
        """Show or hide the list of keys."""
        self.is_help_open = not self.is_help_open

    def _close_help(self) -> None:
        self.is_help_open = False

    def _quit(self) -> None:
        self.choice = None
        self.closed = True

    # Focus

    def _step_focus(self, steps: int) -> None:
        """Highlight the next or the previous item."""
        names = [item.name for item in self.items]
        if self.focus in names:
            self.focus = names[(names.index(self.focus) + steps) % len(names)]
        else:
            self.focus = names[0]

    def _move_focus(self, x: int, y: int) -> None:
        """Highlight the nearest item in a direction."""
        current = self._find_item(self.focus)
        if current is None:
            self.focus = self.items[0].name
            return
        best: tuple[float, str] | None = None
        for item in self.items:
            dx = item.box.centerx - current.box.centerx
            dy = item.box.centery - current.box.centery
            along = dx * x + dy * y
            across = abs(dx * y) + abs(dy * x)
            if along > 0 and along >= across / 2 and (best is None or along + 2 * across < best[0]):
                best = (along + 2 * across, item.name)
        if best is not None:
            self.focus = best[1]

    def _open_focus(self) -> None:
        item = self._find_item(self.focus)
        if item is not None:
            item.action()

    def _find_item(self, name: str) -> StartItem | None:
        return next((item for item in self.items if item.name == name), None)

    # Events

    def handle_event(self, event: pygame.event.Event) -> None:
        """Handle an event: dialogs first, then keys and the mouse."""
        self.model.revision += 1
        self._animated_until_s = self.model.now + ANIMATION_S
        if event.type == pygame.QUIT:
            self._quit()
        elif event.type == pygame.KEYUP:
            self._commands.release_key(event)
        elif self.choice is not None:
            self._handle_while_loading(event)
        elif self.dialogs.handle_event(event):
            pass
        elif event.type == pygame.KEYDOWN:
            self._press_key(event)
        elif event.type == pygame.DROPFILE:
            self.open_file(Path(event.file))
        elif event.type == pygame.MOUSEMOTION:
            self._point_at(event.pos)
        elif event.type == pygame.MOUSEWHEEL:
            self._scroll_maps(-1 if get_wheel_notches(event) > 0 else 1)
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self._click(event.pos)

    def _handle_while_loading(self, event: pygame.event.Event) -> None:
        """Give up the choice on Escape; other input waits for the viewer."""
        if event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE:
            self.choice = None

    def _press_key(self, event: pygame.event.Event) -> None:
        command = self._commands.take_command(event)
        if command is not None:
            self._commands.run(command.name)
        self.dialogs.ignore_letter(event.unicode)

    def _point_at(self, pixel: tuple[int, int]) -> None:
        """Highlight the item under the mouse."""
        for item in self.items:
            if item.box.collidepoint(pixel):
                self.focus = item.name
                return

    def _click(self, pixel: tuple[int, int]) -> None:
        if self.is_help_open:
            self.is_help_open = False
            return
        for item in self.items:
            if item.box.collidepoint(pixel):
                item.action()
                return

    def _scroll_maps(self, steps: int) -> None:
        """Show later or earlier thumbnails."""
        last = max(len(self._map_names) - len(self._layout.maps), 0)
        self._first_map = min(max(self._first_map + steps, 0), last)
        self._arrange()

    # Frames

    def update(self, seconds: float) -> None:
        """Advance the examples; close the page once the viewer can open the user's choice."""
        self.model.pass_time(seconds)
        if self.choice is not None and self._is_ready():
            self.closed = True
        self._arrange()

    def build_frame_key(self) -> object:
        """Return everything on which the frame depends."""
        moment = self._preview_time
        if self.choice is not None:
            moment = self.model.now
        return (
            self.model.revision,
            self.model.message,
            self.screen.get_size(),
            self.theme_name,
            self.focus,
            self.is_help_open,
            round(moment * ANIMATION_FPS),
        )

    @property
    def _preview_time(self) -> float:
        """Time of the examples, s; it stops a while after the last event."""
        return min(self.model.now, self._animated_until_s)

    def _arrange(self) -> None:
        """Lay out the page for the size of the window, and list the items."""
        size = self.screen.get_size()
        self.theme: Theme = get_theme(self.theme_name)
        scale = min(self.scale, find_max_scale(size))
        recent = self._recent[:MAX_RECENT_ROWS]
        self._layout: StartLayout = build_start_layout(size, scale, len(self._map_names), bool(recent))
        layout = self._layout
        items: list[StartItem] = []
        for number, (card, box) in enumerate(zip(START_CARDS, layout.cards, strict=True), 1):
            action = partial(self.choose, card.choice)
            items.append(
                StartItem(f"card:{number}", box, action, partial(self._draw_card, number, card, box))
            )
        last = max(len(self._map_names) - len(layout.maps), 0)
        self._first_map = min(self._first_map, last)
        for name, box in zip(self._map_names[self._first_map :], layout.maps, strict=False):
            action = partial(self.choose, choose_map(name))
            items.append(StartItem(f"map:{name}", box, action, partial(self._draw_map, name, box)))
        for row, path in enumerate(recent):
            box = layout.get_recent_row(row)
            if box.bottom <= layout.recent.bottom:
                action = partial(self.open_file, path)
                items.append(StartItem(f"recent:{row}", box, action, partial(self._draw_recent, path, box)))
        self.items = items + self._list_buttons()

    def _list_buttons(self) -> list[StartItem]:
        layout = self._layout
        theme_label = "Dark" if self.theme_name == _LIGHT_NAME else "Light"
        buttons: list[tuple[str, str, Rect, Callable[[], object]]] = [
            ("file", "Open a file…", layout.open_button, self.open_dialog),
            ("theme", theme_label, layout.theme_button, self.toggle_theme),
            ("help", "Keys", layout.help_button, self.toggle_help),
        ]
        if len(self._map_names) > len(layout.maps):
            buttons.append(("maps:back", "‹", layout.back_button, partial(self._scroll_maps, -1)))
            buttons.append(("maps:on", "›", layout.forward_button, partial(self._scroll_maps, 1)))
        return [
            StartItem(name, box, action, partial(self._draw_button, label, box))
            for name, label, box, action in buttons
        ]

    def draw(self) -> None:
        """Draw the page, the open dialog and the help, and show the frame."""
        theme = self.theme
        layout = self._layout
        scale = layout.scale
        self.screen.fill(mix(theme.background, theme.panel, 0.6))
        left, top = layout.title
        self._write(_TITLE, (left, top), _TITLE_PX, theme.ink, bold=True)
        title_width = measure_text(_TITLE, round(_TITLE_PX * scale), True)
        room = layout.open_button.left - left - title_width - 40 * scale
        tagline = shorten_to_width(_TAGLINE, round(_TAGLINE_PX * scale), room)
        self._write(tagline, (left + title_width + 16 * scale, top + 9 * scale), _TAGLINE_PX, theme.faint)
        self._write("Maps", layout.maps_title, _HEADING_PX, theme.faint, bold=True)
        if layout.recent.width:
            self._write("Recent sessions", layout.recent.topleft, _HEADING_PX, theme.faint, bold=True)
        for item in self.items:
            item.draw(item.name == self.focus)
        if self.is_help_open:
            draw_help_page(self.screen, theme, scale, self._commands.commands, groups=_GROUPS, hint=_HINT)
        self._draw_message()
        self.dialogs.draw(self.screen, theme, scale)
        self.show_screen()

    def _draw_message(self) -> None:
        message = self.model.message
        is_error = self.model.has_error_message
        if self.choice is not None:
            dots = "." * (1 + int(self.model.now * 2) % 3)
            message = f"Opening {self.choice.title} {dots}"
            is_error = False
        width, height = self.screen.get_size()
        draw_message(
            self.screen, message, Box(0, 0, width, height), self.theme, self._layout.scale, is_error=is_error
        )

    def _write(
        self, text: str, position: tuple[float, float], size: float, color: Color, *, bold: bool = False
    ) -> None:
        image = render_text(text, round(size * self._layout.scale), color, bold)
        self.screen.blit(image, (round(position[0]), round(position[1])))

    def _draw_frame(self, box: Rect, *, is_focused: bool) -> None:
        """Draw the background of an item; with a thick edge if it is highlighted."""
        theme = self.theme
        scale = self._layout.scale
        edge = theme.accent if is_focused else mix(theme.panel, theme.ink, 0.18)
        width = max(round(scale * (2 if is_focused else 1)), 1)
        draw_rounded_box(
            self.screen, box, theme.background, edge=edge, radius=round(_RADIUS_PX * scale), width=width
        )

    def _draw_card(self, number: int, card: StartCard, box: Rect, is_focused: bool) -> None:
        """Draw an example: its preview above its title and text."""
        theme = self.theme
        scale = self._layout.scale
        self._draw_frame(box, is_focused=is_focused)
        padding = round(_PADDING_PX * scale)
        text_height = round((24 + 2 * _CARD_LINE_PX + 6) * scale)
        inner = box.inflate(-2 * padding, -2 * padding)
        picture = Rect(inner.left, inner.top, inner.width, inner.height - text_height)
        self._draw_previews(card, picture)
        self._draw_badge(number, inner, is_focused=is_focused)
        y = picture.bottom + round(8 * scale)
        size = self._choose_title_size(card.choice.title, inner.width)
        title = shorten_to_width(card.choice.title, round(size * scale), inner.width, True)
        self._write(title, (inner.left, y), size, theme.ink, bold=True)
        lines = wrap_text(card.text, round(_CARD_TEXT_PX * scale), inner.width)[:2]
        for k, line in enumerate(lines):
            y_line = y + (24 + _CARD_LINE_PX * k) * scale
            self._write(line, (inner.left, y_line), _CARD_TEXT_PX, mix(theme.background, theme.ink, 0.72))

    def _choose_title_size(self, title: str, width: float) -> float:
        """Return the size of a title at scale 1, px: smaller if it would not fit into a width."""
        if measure_text(title, round(_CARD_TITLE_PX * self._layout.scale), True) <= width:
            return _CARD_TITLE_PX
        return _SMALL_CARD_TITLE_PX

    def _draw_badge(self, number: int, box: Rect, *, is_focused: bool) -> None:
        """Draw the key of a card in the upper left corner of a box."""
        theme = self.theme
        scale = self._layout.scale
        badge = Rect(box.left, box.top, round(18 * scale), round(18 * scale))
        fill = theme.accent if is_focused else mix(theme.background, theme.ink, 0.1)
        color = get_accent_ink(theme) if is_focused else theme.ink
        draw_rounded_box(self.screen, badge, fill, edge=fill, radius=round(5 * scale))
        digit = render_text(str(number), round(_NAME_PX * scale), color, True)
        self.screen.blit(digit, digit.get_rect(center=badge.center))

    def _draw_previews(self, card: StartCard, box: Rect) -> None:
        """Draw the recorded runs of a card side by side, or the drawing of a map."""
        theme = self.theme
        scale = self._layout.scale
        seconds = self._preview_time
        if not card.previews:
            draw_sketch(self.screen, box, theme, scale, seconds=seconds)
            return
        gap = round(8 * scale)
        label_height = round(18 * scale) if card.labels else 0
        width = (box.width - gap * (len(card.previews) - 1)) // len(card.previews)
        for k, name in enumerate(card.previews):
            part = Rect(box.left + k * (width + gap), box.top, width, box.height - label_height)
            run = self._previews.runs[name]
            draw_run(self.screen, run, part, theme, scale, seconds=seconds, outside=theme.background)
            if card.labels:
                label = render_text(card.labels[k], round(_NAME_PX * scale), theme.ink)
                bottom = fit_outline(run.outline, part).bottom + round(3 * scale)
                self.screen.blit(label, label.get_rect(midtop=(part.centerx, bottom)))

    def _draw_map(self, name: str, box: Rect, is_focused: bool) -> None:
        """Draw the thumbnail of a map above its name."""
        theme = self.theme
        scale = self._layout.scale
        self._draw_frame(box, is_focused=is_focused)
        name_height = round(18 * scale)
        margin = round(6 * scale)
        picture = Rect(box.left, box.top, box.width, box.height - name_height).inflate(
            -2 * margin, -2 * margin
        )
        draw_outline(self.screen, self._previews.outlines[name], picture, theme, scale, theme.background)
        text = shorten_to_width(name, round(_NAME_PX * scale), box.width - 8 * scale)
        image = render_text(text, round(_NAME_PX * scale), theme.ink)
        self.screen.blit(image, image.get_rect(midbottom=(box.centerx, box.bottom - round(5 * scale))))

    def _draw_recent(self, path: Path, box: Rect, is_focused: bool) -> None:
        """Draw a row of the list of recent sessions: name, and its folder."""
        theme = self.theme
        scale = self._layout.scale
        if is_focused:
            self._draw_frame(box, is_focused=True)
        width = box.width - 16 * scale
        x = box.left + 8 * scale
        name = shorten_to_width(path.stem, round(_TAGLINE_PX * scale), width)
        self._write(name, (x, box.top + 4 * scale), _TAGLINE_PX, theme.ink)
        folder = shorten_to_width(str(path.parent), round(_NAME_PX * scale), width)
        self._write(folder, (x, box.top + (RECENT_ROW_PX / 2 + 3) * scale), _NAME_PX, theme.faint)

    def _draw_button(self, label: str, box: Rect, is_focused: bool) -> None:
        self._draw_frame(box, is_focused=is_focused)
        image = render_text(label, round(_BUTTON_TEXT_PX * self._layout.scale), self.theme.ink)
        self.screen.blit(image, image.get_rect(center=box.center))
