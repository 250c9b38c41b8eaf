"""One-line text fields."""

from bisect import bisect_left

import pygame
from pygame import Rect, Surface

from robocov_app.look.colors import Color, mix
from robocov_app.render.fonts import measure_text, render_text
from robocov_app.toolkit.overlay import get_field_color
from robocov_app.toolkit.widgets.appearance import (
    EDGE_SHADE,
    TEXT_PX,
    draw_box,
    draw_text,
    get_edge_width,
    is_visible,
    shade,
)
from robocov_app.toolkit.widgets.page import Page, Widget
from robocov_app.toolkit.widgets.text_edit import TextEdit
from robocov_app.toolkit.window.input import ENTER_KEYS

# Lengths in pixels at scale 1.
_MARGIN_PX = 6
_CURSOR_HEIGHT_PX = 17
_CURSOR_WIDTH_PX = 1
_PLACEHOLDER_SHIFT_PX = 3
_INNER_MARGIN_PX = 2
"""Margin of the text above and below it; also the space for the cursor at both ends of the text."""
_EDITED_EDGE_WIDTH_PX = 1.25

_SELECTION_STRENGTH = 0.35
"""Fraction of the accent color in the background of selected text."""


def show_text_field(
    page: Page, key: str, text: str, *, placeholder: str = "", tip: str = "", live: bool = False
) -> str | None:
    """Show a text field.

    Parameters
    ----------
    page : Page
    key : str
    text : str
        Text that is shown while the field is not being edited.
    placeholder : str
        Faint text in the empty field.
    tip : str
        Tooltip.
    live : bool
        Whether to return every change, rather than only the text that is confirmed with Enter.

    Returns
    -------
    str or None
        The text that was confirmed with Enter, even if it equals `text`. With `live`, also the text that is
        being edited if it differs from `text`. Otherwise None.
    """
    rect = page.cell()
    if page.is_pressed(rect):
        _press(page, key, text, rect)
    entered_text = _read_input(page, key, rect)
    edit = page.get_edit(key)
    if live and edit is not None and edit.text != text:
        entered_text = edit.text
    shown_text = text if edit is None else edit.text
    page.add_widget(Widget("entry", key, rect, text=shown_text, value=text, tip=tip))
    if page.surface is not None and is_visible(page, rect):
        _draw_field(page, rect, is_edited=edit is not None)
        if edit is None:
            draw_text(page, text or placeholder, _get_inner(page, rect), _get_text_color(page, text), TEXT_PX)
        else:
            _draw_edit(page, page.surface, rect, edit, placeholder)
    return entered_text


def _press(page: Page, key: str, text: str, rect: Rect) -> None:
    """Handle a click: start editing, or move the text cursor; a double click selects a word."""
    page.consume_event()
    is_double = page.record_click(key)
    if page.focus != key or page.edit is None:
        page.focus = key
        page.edit = TextEdit.select_all(text)
        return
    page.active = key
    page.edit.place(_find_caret(page, page.edit, rect))
    if is_double:
        page.edit.select_word(page.edit.caret)


def _read_input(page: Page, key: str, rect: Rect) -> str | None:
    """Pass a key or a mouse drag to the text being edited; return the text if Enter was pressed."""
    edit = page.get_edit(key)
    if edit is None:
        return None
    if page.is_event(pygame.MOUSEMOTION) and page.active == key:
        edit.place(_find_caret(page, edit, rect), extend=True)
        return None
    name = page.get_key(key)
    if not name:
        return None
    page.consume_event()
    if edit.composed:
        return None
    if name in ENTER_KEYS:
        page.clear_focus()
        return edit.text
    edit.press_key(name, page.clipboard)
    return None


def _get_text_color(page: Page, text: str) -> Color:
    """Return the color of the text, or of the placeholder in its place."""
    if text:
        return page.theme.ink
    return page.theme.faint


def _get_inner(page: Page, rect: Rect) -> Rect:
    return rect.inflate(-page.px(2 * _MARGIN_PX), -page.px(2 * _INNER_MARGIN_PX))


def _find_caret(page: Page, edit: TextEdit, rect: Rect) -> int:
    """Return the caret position nearest to the pointer, by bisection: longer text is wider."""
    x = page.pointer[0] - rect.left - page.px(_MARGIN_PX) + _compute_shift(page, edit, rect)

    def get_width_before(caret: int) -> int:
        return measure_text(edit.text[:caret], page.px(TEXT_PX))

    after = bisect_left(range(len(edit.text) + 1), x, key=get_width_before)
    candidates = range(max(after - 1, 0), min(after, len(edit.text)) + 1)
    return min(candidates, key=lambda caret: abs(get_width_before(caret) - x))


def _compute_shift(page: Page, edit: TextEdit, rect: Rect) -> int:
    """Return the shift to the left that keeps the caret of a long text visible, px."""
    width_before = measure_text(edit.text[: edit.caret] + edit.composed, page.px(TEXT_PX))
    return max(width_before - (rect.width - page.px(2 * (_MARGIN_PX + _CURSOR_WIDTH_PX))), 0)


def _draw_field(page: Page, rect: Rect, *, is_edited: bool) -> None:
    edge = shade(page, EDGE_SHADE)
    if is_edited or page.is_hovered(rect):
        edge = page.theme.accent
    width = get_edge_width(page)
    if is_edited:
        width = max(2, page.px(_EDITED_EDGE_WIDTH_PX))
    draw_box(page, rect, get_field_color(page.theme), edge=edge, width=width)


def _draw_edit(page: Page, screen: Surface, rect: Rect, edit: TextEdit, placeholder: str) -> None:
    """Draw the text being edited, with selection, cursor, and the text that an input method composes."""
    theme = page.theme
    size = page.px(TEXT_PX)
    clip = screen.get_clip()
    inner = _get_inner(page, rect)
    screen.set_clip(inner.inflate(page.px(2 * _INNER_MARGIN_PX), 0).clip(clip))
    left = inner.left - _compute_shift(page, edit, rect)
    start, end = (measure_text(edit.text[:position], size) for position in edit.selection)
    selection = Rect(left + start, 0, end - start, page.px(_CURSOR_HEIGHT_PX))
    selection.centery = rect.centery
    if start != end:
        screen.fill(mix(get_field_color(theme), theme.accent, _SELECTION_STRENGTH), selection)
    # Composed text is shown at the caret and underlined, although it is not part of the text yet.
    text = edit.text[: edit.caret] + edit.composed + edit.text[edit.caret :]
    image = render_text(text or placeholder, size, _get_text_color(page, text))
    # The cursor must not cover the first character of the placeholder.
    text_left = left if text else left + page.px(_PLACEHOLDER_SHIFT_PX)
    screen.blit(image, image.get_rect(midleft=(text_left, rect.centery)))
    x = left + measure_text(edit.text[: edit.caret], size)
    line_width = max(1, page.px(_CURSOR_WIDTH_PX))
    if edit.composed:
        width = measure_text(edit.composed, size)
        screen.fill(theme.ink, (x, selection.bottom - 1, width, line_width))
        pygame.key.set_text_input_rect(Rect(x, rect.top, width, rect.height))
        x += width
    screen.fill(theme.ink, (x, selection.top, line_width, selection.height))
    screen.set_clip(clip)
