"""Drop-down menus."""

from collections.abc import Sequence

import pygame
from pygame import Rect

from robocov_app.render.fonts import measure_text
from robocov_app.toolkit.widgets.appearance import TEXT_PX, draw_face, draw_text, is_visible
from robocov_app.toolkit.widgets.open_list import (
    LIST_EDGE_PX,
    LIST_ROW_PX,
    MAX_LIST_HEIGHT_PX,
    ListResponse,
    OpenList,
)
from robocov_app.toolkit.widgets.page import Page, Widget

# Lengths in pixels at scale 1.
_PAGE_MARGIN_PX = 8
"""Minimum distance of an open list from the edges of the page."""
_LIST_GAP_PX = 2
"""Distance between a menu and its list."""
_LIST_TEXT_MARGINS_PX = 34
"""Width of a list in addition to its longest option: margins and scroll bar."""
_TEXT_MARGIN_PX = 9
_TRIANGLE_SPACE_PX = 12
_TRIANGLE_RIGHT_PX = 13
"""Distance of the center of the triangle from the right edge of the menu."""
_TRIANGLE_DROP_PX = 1
"""Distance of the center of the triangle below the middle of the menu."""
_TRIANGLE_SIDE_PX = 4


def show_dropdown(page: Page, key: str, options: Sequence[str], value: str, *, tip: str = "") -> str | None:
    """Show a drop-down menu, which opens a list of options.

    Parameters
    ----------
    page : Page
    key : str
    options : sequence of str
    value : str
        The current option, shown while the list is closed.
    tip : str
        Tooltip.

    Returns
    -------
    str or None
        Option that was just picked; None if no option was picked, or the current one was.
    """
    rect = page.cell()
    picked = _read_list(page, key, options)
    is_clicked = page.add_clickable(Widget("menu", key, rect, text=value, value=value, tip=tip))
    if picked is None and (is_clicked or page.get_key(key) == "down"):
        page.open_list = _build_list(page, key, options, value, rect)
        page.focus = key
        page.edit = None
        page.consume_event()
    if is_visible(page, rect):
        _draw_menu(page, key, value, rect)
    if picked == value:
        return None
    return picked


def handle_list_event(page: Page, event: pygame.event.Event) -> bool:
    """Pass an event to the open list of a drop-down menu; the focus leaves the menu when the list closes.

    Parameters
    ----------
    page : Page
    event : pygame.event.Event

    Returns
    -------
    bool
        Whether the list has handled the event; False if no list is open.
    """
    if page.open_list is None:
        return False
    page.needs_redraw = True
    response = page.open_list.handle_event(event)
    if response is ListResponse.CLOSED:
        page.clear_focus()
    elif response is ListResponse.PICKED:
        page.focus = None
        page.run()  # In this run, the menu reads the picked option.
        page.open_list = None
    return response is not ListResponse.IGNORED


def _read_list(page: Page, key: str, options: Sequence[str]) -> str | None:
    """Return the option picked from the open list of a menu; close the list if its options have changed."""
    open_list = page.open_list
    if open_list is None or open_list.key != key:
        return None
    if open_list.picked is not None or open_list.options != list(options):
        page.open_list = None
    if open_list.picked is None or open_list.picked not in options:
        return None
    return open_list.picked


def _build_list(page: Page, key: str, options: Sequence[str], value: str, menu: Rect) -> OpenList:
    """Build the list below its menu, or above the menu if there is not enough space below but more above."""
    row_height = page.px(LIST_ROW_PX)
    height = min(len(options) * row_height + 2 * LIST_EDGE_PX, page.px(MAX_LIST_HEIGHT_PX))
    space_below = page.box.bottom - menu.bottom - page.px(_PAGE_MARGIN_PX)
    space_above = menu.top - page.box.top - page.px(_PAGE_MARGIN_PX)
    rect = Rect(
        menu.left, menu.bottom + page.px(_LIST_GAP_PX), menu.width, min(height, max(space_below, space_above))
    )
    if space_below < height and space_above > space_below:
        rect.bottom = menu.top - page.px(_LIST_GAP_PX)
    longest = max((measure_text(option, page.px(TEXT_PX)) for option in options), default=0)
    rect.width = min(
        max(longest + page.px(_LIST_TEXT_MARGINS_PX), menu.width),
        page.box.width - page.px(2 * _PAGE_MARGIN_PX),
    )
    rect.right = min(rect.right, page.box.right - page.px(_PAGE_MARGIN_PX))
    open_list = OpenList(key, list(options), rect, row_height)
    if value in options:
        open_list.highlight(open_list.options.index(value))
    else:
        open_list.highlight(0)
    return open_list


def _draw_menu(page: Page, key: str, value: str, rect: Rect) -> None:
    """Draw a closed menu: its face, the current option, and a triangle that points down."""
    ink = draw_face(page, rect, key)
    text_rect = rect.inflate(-page.px(2 * _TEXT_MARGIN_PX), 0)
    text_rect.width -= page.px(_TRIANGLE_SPACE_PX)
    draw_text(page, value, text_rect, ink, TEXT_PX)
    if page.surface is None:
        return
    x = rect.right - page.px(_TRIANGLE_RIGHT_PX)
    y = rect.centery + page.px(_TRIANGLE_DROP_PX)
    side = page.px(_TRIANGLE_SIDE_PX)
    corners = [(x - side, y - side // 2), (x + side, y - side // 2), (x, y + side // 2 + 1)]
    pygame.draw.polygon(page.surface, ink, corners)
