"""Areas whose content scrolls when it is higher than the available space."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import pygame
from pygame import Rect

from robocov_app.toolkit.widgets.appearance import draw_box, shade
from robocov_app.toolkit.widgets.page import Page, Widget
from robocov_app.toolkit.window.input import SCROLL_PX_PER_NOTCH, get_wheel_notches

# Lengths in pixels at scale 1.
BAR_WIDTH_PX = 10.0
PANEL_MARGIN_PX = 12.0
"""Margin at the side of a panel, which contains the scroll bar."""
_MIN_KNOB_PX = 20
_BAR_GAP_PX = 4
"""Distance between the content and the scroll bar."""
_BAR_RIGHT_PX = 1
"""Distance of the scroll bar from the right edge of the area."""
_KNOB_MARGINS_PX = (4, 2)
"""Amounts by which the drawn knob is narrower and lower than its area."""
_HEIGHT_TOLERANCE_PX = 0.5
_REVEAL_MARGIN_PX = 8
"""Space between the edge of the area and a widget to which it scrolls."""

# Fractions of the color of text in the color of the knob.
_KNOB_SHADE = 0.3
_HOVERED_KNOB_SHADE = 0.45
_HELD_KNOB_SHADE = 0.55


@dataclass(frozen=True)
class _Bar:
    """A scroll bar: its track and knob in the window, and the maximum scroll offset at scale 1, px."""

    key: str
    track: Rect
    knob: Rect
    max_offset: float

    @property
    def free_height(self) -> int:
        """Distance over which the knob can move, px."""
        return max(self.track.height - self.knob.height, 1)


@contextmanager
def scroll(page: Page, key: str) -> Iterator[None]:
    """Put the widgets shown in this context into a scroll area that fills the rest of the page.

    Parameters
    ----------
    page : Page
    key : str
    """
    page.end_row()
    height = page.rest.height / page.scale
    start_x = page.x
    start_y = page.y
    start_width = page.width
    start_clip = page.clip
    area = Rect(page.box.left, page.rest.top, page.box.width, page.px(height))
    content_height = page.content_heights.get(key, 0.0)
    max_offset = max(content_height - height, 0.0)
    offset = min(max(page.scroll_offsets.get(key, 0.0), 0.0), max_offset)
    page.scroll_offsets[key] = offset
    if max_offset:
        offset = _show_bar(page, key, area, content_height, offset)
        page.width -= BAR_WIDTH_PX + _BAR_GAP_PX - PANEL_MARGIN_PX
    page.clip = page.clip.clip(area)
    if page.surface is not None:
        page.surface.set_clip(page.clip)
    # Shift the content up by the scroll offset; the clip hides what lies outside the area.
    page.y -= offset
    content_start = page.y
    page.clear_cells()
    page.focused_rect = None
    yield
    page.end_row()
    _reveal_focus(page, key, area)
    # The height is known only now. If it has changed, the scroll bar must be laid out again.
    new_height = page.y - content_start
    if abs(new_height - content_height) > _HEIGHT_TOLERANCE_PX:
        page.content_heights[key] = new_height
        page.request_another_run()
    page.x = start_x
    page.y = start_y + height
    page.width = start_width
    page.clip = start_clip
    if page.surface is not None:
        page.surface.set_clip(None)


def _reveal_focus(page: Page, key: str, area: Rect) -> None:
    """Scroll to the widget that has just received the focus, if it is in this area but out of sight."""
    rect = page.focused_rect
    if rect is None or page.surface is None or not page.reveals_focus:
        return
    page.reveals_focus = False
    margin = page.px(_REVEAL_MARGIN_PX)
    shift = min(rect.top - margin - area.top, 0) or max(rect.bottom + margin - area.bottom, 0)
    if shift:
        page.scroll_offsets[key] += shift / page.scale
        page.request_another_run()


def list_visible_rows(page: Page, count: int, height: float) -> Iterator[int]:
    """Lay out many rows of equal height with one cell each, and yield the indices of the visible ones.

    Parameters
    ----------
    page : Page
    count : int
        Number of rows.
    height : float
        Height of a row at scale 1, px.

    Yields
    ------
    int
    """
    page.end_row()
    # The height is not rounded, because the positions of rows are computed before they are rounded.
    row_px = height * page.scale
    first = int((page.clip.top - page.box.top - page.y * page.scale) / row_px)
    first = min(max(first, 0), count)
    last = min(first + int(page.clip.height / row_px) + 2, count)
    # Skip the invisible rows above and below without laying them out.
    page.y += first * height
    page.row(height=height, below=0)
    yield from range(first, last)
    page.end_row()
    page.y += (count - last) * height


def _show_bar(page: Page, key: str, area: Rect, content_height: float, offset: float) -> float:
    """Show the scroll bar of an area and handle its input; return the new scroll offset.

    Parameters
    ----------
    page : Page
    key : str
        Key of the scroll area.
    area : pygame.Rect
        Position of the area in the window, px.
    content_height : float
        Height of all content at scale 1, px; larger than the area.
    offset : float
        Scroll offset before this event, at scale 1, px.

    Returns
    -------
    float
    """
    bar = _build_bar(page, key, area, content_height, offset)
    offset = _read_input(page, bar, area, offset)
    page.scroll_offsets[key] = offset
    page.widgets[bar.key] = Widget("bar", key, bar.knob, value=offset)
    _draw_bar(page, bar)
    return offset


def _build_bar(page: Page, key: str, area: Rect, content_height: float, offset: float) -> _Bar:
    """Lay out the scroll bar of an area; the parameters are those of `_show_bar`."""
    height = area.height / page.scale
    max_offset = content_height - height
    left = area.right - page.px(BAR_WIDTH_PX + _BAR_RIGHT_PX)
    track = Rect(left, area.top, page.px(BAR_WIDTH_PX), area.height)
    knob_height = max(round(track.height * height / content_height), page.px(_MIN_KNOB_PX))
    bar = _Bar(f"bar:{key}", track, Rect(track.topleft, (track.width, knob_height)), max_offset)
    bar.knob.top += round(bar.free_height * offset / max_offset)
    return bar


def _read_input(page: Page, bar: _Bar, area: Rect, offset: float) -> float:
    """Return the scroll offset after the current mouse event: a turn of the wheel, a press or a drag."""
    event = page.get_event()
    is_pressed = page.is_pressed(bar.track)
    is_dragged = page.active == bar.key and page.is_event(pygame.MOUSEMOTION)
    if event is not None and event.type == pygame.MOUSEWHEEL and area.collidepoint(page.pointer):
        offset -= get_wheel_notches(event) * SCROLL_PX_PER_NOTCH
        page.consume_event()
    elif is_pressed or is_dragged:
        is_knob_press = is_pressed and bool(bar.knob.collidepoint(page.pointer))
        if is_pressed:
            page.active = bar.key
            page.consume_event()
            page.grab_offset = bar.knob.height / 2
            if is_knob_press:
                page.grab_offset = page.pointer[1] - bar.knob.top
        # A press on the knob moves nothing yet; one outside centers the knob on the pointer.
        if not is_knob_press:
            knob_offset = page.pointer[1] - page.grab_offset - bar.track.top
            offset = knob_offset / bar.free_height * bar.max_offset
    return min(max(offset, 0.0), bar.max_offset)


def _draw_bar(page: Page, bar: _Bar) -> None:
    strength = _KNOB_SHADE
    if page.active == bar.key:
        strength = _HELD_KNOB_SHADE
    elif page.is_hovered(bar.track):
        strength = _HOVERED_KNOB_SHADE
    margin_x, margin_y = _KNOB_MARGINS_PX
    knob = bar.knob.inflate(-page.px(margin_x), -page.px(margin_y))
    draw_box(page, knob, shade(page, strength), radius=BAR_WIDTH_PX / 2)
