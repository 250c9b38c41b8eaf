"""What is drawn on top of the sheet: the selection, its handles, guides, what is being drawn."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pygame

from robocov.environment import DiscStart, PointsStart
from robocov_app.editor.canvas.drawn_rings import outline_of
from robocov_app.editor.model.geometry import distance
from robocov_app.editor.tools.tool import length_words
from robocov_app.render import sprites
from robocov_app.render.theme import mix
from robocov_app.viewer.overlays import tag

if TYPE_CHECKING:
    from collections.abc import Iterable

    from shapely.geometry.base import BaseGeometry

    from robocov.arrays import Array
    from robocov.environment import ObstaclePath, Point, StartSpec
    from robocov_app.editor.tools.handles import Handle
    from robocov_app.editor.tools.snapping import Guide
    from robocov_app.editor.tools.tool import Preview
    from robocov_app.render.canvas import Canvas
    from robocov_app.render.theme import Colour, Theme

SQUARE = 3.5
"""Half the side of a handle in pixels at scale 1."""

MOST_RADIUS = 300.0
"""Pixels up to which circles are sprites."""

MOST_LENGTHS = 40
"""Edges of what is drawn whose lengths are told."""


def accent(theme: Theme) -> Colour:
    """Return the colour of what is selected."""
    return theme.final


def guide_colour(theme: Theme) -> Colour:
    """Return the colour of guides."""
    return theme.forces["repulsion_obstacle"]


def pixels(canvas: Canvas, points: Iterable[Point]) -> Array:
    """Return the pixels of points in metres, (k, 2)."""
    return canvas.camera.to_pixels(np.array(list(points), dtype=float).reshape(-1, 2))


def draw_outline(canvas: Canvas, rings: Iterable[Array], colour: Colour, width: float = 2.0) -> None:
    """Draw the rings of something, (k, 2) m each."""
    for ring in rings:
        canvas.outline(canvas.camera.to_pixels(ring), colour, canvas.width(width))


def draw_box(canvas: Canvas, box: tuple[float, float, float, float], colour: Colour) -> None:
    """Draw a dashed box, m."""
    low_x, low_y, high_x, high_y = box
    corners = pixels(canvas, ((low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y))).tolist()
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        canvas.dashes(a, b, colour, canvas.width(1.0), dash=3.0)


def draw_grips(
    canvas: Canvas, found: tuple[Handle, ...], chosen: frozenset[object], near: Handle | None, stem: float
) -> None:
    """Draw the handles; `stem` is how far the knob is from the box, px."""
    theme = canvas.theme
    places = pixels(canvas, (handle.at for handle in found)).tolist()
    for handle, (x, y) in zip(found, places, strict=True):
        if handle.kind == "turn":
            canvas.line((x, y), (x, y + stem), accent(theme), canvas.width(1.0))
            radius = (5.5 if handle == near else 4.5) * canvas.scale
            fill, edge = theme.background, accent(theme)
            canvas.stamp(partial(sprites.disc, radius, fill, edge, 1.6 * canvas.scale, edge, ""), (x, y))
        elif handle.kind == "scale":
            _square(canvas, x, y, theme.background, accent(theme), large=handle == near)
        else:
            fill = accent(theme) if handle.vertex in chosen else theme.background
            _square(canvas, x, y, fill, accent(theme), large=handle == near, round_ones=True)


def _square(
    canvas: Canvas, x: float, y: float, fill: Colour, edge: Colour, *, large: bool, round_ones: bool = False
) -> None:
    half = SQUARE * canvas.scale * (1.4 if large else 1.0)
    box = pygame.Rect(round(x - half), round(y - half), round(2 * half) + 1, round(2 * half) + 1)
    if not canvas.surface.get_rect().colliderect(box):
        return
    radius = round(half) if round_ones else 0
    pygame.draw.rect(canvas.surface, fill, box, border_radius=radius)
    pygame.draw.rect(canvas.surface, edge, box, canvas.width(1.5), border_radius=radius)


def draw_guides(canvas: Canvas, guides: Iterable[Guide]) -> None:
    """Draw why a point is where it is."""
    colour = guide_colour(canvas.theme)
    words: list[str] = []
    last: tuple[float, float] | None = None
    for guide in guides:
        line = pixels(canvas, guide.line)
        for a, b in zip(line[:-1].tolist(), line[1:].tolist(), strict=True):
            canvas.dashes(a, b, colour, canvas.width(1.0), dash=4.0)
        if len(line):
            last = (float(line[-1][0]), float(line[-1][1]))
            if guide.kind in ("vertex", "middle", "centre", "crossing", "edge"):
                canvas.stamp(partial(sprites.ring, 5.0 * canvas.scale, colour, 1.6 * canvas.scale), last)
        if guide.kind != "grid" and guide.words not in words:
            words.append(guide.words)
    if last is not None and words:
        x, y = last
        at = (x + 11 * canvas.scale, y + 15 * canvas.scale)
        canvas.text(" · ".join(words), at, size=canvas.theme.small_text, colour=colour)


def draw_circle(canvas: Canvas, center: Array, radius: float, colour: Colour, width: float) -> None:
    """Draw a circle's line; as a sprite, which is smoother than many short lines, unless it is huge."""
    if radius < MOST_RADIUS:
        rounded = round(2 * radius) / 2
        canvas.stamp(partial(sprites.ring, rounded, colour, width * canvas.scale), center.tolist())
        return
    sides = int(min(radius, 720))
    angle = np.arange(sides) * (2 * np.pi / sides)
    ring = center + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    canvas.outline(ring, colour, canvas.width(width))


def draw_start(
    canvas: Canvas, spec: StartSpec, name: str, *, chosen: bool, first: bool, scale_of_dots: float = 1.0
) -> None:
    """Draw where a team may start, with its name."""
    theme, scale = canvas.theme, canvas.scale
    colour = theme.start
    if isinstance(spec, DiscStart):
        center = pixels(canvas, (spec.center,))[0]
        radius = spec.radius * canvas.camera.zoom
        draw_circle(canvas, center, radius, colour, 2.2 if chosen else 1.6)
        words = f"{name}, default" if first and name else name
        if words:  # above, where no robot stands
            ink = mix(colour, theme.ink, 0.45)
            at = (float(center[0]), float(center[1]) - radius - 10 * scale)
            canvas.text(words, at, size=theme.small_text, colour=ink, anchor="middle")
    elif isinstance(spec, PointsStart):
        for k, at in enumerate(pixels(canvas, spec.positions).tolist()):
            ring = partial(
                sprites.ring, 5.0 * scale * scale_of_dots, colour, (2.2 if chosen else 1.6) * scale
            )
            canvas.stamp(ring, at)
            if k == 0 and name:
                ink = mix(colour, theme.ink, 0.45)
                words = f"{name}, default" if first else name
                above = (at[0] - 5 * scale, at[1] - 14 * scale)
                canvas.text(words, above, size=theme.small_text, colour=ink)


def draw_path(canvas: Canvas, path: ObstaclePath, colour: Colour) -> None:
    """Draw the way of an obstacle: dashed, with an arrow in each leg; the last one of a loop is fainter."""
    points = pixels(canvas, path.points)
    legs = list(pairwise(points))
    if path.repeat == "loop" and len(points) > 2:
        legs.append((points[-1], points[0]))
    for k, (a, b) in enumerate(legs):
        closing = k == len(points) - 1
        canvas.dashes(a.tolist(), b.tolist(), colour, canvas.width(1.0 if closing else 1.6), dash=4.0)
        length = float(np.hypot(*(b - a)))
        if length < 24 * canvas.scale:
            continue
        along = (b - a) / length
        across, tip = np.array([-along[1], along[0]]), (a + b) / 2 + 4 * canvas.scale * along
        for side in (1.0, -1.0):
            end = tip - 7 * canvas.scale * along + side * 4 * canvas.scale * across
            canvas.line(tip.tolist(), end.tolist(), colour, canvas.width(1.6))
    for x, y in points.tolist():
        canvas.stamp(partial(sprites.dot, 2.5 * canvas.scale, colour), (x, y))


def draw_ghost(canvas: Canvas, geometry: BaseGeometry) -> None:
    """Draw where something will be."""
    for ring in outline_of(geometry).rings:
        corners = canvas.camera.to_pixels(ring)
        _tint(canvas, corners, accent(canvas.theme))
        canvas.outline(corners, accent(canvas.theme), canvas.width(1.5))


def draw_preview(canvas: Canvas, preview: Preview, at: tuple[float, float] | None) -> None:
    """Draw what a tool is about to do; words stand beside the cursor, px."""
    theme, scale = canvas.theme, canvas.scale
    colour = accent(theme)
    for shape in preview.shapes:
        draw_ghost(canvas, shape.polygon)
    if preview.start is not None:
        draw_start(canvas, preview.start, "", chosen=True, first=False)
    line = pixels(canvas, preview.line)
    if len(line) > 1:
        canvas.outline(line, colour, canvas.width(1.5), closed=False)
        if preview.closed:
            canvas.dashes(line[-1].tolist(), line[0].tolist(), colour, canvas.width(1.0))
    for x, y in line.tolist():
        _square(canvas, x, y, theme.background, colour, large=False, round_ones=True)
    if preview.lengths:
        _draw_lengths(canvas, preview.line)
    for k, rim in enumerate(preview.rings):
        width = 2.2 if k == preview.chosen else 1.2
        canvas.outline(pixels(canvas, rim), colour, canvas.width(width))
    for k, (x, y) in enumerate(pixels(canvas, preview.dots).tolist()):
        _square(canvas, x, y, theme.background, colour, large=k == preview.chosen, round_ones=True)
    if preview.box is not None:
        _draw_selecting(canvas, preview)
    if preview.words and at is not None:
        tag(canvas, preview.words, (at[0] + 18 * scale, at[1] - 22 * scale))


def _tint(canvas: Canvas, corners: Array, colour: Colour) -> None:
    low, high = np.floor(corners.min(axis=0)), np.ceil(corners.max(axis=0))
    box = pygame.Rect(*np.clip([*low, *(high - low + 1)], -30000, 30000).astype(int).tolist())
    box = box.clip(canvas.surface.get_clip())
    if not (box.width and box.height):
        return
    page = pygame.Surface(box.size, pygame.SRCALPHA, 32)
    shifted = np.clip(corners - np.array(box.topleft), -30000, 30000)
    pygame.draw.polygon(page, (*mix(canvas.theme.obstacle, colour, 0.35), 130), np.rint(shifted).tolist())
    canvas.surface.blit(page, box)


def _draw_lengths(canvas: Canvas, line: tuple[Point, ...]) -> None:
    """Write the length of each edge beside it, but of the last, which stands beside the cursor."""
    edges = list(pairwise(line[:-1]))[-MOST_LENGTHS:]
    ink = mix(canvas.theme.background, canvas.theme.ink, 0.85)
    for a, b in edges:
        ends = pixels(canvas, (a, b))
        words = length_words(distance(a, b))
        if float(np.hypot(*(ends[1] - ends[0]))) < canvas.text_width(words, canvas.theme.small_text):
            continue
        along = ends[1] - ends[0]
        across = np.array([along[1], -along[0]]) / max(float(np.hypot(*along)), 1e-9)
        if across[1] > 0 or (across[1] == 0 and across[0] < 0):
            across = -across
        wide = canvas.text_width(words, canvas.theme.small_text) / 2
        far = 9 * canvas.scale + abs(float(across[0])) * wide
        at = (ends[0] + ends[1]) / 2 + far * across
        canvas.text(words, at.tolist(), size=canvas.theme.small_text, colour=ink, anchor="middle")


def _draw_selecting(canvas: Canvas, preview: Preview) -> None:
    assert preview.box is not None
    ends = pixels(canvas, preview.box)
    low, high = ends.min(axis=0), ends.max(axis=0)
    box = pygame.Rect(*np.rint([*low, *(high - low)]).astype(int).tolist()).clip(canvas.surface.get_clip())
    colour = canvas.theme.start if preview.touched else accent(canvas.theme)
    if box.width and box.height:
        page = pygame.Surface(box.size, pygame.SRCALPHA, 32)
        page.fill((*colour, 34))
        canvas.surface.blit(page, box)
    corners = [low.tolist(), [high[0], low[1]], high.tolist(), [low[0], high[1]]]
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        if preview.touched:
            canvas.dashes(a, b, colour, canvas.width(1.0), dash=4.0)
        else:
            canvas.line(a, b, colour, canvas.width(1.0))


def draw_typed(canvas: Canvas, text: str, at: tuple[float, float]) -> None:
    """Show what is being typed, below the cursor."""
    theme, scale = canvas.theme, canvas.scale
    words = f"{text}▏"
    size = canvas.text_size(theme.text * 1.1)
    wide = canvas.text_width(words, theme.text * 1.1, bold=True)
    hint = "Enter"
    box = pygame.Rect(
        0, 0, wide + round(26 * scale) + canvas.text_width(hint, theme.small_text), round(26 * scale)
    )
    box.topleft = round(at[0] + 14 * scale), round(at[1] + 14 * scale)
    box.clamp_ip(canvas.surface.get_rect())
    pygame.draw.rect(canvas.surface, theme.panel, box, border_radius=round(5 * scale))
    pygame.draw.rect(canvas.surface, accent(theme), box, canvas.width(1.5), border_radius=round(5 * scale))
    canvas.text(words, (box.left + 8 * scale, box.centery), size=size / scale, bold=True)
    canvas.text(
        hint, (box.right - 8 * scale, box.centery), size=theme.small_text, colour=theme.faint, anchor="right"
    )
