"""Display of a lesson on a phone: a sheet with text that scrolls, and large buttons below it."""

from dataclasses import dataclass
from typing import ClassVar

import pygame

from robocov_app.look.colors import mix
from robocov_app.look.theme import Theme
from robocov_app.toolkit.window.layout import Layout
from robocov_app.viewer.lessons.page import ClickArea, LessonPage, get_answer_sign
from robocov_app.viewer.lessons.player import AnswerMark, LessonPlayer, LessonState, MarkedAnswer

# Lengths in pixels at scale 1.
_TOP_PX = 6
"""Distance of the heading from the handle."""
_TOP_WITHOUT_HANDLE_PX = 18
_TEXT_BOTTOM_PX = 8
"""Distance of the text from the progress bar."""
_SCROLL_BAR_WIDTH_PX = 3
_SCROLL_BAR_RIGHT_PX = 6
"""Distance of the scroll bar from the right edge of the sheet."""
_SPECTATOR_ANSWER_INDENT_PX = 20
_SPECTATOR_ANSWER_GAP_PX = 4
_SCROLL_BAR_STRENGTH = 0.35
"""Fraction of the color of text in the scroll bar."""


def draw_lesson_sheet(
    screen: pygame.Surface,
    layout: Layout,
    theme: Theme,
    lesson: LessonPlayer,
    scroll_offset: float | None,
    *,
    has_buttons: bool = True,
) -> tuple[list[ClickArea], float, float]:
    """Draw a lesson in the sheet of a small window.

    Parameters
    ----------
    screen : pygame.Surface
    layout : Layout
    theme : Theme
    lesson : LessonPlayer
    scroll_offset : float or None
        Distance by which the text is scrolled, px; None shows its start, or its end once there is an answer.
    has_buttons : bool
        Whether the user can answer, and go to other chapters.

    Returns
    -------
    areas : list of ClickArea
        Areas of the answers and buttons that can be clicked.
    offset : float
        Distance by which the text is scrolled, px.
    max_offset : float
        The maximum of this distance, px; 0 if all of the text is visible.
    """
    sheet_class = LessonSheet if has_buttons else SpectatorLessonSheet
    *larger_sizes_px, smallest_size_px = sheet_class.text_sizes_px

    def draw_sheet(text_px: float) -> LessonSheet:
        screen.fill(theme.panel, layout.panel)
        top_px = _TOP_PX if layout.handle.height else _TOP_WITHOUT_HANDLE_PX
        top = layout.panel.top + top_px * layout.scale
        sheet = sheet_class(screen, layout, theme, lesson, text_px, top, scroll_offset=scroll_offset)
        sheet.draw()
        return sheet

    for text_px in larger_sizes_px:
        sheet = draw_sheet(text_px)
        if not sheet.max_offset:
            break
    else:
        sheet = draw_sheet(smallest_size_px)
    return sheet.areas, sheet.offset, sheet.max_offset


@dataclass
class LessonSheet(LessonPage):
    """The page of a lesson in a sheet.

    Attributes
    ----------
    scroll_offset : float or None
        Requested distance by which the text is scrolled, px; see `draw_lesson_sheet`.
    offset : float
        Distance by which the text is scrolled, px.
    max_offset : float
        The maximum of this distance, px.
    """

    text_sizes_px: ClassVar[tuple[float, ...]] = (14.0, 13.0)
    """Sizes of the text; the first one at which all of it is visible is used, or else the last one."""
    min_answer_height: ClassVar[float] = 48.0
    button_height: ClassVar[float] = 48.0
    buttons_above_bottom: ClassVar[float] = 56.0
    progress_above_bottom: ClassVar[float] = 66.0
    end_button_size: ClassVar[float] = 48.0

    scroll_offset: float | None = None
    offset: float = 0.0
    max_offset: float = 0.0

    def draw(self) -> None:
        """Draw the heading, the text, the progress bar and the buttons."""
        heading_y = self.y
        self._draw_heading()
        self._draw_scrolled_text()
        self._draw_progress()
        self._draw_buttons()
        self._draw_end_button(heading_y)

    def _draw_scrolled_text(self) -> None:
        """Draw the text in the space between the heading and the progress bar."""
        top = round(self.y)
        bottom = round(self.bottom - (self.progress_above_bottom + _TEXT_BOTTOM_PX) * self.scale)
        panel = self.layout.panel
        view = pygame.Rect(panel.left, top, panel.width, max(bottom - top, 1))
        self.max_offset = max(self._measure_text(view) - view.height, 0.0)
        self.offset = min(self._choose_offset(), self.max_offset)
        self.screen.set_clip(view)
        self.screen.fill(self.theme.panel, view)
        self.y = top - self.offset
        self._draw_text()
        self.screen.set_clip(None)
        self.areas = [area._replace(box=area.box.clip(view)) for area in self.areas]
        self._draw_scroll_bar(view)

    def _measure_text(self, view: pygame.Rect) -> float:
        """Return the height of the text, px; it is drawn in the view for this."""
        self.screen.set_clip(view)
        self._draw_text()
        self.screen.set_clip(None)
        self.areas = []
        return self.y - view.top

    def _choose_offset(self) -> float:
        """Return the distance by which the text is scrolled: explanations of an answer are at its end."""
        if self.scroll_offset is not None:
            return self.scroll_offset
        if self.lesson.state in (LessonState.ENDED, LessonState.TASK):
            return self.max_offset
        return 0.0

    def _draw_scroll_bar(self, view: pygame.Rect) -> None:
        if not self.max_offset:
            return
        height = view.height + self.max_offset
        bar = pygame.Rect(0, 0, round(_SCROLL_BAR_WIDTH_PX * self.scale), round(view.height**2 / height))
        bar.right = view.right - round(_SCROLL_BAR_RIGHT_PX * self.scale)
        bar.top = view.top + round(view.height * self.offset / height)
        color = mix(self.theme.panel, self.theme.ink, _SCROLL_BAR_STRENGTH)
        pygame.draw.rect(self.screen, color, bar, border_radius=bar.width)


@dataclass
class SpectatorLessonSheet(LessonSheet):
    """The page of a lesson in the sheet of a spectator, without buttons and with answers as a list."""

    text_sizes_px: ClassVar[tuple[float, ...]] = (14.0, 13.0, 12.0, 11.0)
    """As in `LessonSheet`; smaller, because a spectator cannot scroll the text."""
    progress_above_bottom: ClassVar[float] = 20.0

    def draw(self) -> None:
        """Draw the heading, the text and the progress bar."""
        self._draw_heading()
        self._draw_scrolled_text()
        self._draw_progress()
        self.areas = []

    def _draw_answer(self, number: int, answer: MarkedAnswer) -> None:
        """Write an answer behind its number or mark."""
        ink = self._choose_answer_ink(answer, is_open=self.lesson.state is LessonState.ASKING)
        sign_color = self._choose_answer_edge(answer, is_open=False)
        if answer.mark is AnswerMark.NONE:
            sign_color = self.theme.faint
        self._write(get_answer_sign(number, answer), self.text_px, sign_color, bold=True)
        self._write_paragraph(answer.text, ink, indent=_SPECTATOR_ANSWER_INDENT_PX, right_indent=0)
        self.y += _SPECTATOR_ANSWER_GAP_PX * self.scale
