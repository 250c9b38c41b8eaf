"""What lies over the window for a while: messages, keys, commands, captions, the tour."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Protocol

import numpy as np
import pygame

from robocov_app.render import sprites
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import label, shortened, text_width
from robocov_app.render.theme import mix
from robocov_app.viewer.actions import key_words, matching

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from robocov_app.render.theme import Theme
    from robocov_app.viewer.actions import Action
    from robocov_app.viewer.layout import Layout
    from robocov_app.viewer.lessons import LessonPlayer

FLAT = Camera((0.0, 0.0), 1.0, (0.0, 0.0, 1.0, 1.0))
"""For strokes and words that are placed in pixels alone."""


def wrapped(text: str, size: int, width: float, bold: bool = False) -> list[str]:
    """Break text into lines of at most `width` pixels."""
    lines: list[str] = []
    for word in text.split():
        if lines and text_width(f"{lines[-1]} {word}", size, bold) <= width:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return lines


def card(screen: pygame.Surface, box: pygame.Rect, theme: Theme, scale: float) -> None:
    """Draw a card with a soft edge."""
    radius = round(8 * scale)
    pygame.draw.rect(screen, theme.panel, box, border_radius=radius)
    pygame.draw.rect(
        screen, mix(theme.panel, theme.ink, 0.28), box, max(1, round(scale)), border_radius=radius
    )


def tag(canvas: Canvas, words: str, at: tuple[float, float], anchor: str = "left") -> None:
    """Write words on a small card."""
    wide = canvas.text_width(words)
    x, y = at
    width, height = canvas.surface.get_size()
    x = min(max(x, 6.0 * canvas.scale), width - wide - 6 * canvas.scale)
    y = min(max(y, 12 * canvas.scale), height - 12 * canvas.scale)
    box = pygame.Rect(0, 0, wide + round(12 * canvas.scale), round(20 * canvas.scale))
    box.midleft = round(x - 6 * canvas.scale), round(y)
    theme = canvas.theme
    pygame.draw.rect(canvas.surface, theme.background, box, border_radius=round(4 * canvas.scale))
    pygame.draw.rect(
        canvas.surface, mix(theme.background, theme.ink, 0.3), box, 1, border_radius=round(4 * canvas.scale)
    )
    canvas.text(words, (x, y), anchor=anchor)


def dim(screen: pygame.Surface, theme: Theme) -> None:
    """Let everything so far step back."""
    veil = pygame.Surface(screen.get_size(), pygame.SRCALPHA, 32)
    veil.fill((*theme.background, 150))
    screen.blit(veil, (0, 0))


class Saying(Protocol):
    """Who tells something for a while."""

    message: str
    trouble: bool


def draw_message(screen: pygame.Surface, desk: Saying, layout: Layout, theme: Theme) -> None:
    """Show what was said last, above the plot."""
    if not desk.message:
        return
    scale = layout.scale
    size = round(12.5 * scale)
    left, top, width, height = layout.arena
    lines = wrapped(desk.message, size, min(width - 80 * scale, 620 * scale))
    wide = max(text_width(line, size) for line in lines) + 28 * scale
    high = (len(lines) * 18 + 14) * scale
    box = pygame.Rect(0, 0, round(wide), round(high))
    box.midbottom = round(left + width / 2), round(top + height - 42 * scale)
    fill = mix(theme.panel, theme.trajectory, 0.14) if desk.trouble else theme.panel
    radius = round(8 * scale)
    pygame.draw.rect(screen, fill, box, border_radius=radius)
    edge = theme.trajectory if desk.trouble else mix(theme.panel, theme.ink, 0.3)
    pygame.draw.rect(screen, edge, box, max(1, round(scale)), border_radius=radius)
    for k, line in enumerate(lines):
        picture = label(line, size, theme.ink)
        screen.blit(picture, picture.get_rect(center=(box.centerx, round(box.top + (16 + 18 * k) * scale))))


def draw_keys(
    screen: pygame.Surface,
    layout: Layout,
    theme: Theme,
    actions: Iterable[Action],
    groups: Sequence[str],
    words: str,
) -> None:
    """Show the keys of actions, group by group in columns, under a line with a hint."""
    dim(screen, theme)
    actions = [action for action in actions if action.keys]
    scale = layout.scale
    blocks: list[tuple[str, Action | None]] = []
    for group in groups:
        blocks.append((group, None))
        members = [action for action in actions if action.group == group]
        blocks += [(group, action) for action in members]
    width, height = screen.get_size()
    row = 16.5 * scale
    columns = 4 if width >= 1150 * scale else 3
    # small windows get smaller letters rather than a page that does not fit
    rows = -(-(len(blocks) + len(groups)) // columns) + 1
    row = min(row, (height - 90 * scale) / rows)
    size = max(8, round(row * 0.66))
    box = pygame.Rect(0, 0, round(min(width - 24 * scale, 1240 * scale)), round(rows * row + 66 * scale))
    box.center = width // 2, height // 2
    card(screen, box, theme, scale)
    title = label("Keys", round(16 * scale), theme.ink, True)
    screen.blit(title, (box.left + round(20 * scale), box.top + round(12 * scale)))
    hint = label(words, round(11 * scale), theme.faint)
    screen.blit(hint, hint.get_rect(midright=(box.right - round(20 * scale), box.top + round(22 * scale))))
    wide = (box.width - 40 * scale) / columns
    x, y = box.left + 20 * scale, box.top + 44 * scale
    limit = box.bottom - 14 * scale
    for group, action in blocks:
        # a heading does not stand alone at the foot of a column
        if y + row * (2.6 if action is None else 1.0) > limit:
            x, y = x + wide, box.top + 44 * scale
        if action is None:
            if y > box.top + 45 * scale:
                y += 0.5 * row
            picture = label(group.upper(), max(8, round(size * 0.92)), theme.final, True)
            screen.blit(picture, (round(x), round(y)))
        else:
            keys = "  ".join(key_words(key) for key in action.keys[:1])
            screen.blit(label(keys, size, theme.ink, True), (round(x), round(y)))
            # tools tell more than fits
            words = action.title.partition(":")[0] if action.group == "Tools" else action.title
            room = wide - 92 * scale
            screen.blit(
                label(shortened(words, size, room), size, mix(theme.panel, theme.ink, 0.8)),
                (round(x + 84 * scale), round(y)),
            )
        y += row


class CommandList:
    """Commands by name: type some letters, choose, Enter.

    Parameters
    ----------
    actions : list of Action
    ghost : str
        What is shown before anything is typed.
    """

    ROWS = 9

    def __init__(self, actions: Sequence[Action], ghost: str) -> None:
        self.open = False
        self.text = ""
        self.chosen = 0
        self._actions = [action for action in actions if action.name != "palette"]
        self._ghost = ghost

    def show(self) -> None:
        """Open it, empty."""
        self.open, self.text, self.chosen = True, "", 0

    @property
    def found(self) -> list[Action]:
        """What matches."""
        return matching(self._actions, self.text)[: self.ROWS]

    def type(self, text: str) -> None:
        """Take letters."""
        self.text, self.chosen = self.text + text, 0

    def erase(self) -> None:
        """Take the last letter back."""
        self.text, self.chosen = self.text[:-1], 0

    def move(self, by: int) -> None:
        """Choose another."""
        self.chosen = min(max(self.chosen + by, 0), max(len(self.found) - 1, 0))

    def is_command(self) -> bool:
        """Whether what is typed is a command with a value, not the name of an action."""
        return False

    def draw(self, screen: pygame.Surface, layout: Layout, theme: Theme) -> None:
        """Draw it."""
        dim(screen, theme)
        scale = layout.scale
        row = 27 * scale
        found = [] if self.is_command() else self.found
        rows = max(len(found), 1)
        box = pygame.Rect(0, 0, round(560 * scale), round(48 * scale + row * rows + 34 * scale))
        box.midtop = screen.get_width() // 2, round(70 * scale)
        card(screen, box, theme, scale)
        size = round(14 * scale)
        typed = label(self.text + "▏", size, theme.ink)
        screen.blit(typed, (box.left + round(18 * scale), box.top + round(14 * scale)))
        if not self.text:
            ghost = label(self._ghost, size, theme.faint)
            screen.blit(ghost, (box.left + round(30 * scale), box.top + round(14 * scale)))
        line = mix(theme.panel, theme.ink, 0.2)
        screen.fill(line, pygame.Rect(box.left, box.top + round(44 * scale), box.width, 1))
        y = box.top + 46 * scale
        if self.is_command():
            screen.blit(
                label(f"Enter: set {self.text.strip()}", round(12.5 * scale), theme.final, True),
                (box.left + round(18 * scale), round(y + 5 * scale)),
            )
        elif not found:
            screen.blit(
                label("nothing of that name", round(12.5 * scale), theme.faint),
                (box.left + round(18 * scale), round(y + 5 * scale)),
            )
        for k, action in enumerate(found):
            rect = pygame.Rect(box.left + 1, round(y), box.width - 2, round(row))
            if k == self.chosen:
                screen.fill(mix(theme.panel, theme.final, 0.2), rect)
            words = shortened(action.title, round(12.5 * scale), box.width - 170 * scale)
            screen.blit(
                label(words, round(12.5 * scale), theme.ink),
                (box.left + round(18 * scale), round(y + 5 * scale)),
            )
            keys = " or ".join(key_words(key) for key in action.keys[:2])
            picture = label(keys, round(11 * scale), theme.faint)
            screen.blit(picture, picture.get_rect(midright=(box.right - round(18 * scale), rect.centery)))
            y += row
        hint = label("↑ ↓ choose · Enter does it · Esc closes", round(11 * scale), theme.faint)
        screen.blit(hint, hint.get_rect(midbottom=(box.centerx, box.bottom - round(9 * scale))))


def draw_caption(
    screen: pygame.Surface, layout: Layout, theme: Theme, title: str, text: str, progress: float
) -> None:
    """Show a chapter of the tour: its title and its two sentences, over the lower arena."""
    scale = layout.scale
    left, top, width, height = layout.arena
    size, bold = round(14 * scale), round(15.5 * scale)
    wide = min(width - 40 * scale, 800 * scale)
    lines = wrapped(text, size, wide - 44 * scale)
    high = (44 + 20 * len(lines)) * scale
    box = pygame.Rect(0, 0, round(wide), round(high))
    box.midbottom = round(left + width / 2), round(top + height - 44 * scale)
    card(screen, box, theme, scale)
    screen.blit(
        label(title, bold, theme.final, True), (box.left + round(22 * scale), box.top + round(11 * scale))
    )
    for k, line in enumerate(lines):
        screen.blit(
            label(line, size, theme.ink),
            (box.left + round(22 * scale), box.top + round((35 + 20 * k) * scale)),
        )
    bar = pygame.Rect(
        box.left + 8, box.bottom - max(3, round(3 * scale)), box.width - 16, max(2, round(2 * scale))
    )
    screen.fill(mix(theme.panel, theme.ink, 0.15), bar)
    bar.width = round(bar.width * min(max(progress, 0.0), 1.0))
    screen.fill(theme.final, bar)


def draw_tour(screen: pygame.Surface, layout: Layout, theme: Theme, tour: LessonPlayer) -> None:
    """Show a lesson in place of the panel: what its chapter says and asks, and which chapters there are."""
    scale = layout.scale
    left, top, width, height = layout.panel
    screen.fill(theme.panel, pygame.Rect(layout.panel))
    canvas = Canvas(screen, FLAT, theme, scale, np.zeros(1, dtype=np.intp))
    x, y, wide = left + 20 * scale, top + 18 * scale, width - 40 * scale
    screen.blit(label("LESSON", round(11 * scale), theme.faint, True), (round(x), round(y)))
    y += 30 * scale
    bold, size = round(18 * scale), round(14 * scale)
    for line in wrapped(tour.chapter.title, bold, wide, True):
        screen.blit(label(line, bold, theme.final, True), (round(x), round(y)))
        y += 25 * scale
    y += 6 * scale
    for line in wrapped(tour.text, size, wide):
        screen.blit(label(line, size, theme.ink), (round(x), round(y)))
        y += 21 * scale
    y += 8 * scale
    for asked in tour.asks:
        for line in wrapped(asked, size, wide):
            screen.blit(label(line, size, theme.final), (round(x), round(y)))
            y += 21 * scale
    row = 23 * scale
    y = max(y + 24 * scale, top + height - 62 * scale - row * len(tour.chapters))
    small = round(12 * scale)
    for k, title in enumerate(tour.chapters):
        now = k == tour.number
        colour = theme.ink if now else theme.faint
        fill = theme.final if k <= tour.number else mix(theme.panel, theme.ink, 0.25)
        canvas.stamp(partial(sprites.dot, 3.5 * scale, fill), (x + 4 * scale, y + 8 * scale))
        words = shortened(title, small, wide - 18 * scale, now)
        screen.blit(label(words, small, colour, now), (round(x + 16 * scale), round(y)))
        y += row
    bar = pygame.Rect(round(x), round(top + height - 46 * scale), round(wide), max(3, round(3 * scale)))
    pygame.draw.rect(screen, mix(theme.panel, theme.ink, 0.15), bar, border_radius=bar.height)
    bar.width = max(round(bar.width * min(max(tour.progress, 0.0), 1.0)), bar.height)
    pygame.draw.rect(screen, theme.final, bar, border_radius=bar.height)
    hint = label("← → chapters · Space · F2 just play · Esc ends", round(11 * scale), theme.faint)
    screen.blit(hint, (round(x), round(top + height - 32 * scale)))
