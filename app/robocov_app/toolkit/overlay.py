"""Drawings over a window: cards, tags, messages, the status line, a veil."""

from collections.abc import Iterable

import numpy as np
import pygame
from pygame import Rect, Surface

from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import LIGHT, Theme
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import measure_text, render_text, shorten_to_width
from robocov_app.render.surface_cache import cache_surfaces
from robocov_app.toolkit.window.layout import Box

_SUPERSAMPLING = 4
"""Rounded boxes are drawn larger by this factor and then scaled down, which smooths their edges."""
_BOX_CACHE_BYTES = 4_000_000
_VEIL_ALPHA = 150
_FACT_SEPARATOR = "    "

# Lengths in pixels at scale 1.
_CARD_RADIUS_PX = 8
_MESSAGE_TEXT_PX = 12.5
_MESSAGE_LINE_PX = 18
_MIN_MESSAGE_WIDTH_PX = 150
"""Minimum width of the lines of a message; next to an open panel on a phone, the arena is narrower."""
_MAX_MESSAGE_WIDTH_PX = 900
_MESSAGE_MARGIN_PX = 14
"""Distance of the text of a message from the left and right edges of its box."""
_MESSAGE_HEIGHT_PX = 10
"""Height of the box of a message in addition to that of its lines."""
_FIRST_LINE_PX = 14
"""Distance of the middle of the first line of a message from the top of its box."""
_MESSAGE_SIDE_PX = 10
"""Minimum distance of a message from the left and right edges of the arena."""
_MESSAGE_STRIP_PX = 34
"""Height of the strip at the bottom of the arena, with the scale bar, over which messages are centered."""
_MAX_MESSAGE_OVERHANG_PX = 6
"""Distance by which messages may extend below the arena, which is free of text."""
_MESSAGE_TOP_PX = 40
"""Distance of a message from the top of the arena, which leaves the chips of layers visible."""
_MESSAGE_GAP_PX = 8
"""Minimum distance of a message from texts next to it; texts that are closer are hidden."""
_TAG_MARGIN_PX = 6
_TAG_HEIGHT_PX = 20
_TAG_RADIUS_PX = 4
_STATUS_MARGIN_PX = 12
_STATUS_GAP_PX = 20
"""Minimum distance between the facts and the hint of the status line."""

# Fractions of the second color that are mixed into the first one.
_FIELD_STRENGTH = 0.8
_CARD_EDGE_STRENGTH = 0.28
_EDGE_STRENGTH = 0.3
_STATUS_STRENGTH = 0.06
_ERROR_STRENGTH = 0.14


def create_flat_canvas(surface: Surface, theme: Theme, scale: float) -> Canvas:
    """Create a canvas whose coordinates are pixels of a surface."""
    camera = Camera((0.0, 0.0), 1.0, (0.0, 0.0, 1.0, 1.0))
    return Canvas(surface, camera, theme, scale, np.zeros(1, dtype=np.intp))


@cache_surfaces(_BOX_CACHE_BYTES)
def _render_rounded_box(size: tuple[int, int], fill: Color, edge: Color, radius: int, width: int) -> Surface:
    large = Surface((size[0] * _SUPERSAMPLING, size[1] * _SUPERSAMPLING), pygame.SRCALPHA, 32)
    box = large.get_rect()
    pygame.draw.rect(large, edge, box, border_radius=radius * _SUPERSAMPLING)
    inner = box.inflate(-2 * width * _SUPERSAMPLING, -2 * width * _SUPERSAMPLING)
    pygame.draw.rect(large, fill, inner, border_radius=max(radius - width, 0) * _SUPERSAMPLING)
    return pygame.transform.smoothscale(large.premul_alpha(), size)


def draw_rounded_box(
    screen: Surface, box: Rect, fill: Color, *, edge: Color, radius: int, width: int = 1
) -> None:
    """Draw a box with rounded corners.

    Parameters
    ----------
    screen : pygame.Surface
    box : pygame.Rect
    fill, edge : color
    radius : int
        Radius of the corners, px.
    width : int
        Width of the edge, px.
    """
    if box.width > 0 and box.height > 0:
        image = _render_rounded_box(box.size, fill, edge, min(radius, min(box.size) // 2), width)
        screen.blit(image, box, special_flags=pygame.BLEND_PREMULTIPLIED)


def get_accent_ink(theme: Theme) -> Color:
    """Return the color of texts on the accent color."""
    if theme is LIGHT:
        return (255, 255, 255)
    return theme.background


def get_field_color(theme: Theme) -> Color:
    """Return the color of buttons and text fields."""
    if theme is LIGHT:
        return theme.background
    return mix(theme.panel, theme.background, _FIELD_STRENGTH)


def wrap_text(text: str, size: int, width: float, *, bold: bool = False) -> list[str]:
    """Wrap text into lines of limited width.

    Parameters
    ----------
    text : str
    size : int
        Height of the text, px.
    width : float
        Maximum width of a line, px. Words that are wider are split.
    bold : bool

    Returns
    -------
    list of str
    """
    lines: list[str] = []
    for word in text.split():
        if lines and measure_text(f"{lines[-1]} {word}", size, bold=bold) <= width:
            lines[-1] += f" {word}"
            continue
        lines.append("")
        for character in word:
            if lines[-1] and measure_text(lines[-1] + character, size, bold=bold) > width:
                lines.append("")
            lines[-1] += character
    return lines


def draw_edge(screen: Surface, line: Rect, theme: Theme) -> None:
    """Draw a thin line between two parts of a window."""
    screen.fill(mix(theme.panel, theme.ink, _EDGE_STRENGTH), line)


def draw_card(screen: Surface, box: Rect, theme: Theme, scale: float) -> None:
    """Draw the background of a dialog or another card over the window."""
    edge = mix(theme.panel, theme.ink, _CARD_EDGE_STRENGTH)
    radius = round(_CARD_RADIUS_PX * scale)
    draw_rounded_box(screen, box, theme.panel, edge=edge, radius=radius, width=max(1, round(scale)))


def draw_veil(screen: Surface, theme: Theme) -> None:
    """Dim everything that has been drawn so far, by a translucent layer in the background color."""
    veil = Surface(screen.get_size(), pygame.SRCALPHA, 32)
    veil.fill((*theme.background, _VEIL_ALPHA))
    screen.blit(veil, (0, 0))


def draw_tag(screen: Surface, text: str, position: tuple[float, float], theme: Theme, scale: float) -> None:
    """Draw text in a small box, which is moved if it would extend beyond the window.

    Parameters
    ----------
    screen : pygame.Surface
    text : str
    position : (x, y), px
        Middle of the left edge of the text.
    theme : Theme
    scale : float
        Scale of the text and the box.
    """
    size = round(theme.text * scale)
    width = measure_text(text, size) + round(2 * _TAG_MARGIN_PX * scale)
    box = Rect(0, 0, width, round(_TAG_HEIGHT_PX * scale))
    box.midleft = round(position[0] - _TAG_MARGIN_PX * scale), round(position[1])
    box.clamp_ip(screen.get_rect())
    edge = mix(theme.background, theme.ink, _EDGE_STRENGTH)
    draw_rounded_box(screen, box, theme.background, edge=edge, radius=round(_TAG_RADIUS_PX * scale))
    image = render_text(text, size, theme.ink)
    screen.blit(image, image.get_rect(center=box.center))


def draw_status(
    screen: Surface, box: Box, theme: Theme, scale: float, *, facts: list[str], hint: str
) -> None:
    """Draw the status line.

    Parameters
    ----------
    screen : pygame.Surface
    box : Box
    theme : Theme
    scale : float
        Scale of the texts and margins.
    facts : list of str
        Texts shown from the left; the last ones are omitted if there is not enough space.
    hint : str
        Text at the right end.
    """
    left, top, width, height = box
    screen.fill(mix(theme.panel, theme.ink, _STATUS_STRENGTH), Rect(box))
    canvas = create_flat_canvas(screen, theme, scale)
    size = theme.small_text
    y = top + height / 2
    max_width = width - (2 * _STATUS_MARGIN_PX + _STATUS_GAP_PX) * scale - canvas.measure_text(hint, size)
    count = len(facts)
    while count > 1 and canvas.measure_text(_FACT_SEPARATOR.join(facts[:count]), size) > max_width:
        count -= 1
    text = shorten_to_width(_FACT_SEPARATOR.join(facts[:count]), canvas.scale_text_size(size), max_width)
    canvas.draw_text(text, (left + _STATUS_MARGIN_PX * scale, y), size=size)
    right = left + width - _STATUS_MARGIN_PX * scale
    canvas.draw_text(hint, (right, y), size=size, color=theme.faint, anchor="right")


def draw_message(
    screen: Surface,
    text: str,
    arena: Box,
    theme: Theme,
    scale: float,
    *,
    is_error: bool,
    is_at_top: bool = False,
    strip_texts: Iterable[Rect] = (),
) -> Rect | None:
    """Draw a message over the strip at the bottom of the arena; nothing if the text is empty.

    The strip is below the map, so that messages of one or two lines leave the map visible. In an arena that
    is too narrow for words, the message extends beyond the arena, but not beyond the screen.

    Parameters
    ----------
    screen : pygame.Surface
    text : str
        May have several lines.
    arena : Box
    theme : Theme
    scale : float
        Scale of the text and the box.
    is_error : bool
        Whether it is drawn in the color of errors.
    is_at_top : bool
        Whether it is at the top of the arena instead, below the chips of layers.
    strip_texts : iterable of pygame.Rect
        Texts in the strip, px. Those that the message would cover in part are hidden.

    Returns
    -------
    pygame.Rect or None
        The part of its box, px, that is outside the map: where a click removes the message; None if the text
        is empty.
    """
    if not text:
        return None
    size = round(_MESSAGE_TEXT_PX * scale)
    left, top, width, height = arena
    free_width = width - 2 * (_MESSAGE_SIDE_PX + _MESSAGE_MARGIN_PX) * scale
    max_width = min(free_width, _MAX_MESSAGE_WIDTH_PX * scale)
    max_width = max(max_width, _MIN_MESSAGE_WIDTH_PX * scale)
    lines: list[str] = []
    for paragraph in text.split("\n"):
        lines += wrap_text(paragraph, size, max_width)
    box_width = max(measure_text(line, size) for line in lines) + 2 * _MESSAGE_MARGIN_PX * scale
    box_height = (len(lines) * _MESSAGE_LINE_PX + _MESSAGE_HEIGHT_PX) * scale
    box = Rect(0, 0, round(box_width), round(box_height))
    middle = round(left + width / 2)
    if is_at_top:
        box.midtop = middle, round(top + _MESSAGE_TOP_PX * scale)
    else:
        bottom = top + height
        box.center = middle, round(bottom - _MESSAGE_STRIP_PX * scale / 2)
        box.bottom = min(box.bottom, round(bottom + _MAX_MESSAGE_OVERHANG_PX * scale))
    box.clamp_ip(screen.get_rect())
    occupied = box.inflate(2 * round(_MESSAGE_GAP_PX * scale), 0)
    for strip_text in strip_texts:
        if occupied.colliderect(strip_text):
            screen.fill(theme.background, strip_text)
    fill = theme.panel
    edge = mix(theme.panel, theme.ink, _EDGE_STRENGTH)
    if is_error:
        fill = mix(theme.panel, theme.error, _ERROR_STRENGTH)
        edge = theme.error
    radius = round(_CARD_RADIUS_PX * scale)
    draw_rounded_box(screen, box, fill, edge=edge, radius=radius, width=max(1, round(scale)))
    for number, line in enumerate(lines):
        image = render_text(line, size, theme.ink)
        y = round(box.top + (_FIRST_LINE_PX + _MESSAGE_LINE_PX * number) * scale)
        screen.blit(image, image.get_rect(center=(box.centerx, y)))
    if is_at_top:
        return box
    strip_top = round(top + height - _MESSAGE_STRIP_PX * scale)
    return box.clip((box.left, strip_top, box.width, box.height))
