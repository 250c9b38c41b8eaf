"""Questions, lists and the menu at the cursor, drawn over the window; what keys and clicks do to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import pygame

from robocov_app.editor.ui.asking import ROWS, FileQuestion, ListQuestion, Question
from robocov_app.editor.ui.commands import GHOST, TYPED, told_commands
from robocov_app.editor.ui.import_view import ImportView
from robocov_app.editor.ui.importing import ImportQuestion
from robocov_app.render.fonts import label, shortened, text_width
from robocov_app.render.theme import LIGHT, mix
from robocov_app.toolkit.command import parted
from robocov_app.viewer.actions import Action, key_words
from robocov_app.viewer.overlays import CommandList, card, dim, wrapped

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov_app.editor.ui.editor import Editor
    from robocov_app.render.theme import Theme
    from robocov_app.viewer.layout import Layout

_ROW = 27
_MOST_LINES = 14


class Dialogs:
    """Shows what a desk asks, and takes the answers."""

    def __init__(self, desk: Editor) -> None:
        self._desk = desk
        self._boxes: list[tuple[pygame.Rect, int]] = []
        self._drawn: Question | ListQuestion | ImportQuestion | None = None  # what the boxes are of
        self._import = ImportView()
        self._opened_by = ""

    @property
    def open(self) -> bool:
        """Whether something is asked."""
        return self._desk.asked is not None

    def opened_by(self, letter: str) -> None:
        """Note the letter of the key that has opened one: it is still to come, and not meant for it."""
        self._opened_by = letter

    # what people do

    def key(self, name: str) -> None:
        """Take a key, by its name in the list of actions."""
        asked, self._opened_by = self._desk.asked, ""
        if isinstance(asked, Question):
            self._key_of_question(asked, name)
        elif isinstance(asked, ImportQuestion):
            self._key_of_import(asked, name)
        elif asked is not None:
            self._key_of_list(asked, name)

    def _key_of_question(self, asked: Question, name: str) -> None:
        if name in ("left", "shift+tab"):
            asked.move(-1)
        elif name in ("right", "tab"):
            asked.move(1)
        else:
            answer = asked.answer(name)
            if answer is not None:
                self._give(answer.call)

    def _key_of_list(self, asked: ListQuestion, name: str) -> None:
        if name == "escape":
            self._desk.asked = None
        elif name in ("backspace", "ctrl+backspace"):
            asked.erase(word=name != "backspace")
        elif name in ("up", "down", "page up", "page down"):
            asked.move((ROWS if "page" in name else 1) * (1 if "down" in name else -1))
        elif name == "tab":
            asked.complete()
        elif name == "ctrl+v":
            asked.type("".join(self._desk.pasteboard.get().splitlines()[:1]))
        elif name in ("return", "enter"):
            self._accept(asked)

    def _key_of_import(self, asked: ImportQuestion, name: str) -> None:
        if name == "escape":
            asked.close()
            self._desk.asked = None
        elif name in ("up", "shift+tab", "down", "tab"):
            asked.move(-1 if name in ("up", "shift+tab") else 1)
        elif name in ("left", "right"):
            asked.turn(-1 if name == "left" else 1)
        elif name in ("backspace", "ctrl+backspace", "delete"):
            asked.erase(all_of_it=name != "backspace")
        elif name == "ctrl+v":
            asked.type("".join(self._desk.pasteboard.get().splitlines()[:1]))
        elif name in ("return", "enter"):
            asked.accepted = True

    def _click_on_import(self, asked: ImportQuestion, pixel: tuple[int, int]) -> None:
        row, key, place = self._import.at(pixel)
        if key:
            self._key_of_import(asked, key)
        elif row is not None:
            if row == asked.chosen:
                asked.turn(1)
            asked.chosen = row
        elif place is not None:
            asked.keep_inside(place)

    def _accept(self, asked: ListQuestion) -> None:
        text = asked.accept()
        if text is not None:
            self._give(lambda: asked.call(text))

    def _give(self, call: Callable[[], object]) -> None:
        """Close it, and do what was answered: that may ask something else."""
        self._desk.asked = None
        self._desk.attempt(call)

    def letters(self, text: str) -> None:
        """Take letters."""
        asked = self._desk.asked
        if not isinstance(asked, Question) and asked is not None and text != self._opened_by:
            asked.type(text)
        self._opened_by = ""

    def click(self, pixel: tuple[int, int]) -> None:
        """Take a click: on an answer or a line; beside a list it closes it."""
        asked, hit = self._desk.asked, self._hit(pixel)
        if asked is not self._drawn:
            return
        if isinstance(asked, ImportQuestion):
            self._click_on_import(asked, pixel)
        elif isinstance(asked, Question):
            if hit is not None and hit >= 0:
                self._give(asked.answers[hit].call)
        elif asked is not None:
            if hit is None:
                self._desk.asked = None
            elif hit >= 0:
                asked.chosen = hit
                self._accept(asked)

    def wheel(self, amount: int) -> None:
        """Move through a list."""
        asked = self._desk.asked
        if isinstance(asked, ListQuestion | ImportQuestion):
            asked.move(-amount)

    def hover(self, pixel: tuple[int, int]) -> None:
        """Choose what the mouse is on."""
        asked, hit = self._desk.asked, self._hit(pixel)
        if asked is not None and asked is self._drawn and hit is not None and hit >= 0:
            asked.chosen = hit

    def _hit(self, pixel: tuple[int, int]) -> int | None:
        """Return the number of the answer or line at a pixel, -1 beside them; None beside the card."""
        return next((k for box, k in self._boxes if box.collidepoint(pixel)), None)

    # drawing

    def draw(self, screen: pygame.Surface, layout: Layout, theme: Theme) -> None:
        """Draw it."""
        asked = self._desk.asked
        self._boxes, self._drawn = [], asked
        if asked is None:
            return
        if isinstance(asked, ImportQuestion):
            self._import.draw(screen, asked, layout.scale, theme)
            return
        dim(screen, theme)
        if isinstance(asked, Question):
            self._draw_question(screen, asked, layout.scale, theme)
        else:
            self._draw_list(screen, asked, layout.scale, theme)

    def _draw_question(self, screen: pygame.Surface, asked: Question, scale: float, theme: Theme) -> None:
        width, height = screen.get_size()
        size, bold = round(13 * scale), round(16 * scale)
        wide = min(560 * scale, width - 40 * scale)
        lines = [line for part in asked.words.split("\n") for line in wrapped(part, size, wide - 48 * scale)]
        lines = [shortened(line, size, wide - 48 * scale) for line in lines]
        if len(lines) > _MOST_LINES:
            lines = [*lines[: _MOST_LINES - 1], f"… and {len(lines) - _MOST_LINES + 1} lines more"]
        box = pygame.Rect(0, 0, round(wide), round((112 + 20 * len(lines)) * scale))
        box.center = width // 2, round(height * 0.42)
        card(screen, box, theme, scale)
        left = box.left + round(24 * scale)
        title = shortened(asked.title, bold, wide - 48 * scale, True)
        screen.blit(label(title, bold, theme.ink, True), (left, box.top + round(18 * scale)))
        for k, line in enumerate(lines):
            ink = mix(theme.panel, theme.ink, 0.85)
            screen.blit(label(line, size, ink), (left, box.top + round((48 + 20 * k) * scale)))
        self._draw_answers(screen, asked, box, scale, theme)

    def _draw_answers(
        self, screen: pygame.Surface, asked: Question, box: pygame.Rect, scale: float, theme: Theme
    ) -> None:
        size = round(12.5 * scale)
        wides = [text_width(each.text, size, True) + round(36 * scale) for each in asked.answers]
        gap = round(8 * scale)
        x = box.right - round(24 * scale) - sum(wides) - gap * (len(wides) - 1)
        for k, (answer, wide) in enumerate(zip(asked.answers, wides, strict=True)):
            rect = pygame.Rect(x, box.bottom - round(48 * scale), wide, round(30 * scale))
            chosen = k == asked.chosen
            field = theme.background if theme is LIGHT else mix(theme.panel, theme.background, 0.8)
            radius = round(4 * scale)
            pygame.draw.rect(screen, theme.final if chosen else field, rect, border_radius=radius)
            edge = theme.final if chosen else mix(theme.panel, theme.ink, 0.24)
            pygame.draw.rect(screen, edge, rect, max(1, round(scale)), border_radius=radius)
            on = ((255, 255, 255) if theme is LIGHT else theme.background) if chosen else theme.ink
            words = label(answer.text, size, on, chosen)
            screen.blit(words, words.get_rect(center=rect.center))
            letter = answer.text.lower().find(answer.key)
            if letter >= 0:  # a line under the letter that gives it
                before = text_width(answer.text[:letter], size, chosen)
                under = pygame.Rect(words.get_rect(center=rect.center))
                one = text_width(answer.text[letter], size, chosen)
                screen.fill(on, (under.left + before, under.bottom - round(scale), one, max(1, round(scale))))
            self._boxes.append((rect, k))
            x += wide + gap

    def _draw_list(self, screen: pygame.Surface, asked: ListQuestion, scale: float, theme: Theme) -> None:
        row = _ROW * scale
        options = asked.options
        shown = options[asked.top : asked.top + ROWS]
        wide = min(660 * scale, screen.get_width() - 40 * scale)
        box = pygame.Rect(0, 0, round(wide), round(76 * scale + row * max(len(shown), 1) + 34 * scale))
        box.midtop = screen.get_width() // 2, round(64 * scale)
        card(screen, box, theme, scale)
        self._boxes.append((box, -1))
        left, size, small = box.left + round(18 * scale), round(14 * scale), round(12.5 * scale)
        room = box.width - 36 * scale
        title = label(
            shortened(asked.title, round(12 * scale), room, True), round(12 * scale), theme.faint, True
        )
        screen.blit(title, (left, box.top + round(12 * scale)))
        text = asked.text
        while text and text_width(f"…{text}▏", size) > room:  # the end of a path counts
            text = text[1:]
        typed = text if text == asked.text else f"…{text}"
        screen.blit(label(f"{typed}▏", size, theme.ink), (left, box.top + round(38 * scale)))
        if not asked.text and isinstance(asked, FileQuestion):
            ghost = label(f"a path from {asked.folder.absolute()}", small, theme.faint)
            screen.blit(ghost, (left + round(12 * scale), box.top + round(40 * scale)), (0, 0, room, row))
        line = mix(theme.panel, theme.ink, 0.2)
        screen.fill(line, pygame.Rect(box.left, box.top + round(68 * scale), box.width, 1))
        y = box.top + 70 * scale
        if not shown:
            new = isinstance(asked, FileQuestion) and asked.saves
            words = "Enter saves it there" if new and asked.text.strip() else "nothing of that name"
            screen.blit(label(words, small, theme.faint), (left, round(y + 5 * scale)))
        for k, (name, aside) in enumerate(shown, asked.top):
            rect = pygame.Rect(box.left + 1, round(y), box.width - 2, round(row))
            if k == asked.chosen:
                screen.fill(mix(theme.panel, theme.final, 0.2), rect)
            beside = label(aside, round(11 * scale), theme.faint)
            words = shortened(name, small, room - beside.get_width() - 12 * scale)
            screen.blit(label(words, small, theme.ink), (left, round(y + 5 * scale)))
            screen.blit(beside, beside.get_rect(midright=(box.right - round(18 * scale), rect.centery)))
            self._boxes.insert(0, (rect, k))
            y += row
        more = f"{len(options)} in all · " if len(options) > ROWS else ""
        hint = label(more + asked.hint, round(11 * scale), theme.faint)
        screen.blit(hint, hint.get_rect(midbottom=(box.centerx, box.bottom - round(9 * scale))))


class Commands(CommandList):
    """The editor's commands by name; or a command such as ``rotate 30``."""

    def __init__(self) -> None:
        valued = [Action(f"type:{word}", f"{word} {typed.example}", "", ()) for word, typed in TYPED.items()]
        super().__init__([*told_commands(), *valued], GHOST)

    def show(self, text: str = "") -> None:
        """Open it, with the beginning of a command."""
        super().show()
        self.text = text

    def is_command(self) -> bool:
        """Whether what is typed is a command with a value, not the name of an action."""
        word, value = parted(self.text)
        return bool(value) and word in TYPED


@dataclass
class Menu:
    """What can be done at a place, as a list at the cursor.

    Attributes
    ----------
    actions : list of Action or None
        None for a line between two groups.
    at : (x, y), px
    """

    actions: list[Action | None]
    at: tuple[int, int]
    chosen: int = -1
    box: pygame.Rect | None = None

    def _rows(self, scale: float) -> list[tuple[int, Action | None]]:
        rows, y = [], round(5 * scale)
        for action in self.actions:
            rows.append((y, action))
            y += round((24 if action else 9) * scale)
        rows.append((y, None))
        return rows

    def move(self, by: int) -> None:
        """Choose another."""
        there = [k for k, action in enumerate(self.actions) if action]
        if there:
            place = there.index(self.chosen) + by if self.chosen in there else (0 if by > 0 else -1)
            self.chosen = there[place % len(there)]

    def hover(self, pixel: tuple[int, int], scale: float) -> None:
        """Choose what the mouse is on."""
        self.chosen = -1
        if self.box is None or not self.box.collidepoint(pixel):
            return
        rows = self._rows(scale)
        for k, (top, action) in enumerate(rows[:-1]):
            if action and self.box.top + top <= pixel[1] < self.box.top + rows[k + 1][0]:
                self.chosen = k

    def mouse(self, event: pygame.event.Event, scale: float) -> str | None:
        """Take an event of the mouse: return what was chosen, nothing to close, None to stay open."""
        if event.type == pygame.MOUSEMOTION:
            self.hover(event.pos, scale)
        elif event.type == pygame.MOUSEBUTTONUP and event.button == 1:
            return self._taken() or None
        elif event.type == pygame.MOUSEBUTTONDOWN and not (self.box and self.box.collidepoint(event.pos)):
            return ""
        return None

    def key(self, key: int) -> str | None:
        """Take a key: return what was chosen, nothing to close, None to stay open."""
        if key in (pygame.K_UP, pygame.K_DOWN):
            self.move(1 if key == pygame.K_DOWN else -1)
            return None
        return self._taken() if key in (pygame.K_RETURN, pygame.K_KP_ENTER) else ""

    def _taken(self) -> str:
        action = self.actions[self.chosen] if 0 <= self.chosen < len(self.actions) else None
        return action.name if action else ""

    def draw(self, screen: pygame.Surface, theme: Theme, scale: float) -> None:
        """Draw it, where there is room beside the cursor."""
        size, small = round(12.5 * scale), round(11 * scale)
        keys = {each.name: key_words(each.keys[0]) if each.keys else "" for each in self.actions if each}
        wide = max(
            text_width(each.title, size) + text_width(keys[each.name], small) for each in self.actions if each
        )
        rows = self._rows(scale)
        box = pygame.Rect(*self.at, wide + round(56 * scale), rows[-1][0] + round(5 * scale))
        box.clamp_ip(screen.get_rect())
        self.box = box
        card(screen, box, theme, scale)
        for k, (top, action) in enumerate(rows[:-1]):
            y = box.top + top
            if action is None:
                line = pygame.Rect(box.left + 8, y + round(4 * scale), box.width - 16, 1)
                screen.fill(mix(theme.panel, theme.ink, 0.2), line)
                continue
            row = pygame.Rect(box.left + 3, y, box.width - 6, rows[k + 1][0] - top)
            if k == self.chosen:
                pygame.draw.rect(
                    screen, mix(theme.panel, theme.final, 0.22), row, border_radius=round(4 * scale)
                )
            words = label(action.title, size, theme.ink)
            screen.blit(words, words.get_rect(midleft=(box.left + round(14 * scale), row.centery)))
            key = label(keys[action.name], small, theme.faint)
            screen.blit(key, key.get_rect(midright=(box.right - round(14 * scale), row.centery)))
