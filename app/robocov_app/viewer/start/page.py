"""The start page: a window with examples that move, maps as thumbnails, and recent sessions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Literal, TypeAlias

import pygame
from pygame import Rect

from robocov.errors import RobocovError
from robocov_app.look.colors import mix
from robocov_app.look.theme import Theme, get_theme
from robocov_app.render.fonts import measure_text, render_text, shorten_to_width
from robocov_app.storage.autosave import Draft
from robocov_app.storage.regular_files import require_regular_file
from robocov_app.toolkit.commands.command import Command, CommandTable
from robocov_app.toolkit.commands.help_page import HelpPage
from robocov_app.toolkit.dialogs import Dialogs, create_file_choice
from robocov_app.toolkit.overlay import draw_message
from robocov_app.toolkit.window.display import find_suitable_scale, prefers_reduced_motion
from robocov_app.toolkit.window.input import get_wheel_notches
from robocov_app.toolkit.window.layout import Box, find_max_scale
from robocov_app.toolkit.window.window import BaseWindow
from robocov_app.toolkit.window.window_model import WindowModel
from robocov_app.viewer.recovery import offer_recovery
from robocov_app.viewer.start.card_section import CardSection
from robocov_app.viewer.start.cards import START_CARDS, StartChoice, choose_draft, choose_session
from robocov_app.viewer.start.drawing import StartDrawing
from robocov_app.viewer.start.items import ItemFocus, StartItem
from robocov_app.viewer.start.layout import StartLayout, build_start_layout
from robocov_app.viewer.start.map_section import MapSection
from robocov_app.viewer.start.previews import load_previews
from robocov_app.viewer.start.recent_section import RecentSection

ThemeName: TypeAlias = Literal["light", "dark"]
"""Name of a theme."""
SUFFIXES = (".robocov", ".json")
"""Suffixes of the files that can be opened."""
ANIMATION_S = 30.0
"""Time after the last event for which the examples move."""
ANIMATION_FPS = 10.0
"""Frames per second of the examples."""
STILL_TIME_S = 3.0
"""Time of the examples with reduced motion, at which the robots have left their starts."""

_TITLE = "robocov"
_TAGLINE = "Robots spread out through an unknown building. Pick an example."
_GROUPS = ("Start page",)
_HINT = "F1 or Esc closes"
_LIGHT_NAME: ThemeName = "light"

# Lengths in pixels at scale 1.
_TITLE_PX = 22
_TAGLINE_PX = 13
_HEADING_PX = 12
_BUTTON_TEXT_PX = 13
_TAGLINE_GAP_PX = 16  # from the title to the tagline
_TAGLINE_DROP_PX = 9  # from the top of the title to that of the tagline
_TAGLINE_MARGINS_PX = 40  # to the left and right of the tagline, together


class StartPage(BaseWindow):
    """The first window of `robocov demo`, which closes when the user has chosen something.

    Parameters
    ----------
    size : (width, height), px
    scale : float or None
        Size of texts and widgets; None for one that suits the size of the window.
    theme_name : str
        ``light`` or ``dark``.
    recent : sequence of Path
        Sessions used recently, newest first.
    folder : Path
        Folder in which files are opened.
    drafts : sequence of Draft
        Unsaved work of earlier windows, newest first, which the page offers to recover.
    can_open_viewer : callable
        Returns whether the viewer can be opened. Until then, the page shows that it is loading.

    Attributes
    ----------
    choice : StartChoice or None
        The user's choice, or None until there is one.
    model : WindowModel
        Status message.
    theme_name : str
    focus : ItemFocus
        Everything that can be chosen, and the highlighted item.
    """

    def __init__(
        self,
        size: tuple[int, int],
        scale: float | None,
        *,
        theme_name: ThemeName = _LIGHT_NAME,
        recent: Sequence[Path] = (),
        folder: Path = Path(),
        drafts: Sequence[Draft] = (),
        can_open_viewer: Callable[[], bool] = lambda: True,
    ) -> None:
        super().__init__(size)
        pygame.display.set_caption(_TITLE)
        self.scale = scale
        self.theme_name: ThemeName = theme_name
        self.choice: StartChoice | None = None
        self.model = WindowModel()
        self.dialogs = Dialogs()
        self.focus = ItemFocus()
        self.help_page = HelpPage(_GROUPS, _HINT)
        self._recent = list(recent)
        self._folder = folder
        self._can_open_viewer = can_open_viewer
        previews = load_previews()
        self._cards = CardSection(previews, self.choose)
        self._maps = MapSection(previews, self.choose)
        self._recent_sessions = RecentSection(self._recent, self.open_file)
        self._animation_end_s = ANIMATION_S
        self._is_motion_reduced = prefers_reduced_motion()
        self._commands = CommandTable(self._list_commands(), self.model.attempt)
        if drafts:
            offer_recovery(self.dialogs, drafts, self._recover)
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
            Command("next", "Next", group, partial(self.focus.step, 1), ("tab",)),
            Command(
                "previous", "Previous", group, partial(self.focus.step, -1), ("shift+tab",), repeats=True
            ),
            Command("left", "Left", group, partial(self.focus.move, -1, 0), ("left",), repeats=True),
            Command("right", "Right", group, partial(self.focus.move, 1, 0), ("right",), repeats=True),
            Command("up", "Up", group, partial(self.focus.move, 0, -1), ("up",), repeats=True),
            Command("down", "Down", group, partial(self.focus.move, 0, 1), ("down",), repeats=True),
            Command(
                "open", "Open the highlighted item", group, self.focus.open, ("return", "space", "enter")
            ),
            Command("file", "Open a file", group, self.open_dialog, ("ctrl+o",)),
            Command("theme", "Light or dark", group, self.toggle_theme, ("t",)),
            Command("help", "Keys", group, self.toggle_help, ("f1",)),
            Command("cancel", "Close help", group, self.help_page.close, ("escape",), hidden=True),
            Command("quit", "Quit", group, self._quit, ("ctrl+q",)),
        ]
        return commands

    def choose(self, choice: StartChoice) -> None:
        """Choose what to open. The page closes as soon as the viewer can be opened."""
        self.choice = choice
        self.model.revision += 1

    def _recover(self, draft: Draft) -> None:
        self.choose(choose_draft(draft))

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
        self.help_page.toggle()

    def _quit(self) -> None:
        self.choice = None
        self.closed = True

    # Events

    def handle_event(self, event: pygame.event.Event) -> None:
        """Handle an event: dialogs first, then keys and the mouse."""
        self.model.revision += 1
        self._animation_end_s = self.model.now + ANIMATION_S
        if event.type == pygame.QUIT:
            self._quit()
        elif event.type == pygame.KEYUP:
            self._commands.release_key(event)
        elif self.choice is not None:
            self._handle_while_loading(event)
        elif self.dialogs.handle_event(event) or self.help_page.handle_event(event):
            pass
        elif event.type == pygame.KEYDOWN:
            self._press_key(event)
        elif event.type == pygame.DROPFILE:
            self.open_file(Path(event.file))
        elif event.type == pygame.MOUSEMOTION:
            self.focus.point_at(event.pos)
        elif event.type == pygame.MOUSEWHEEL:
            self._scroll_by_wheel(get_wheel_notches(event))
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self._click(event.pos)

    def _handle_while_loading(self, event: pygame.event.Event) -> None:
        """Cancel the choice on Escape; other input waits for the viewer."""
        if event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE:
            self.choice = None

    def _press_key(self, event: pygame.event.Event) -> None:
        command = self._commands.take_command(event)
        if command is not None:
            self._commands.run(command.name)
        # The character of the key follows as a separate text event, which a newly opened dialog must ignore.
        self.dialogs.ignore_character(event.unicode)

    def _click(self, pixel: tuple[int, int]) -> None:
        item = self.focus.find_at(pixel)
        if item is not None:
            item.action()

    def _scroll_by_wheel(self, notches: float) -> None:
        """Show earlier thumbnails if the wheel turns up, later ones if it turns down."""
        # A touchpad that scrolls sideways reports 0 notches.
        if notches != 0.0:
            self._scroll_maps(-1 if notches > 0.0 else 1)

    def _scroll_maps(self, steps: int) -> None:
        """Show later or earlier thumbnails."""
        self._maps.scroll(steps)
        self._arrange()

    # Frames

    def update(self, seconds: float) -> None:
        """Advance the time of the page; close it once something is chosen and the viewer can be opened."""
        self.model.pass_time(seconds)
        if self.choice is not None and self._can_open_viewer():
            self.closed = True
        # In every frame, because the size of the window or the theme may have changed.
        self._arrange()

    def build_frame_key(self) -> object:
        """Return everything on which the frame depends."""
        time = self._preview_time
        if self.choice is not None:
            # The dots of the message "Opening …" move until the viewer opens.
            time = self.model.now
        return (
            self.model.revision,
            self.model.message,
            self.screen.get_size(),
            self.theme_name,
            self.focus.name,
            self.help_page.frame_key,
            round(time * ANIMATION_FPS),
        )

    @property
    def _preview_time(self) -> float:
        """Time of the examples, s.

        It stops a while after the last event. With reduced motion, it is fixed.
        """
        if self._is_motion_reduced:
            return STILL_TIME_S
        return min(self.model.now, self._animation_end_s)

    def _arrange(self) -> None:
        """Lay out the page for the size of the window, and list the items."""
        size = self.screen.get_size()
        self.theme: Theme = get_theme(self.theme_name)
        scale = min(self.scale or find_suitable_scale(size), find_max_scale(size))
        layout: StartLayout = build_start_layout(size, scale, len(self._maps.names), bool(self._recent))
        self._layout = layout
        self.focus.items = [
            *self._cards.list_items(layout),
            *self._maps.list_items(layout),
            *self._recent_sessions.list_items(layout),
            *self._list_buttons(),
        ]

    def _list_buttons(self) -> list[StartItem]:
        layout = self._layout
        theme_label = "Dark" if self.theme_name == _LIGHT_NAME else "Light"
        buttons: list[tuple[str, str, Rect, Callable[[], object]]] = [
            ("file", "Open a file…", layout.open_button, self.open_dialog),
            ("theme", theme_label, layout.theme_button, self.toggle_theme),
            ("help", "Keys", layout.help_button, self.toggle_help),
        ]
        if self._maps.can_scroll(layout):
            buttons.append(("maps:back", "‹", layout.back_button, partial(self._scroll_maps, -1)))
            buttons.append(("maps:on", "›", layout.forward_button, partial(self._scroll_maps, 1)))
        return [
            StartItem(name, box, action, partial(_draw_button, label, box))
            for name, label, box, action in buttons
        ]

    def draw(self) -> None:
        """Draw the page, the open dialog and the help, and show the frame."""
        theme = self.theme
        scale = self._layout.scale
        drawing = StartDrawing(self.screen, theme, scale, self._preview_time)
        self.screen.fill(mix(theme.background, theme.panel, 0.6))
        _draw_headings(drawing, self._layout)
        for item in self.focus.items:
            item.draw(drawing, item.name == self.focus.name)
        self.help_page.draw(self.screen, theme, scale, self._commands.commands)
        self._draw_message()
        self.dialogs.draw(self.screen, theme, scale)
        self.display.show()

    def _draw_message(self) -> None:
        """Draw the status message or, while the viewer starts, which choice is being opened."""
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


def _draw_headings(drawing: StartDrawing, layout: StartLayout) -> None:
    """Draw the title of the page and those of its sections."""
    theme = drawing.theme
    scale = drawing.scale
    left, top = layout.title
    drawing.write(_TITLE, (left, top), _TITLE_PX, theme.ink, bold=True)
    title_width = measure_text(_TITLE, drawing.px(_TITLE_PX), bold=True)
    max_tagline_width = layout.open_button.left - left - title_width - _TAGLINE_MARGINS_PX * scale
    tagline = shorten_to_width(_TAGLINE, drawing.px(_TAGLINE_PX), max_tagline_width)
    tagline_position = (left + title_width + _TAGLINE_GAP_PX * scale, top + _TAGLINE_DROP_PX * scale)
    drawing.write(tagline, tagline_position, _TAGLINE_PX, theme.faint)
    drawing.write("Maps", layout.maps_title, _HEADING_PX, theme.faint, bold=True)
    if layout.recent.width:
        drawing.write("Recent sessions", layout.recent.topleft, _HEADING_PX, theme.faint, bold=True)


def _draw_button(label: str, box: Rect, drawing: StartDrawing, is_focused: bool) -> None:
    drawing.draw_frame(box, is_focused=is_focused)
    image = render_text(label, drawing.px(_BUTTON_TEXT_PX), drawing.theme.ink)
    drawing.screen.blit(image, image.get_rect(center=box.center))
