"""The page of keys, as F1 shows it."""

from collections.abc import Iterable, Sequence

import pygame

from robocov_app.render.fonts import label, shortened
from robocov_app.render.theme import Theme, mix
from robocov_app.toolkit.command import Command
from robocov_app.toolkit.input import key_words
from robocov_app.toolkit.overlay import card, dim


def draw_keys(
    screen: pygame.Surface,
    theme: Theme,
    scale: float,
    commands: Iterable[Command],
    groups: Sequence[str],
    words: str,
) -> None:
    """Show the keys of commands, group by group in columns, under a line with a hint."""
    dim(screen, theme)
    keyed = [each for each in commands if each.keys and not each.hidden]
    blocks: list[tuple[str, Command | None]] = []
    for group in groups:
        blocks.append((group, None))
        blocks += [(group, each) for each in keyed if each.group == group]
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
    for group, command in blocks:
        # a heading does not stand alone at the foot of a column
        if y + row * (2.6 if command is None else 1.0) > limit:
            x, y = x + wide, box.top + 44 * scale
        if command is None:
            if y > box.top + 45 * scale:
                y += 0.5 * row
            heading = label(group.upper(), max(8, round(size * 0.92)), theme.final, True)
            screen.blit(heading, (round(x), round(y)))
        else:
            screen.blit(label(key_words(command.keys[0]), size, theme.ink, True), (round(x), round(y)))
            told = shortened(command.title.partition(":")[0], size, wide - 92 * scale)
            meaning = label(told, size, mix(theme.panel, theme.ink, 0.8))
            screen.blit(meaning, (round(x + 84 * scale), round(y)))
        y += row
