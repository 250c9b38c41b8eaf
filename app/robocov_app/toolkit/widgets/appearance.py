"""Common appearance of widgets: text sizes, boxes, button faces, focus ring and texts."""

from typing import NamedTuple

import pygame
from pygame import Rect, Surface

from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import Theme
from robocov_app.render.fonts import render_text, shorten_to_width
from robocov_app.toolkit.overlay import draw_rounded_box, get_accent_ink, get_field_color
from robocov_app.toolkit.widgets.page import Page

# Lengths in pixels at scale 1.
TEXT_PX = 13.0
"""Size of a widget's text."""
SMALL_TEXT_PX = 11.5
"""Size of the text of small buttons, headings and units."""
CORNER_RADIUS_PX = 4.0
EDGE_WIDTH_PX = 0.75
_FOCUS_RING_WIDTH_PX = 1.5

# Fractions for `shade`.
EDGE_SHADE = 0.24
"""Edge of a button or text field."""
DISABLED_TEXT_SHADE = 0.45
_DISABLED_EDGE_SHADE = 0.14


class _Tint(NamedTuple):
    """Fractions of a second color that are mixed into the face of a button while it is hovered or held."""

    hovered: float
    held: float


# The accent color is mixed into plain faces, the color of text into selected ones.
_PLAIN_TINT = _Tint(hovered=0.14, held=0.28)
_SELECTED_TINT = _Tint(hovered=0.15, held=0.25)


def shade(page: Page, fraction: float) -> Color:
    """Return a color between the panel's color (fraction 0) and its text color (fraction 1)."""
    return mix(page.theme.panel, page.theme.ink, fraction)


def get_text_size(*, small: bool) -> float:
    """Return the text size for normal or small text, at scale 1, px."""
    if small:
        return SMALL_TEXT_PX
    return TEXT_PX


def get_edge_width(page: Page) -> int:
    """Return the width of the edge of a widget, px."""
    return max(1, page.px(EDGE_WIDTH_PX))


def is_visible(page: Page, rect: Rect) -> bool:
    """Return whether the page is being drawn and a rectangle is at least partly visible."""
    return page.surface is not None and bool(rect.colliderect(page.clip))


def draw_box(
    page: Page,
    rect: Rect,
    fill: Color,
    *,
    edge: Color | None = None,
    radius: float = CORNER_RADIUS_PX,
    width: int = 1,
) -> None:
    """Draw a rounded box.

    Parameters
    ----------
    page : Page
    rect : pygame.Rect
    fill : color
    edge : color, optional
        By default the same as `fill`.
    radius : float
        Radius of the corners at scale 1, px.
    width : int
        Width of the edge, px.
    """
    if page.surface is None:
        return
    if edge is None:
        edge = fill
    draw_rounded_box(page.surface, rect, fill, edge=edge, radius=page.px(radius), width=width)


def draw_face(page: Page, rect: Rect, key: str, *, selected: bool = False, enabled: bool = True) -> Color:
    """Draw the background of a button or menu, depending on its state, and return the color for its text.

    Parameters
    ----------
    page : Page
    rect : pygame.Rect
        Position in the window, px.
    key : str
        Key of the widget.
    selected : bool
        Whether it has the accent color.
    enabled : bool
        Whether it can be used; otherwise it is gray.

    Returns
    -------
    Color
    """
    theme = page.theme
    is_hovered = page.is_hovered(rect)
    is_held = page.active == key and bool(rect.collidepoint(page.pointer))
    if not enabled:
        # The colors are close to that of the panel, so the button looks faint.
        fill = theme.panel
        edge = shade(page, _DISABLED_EDGE_SHADE)
        ink = shade(page, DISABLED_TEXT_SHADE)
    elif selected:
        strength = _choose_strength(_SELECTED_TINT, is_hovered=is_hovered, is_held=is_held)
        fill = mix(theme.accent, theme.ink, strength)
        edge = fill
        ink = get_accent_ink(theme)
    else:
        strength = _choose_strength(_PLAIN_TINT, is_hovered=is_hovered, is_held=is_held)
        fill = mix(get_field_color(theme), theme.accent, strength)
        edge = shade(page, EDGE_SHADE)
        if is_held or is_hovered:
            edge = theme.accent
        ink = theme.ink
    draw_box(page, rect, fill, edge=edge, width=get_edge_width(page))
    draw_focus_ring(page, rect, key)
    return ink


def _choose_strength(tint: _Tint, *, is_hovered: bool, is_held: bool) -> float:
    """Return the fraction of the tint that a face has in its current state."""
    if is_held:
        return tint.held
    if is_hovered:
        return tint.hovered
    return 0.0


def draw_focus_ring(page: Page, rect: Rect, key: str) -> None:
    """Draw a ring around a widget if it has the focus."""
    if page.surface is not None and page.focus == key:
        draw_ring(page.surface, rect, page.theme, page.scale)


def draw_ring(surface: Surface, rect: Rect, theme: Theme, scale: float) -> None:
    """Draw a ring that stands out from any widget: in the accent color, with a light line inside."""
    width = max(2, round(_FOCUS_RING_WIDTH_PX * scale))
    radius = round(CORNER_RADIUS_PX * scale)
    pygame.draw.rect(surface, theme.accent, rect, width, border_radius=radius)
    inner = rect.inflate(-2 * width, -2 * width)
    pygame.draw.rect(surface, theme.background, inner, max(1, width // 2), border_radius=radius)


def draw_text(
    page: Page,
    text: str,
    rect: Rect,
    color: Color,
    size: float,
    *,
    bold: bool = False,
    align: str = "left",
) -> None:
    """Draw a line of text, shortened to the width of a rectangle.

    Parameters
    ----------
    page : Page
    text : str
    rect : pygame.Rect
    color : color
    size : float
        Height at scale 1, px.
    bold : bool
    align : str
        "left", "center" or "right".
    """
    if page.surface is None or not text or not is_visible(page, rect):
        return
    pixels = page.px(size)
    image = render_text(shorten_to_width(text, pixels, rect.width, bold=bold), pixels, color, bold=bold)
    box = image.get_rect(midleft=rect.midleft)
    if align == "center":
        box = image.get_rect(center=rect.center)
    elif align == "right":
        box = image.get_rect(midright=rect.midright)
    page.surface.blit(image, box)
