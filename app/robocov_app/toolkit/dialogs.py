"""Dialogs over a window: questions with answers, lists to choose from by typing, files."""

import os
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path

import pygame
from pygame import Rect, Surface

from robocov.errors import InputError, RobocovError
from robocov_app.look.theme import LIGHT, Theme
from robocov_app.render.fonts import text_width
from robocov_app.toolkit.input import OF_THE_MOUSE, key_of, wheel_notches
from robocov_app.toolkit.overlay import card, dim, wrapped
from robocov_app.toolkit.text_edit import TextEdit
from robocov_app.toolkit.ui import TEXT, Ui

MOST_LISTED = 5000  # names of a folder that are looked at
ROWS = 9  # lines of a list that are in sight
_MOST_LINES = 14
_NOT_OURS = (pygame.QUIT, pygame.VIDEORESIZE, pygame.WINDOWSIZECHANGED)


class Dialog:
    """Something that is asked, in a card over the window."""

    width = 560.0
    margin = 20.0, 16.0  # beside and above what is in it, px at scale 1
    veils = True  # whether all else steps back
    closes_beside = False  # whether a press beside it gives it up
    done = False

    def page(self, ui: Ui) -> None:
        """Show it."""

    def place(self, box: Rect, screen: Rect, scale: float) -> None:
        box.midtop = screen.width // 2, max(round((screen.height - box.height) * 0.42), 0)

    def framed(self, ui: Ui) -> None:
        side, above = self.margin
        ui.inset(side, above, side)
        self.page(ui)
        ui.space(above)

    def key(self, name: str, ui: Ui) -> bool:
        """Take a key; return whether it meant something."""
        return False

    def canceled(self) -> None:
        """Take note that it was given up."""


@dataclass
class Answer:
    """Button of a dialog: its words, its action, and a key besides those of the focus."""

    text: str
    call: Callable[[], object] = lambda: None
    key: str = ""


@dataclass
class Question(Dialog):
    """A question with answers as buttons; the first is chosen by Enter, `on_cancel` done by Escape."""

    title: str
    words: str
    answers: Sequence[Answer]
    on_cancel: Callable[[], object] = lambda: None
    chosen: int = 0

    def page(self, ui: Ui) -> None:
        ui.words(self.title, size=16, bold=True)
        ui.space(6)
        size, wide = ui.px(TEXT + 1), ui.px(ui.wide)
        lines = [line for part in self.words.split("\n") for line in wrapped(part, size, wide) or [""]]
        for line in lines[:_MOST_LINES]:
            ui.words(line, size=TEXT + 1)
        if len(lines) > _MOST_LINES:
            ui.words(f"… and {len(lines) - _MOST_LINES} lines more", size=TEXT + 1, color=ui.theme.faint)
        ui.space(12)
        widths = [text_width(each.text, ui.px(TEXT), True) / ui.scale + 36 for each in self.answers]
        ui.row(max(ui.wide - sum(widths) - 8 * len(widths), 1.0), *widths, height=30, gap=8, below=0)
        ui.cell()
        for k, answer in enumerate(self.answers):
            tip = f"Key {answer.key.upper()}" if answer.key else ""
            if ui.button(answer.text, key=f"answer:{k}", chosen=k == self.chosen, tip=tip):
                self._give(answer)

    def _give(self, answer: Answer) -> None:
        self.done = True
        answer.call()

    def key(self, name: str, ui: Ui) -> bool:
        by = {"left": -1, "shift+tab": -1, "right": 1, "tab": 1}.get(name, 0)
        self.chosen = (self.chosen + by) % len(self.answers)
        own = next((each for each in self.answers if each.key == name), None)
        if name in ("return", "enter"):
            own = self.answers[self.chosen]
        if own is not None:
            self._give(own)
        return True

    def canceled(self) -> None:
        self.on_cancel()


@dataclass(frozen=True)
class Option:
    """A line to choose."""

    text: str
    aside: str = ""  # at its right end
    fills: str = ""  # what completion makes of it
    why: str = ""  # it cannot be chosen
    value: object = None


@dataclass
class Choice(Dialog):
    """A list that typing narrows down; an error of `accept` is told below, and nothing typed is lost."""

    width, closes_beside = 620.0, True

    title: str
    options: Callable[[str], Sequence[Option]]  # the lines for what is typed
    accept: Callable[[str, Option | None], object]  # takes text and line; a text it returns is typed in place
    ghost: str = ""  # in the empty field
    hint: str = "↑ ↓ choose · Enter does it · Esc closes"
    none: str = "nothing of that name"
    text: str = ""
    chosen: int = 0
    top: int = 0
    trouble: str = ""

    def page(self, ui: Ui) -> None:
        ui.words(self.title, color=ui.theme.faint, bold=True)
        if ui.edit is None or ui.focus != "text":
            ui.focus, ui.edit = "text", TextEdit(self.text, len(self.text), len(self.text))
        ui.row(height=32, below=8)
        ui.text_entry("text", self.text, ghost=self.ghost)
        self.typed(ui)
        ui.words(self.trouble, color=ui.theme.trajectory, bold=True)
        found = list(self.options(self.text))
        self.chosen = min(self.chosen, max(len(found) - 1, 0))
        ui.row(height=26, below=1)
        if not found:
            ui.label(self.none, style="unit")
        for k, each in list(enumerate(found))[self.top : self.top + ROWS]:
            if ui.option(each.text, each.aside, key=f"option:{k}", chosen=k == self.chosen, why=each.why):
                self._accept(each, ui)
        ui.row(height=22, below=0)
        more = f"{len(found)} in all · " if len(found) > ROWS else ""
        ui.label(more + self.hint, style="unit", at="center")

    def place(self, box: Rect, screen: Rect, scale: float) -> None:
        box.midtop = screen.width // 2, round(64 * scale)

    def typed(self, ui: Ui) -> None:
        """Take note of what the field holds: letters and Enter may come within one frame."""
        if ui.focus == "text" and ui.edit is not None and ui.edit.text != self.text:
            self._begin(ui.edit.text)

    def _begin(self, text: str) -> None:
        self.text, self.chosen, self.top, self.trouble = text, 0, 0, ""

    def _accept(self, option: Option | None, ui: Ui) -> None:
        try:
            filled = self.accept(self.text, option)
        except RobocovError as error:
            self.trouble = str(error)
            return
        if isinstance(filled, str):
            self._fill(filled, ui)
        else:
            self.done = True

    def _fill(self, text: str, ui: Ui) -> None:
        self._begin(text)
        ui.edit = TextEdit(text, len(text), len(text))

    def key(self, name: str, ui: Ui) -> bool:
        found = list(self.options(self.text))
        option = found[self.chosen] if self.chosen < len(found) else None
        if by := {"up": -1, "down": 1, "page up": -ROWS, "page down": ROWS}.get(name, 0):
            self.wheel(-by)
        elif name == "tab":
            if option is not None:
                self._fill(option.fills or option.text, ui)
        elif name in ("return", "enter"):
            self._accept(option, ui)
        else:
            return False
        return True

    def wheel(self, notches: float) -> None:
        self.chosen = min(max(self.chosen - round(notches), 0), max(len(self.options(self.text)) - 1, 0))
        self.top = min(max(self.top, self.chosen - ROWS + 1), self.chosen)


def list_choice(
    title: str, options: Callable[[], Iterable[Option]], accept: Callable[[Option], object]
) -> Choice:
    def found(typed: str) -> list[Option]:
        words = typed.lower().split()
        lines = [(each, f"{each.text} {each.aside}".lower()) for each in options()]
        return [each for each, line in lines if all(word in line for word in words)]

    def chosen(typed: str, option: Option | None) -> None:
        if option is None:
            raise InputError(f"expected one of the list, got {typed!r}")
        accept(option)

    return Choice(title, found, chosen, "type to find")


def file_choice(
    title: str,
    folder: Path,
    accept: Callable[[Path], object],
    *,
    endings: Sequence[str] = (),
    recent: Sequence[Path] = (),
    text: str = "",
) -> Choice:
    """Return a choice of a file by its path from `folder`; `text` is the name of one to be saved."""
    saves = bool(text)

    def path_of(typed: str) -> Path:
        return folder / os.path.expanduser(typed)  # noqa: PTH111 - raises nothing where there is no such user

    @cache
    def options(typed: str) -> list[Option]:
        begun = typed.rpartition("/")[2]
        prefix = typed.removesuffix(begun)
        place = path_of(prefix)
        try:
            there = [(not each.is_dir(), each) for each in islice(place.iterdir(), MOST_LISTED)]
        except (OSError, ValueError):
            return []
        found = [Option(str(each), "recent", str(each), value=each) for each in recent if not typed]
        for is_file, each in sorted(there, key=lambda pair: (pair[0], pair[1].name.lower())):
            hidden = each.name.startswith(".") and not begun.startswith(".")
            wanted = not (is_file and endings) or each.suffix.lower() in endings
            if wanted and not hidden and begun.lower() in each.name.lower():
                name, kind = (each.name, "") if is_file else (f"{each.name}/", "folder")
                found.append(Option(name, kind, prefix + name, value=each))
        if not begun:
            found.append(Option("../", "folder", f"{place.resolve().parent.as_posix().rstrip('/')}/"))
        return found

    def chosen(typed: str, option: Option | None) -> object:
        if saves and typed.strip() and not typed.endswith("/"):
            accept(path_of(typed.strip()))
        elif option is not None and option.text.endswith("/"):
            return option.fills
        elif option is not None and isinstance(option.value, Path):
            accept(option.value)
        elif typed.strip():
            accept(path_of(typed.strip()))
        return None

    none = "Enter saves it there" if saves else Choice.none
    hint = "↑ ↓ choose · Tab completes · Enter accepts · Esc closes"
    return Choice(title, options, chosen, f"a path from {folder.absolute()}", hint, none, text)


class Dialogs:
    """Shows what is asked, one thing at a time, and takes the answers."""

    def __init__(self) -> None:
        self.asked: Dialog | None = None
        self._ui: Ui | None = None
        self._swallow = ""
        self._drawn = False  # whether it was, since it is asked

    @property
    def open(self) -> bool:
        return self.asked is not None

    def ask(self, dialog: Dialog) -> None:
        self.asked, self._ui, self._swallow, self._drawn = dialog, None, "", False

    def swallow(self, letter: str) -> None:
        """Take note that the letter of the key that has opened it is still to come, and not meant for it."""
        self._swallow = letter if self.open else ""

    def close(self) -> None:
        asked, self.asked = self.asked, None
        if asked is not None:
            asked.canceled()

    def drop(self) -> None:
        """Remove a dialog that cannot be drawn, even if it cannot be closed in an orderly way."""
        with suppress(Exception):
            self.close()
        self.asked = None

    def take(self, event: pygame.event.Event) -> bool:
        asked = self.asked
        if asked is None:
            return False
        if event.type == pygame.DROPFILE and not asked.veils:
            self.close()
            return False
        ui = self._ui or self._made(asked, LIGHT, 1.0)  # keys come before it was drawn
        if not self._drawn and event.type in OF_THE_MOUSE:
            return True
        ui.stale = True
        if event.type == pygame.TEXTINPUT and self._swallow:
            swallowed, self._swallow = self._swallow, ""
            if event.text == swallowed:
                return True
        if event.type == pygame.KEYDOWN:
            name, self._swallow = key_of(event), ""
            composing = ui.edit is not None and bool(ui.edit.composed)
            if name == "escape" and not composing:
                self.close()
            elif composing or not asked.key(name, ui):
                ui.take(event)
            if self.asked is not asked:  # it was answered, and that asks something else
                self.swallow(event.unicode)
        elif event.type == pygame.MOUSEWHEEL and isinstance(asked, Choice):
            asked.wheel(wheel_notches(event))
        elif event.type != pygame.MOUSEBUTTONDOWN or ui.box.collidepoint(event.pos):
            ui.take(event)
        elif asked.closes_beside:
            self.close()
        if isinstance(asked, Choice):
            asked.typed(ui)
        if asked.done and self.asked is asked:
            self.asked = None
        return event.type not in _NOT_OURS

    def _made(self, asked: Dialog, theme: Theme, scale: float) -> Ui:
        self._ui = ui = Ui(asked.framed, theme, scale)
        ui.background = None
        ui.box = Rect(0, 0, round(asked.width * scale), 100)
        ui.run(None, None)
        return ui

    def draw(self, screen: Surface, theme: Theme, scale: float) -> None:
        asked, ui = self.asked, self._ui
        if asked is None:
            return
        self._drawn = True
        if ui is None or ui.theme is not theme or ui.scale != scale:
            ui = self._made(asked, theme, scale)
        if asked.veils:
            dim(screen, theme)
        wide = min(asked.width * scale, screen.get_width() - 24 * scale)
        for _ in range(2):  # its height is known after it has run
            ui.box = Rect(0, 0, round(wide), min(round(ui.y * scale), screen.get_height()))
            asked.place(ui.box, screen.get_rect(), scale)
            ui.run(None, None)
        card(screen, ui.box, theme, scale)
        ui.stale = True
        ui.draw(screen)
        ui.draw_over(screen)
