"""Buttons, options of a list, areas that can be clicked, tabs and check boxes."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType

import pygame
from pygame import Rect, Surface

from robocov_app.look.colors import mix
from robocov_app.render.fonts import measure_text
from robocov_app.toolkit.overlay import get_accent_ink, get_field_color
from robocov_app.toolkit.widgets.appearance import (
    DISABLED_TEXT_SHADE,
    SMALL_TEXT_PX,
    TEXT_PX,
    draw_box,
    draw_face,
    draw_focus_ring,
    draw_text,
    get_edge_width,
    get_text_size,
    is_visible,
    shade,
)
from robocov_app.toolkit.widgets.page import Page, Widget

# Lengths in pixels at scale 1.
_MAX_BUTTON_HEIGHT_PX = 32.0
_LINE_PX = TEXT_PX + 5
_BUTTON_MARGIN_PX = 1
_OPTION_MARGIN_PX = 8
_NOTE_GAP_PX = 12
_DESCRIBED_TEXT_UP_PX = 8
"""Distance by which the text of an option is above its middle, if there is a description below it."""
_DESCRIPTION_DOWN_PX = 9
_TABS_GAP_PX = 8
_CHECK_BOX_PX = 16
_CHECK_BOX_RADIUS_PX = 3.0
_CHECK_TEXT_LEFT_PX = 23
_TICK = ((0.22, 0.52), (0.42, 0.72), (0.78, 0.28))
"""Corners of the tick, as fractions of the check box."""
_TICK_WIDTH = 1 / 8
"""Width of the lines of the tick, as a fraction of the check box."""
_SUPERSAMPLING = 4
"""The tick is drawn larger by this factor and then scaled down, which smooths its edges."""

# Fractions of the accent color that are mixed into the background.
_HIGHLIGHTED_TINT = 0.2
_HOVERED_TINT = 0.08
_HOVERED_BOX_TINT = 0.14

_BOX_EDGE_SHADE = 0.35
_NO_TITLES: Mapping[str, str] = MappingProxyType({})


def show_button(
    page: Page,
    text: str,
    *,
    key: str = "",
    tip: str = "",
    disabled_reason: str = "",
    selected: bool = False,
    small: bool = False,
) -> bool:
    """Show a button.

    Parameters
    ----------
    page : Page
    text : str
    key : str, optional
        By default the text.
    tip : str
        Tooltip.
    disabled_reason : str
        Why it cannot be pressed; empty if it can.
    selected : bool
        Whether it has the accent color.
    small : bool
        Whether its text is small.

    Returns
    -------
    bool
        Whether it was just pressed.
    """
    key = key or text
    rect = page.cell()
    rect.height = min(rect.height, page.px(_MAX_BUTTON_HEIGHT_PX))
    widget = Widget("button", key, rect, text, value=selected, tip=tip)
    is_clicked = page.add_clickable(widget, disabled_reason)
    if is_visible(page, rect):
        ink = draw_face(page, rect, key, selected=selected, enabled=not disabled_reason)
        size = get_text_size(small=small)
        inner = rect.inflate(-page.px(2 * _BUTTON_MARGIN_PX), 0)
        draw_text(page, text, inner, ink, size, bold=selected and not small, align="center")
    return is_clicked


def show_option(
    page: Page,
    text: str,
    note: str = "",
    *,
    key: str,
    description: str = "",
    highlighted: bool = False,
    disabled_reason: str = "",
) -> bool:
    """Show a line of a list that can be clicked.

    Parameters
    ----------
    page : Page
    text : str
        May have several lines.
    note : str
        Faint text at the right end.
    key : str
    description : str
        Faint text below a text of one line.
    highlighted : bool
        Whether it is highlighted.
    disabled_reason : str
        Why it cannot be chosen; empty if it can.

    Returns
    -------
    bool
        Whether it was just clicked.
    """
    rect = page.cell()
    is_clicked = page.add_clickable(Widget("option", key, rect, text, value=highlighted), disabled_reason)
    if not is_visible(page, rect):
        return is_clicked
    if highlighted:
        draw_box(page, rect, mix(page.theme.panel, page.theme.accent, _HIGHLIGHTED_TINT))
    elif page.is_hovered(rect):
        draw_box(page, rect, mix(page.theme.panel, page.theme.accent, _HOVERED_TINT))
    inner = rect.inflate(-page.px(2 * _OPTION_MARGIN_PX), 0)
    if description:
        below = inner.move(0, page.px(_DESCRIPTION_DOWN_PX))
        draw_text(page, description, below, page.theme.faint, SMALL_TEXT_PX)
        inner.top -= page.px(_DESCRIBED_TEXT_UP_PX)
    draw_text(page, note, inner, page.theme.faint, SMALL_TEXT_PX, align="right")
    if note:
        # The text must not run into the note.
        inner.width -= measure_text(note, page.px(SMALL_TEXT_PX)) + page.px(_NOTE_GAP_PX)
    lines = text.split("\n")
    ink = page.theme.ink
    if disabled_reason:
        ink = shade(page, DISABLED_TEXT_SHADE)
    # Texts are centered vertically in their rectangle: start half the extra lines higher.
    inner.top -= page.px(_LINE_PX * (len(lines) - 1) / 2)
    for number, line in enumerate(lines):
        draw_text(page, line, inner.move(0, page.px(_LINE_PX * number)), ink, TEXT_PX)
    return is_clicked


def show_area(page: Page, key: str) -> tuple[Rect, bool]:
    """Reserve the next cell for an image that can be clicked.

    Returns
    -------
    rect : pygame.Rect
        Position in the window, px.
    is_clicked : bool
        Whether it was just clicked.
    """
    rect = page.cell()
    return rect, page.add_clickable(Widget("area", key, rect))


def show_tabs(
    page: Page,
    key: str,
    names: Sequence[str],
    value: str,
    *widths: float,
    titles: Mapping[str, str] = _NO_TITLES,
) -> str | None:
    """Show a row of buttons with one of them selected.

    Parameters
    ----------
    page : Page
    key : str
    names : sequence of str
    value : str
        Name of the selected button.
    *widths : float
        Widths of the buttons at scale 1, px; by default they are equal.
    titles : mapping of str to str
        Label of each button by its name; by default the capitalized name.

    Returns
    -------
    str or None
        Name of the button that was just clicked; None if no button was clicked, or the selected one was.
    """
    page.row(*(widths or [0.0] * len(names)), below=_TABS_GAP_PX)
    picked = None
    for name in names:
        title = titles.get(name, name.capitalize())
        is_selected = name == value
        is_clicked = show_button(page, title, key=f"{key}:{name}", selected=is_selected, small=True)
        if is_clicked and not is_selected:
            picked = name
    page.row()
    return picked


def show_check_box(page: Page, text: str, *, value: bool, key: str = "", tip: str = "") -> bool | None:
    """Show a check box.

    Parameters
    ----------
    page : Page
    text : str
    value : bool
        Whether it is ticked.
    key : str, optional
        By default the text.
    tip : str
        Tooltip.

    Returns
    -------
    bool or None
        The new value if it was just clicked; otherwise None.
    """
    key = key or text
    rect = page.cell()
    is_clicked = page.add_clickable(Widget("check", key, rect, text, value=value, tip=tip))
    if is_visible(page, rect):
        box = Rect(0, 0, page.px(_CHECK_BOX_PX), page.px(_CHECK_BOX_PX))
        box.midleft = rect.midleft
        _draw_check_box(page, box, is_hovered=page.is_hovered(rect), is_ticked=value)
        text_rect = rect.move(page.px(_CHECK_TEXT_LEFT_PX), 0)
        text_rect.width -= page.px(_CHECK_TEXT_LEFT_PX)
        draw_text(page, text, text_rect, page.theme.ink, TEXT_PX)
        draw_focus_ring(page, rect, key)
    if is_clicked:
        return not value
    return None


def _draw_check_box(page: Page, box: Rect, *, is_hovered: bool, is_ticked: bool) -> None:
    """Draw the box of a check box, with a tick if it is ticked."""
    theme = page.theme
    if is_ticked:
        fill = edge = theme.accent
    elif is_hovered:
        fill = mix(get_field_color(theme), theme.accent, _HOVERED_BOX_TINT)
        edge = theme.accent
    else:
        fill = get_field_color(theme)
        edge = shade(page, _BOX_EDGE_SHADE)
    draw_box(page, box, fill, edge=edge, radius=_CHECK_BOX_RADIUS_PX, width=get_edge_width(page))
    if not is_ticked or page.surface is None:
        return
    # For smooth edges, the tick is drawn enlarged and scaled down.
    side = _SUPERSAMPLING * box.width
    large = Surface((side, side), pygame.SRCALPHA, 32)
    line_width = max(_SUPERSAMPLING, round(_TICK_WIDTH * side))
    corners = [(x * side, y * side) for x, y in _TICK]
    for start, end in pairwise(corners):
        pygame.draw.line(large, get_accent_ink(theme), start, end, line_width)
    tick = pygame.transform.smoothscale(large.premul_alpha(), box.size)
    page.surface.blit(tick, box, special_flags=pygame.BLEND_PREMULTIPLIED)
