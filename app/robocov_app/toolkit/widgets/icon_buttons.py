"""Buttons that show an icon instead of a text."""

from pygame import BLEND_PREMULTIPLIED, Rect

from robocov_app.look.colors import Color, mix
from robocov_app.toolkit.overlay import get_accent_ink
from robocov_app.toolkit.widgets.appearance import (
    TEXT_PX,
    draw_box,
    draw_focus_ring,
    draw_text,
    is_visible,
    shade,
)
from robocov_app.toolkit.widgets.icons import render_icon
from robocov_app.toolkit.widgets.page import Page, Widget

# Lengths in pixels at scale 1.
_ICON_PX = 20.0
_ICON_CELL_PX = 32.0  # part of a button with a label that the icon takes
_MAIN_ICON_PX = 22.0
_KEY_TEXT_PX = 9.0
_KEY_MARGIN_PX = (4, 1)
_CORNER_RADIUS_PX = 6.0
_ROUND_RADIUS_PX = 100.0  # larger than any button, so that its ends are half circles
_KEY_LINE_PX = 11.0
_DISABLED_STRENGTH = 0.35
# Fractions of the color of text in the faces of buttons.
_HOVERED_STRENGTH = 0.08
_HELD_STRENGTH = 0.16
_HOVERED_ACCENT_STRENGTH = 0.15
_HELD_ACCENT_STRENGTH = 0.25


def show_icon_button(
    page: Page,
    icon: str,
    text: str,
    *,
    key: str,
    tip: str = "",
    disabled_reason: str = "",
    selected: bool = False,
    shortcut: str = "",
    has_label: bool = False,
) -> bool:
    """Show a flat button with an icon.

    Parameters
    ----------
    page : Page
    icon : str
        Key of `toolkit.widgets.icons.ICONS`.
    text : str
        Name of the button.
    key : str
    tip : str
        Tooltip.
    disabled_reason : str
        Why it cannot be pressed; empty if it can.
    selected : bool
        Whether it is highlighted.
    shortcut : str
        Name of a key, which is drawn at the right end of the label, or in the corner of a bare icon.
    has_label : bool
        Whether the name is drawn to the right of the icon.

    Returns
    -------
    bool
        Whether it was just pressed.
    """
    rect = page.cell()
    widget = Widget("button", key, rect, text, value=selected, tip=tip)
    is_clicked = page.add_clickable(widget, disabled_reason)
    if is_visible(page, rect):
        ink = _draw_flat_face(page, rect, key, selected=selected, enabled=not disabled_reason)
        icon_rect = rect.copy()
        if has_label:
            icon_rect.width = page.px(_ICON_CELL_PX)
            label = rect.copy()
            label.left = icon_rect.right
            label.width = rect.right - label.left
            draw_text(page, text, label, ink, TEXT_PX)
        _draw_icon(page, icon, icon_rect, _ICON_PX, ink)
        if shortcut:
            faint = ink if selected else page.theme.faint
            shortcut_box = _place_shortcut(page, rect, in_corner=not has_label)
            draw_text(page, shortcut, shortcut_box, faint, _KEY_TEXT_PX, align="right")
    return is_clicked


def _place_shortcut(page: Page, button: Rect, *, in_corner: bool) -> Rect:
    """Return the box of a shortcut: in the lower right corner, or on the line of the label."""
    margin_x, margin_y = _KEY_MARGIN_PX
    box = button.inflate(-page.px(2 * margin_x), -page.px(2 * margin_y))
    if in_corner:
        box.top = box.bottom - page.px(_KEY_LINE_PX)
        box.height = page.px(_KEY_LINE_PX)
    return box


def show_main_button(page: Page, icon: str, text: str, *, key: str, tip: str = "") -> bool:
    """Show a round button in the accent color, for the most important action of a page.

    Parameters
    ----------
    page : Page
    icon, text, key, tip : str
        As in `show_icon_button`.

    Returns
    -------
    bool
        Whether it was just pressed.
    """
    rect = page.cell()
    is_clicked = page.add_clickable(Widget("button", key, rect, text, tip=tip))
    if is_visible(page, rect):
        strength = 0.0
        if page.active == key:
            strength = _HELD_ACCENT_STRENGTH
        elif page.is_hovered(rect):
            strength = _HOVERED_ACCENT_STRENGTH
        side = min(rect.size)
        disc = Rect(0, 0, side, side)
        disc.center = rect.center
        draw_box(page, disc, mix(page.theme.accent, page.theme.ink, strength), radius=_ROUND_RADIUS_PX)
        _draw_icon(page, icon, disc, _MAIN_ICON_PX, get_accent_ink(page.theme))
        draw_focus_ring(page, disc, key)
    return is_clicked


def _draw_flat_face(page: Page, rect: Rect, key: str, *, selected: bool, enabled: bool) -> Color:
    """Draw the background of a flat button, and return the color of its icon."""
    is_hovered = enabled and page.is_hovered(rect)
    is_held = page.active == key and bool(rect.collidepoint(page.pointer))
    if selected:
        strength = _HOVERED_ACCENT_STRENGTH if is_hovered else 0.0
        draw_box(page, rect, mix(page.theme.accent, page.theme.ink, strength), radius=_CORNER_RADIUS_PX)
    elif is_held:
        draw_box(page, rect, shade(page, _HELD_STRENGTH), radius=_CORNER_RADIUS_PX)
    elif is_hovered:
        draw_box(page, rect, shade(page, _HOVERED_STRENGTH), radius=_CORNER_RADIUS_PX)
    draw_focus_ring(page, rect, key)
    if not enabled:
        return shade(page, _DISABLED_STRENGTH)
    if selected:
        return get_accent_ink(page.theme)
    return page.theme.ink


def _draw_icon(page: Page, icon: str, rect: Rect, side: float, color: Color) -> None:
    """Draw an icon in the middle of a rectangle."""
    if page.surface is None:
        return
    image = render_icon(icon, page.px(side), color)
    page.surface.blit(image, image.get_rect(center=rect.center), special_flags=BLEND_PREMULTIPLIED)
