"""Display of a lesson: a page in place of the panel, or a caption over the map."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar, NamedTuple

import pygame

from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import Theme
from robocov_app.render import sprites
from robocov_app.render.fonts import render_text, shorten_to_width
from robocov_app.toolkit.overlay import (
    create_flat_canvas,
    draw_card,
    draw_rounded_box,
    get_accent_ink,
    get_field_color,
    wrap_text,
)
from robocov_app.toolkit.window.layout import Layout
from robocov_app.viewer.lessons.player import (
    AnswerMark,
    LessonPlayer,
    LessonState,
    MarkedAnswer,
    list_next_steps,
    list_skipped_tasks,
)


class ClickArea(NamedTuple):
    """A part of the page that can be clicked.

    Attributes
    ----------
    box : Rect
        Position and size, px.
    action : callable
        Called when the area is clicked.
    name : str
        ``answer:1``, ``chapter:0``, ``back``, ``next`` or ``end``.
    """

    box: pygame.Rect
    action: Callable[[], object]
    name: str


# Lengths in pixels at scale 1.
_CAPTION_TEXT_PX = 14
_CAPTION_TITLE_PX = 15.5
_CAPTION_WIDTH_PX = 800
_CAPTION_LINE_PX = 20
_CAPTION_MARGIN_PX = 22
"""Distance of the text from the left and right edges of the card."""
_CAPTION_SIDE_PX = 20
"""Minimum distance of the card from the left and right edges of the arena."""
_CAPTION_BOTTOM_PX = 44
"""Distance of the card from the bottom of the arena."""
_CAPTION_HEIGHT_PX = 44
"""Height of the card in addition to that of its lines."""
_CAPTION_TITLE_TOP_PX = 11
_CAPTION_TEXT_TOP_PX = 35
_CAPTION_BAR_MARGIN_PX = 8
"""Distance of the progress bar from the left and right edges of the card, at any scale."""
_CAPTION_BAR_HEIGHT_PX = 2
_CAPTION_BAR_BOTTOM_PX = 3
"""Distance of the top of the progress bar from the bottom of the card."""
_PAGE_MARGIN_PX = 20
_PAGE_TITLE_PX = 18
_PAGE_TOP_PX = 18
_SMALL_TEXT_PX = 11
_HEADING_LINE_PX = 30
_TITLE_LINE_PX = 25
_TITLE_GAP_PX = 6
_TEXT_GAP_PX = 8
_QUESTION_GAP_PX = 9
_ITEM_GAP_PX = 4
_ITEM_INDENT_PX = 20
_ANSWER_GAP_PX = 11
_ANSWER_INDENT_PX = 30
_ANSWER_RIGHT_INDENT_PX = 12
_ANSWER_TOP_PX = 5
"""Distance of the frame of an answer above its text."""
_ANSWER_HEIGHT_PX = 8
"""Height of the frame of an answer in addition to that of its lines."""
_ANSWER_RADIUS_PX = 5
_ANSWER_EDGE_PX = 1
_MARKED_ANSWER_EDGE_PX = 2
_MARK_X_PX = 10
_CHAPTER_TEXT_PX = 12
_CHAPTER_ROW_PX = 23
_MIN_CHAPTER_ROW_PX = 15
_CHAPTERS_TOP_PX = 6
_CHAPTERS_BOTTOM_PX = 10
"""Distance of the list of chapters from the progress bar."""
_CHAPTER_INDENT_PX = 16
_CHAPTER_MARGINS_PX = 18
_CHAPTER_TOP_PX = 3
"""Distance of the area of a chapter that can be clicked above its text."""
_CHAPTER_DOT_RADIUS_PX = 3.5
_CHAPTER_DOT_CENTER_PX = (4, 8)
_DOTS_ROW_PX = 24
_DOT_RADIUS_PX = 3.0
_CURRENT_DOT_RADIUS_PX = 4.5
_BAR_HEIGHT_PX = 3
_END_BUTTON_CENTER_PX = 7
"""Distance of the center of the button that ends the lesson below the top of the heading."""
_BUTTON_RADIUS_PX = 6
_BUTTON_GAP_PX = 10
_BUTTON_TEXT_PX = 14
_HINT_ABOVE_BOTTOM_PX = 26
_TEXT_SIZES_PX = (14.0, 13.0, 12.0, 11.0)
"""Sizes of the text; the first one at which the page fits is used."""
_LINE_HEIGHT = 1.5
"""Distance of lines in text sizes."""

# Fractions of the color of text.
_EMPTY_BAR_STRENGTH = 0.15
_FUTURE_DOT_STRENGTH = 0.25
_CLOSED_ANSWER_STRENGTH = 0.25
_BUTTON_EDGE_STRENGTH = 0.28

_PAGE_HINT = "Space: pause · F2: play freely · Esc: end"
_CLOSING_TITLE = "What you found out"
_NEXT_TITLE = "Try next"
_MARK_SIGNS = {AnswerMark.NONE: "", AnswerMark.CHOSEN: "●", AnswerMark.RIGHT: "✓", AnswerMark.WRONG: "✗"}


def get_answer_sign(number: int, answer: MarkedAnswer) -> str:
    """Return the sign of an answer's mark, or its number if it has none."""
    return _MARK_SIGNS[answer.mark] or str(number)


def draw_caption(screen: pygame.Surface, layout: Layout, theme: Theme, lesson: LessonPlayer) -> None:
    """Draw a lesson as a card over the map, for windows without a panel."""
    scale = layout.scale
    left, top, width, height = layout.arena
    text_size = round(_CAPTION_TEXT_PX * scale)
    title_size = round(_CAPTION_TITLE_PX * scale)
    card_width = min(width - 2 * _CAPTION_SIDE_PX * scale, _CAPTION_WIDTH_PX * scale)
    is_closing = lesson.state is LessonState.CLOSING
    text = " ".join(_list_closing_lines(lesson) if is_closing else [lesson.chapter.text, *lesson.lines])
    lines = wrap_text(text, text_size, card_width - 2 * _CAPTION_MARGIN_PX * scale)
    card_height = (_CAPTION_HEIGHT_PX + _CAPTION_LINE_PX * len(lines)) * scale
    box = pygame.Rect(0, 0, round(card_width), round(card_height))
    box.midbottom = (round(left + width / 2), round(top + height - _CAPTION_BOTTOM_PX * scale))
    draw_card(screen, box, theme, scale)
    x = box.left + round(_CAPTION_MARGIN_PX * scale)
    title = _CLOSING_TITLE if is_closing else f"{lesson.number + 1}  {lesson.chapter.title}"
    title_top = box.top + round(_CAPTION_TITLE_TOP_PX * scale)
    screen.blit(render_text(title, title_size, theme.accent, bold=True), (x, title_top))
    for k, line in enumerate(lines):
        y = box.top + round((_CAPTION_TEXT_TOP_PX + _CAPTION_LINE_PX * k) * scale)
        screen.blit(render_text(line, text_size, theme.ink), (x, y))
    # A thin progress bar along the lower edge of the card.
    bar_height = max(_CAPTION_BAR_HEIGHT_PX, round(_CAPTION_BAR_HEIGHT_PX * scale))
    bar = pygame.Rect(0, 0, box.width - 2 * _CAPTION_BAR_MARGIN_PX, bar_height)
    bar.left = box.left + _CAPTION_BAR_MARGIN_PX
    bar.top = box.bottom - max(_CAPTION_BAR_BOTTOM_PX, round(_CAPTION_BAR_BOTTOM_PX * scale))
    screen.fill(mix(theme.panel, theme.ink, _EMPTY_BAR_STRENGTH), bar)
    bar.width = round(bar.width * lesson.progress)
    screen.fill(theme.accent, bar)


def _list_closing_lines(lesson: LessonPlayer) -> list[str]:
    """Return the texts of the closing page in a caption."""
    return [*lesson.findings, *(f"{text}." for text in _list_skipped_tasks(lesson))]


def _list_skipped_tasks(lesson: LessonPlayer) -> list[str]:
    """Return a text for each task that the user has skipped; none if there is no user."""
    if lesson.is_unattended:
        return []
    return list_skipped_tasks(lesson.lesson, lesson.done_tasks)


def draw_lesson_page(
    screen: pygame.Surface, layout: Layout, theme: Theme, lesson: LessonPlayer
) -> list[ClickArea]:
    """Draw a lesson in place of the panel, with the largest text at which it fits.

    Returns
    -------
    list of ClickArea
        Areas of the answers, chapters and buttons that can be clicked.
    """
    areas: list[ClickArea] = []
    top = layout.panel.top + _PAGE_TOP_PX * layout.scale
    for text_px in _TEXT_SIZES_PX:
        screen.fill(theme.panel, layout.panel)
        page = LessonPage(screen, layout, theme, lesson, text_px, top)
        page.draw()
        areas = page.areas
        if page.fits:
            break
    return areas


@dataclass
class LessonPage:
    """The page of a lesson in place of the panel, which is drawn from top to bottom.

    Attributes
    ----------
    screen : pygame.Surface
    layout : Layout
    theme : Theme
    lesson : LessonPlayer
    text_px : float
        Size of the text at scale 1, px.
    y : float
        Top of the next item, px.
    areas : list of ClickArea
        Areas that can be clicked, drawn so far.
    fits : bool
        Whether everything fits into the panel.
    """

    min_answer_height: ClassVar[float] = 0.0
    """Minimum height of the frame of an open answer at scale 1, px."""
    button_height: ClassVar[float] = 34.0
    """Height of the buttons at the bottom at scale 1, px."""
    buttons_above_bottom: ClassVar[float] = 74.0
    """Distance of their top from the bottom of the page at scale 1, px."""
    progress_above_bottom: ClassVar[float] = 88.0
    """Distance of the top of the progress bar from the bottom of the page at scale 1, px."""
    end_button_size: ClassVar[float] = 28.0
    """Width and height of the button that ends the lesson at scale 1, px."""

    screen: pygame.Surface
    layout: Layout
    theme: Theme
    lesson: LessonPlayer
    text_px: float
    y: float
    areas: list[ClickArea] = field(default_factory=list)
    fits: bool = True

    @property
    def scale(self) -> float:
        """Scale of texts and lengths."""
        return self.layout.scale

    @property
    def x(self) -> float:
        """Left end of the texts, px."""
        return self.layout.panel.left + _PAGE_MARGIN_PX * self.scale

    @property
    def width(self) -> float:
        """Width of the texts, px."""
        return self.layout.panel.width - 2 * _PAGE_MARGIN_PX * self.scale

    @property
    def bottom(self) -> int:
        """Lower end of the page, px."""
        return self.layout.panel.top + self.layout.panel.height

    def draw(self) -> None:
        """Draw the chapter or the closing page, the list of chapters, the buttons and the progress bar."""
        heading_y = self.y
        self._draw_heading()
        self._draw_text()
        self._draw_chapters()
        self._draw_progress()
        self._draw_buttons()
        self.y = self.bottom - _HINT_ABOVE_BOTTOM_PX * self.scale
        hint = shorten_to_width(_PAGE_HINT, round(_SMALL_TEXT_PX * self.scale), self.width)
        self._write(hint, _SMALL_TEXT_PX, self.theme.faint)
        self._draw_end_button(heading_y)

    def _draw_heading(self) -> None:
        """Write the number of the chapter."""
        lesson = self.lesson
        heading = f"LESSON · {lesson.number + 1} OF {len(lesson.lesson.chapters)}"
        if lesson.state is LessonState.CLOSING:
            heading = "LESSON"
        self._write(heading, _SMALL_TEXT_PX, self.theme.faint, bold=True)
        self.y += _HEADING_LINE_PX * self.scale

    def _draw_text(self) -> None:
        """Draw the text of the chapter, or the closing page."""
        if self.lesson.state is LessonState.CLOSING:
            self._draw_closing()
        else:
            self._draw_chapter_text()

    def _draw_end_button(self, top: float) -> None:
        """Draw a cross in the upper right corner, which ends the lesson."""
        size = round(self.end_button_size * self.scale)
        box = pygame.Rect(0, 0, size, size)
        box.right = round(self.x + self.width)
        box.centery = round(top + _END_BUTTON_CENTER_PX * self.scale)
        image = render_text("×", round(_PAGE_TITLE_PX * self.scale), self.theme.faint)
        self.screen.blit(image, image.get_rect(center=box.center))
        self.areas.append(ClickArea(box, self.lesson.end, "end"))

    def _draw_chapter_text(self) -> None:
        """Draw the title and text of the chapter, its question with the answers, and comments."""
        lesson = self.lesson
        self._write_title(lesson.chapter.title)
        self._write_paragraph(lesson.chapter.text, self.theme.ink)
        self.y += _TEXT_GAP_PX * self.scale
        question = lesson.chapter.question
        if question is not None:
            self._write_paragraph(question.text, self.theme.accent)
            self.y += _QUESTION_GAP_PX * self.scale
            for number, answer in enumerate(lesson.marked_answers, 1):
                self._draw_answer(number, answer)
        for comment in lesson.comments:
            self._write_paragraph(comment, self.theme.ink)
            self.y += _ITEM_GAP_PX * self.scale

    def _draw_closing(self) -> None:
        """Draw the score of the user's predictions, the findings, skipped tasks, and suggested next steps."""
        lesson = self.lesson
        self._write_title(_CLOSING_TITLE)
        right_count, answer_count = lesson.score
        if answer_count:
            text = f"Correct predictions: {right_count} of {answer_count}."
            self._write_paragraph(text, self.theme.accent)
            self.y += _TITLE_GAP_PX * self.scale
        for finding in lesson.findings:
            self._draw_item("✓", finding)
        for text in _list_skipped_tasks(lesson):
            self._draw_item("–", text, color=self.theme.faint)
        self.y += _TEXT_GAP_PX * self.scale
        self._write_title(_NEXT_TITLE)
        for step in list_next_steps(lesson.lesson):
            self._draw_item("→", step)

    def _draw_item(self, sign: str, text: str, *, color: Color | None = None) -> None:
        """Write a paragraph with a sign at its left, both in one color; by default the sign is green."""
        self._write(sign, self.text_px, color or self.theme.start, bold=True)
        self._write_paragraph(text, color or self.theme.ink, indent=_ITEM_INDENT_PX, right_indent=0)
        self.y += _ITEM_GAP_PX * self.scale

    def _write_title(self, title: str) -> None:
        size = round(_PAGE_TITLE_PX * self.scale)
        for line in wrap_text(title, size, self.width, bold=True):
            self._write(line, _PAGE_TITLE_PX, self.theme.accent, bold=True)
            self.y += _TITLE_LINE_PX * self.scale
        self.y += _TITLE_GAP_PX * self.scale

    def _write(
        self, text: str, size: float, color: Color, *, indent: float = 0.0, bold: bool = False
    ) -> None:
        picture = render_text(text, round(size * self.scale), color, bold=bold)
        self.screen.blit(picture, (round(self.x + indent * self.scale), round(self.y)))

    def _write_paragraph(
        self, text: str, color: Color, *, indent: float = 0.0, right_indent: float | None = None
    ) -> None:
        """Write wrapped text, indented on both sides by lengths at scale 1, px, and move below it."""
        if right_indent is None:
            right_indent = indent
        width = self.width - (indent + right_indent) * self.scale
        for line in wrap_text(text, round(self.text_px * self.scale), width):
            self._write(line, self.text_px, color, indent=indent)
            self.y += _LINE_HEIGHT * self.text_px * self.scale

    def _draw_answer(self, number: int, answer: MarkedAnswer) -> None:
        """Draw an answer in a frame: as a button while the question is open, with its mark afterwards."""
        top = self.y
        scale = self.scale
        is_open = self.lesson.state is LessonState.ASKING
        edge = self._choose_answer_edge(answer, is_open=is_open)
        ink = self._choose_answer_ink(answer, is_open=is_open)
        text_width = self.width - (_ANSWER_INDENT_PX + _ANSWER_RIGHT_INDENT_PX) * scale
        lines = wrap_text(answer.text, round(self.text_px * scale), text_width)
        height_px = _LINE_HEIGHT * self.text_px * len(lines) + _ANSWER_HEIGHT_PX
        extra_px = max(self.min_answer_height - height_px, 0.0) if is_open else 0.0
        height = round((height_px + extra_px) * scale)
        box = pygame.Rect(round(self.x), round(top - _ANSWER_TOP_PX * scale), round(self.width), height)
        self.y += extra_px / 2 * scale
        edge_px = _MARKED_ANSWER_EDGE_PX
        if answer.mark is AnswerMark.NONE:
            edge_px = _ANSWER_EDGE_PX
        draw_rounded_box(
            self.screen,
            box,
            self.theme.background,
            edge=edge,
            radius=round(_ANSWER_RADIUS_PX * scale),
            width=max(round(scale * edge_px), 1),
        )
        sign = get_answer_sign(number, answer)
        self._write(sign, self.text_px, edge, indent=_MARK_X_PX, bold=True)
        self._write_paragraph(
            answer.text, ink, indent=_ANSWER_INDENT_PX, right_indent=_ANSWER_RIGHT_INDENT_PX
        )
        self.y = box.bottom + _ANSWER_GAP_PX * scale
        if is_open:
            self.areas.append(ClickArea(box, partial(self.lesson.reply, number), f"answer:{number}"))

    def _choose_answer_ink(self, answer: MarkedAnswer, *, is_open: bool) -> Color:
        """Return the color of the text of an answer; one without a mark is faint after the question."""
        if is_open or answer.mark is not AnswerMark.NONE:
            return self.theme.ink
        return self.theme.faint

    def _choose_answer_edge(self, answer: MarkedAnswer, *, is_open: bool) -> Color:
        """Return the color of an answer's frame; it depends on the mark, if the answer has one."""
        theme = self.theme
        match answer.mark:
            case AnswerMark.RIGHT:
                return theme.start
            case AnswerMark.WRONG:
                return theme.error
            case AnswerMark.CHOSEN:
                return theme.accent
        if is_open:
            return theme.accent
        return mix(theme.panel, theme.ink, _CLOSED_ANSWER_STRENGTH)

    def _draw_chapters(self) -> None:
        """Draw the list of chapters above the progress bar; in a small window, a row of dots.

        On the closing page, they are left out if there is no space.
        """
        scale = self.scale
        count = len(self.lesson.lesson.chapters)
        self.y += _CHAPTERS_TOP_PX * scale
        bottom = self.bottom - (self.progress_above_bottom + _CHAPTERS_BOTTOM_PX) * scale
        free_height = bottom - self.y
        has_space = free_height >= _DOTS_ROW_PX * scale
        if self.lesson.state is LessonState.CLOSING and not has_space:
            self.fits = free_height >= 0
            return
        self.fits = has_space
        if free_height < _MIN_CHAPTER_ROW_PX * scale * count:
            self._draw_dots(bottom - _DOTS_ROW_PX * scale)
            return
        row = min(_CHAPTER_ROW_PX * scale, free_height / count)
        self.y = bottom - row * count
        for number in range(count):
            self._draw_chapter(number, row)
            self.y += row

    def _draw_dots(self, top: float) -> None:
        """Draw one dot for each chapter in a row that can be clicked."""
        count = len(self.lesson.lesson.chapters)
        spacing = self.width / count
        for number in range(count):
            left = round(self.x + number * spacing)
            box = pygame.Rect(left, round(top), round(spacing), round(_DOTS_ROW_PX * self.scale))
            radius = _DOT_RADIUS_PX
            if number == self.lesson.number:
                radius = _CURRENT_DOT_RADIUS_PX
            self._draw_dot(number, box.center, radius)
            self.areas.append(ClickArea(box, partial(self.lesson.show_chapter, number), f"chapter:{number}"))

    def _draw_dot(self, number: int, center: tuple[float, float], radius: float) -> None:
        """Draw the dot of a chapter, filled if it was reached."""
        theme = self.theme
        fill = theme.accent
        if number > self.lesson.number:
            fill = mix(theme.panel, theme.ink, _FUTURE_DOT_STRENGTH)
        canvas = create_flat_canvas(self.screen, theme, self.scale)
        canvas.draw_sprite(partial(sprites.render_dot, radius * self.scale, fill), center)

    def _draw_chapter(self, number: int, row: float) -> None:
        """Draw the title of a chapter, in a row of the given height, px, that can be clicked."""
        theme = self.theme
        scale = self.scale
        lesson = self.lesson
        is_current = number == lesson.number and lesson.state is not LessonState.CLOSING
        dx, dy = _CHAPTER_DOT_CENTER_PX
        self._draw_dot(number, (self.x + dx * scale, self.y + dy * scale), _CHAPTER_DOT_RADIUS_PX)
        size = round(_CHAPTER_TEXT_PX * scale)
        max_width = self.width - _CHAPTER_MARGINS_PX * scale
        title = shorten_to_width(lesson.lesson.chapters[number].title, size, max_width, bold=is_current)
        color = theme.ink if is_current else theme.faint
        self._write(title, _CHAPTER_TEXT_PX, color, indent=_CHAPTER_INDENT_PX, bold=is_current)
        top = round(self.y - _CHAPTER_TOP_PX * scale)
        box = pygame.Rect(round(self.x), top, round(self.width), round(row))
        self.areas.append(ClickArea(box, partial(lesson.show_chapter, number), f"chapter:{number}"))

    def _draw_progress(self) -> None:
        """Draw the progress bar above the buttons."""
        theme = self.theme
        scale = self.scale
        bar_top = round(self.bottom - self.progress_above_bottom * scale)
        bar_height = max(_BAR_HEIGHT_PX, round(_BAR_HEIGHT_PX * scale))
        bar = pygame.Rect(round(self.x), bar_top, round(self.width), bar_height)
        empty_color = mix(theme.panel, theme.ink, _EMPTY_BAR_STRENGTH)
        pygame.draw.rect(self.screen, empty_color, bar, border_radius=bar.height)
        bar.width = max(round(bar.width * self.lesson.progress), bar.height)
        pygame.draw.rect(self.screen, theme.accent, bar, border_radius=bar.height)

    def _draw_buttons(self) -> None:
        """Draw the buttons to the previous and the next chapter."""
        lesson = self.lesson
        scale = self.scale
        is_closing = lesson.state is LessonState.CLOSING
        is_last = lesson.number == len(lesson.lesson.chapters) - 1
        next_label = "Next →"
        if is_closing:
            next_label = "Close lesson"
        elif is_last:
            next_label = "Finish"
        top = round(self.bottom - self.buttons_above_bottom * scale)
        width = round((self.width - _BUTTON_GAP_PX * scale) / 2)
        height = round(self.button_height * scale)
        back = pygame.Rect(round(self.x), top, width, height)
        forward = pygame.Rect(round(self.x + self.width) - width, top, width, height)
        if lesson.number > 0 or is_closing:
            self._draw_button("← Back", back, is_primary=False)
            self.areas.append(ClickArea(back, partial(lesson.skip, -1), "back"))
        has_ended = lesson.state in (LessonState.ENDED, LessonState.CLOSING)
        self._draw_button(next_label, forward, is_primary=has_ended)
        self.areas.append(ClickArea(forward, partial(lesson.skip, 1), "next"))

    def _draw_button(self, label: str, box: pygame.Rect, *, is_primary: bool) -> None:
        """Draw a button; a primary one is filled with the accent color."""
        theme = self.theme
        fill = theme.accent if is_primary else get_field_color(theme)
        edge = theme.accent if is_primary else mix(theme.panel, theme.ink, _BUTTON_EDGE_STRENGTH)
        ink = get_accent_ink(theme) if is_primary else theme.ink
        draw_rounded_box(self.screen, box, fill, edge=edge, radius=round(_BUTTON_RADIUS_PX * self.scale))
        image = render_text(label, round(_BUTTON_TEXT_PX * self.scale), ink, bold=is_primary)
        self.screen.blit(image, image.get_rect(center=box.center))
