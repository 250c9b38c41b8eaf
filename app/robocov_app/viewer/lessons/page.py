"""Display of a lesson: a page in place of the panel, or a caption over the map."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import pygame

from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import Theme
from robocov_app.render import sprites
from robocov_app.render.fonts import render_text, shorten_to_width
from robocov_app.toolkit.overlay import create_flat_canvas, draw_card, wrap_text
from robocov_app.toolkit.window.layout import Layout
from robocov_app.viewer.lessons.player import LessonPlayer, LessonState


class ClickArea(NamedTuple):
    """A part of the page that can be clicked.

    Attributes
    ----------
    box : Rect
        Position and size, px.
    action : callable
        Called when the area is clicked.
    """

    box: pygame.Rect
    action: Callable[[], object]


# Lengths in pixels at scale 1.
_CAPTION_TEXT_PX = 14
_CAPTION_TITLE_PX = 15.5
_CAPTION_WIDTH_PX = 800
_CAPTION_LINE_PX = 20
_PAGE_MARGIN_PX = 20
_PAGE_TITLE_PX = 18
_PAGE_TEXT_PX = 14
_PAGE_LINE_PX = 21
_ANSWER_INDENT_PX = 12
_CHAPTER_TEXT_PX = 12
_CHAPTER_ROW_PX = 23
_MIN_CHAPTER_ROW_PX = 15
_PAGE_HINT = "← → chapters · Space · F2 just play · Esc ends"


def draw_caption(screen: pygame.Surface, layout: Layout, theme: Theme, lesson: LessonPlayer) -> None:
    """Draw a lesson as a card over the map, for windows without a panel."""
    scale = layout.scale
    left, top, width, height = layout.arena
    text_size = round(_CAPTION_TEXT_PX * scale)
    title_size = round(_CAPTION_TITLE_PX * scale)
    card_width = min(width - 40 * scale, _CAPTION_WIDTH_PX * scale)
    text = " ".join([lesson.chapter.text, *lesson.lines])
    lines = wrap_text(text, text_size, card_width - 44 * scale)
    box = pygame.Rect(0, 0, round(card_width), round((44 + _CAPTION_LINE_PX * len(lines)) * scale))
    box.midbottom = (round(left + width / 2), round(top + height - 44 * scale))
    draw_card(screen, box, theme, scale)
    x = box.left + round(22 * scale)
    title = f"{lesson.number + 1}  {lesson.chapter.title}"
    screen.blit(render_text(title, title_size, theme.final, True), (x, box.top + round(11 * scale)))
    for k, line in enumerate(lines):
        y = box.top + round((35 + _CAPTION_LINE_PX * k) * scale)
        screen.blit(render_text(line, text_size, theme.ink), (x, y))
    # A thin progress bar along the lower edge of the card.
    bar_top = box.bottom - max(3, round(3 * scale))
    bar = pygame.Rect(box.left + 8, bar_top, box.width - 16, max(2, round(2 * scale)))
    screen.fill(mix(theme.panel, theme.ink, 0.15), bar)
    bar.width = round(bar.width * lesson.progress)
    screen.fill(theme.final, bar)


def draw_lesson_page(
    screen: pygame.Surface, layout: Layout, theme: Theme, lesson: LessonPlayer
) -> list[ClickArea]:
    """Draw a lesson in place of the panel.

    Returns
    -------
    list of ClickArea
        Areas of the answers and chapters that can be clicked.
    """
    screen.fill(theme.panel, layout.panel)
    page = _LessonPage(screen, layout, theme, lesson)
    page.draw()
    return page.areas


@dataclass
class _LessonPage:
    """The page of a lesson, which is drawn from top to bottom; `y` is the top of the next item, px."""

    screen: pygame.Surface
    layout: Layout
    theme: Theme
    lesson: LessonPlayer
    areas: list[ClickArea] = field(default_factory=list)
    y: float = 0.0

    def __post_init__(self) -> None:
        left, top, width, _ = self.layout.panel
        self.scale = self.layout.scale
        self.x = left + _PAGE_MARGIN_PX * self.scale
        self.width = width - 2 * _PAGE_MARGIN_PX * self.scale
        self.y = top + 18 * self.scale

    def draw(self) -> None:
        """Draw the heading, the text, the question or task, the list of chapters and the progress bar."""
        lesson = self.lesson
        scale = self.scale
        self._write("LESSON", 11, self.theme.faint, bold=True)
        self.y += 30 * scale
        title_size = round(_PAGE_TITLE_PX * scale)
        for line in wrap_text(lesson.chapter.title, title_size, self.width, True):
            self._write(line, _PAGE_TITLE_PX, self.theme.final, bold=True)
            self.y += 25 * scale
        self.y += 6 * scale
        self._write_paragraph(lesson.chapter.text, self.theme.ink)
        self.y += 8 * scale
        for k, line in enumerate(lesson.lines):
            # While the lesson asks, the first line is the question, and the others are the answers.
            if lesson.state is LessonState.ASKING and k > 0:
                self._draw_answer(k, line)
            else:
                self._write_paragraph(line, self.theme.final)
            if lesson.state is LessonState.ASKING:
                self.y += 11 * scale
        self._draw_chapters()
        self._draw_progress()

    def _write(
        self, text: str, size: float, color: Color, *, indent: float = 0.0, bold: bool = False
    ) -> None:
        picture = render_text(text, round(size * self.scale), color, bold)
        self.screen.blit(picture, (round(self.x + indent * self.scale), round(self.y)))

    def _write_paragraph(self, text: str, color: Color, *, indent: float = 0.0) -> None:
        """Write wrapped text, indented on both sides by a length at scale 1, px, and move below it."""
        width = self.width - 2 * indent * self.scale
        for line in wrap_text(text, round(_PAGE_TEXT_PX * self.scale), width):
            self._write(line, _PAGE_TEXT_PX, color, indent=indent)
            self.y += _PAGE_LINE_PX * self.scale

    def _draw_answer(self, number: int, text: str) -> None:
        """Draw an answer in a frame that can be clicked; `number` counts from 1."""
        top = self.y
        scale = self.scale
        self._write_paragraph(text, self.theme.final, indent=_ANSWER_INDENT_PX)
        height = round(self.y - top + 8 * scale)
        box = pygame.Rect(round(self.x), round(top - 5 * scale), round(self.width), height)
        pygame.draw.rect(self.screen, self.theme.final, box, 1, border_radius=round(5 * scale))
        self.areas.append(ClickArea(box, partial(self.lesson.reply, number)))

    def _draw_chapters(self) -> None:
        """Draw the list of chapters at the bottom, above the progress bar, if there is enough space."""
        _, top, _, height = self.layout.panel
        scale = self.scale
        count = len(self.lesson.lesson.chapters)
        self.y += 6 * scale
        bottom = top + height - 62 * scale
        row = min(_CHAPTER_ROW_PX * scale, max((bottom - self.y) / count, _MIN_CHAPTER_ROW_PX * scale))
        self.y = max(self.y, bottom - row * count)
        for number in range(count):
            self._draw_chapter(number, row)
            self.y += row

    def _draw_chapter(self, number: int, row: float) -> None:
        """Draw the title of a chapter, in a row of the given height, px, that can be clicked."""
        theme = self.theme
        scale = self.scale
        lesson = self.lesson
        is_current = number == lesson.number
        fill = theme.final if number <= lesson.number else mix(theme.panel, theme.ink, 0.25)
        canvas = create_flat_canvas(self.screen, theme, scale)
        canvas.draw_sprite(
            partial(sprites.render_dot, 3.5 * scale, fill), (self.x + 4 * scale, self.y + 8 * scale)
        )
        size = round(_CHAPTER_TEXT_PX * scale)
        title = shorten_to_width(
            lesson.lesson.chapters[number].title, size, self.width - 18 * scale, is_current
        )
        color = theme.ink if is_current else theme.faint
        self._write(title, _CHAPTER_TEXT_PX, color, indent=16, bold=is_current)
        box = pygame.Rect(round(self.x), round(self.y - 3 * scale), round(self.width), round(row))
        self.areas.append(ClickArea(box, partial(lesson.skip, number - lesson.number)))

    def _draw_progress(self) -> None:
        """Draw the progress bar and the hint at the bottom of the page."""
        _, top, _, height = self.layout.panel
        theme = self.theme
        scale = self.scale
        bottom = top + height
        bar_top = round(bottom - 46 * scale)
        bar = pygame.Rect(round(self.x), bar_top, round(self.width), max(3, round(3 * scale)))
        pygame.draw.rect(self.screen, mix(theme.panel, theme.ink, 0.15), bar, border_radius=bar.height)
        bar.width = max(round(bar.width * self.lesson.progress), bar.height)
        pygame.draw.rect(self.screen, theme.final, bar, border_radius=bar.height)
        self.y = bottom - 32 * scale
        self._write(_PAGE_HINT, 11, theme.faint)
