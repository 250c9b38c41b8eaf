"""Lists that are filtered by typing."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import pygame
from pygame import Rect

from robocov.errors import InputError, RobocovError
from robocov_app.toolkit.dialogs.dialog import Dialog
from robocov_app.toolkit.widgets.appearance import draw_box, shade
from robocov_app.toolkit.widgets.text_edit import TextEdit
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.input import ENTER_KEYS

MAX_VISIBLE_OPTIONS = 9
_MIN_VISIBLE_OPTIONS = 3
_FIELD = "text"
_KEY_STEPS = {"up": -1, "down": 1, "page up": -MAX_VISIBLE_OPTIONS, "page down": MAX_VISIBLE_OPTIONS}

# Lengths in pixels at scale 1.
_TOP_PX = 64
"""Maximum distance from the upper edge of the window."""
_TITLE_GAP_PX = 4
_OPTION_PX = 26
_FINGER_OPTION_PX = 44
_DESCRIBED_OPTION_PX = 38
_FINGER_DESCRIBED_OPTION_PX = 48
_OPTION_GAP_PX = 1
_BAR_WIDTH_PX = 4
_BAR_RIGHT_PX = 8
"""Distance of the scroll bar from the right end of the options."""
_BAR_SHADE = 0.3
_CLOSE_ABOVE_PX = 8
_CLOSE_HEIGHT_PX = 32
_CLOSE_WIDTH_PX = 96
_OTHER_HEIGHT_PX = 190
"""Height of everything except for the options, and of the margins above and below the list."""


@dataclass(frozen=True)
class Option:
    """A line of a list.

    Attributes
    ----------
    text : str
    note : str
        Faint text at the right end.
    completion : str
        Text that Tab completes to; if empty, `text` is used.
    disabled_reason : str
        Why it cannot be chosen; empty if it can.
    value : object
        Data for the function that handles the choice.
    description : str
        Faint text below `text`.
    """

    text: str
    note: str = ""
    completion: str = ""
    disabled_reason: str = ""
    value: object = None
    description: str = ""


@dataclass
class Choice(Dialog):
    """A list that is filtered as the user types.

    Attributes
    ----------
    title : str
    options : callable
        Returns the lines that match the typed text.
    accept : callable
        Called with the typed text and the chosen line, which is None if the list is empty. If it returns a
        string, that string replaces the typed text and the dialog stays open. If it raises a RobocovError,
        the message is shown and the typed text is kept.
    placeholder : str
        Faint text in the empty field.
    hint : str
        Keys that can be used, shown below the list.
    empty_text : str
        Shown if there are no lines.
    text : str
        Typed text.
    highlighted : int
        Index of the highlighted line.
    top : int
        Index of the first visible line.
    error : str
        Why the text was not accepted.
    """

    width = 620.0
    closes_on_outside_click = True

    title: str
    options: Callable[[str], Sequence[Option]]
    accept: Callable[[str, Option | None], object]
    placeholder: str = ""
    hint: str = "↑ ↓ choose · Enter accepts · Esc closes"
    empty_text: str = "no matches"
    text: str = ""
    highlighted: int = 0
    top: int = 0
    error: str = ""
    _has_descriptions: bool = field(default=False, init=False)

    def show_content(self, ui: Ui) -> None:
        """Show the field and the list."""
        ui.paragraph(self.title, color=ui.theme.faint, bold=True)
        ui.space(_TITLE_GAP_PX)
        if ui.edit is None or ui.focus != _FIELD:
            ui.focus = _FIELD
            ui.edit = TextEdit.append_to(self.text)
        ui.row(height=32, below=8)
        ui.text_field(_FIELD, self.text, placeholder=self.placeholder)
        self.read_widgets(ui)
        ui.paragraph(self.error, color=ui.theme.error, bold=True)
        options = list(self.options(self.text))
        self.highlighted = min(self.highlighted, max(len(options) - 1, 0))
        self._show_options(ui, options)
        facts: list[str] = []
        if len(options) > self._visible_count:
            facts.append(f"{len(options)} in all")
        if self.has_key_hints:
            facts.append(self.hint)
            ui.row(height=22, below=0)
            ui.label(" · ".join(facts), style="unit", align="center")
            return
        # A phone has no Escape key.
        ui.space(_CLOSE_ABOVE_PX)
        ui.row(ui.width - _CLOSE_WIDTH_PX, _CLOSE_WIDTH_PX, height=_CLOSE_HEIGHT_PX, gap=0, below=0)
        ui.label(" · ".join(facts), style="unit")
        if ui.button("Close", key="close"):
            self.is_done = True
            self.handle_cancel()

    def _show_options(self, ui: Ui, options: Sequence[Option]) -> None:
        """Show the visible lines of the list, and accept the one that is clicked."""
        self._has_descriptions = any(option.description for option in options)
        # There may be fewer options, or less space for them, than when one was last highlighted.
        self._reveal_highlighted(len(options))
        ui.row(height=self._option_height, below=_OPTION_GAP_PX)
        if not options:
            ui.label(self.empty_text, style="unit")
        for number in range(self.top, min(self.top + self._visible_count, len(options))):
            option = options[number]
            is_clicked = ui.option(
                option.text,
                option.note,
                key=f"option:{number}",
                description=option.description,
                highlighted=number == self.highlighted,
                disabled_reason=option.disabled_reason,
            )
            if is_clicked:
                self._accept(option, ui)
        self._draw_scroll_bar(ui, len(options))

    def _draw_scroll_bar(self, ui: Ui, count: int) -> None:
        """Draw the scroll bar over the right ends of the options; nothing if all of them are visible."""
        boxes = [widget.rect for widget in ui.widgets.values() if widget.kind == "option"]
        if ui.surface is None or count <= len(boxes):
            return
        area = boxes[0].unionall(boxes[1:])
        height = round(area.height * len(boxes) / count)
        top = area.top + round(area.height * self.top / count)
        left = area.right - ui.px(_BAR_RIGHT_PX)
        bar = pygame.Rect(left, top, ui.px(_BAR_WIDTH_PX), height)
        draw_box(ui, bar, shade(ui, _BAR_SHADE), radius=_BAR_WIDTH_PX / 2)

    @property
    def _option_height(self) -> int:
        """Height of an option at scale 1, px; enough for a finger on a phone."""
        if self._has_descriptions:
            return _DESCRIBED_OPTION_PX if self.has_key_hints else _FINGER_DESCRIBED_OPTION_PX
        return _OPTION_PX if self.has_key_hints else _FINGER_OPTION_PX

    @property
    def _visible_count(self) -> int:
        """Maximum number of options that are visible at once."""
        if self.has_key_hints and not self._has_descriptions:
            return MAX_VISIBLE_OPTIONS
        free_height = self.window_height - _OTHER_HEIGHT_PX
        count = min(free_height / (self._option_height + _OPTION_GAP_PX), MAX_VISIBLE_OPTIONS)
        return max(int(count), _MIN_VISIBLE_OPTIONS)

    def place(self, box: Rect, screen: Rect, scale: float) -> None:
        """Move the box to the upper part of the screen; its top edge stays there while the list grows."""
        free_height = max(screen.height - box.height, 0)
        box.midtop = screen.width // 2, min(round(_TOP_PX * scale), free_height // 2)

    def read_widgets(self, ui: Ui) -> None:
        """Read the typed text after each event, because several events may arrive within one frame."""
        if ui.focus == _FIELD and ui.edit is not None and ui.edit.text != self.text:
            self._set_text(ui.edit.text)

    def _set_text(self, text: str) -> None:
        self.text = text
        self.highlighted = 0
        self.top = 0
        self.error = ""

    def _accept(self, option: Option | None, ui: Ui) -> None:
        try:
            text = self.accept(self.text, option)
        except RobocovError as error:
            self.error = str(error)
            return
        if isinstance(text, str):
            self._complete(text, ui)
        else:
            self.is_done = True

    def _complete(self, text: str, ui: Ui) -> None:
        self._set_text(text)
        ui.edit = TextEdit.append_to(text)

    def handle_key(self, name: str, ui: Ui) -> bool:
        """Highlight a line (arrow keys), complete it (Tab) or accept it (Enter)."""
        options = list(self.options(self.text))
        option = options[self.highlighted] if self.highlighted < len(options) else None
        if name in _KEY_STEPS:
            self._move(_KEY_STEPS[name])
        elif name == "tab":
            if option is not None:
                self._complete(option.completion or option.text, ui)
        elif name in ENTER_KEYS:
            self._accept(option, ui)
        else:
            return False
        return True

    def handle_wheel(self, notches: float) -> bool:
        """Highlight another line: each notch of the wheel moves by one."""
        self._move(-round(notches))
        return True

    def _move(self, step: int) -> None:
        """Highlight the line `step` lines below, and scroll it into view."""
        count = len(self.options(self.text))
        self.highlighted = min(max(self.highlighted + step, 0), max(count - 1, 0))
        self._reveal_highlighted(count)

    def _reveal_highlighted(self, count: int) -> None:
        """Scroll so that the highlighted line is visible and no space stays empty below the last line."""
        top = min(self.top, max(count - self._visible_count, 0))
        self.top = min(max(top, self.highlighted - self._visible_count + 1), self.highlighted)


def create_list_choice(
    title: str, options: Callable[[], Iterable[Option]], accept: Callable[[Option], object]
) -> Choice:
    """Create a dialog that lets the user choose one of several lines.

    Parameters
    ----------
    title : str
    options : callable
        Returns all lines. Those that contain every typed word are listed.
    accept : callable
        Called with the chosen line.

    Returns
    -------
    Choice
    """

    def find_options(text: str) -> list[Option]:
        words = text.lower().split()
        matches = []
        for option in options():
            line = f"{option.text} {option.note}".lower()
            if all(word in line for word in words):
                matches.append(option)
        return matches

    def accept_option(text: str, option: Option | None) -> None:
        if option is None:
            raise InputError(f"no such entry: {text!r}")
        accept(option)

    return Choice(title, find_options, accept_option, placeholder="type to find")
