"""The lesson over the window: its page in the place of the panel, or its caption."""

from collections.abc import Callable
from functools import partial

import pygame

from robocov_app.look.colors import mix
from robocov_app.look.theme import Theme
from robocov_app.render import sprites
from robocov_app.render.fonts import label, shortened
from robocov_app.toolkit.layout import Layout
from robocov_app.toolkit.overlay import card, flat_canvas, wrapped
from robocov_app.viewer.lessons import LessonPlayer

Spot = tuple[pygame.Rect, Callable[[], object]]


def draw_caption(screen: pygame.Surface, layout: Layout, theme: Theme, tour: LessonPlayer) -> None:
    scale, title = layout.scale, f"{tour.number + 1}  {tour.chapter.title}"
    left, top, width, height = layout.arena
    size, bold, wide = round(14 * scale), round(15.5 * scale), min(width - 40 * scale, 800 * scale)
    lines = wrapped(" ".join([tour.chapter.text, *tour.asks]), size, wide - 44 * scale)
    box = pygame.Rect(0, 0, round(wide), round((44 + 20 * len(lines)) * scale))
    box.midbottom = round(left + width / 2), round(top + height - 44 * scale)
    card(screen, box, theme, scale)
    x, thick = box.left + round(22 * scale), max(2, round(2 * scale))
    screen.blit(label(title, bold, theme.final, True), (x, box.top + round(11 * scale)))
    for k, line in enumerate(lines):
        screen.blit(label(line, size, theme.ink), (x, box.top + round((35 + 20 * k) * scale)))
    bar = pygame.Rect(box.left + 8, box.bottom - max(3, round(3 * scale)), box.width - 16, thick)
    screen.fill(mix(theme.panel, theme.ink, 0.15), bar)
    bar.width = round(bar.width * tour.progress)
    screen.fill(theme.final, bar)


def draw_tour(screen: pygame.Surface, layout: Layout, theme: Theme, tour: LessonPlayer) -> list[Spot]:
    """Show a lesson in place of the panel; return where a click answers, or goes to a chapter."""
    scale, spots = layout.scale, list[Spot]()
    left, top, width, height = layout.panel
    screen.fill(theme.panel, layout.panel)
    canvas = flat_canvas(screen, theme, scale)
    x, y, wide = left + 20 * scale, top + 18 * scale, width - 40 * scale
    screen.blit(label("LESSON", round(11 * scale), theme.faint, True), (round(x), round(y)))
    y += 30 * scale
    bold, size = round(18 * scale), round(14 * scale)
    for line in wrapped(tour.chapter.title, bold, wide, True):
        screen.blit(label(line, bold, theme.final, True), (round(x), round(y)))
        y += 25 * scale
    y += 6 * scale
    for line in wrapped(tour.chapter.text, size, wide):
        screen.blit(label(line, size, theme.ink), (round(x), round(y)))
        y += 21 * scale
    y += 8 * scale
    for k, asked in enumerate(tour.asks):
        first, answers = y, tour.state == "asks" and k > 0
        for line in wrapped(asked, size, wide - 24 * scale * answers):
            screen.blit(label(line, size, theme.final), (round(x + 12 * scale * answers), round(y)))
            y += 21 * scale
        if answers:
            box = pygame.Rect(round(x), round(first - 5 * scale), round(wide), round(y - first + 8 * scale))
            pygame.draw.rect(screen, theme.final, box, 1, border_radius=round(5 * scale))
            spots.append((box, partial(tour.reply, k)))
        y += 11 * scale * (tour.state == "asks")
    chapters, small = tour.lesson.chapters, round(12 * scale)
    y, bottom = y + 6 * scale, top + height - 62 * scale
    row = min(23 * scale, max((bottom - y) / len(chapters), 15 * scale))
    y = max(y, bottom - row * len(chapters))
    for k, chapter in enumerate(chapters):
        now, color = k == tour.number, theme.ink if k == tour.number else theme.faint
        fill = theme.final if k <= tour.number else mix(theme.panel, theme.ink, 0.25)
        canvas.stamp(partial(sprites.dot, 3.5 * scale, fill), (x + 4 * scale, y + 8 * scale))
        words = shortened(chapter.title, small, wide - 18 * scale, now)
        screen.blit(label(words, small, color, now), (round(x + 16 * scale), round(y)))
        box = pygame.Rect(round(x), round(y - 3 * scale), round(wide), round(row))
        spots.append((box, partial(tour.skip, k - tour.number)))
        y += row
    bar = pygame.Rect(round(x), round(top + height - 46 * scale), round(wide), max(3, round(3 * scale)))
    pygame.draw.rect(screen, mix(theme.panel, theme.ink, 0.15), bar, border_radius=bar.height)
    bar.width = max(round(bar.width * tour.progress), bar.height)
    pygame.draw.rect(screen, theme.final, bar, border_radius=bar.height)
    hint = label("← → chapters · Space · F2 just play · Esc ends", round(11 * scale), theme.faint)
    screen.blit(hint, (round(x), round(top + height - 32 * scale)))
    return spots
