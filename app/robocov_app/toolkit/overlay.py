"""Overlays of a window: cards, tags, messages, a veil."""

import numpy as np
import pygame
from pygame import Rect, Surface

from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import LIGHT, Theme
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import label, shortened, text_width
from robocov_app.render.surface_cache import kept
from robocov_app.toolkit.layout import Box

_FINE = 4


def flat_canvas(surface: Surface, theme: Theme, scale: float) -> Canvas:
    """Return a canvas for strokes and words that are placed in pixels alone."""
    camera = Camera((0.0, 0.0), 1.0, (0.0, 0.0, 1.0, 1.0))
    return Canvas(surface, camera, theme, scale, np.zeros(1, dtype=np.intp))


@kept(4_000_000)
def _rounded(size: tuple[int, int], fill: Color, edge: Color, radius: int, width: int) -> Surface:
    large = Surface((size[0] * _FINE, size[1] * _FINE), pygame.SRCALPHA, 32)
    box = large.get_rect()
    pygame.draw.rect(large, edge, box, border_radius=radius * _FINE)
    inner = box.inflate(-2 * width * _FINE, -2 * width * _FINE)
    pygame.draw.rect(large, fill, inner, border_radius=max(radius - width, 0) * _FINE)
    return pygame.transform.smoothscale(large.premul_alpha(), size)


def rounded(screen: Surface, box: Rect, fill: Color, edge: Color, radius: int, width: int = 1) -> None:
    if box.width > 0 and box.height > 0:
        picture = _rounded(box.size, fill, edge, min(radius, min(box.size) // 2), width)
        screen.blit(picture, box, special_flags=pygame.BLEND_PREMULTIPLIED)


def on_accent(theme: Theme) -> Color:
    return (255, 255, 255) if theme is LIGHT else theme.background


def field_color(theme: Theme) -> Color:
    return theme.background if theme is LIGHT else mix(theme.panel, theme.background, 0.8)


def wrapped(text: str, size: int, width: float, bold: bool = False) -> list[str]:
    """Break text into lines of at most `width` pixels; a word that is wider is broken too."""
    lines: list[str] = []
    for word in text.split():
        if lines and text_width(f"{lines[-1]} {word}", size, bold) <= width:
            lines[-1] += f" {word}"
            continue
        lines.append("")
        for letter in word:
            if lines[-1] and text_width(lines[-1] + letter, size, bold) > width:
                lines.append("")
            lines[-1] += letter
    return lines


def card(screen: Surface, box: Rect, theme: Theme, scale: float) -> None:
    edge = mix(theme.panel, theme.ink, 0.28)
    rounded(screen, box, theme.panel, edge, round(8 * scale), max(1, round(scale)))


def dim(screen: Surface, theme: Theme) -> None:
    veil = Surface(screen.get_size(), pygame.SRCALPHA, 32)
    veil.fill((*theme.background, 150))
    screen.blit(veil, (0, 0))


def tag(screen: Surface, words: str, at: tuple[float, float], theme: Theme, scale: float) -> None:
    size = round(theme.text * scale)
    box = Rect(0, 0, text_width(words, size) + round(12 * scale), round(20 * scale))
    box.midleft = round(at[0] - 6 * scale), round(at[1])
    box.clamp_ip(screen.get_rect())
    rounded(screen, box, theme.background, mix(theme.background, theme.ink, 0.3), round(4 * scale))
    picture = label(words, size, theme.ink)
    screen.blit(picture, picture.get_rect(center=box.center))


def draw_status(screen: Surface, box: Box, theme: Theme, scale: float, facts: list[str], hint: str) -> None:
    left, top, width, height = box
    screen.fill(mix(theme.panel, theme.ink, 0.06), Rect(box))
    canvas, size, y = flat_canvas(screen, theme, scale), theme.small_text, top + height / 2
    room, kept = width - 44 * scale - canvas.text_width(hint, size), list(facts)
    while len(kept) > 1 and canvas.text_width("    ".join(kept), size) > room:
        kept.pop()
    canvas.text(shortened("    ".join(kept), canvas.text_size(size), room), (left + 12 * scale, y), size=size)
    canvas.text(hint, (left + width - 12 * scale, y), size=size, color=theme.faint, anchor="right")


def draw_message(screen: Surface, words: str, arena: Box, theme: Theme, scale: float, trouble: bool) -> None:
    if not words:
        return
    size = round(12.5 * scale)
    left, top, width, height = arena
    room = min(width - 80 * scale, 620 * scale)
    lines = [line for part in words.split("\n") for line in wrapped(part, size, room)]
    wide = max(text_width(line, size) for line in lines) + 28 * scale
    box = Rect(0, 0, round(wide), round((len(lines) * 18 + 14) * scale))
    box.midbottom = round(left + width / 2), round(top + height - 42 * scale)
    fill = mix(theme.panel, theme.trajectory, 0.14) if trouble else theme.panel
    edge = theme.trajectory if trouble else mix(theme.panel, theme.ink, 0.3)
    rounded(screen, box, fill, edge, round(8 * scale), max(1, round(scale)))
    for k, line in enumerate(lines):
        picture = label(line, size, theme.ink)
        screen.blit(picture, picture.get_rect(center=(box.centerx, round(box.top + (16 + 18 * k) * scale))))
