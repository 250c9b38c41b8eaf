"""Overlay of the sheet: selection and its handles, guides, what is drawn; what validation found."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pygame
import shapely

from robocov.environment import DiscStart, PointsStart
from robocov_app.editor.canvas.drawn_rings import outline_of
from robocov_app.editor.model.geometry import distance
from robocov_app.editor.tools.tool import length_words
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas, LegendEntry, bounded
from robocov_app.render.theme import mix
from robocov_app.toolkit.overlay import tag

if TYPE_CHECKING:
    from collections.abc import Iterable

    from shapely.geometry.base import BaseGeometry

    from robocov.arrays import Array
    from robocov.environment import Gap, ObstaclePath, Point, StartSpec
    from robocov_app.editor.canvas.sheet import View
    from robocov_app.editor.model.measurement import Measurement
    from robocov_app.editor.model.validation import Problem
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
        tag(
            canvas.surface,
            preview.words,
            (at[0] + 18 * scale, at[1] - 22 * scale),
            canvas.theme,
            canvas.scale,
        )


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


HATCH = 7
"""Pixels at scale 1 from one slanted line to the next."""

BADGE = 8.0
"""Radius of a problem's badge in pixels at scale 1."""

STEM = 17.0
"""Pixels at scale 1 that a badge is above its place."""

MOST_BADGES = 200


def narrow_colour(theme: Theme) -> Colour:
    """Return the colour of what is too narrow for a robot."""
    return theme.trajectory


def sealed_colour(theme: Theme) -> Colour:
    """Return the colour of what no robot comes to from the largest part."""
    return theme.forces["repulsion_robots"]


class Hatching:
    """Hatched places on a page of their own, kept as long as map and camera stay."""

    def __init__(self) -> None:
        self._key: tuple[object, ...] = ()
        self._patch: tuple[pygame.Surface, pygame.Rect] | None = None

    def draw(self, screen: pygame.Surface, view: View, measurement: Measurement) -> None:
        """Hatch where robots do not pass, and what is cut off."""
        key = (measurement, view.camera, view.theme.name, view.scale, view.size)
        if len(self._key) != len(key) or any(
            a is not b and a != b for a, b in zip(self._key, key, strict=True)
        ):
            self._key, self._patch = key, self._made(view, measurement)
        if self._patch is not None:
            patch, box = self._patch
            screen.blit(patch, box, special_flags=pygame.BLEND_PREMULTIPLIED)

    @staticmethod
    def _made(view: View, measurement: Measurement) -> tuple[pygame.Surface, pygame.Rect] | None:
        parts = [
            (each, colour)
            for areas, colour in (
                (measurement.sealed, sealed_colour(view.theme)),
                (measurement.impassable, narrow_colour(view.theme)),
            )
            for each in shapely.get_parts(areas)
            if isinstance(each, shapely.Polygon) and not each.is_empty
        ]
        if not parts:
            return None
        bounds = np.array([each.bounds for each, _ in parts])
        low, high = bounds[:, :2].min(axis=0), bounds[:, 2:].max(axis=0)
        ends = view.camera.to_pixels(np.array([[low[0], high[1]], [high[0], low[1]]]))
        (left, top), (right, bottom) = bounded(ends).tolist()
        box = pygame.Rect(int(left) - 1, int(top) - 1, int(right - left) + 3, int(bottom - top) + 3)
        box = box.clip(view.clip)
        if not (box.width and box.height):
            return None
        patch = pygame.Surface(box.size, pygame.SRCALPHA, 32)
        for colour in dict.fromkeys(colour for _, colour in parts):
            mask = pygame.Surface(box.size, pygame.SRCALPHA, 32)
            own = view.canvas(mask)
            for each, its in parts:
                if its == colour:
                    _stencil(own, each, box.topleft)
            soft = colour == sealed_colour(view.theme)
            lines = _lines(box.size, colour, view.scale, box.topleft, 0.5 if soft else 1.0)
            mask.blit(lines, (0, 0), special_flags=pygame.BLEND_RGBA_MULT)
            patch.blit(mask.premul_alpha(), (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
            edged = view.canvas(patch)
            for each, its in parts:
                if its == colour:
                    ring = view.camera.to_pixels(np.asarray(each.exterior.coords)[:-1]) - np.array(
                        box.topleft
                    )
                    edged.outline(ring, colour, edged.width(1.0))
        return patch, box


def _stencil(canvas: Canvas, area: shapely.Polygon, corner: tuple[int, int]) -> None:
    """Paint an area white, its holes clear; what is thinner than a pixel as a line."""
    shift = np.array(corner, dtype=float)
    white = (255, 255, 255, 255)
    ring = canvas.camera.to_pixels(np.asarray(area.exterior.coords)[:-1]) - shift
    canvas.polygon(ring, white)
    for hole in area.interiors:
        canvas.polygon(canvas.camera.to_pixels(np.asarray(hole.coords)[:-1]) - shift, (0, 0, 0, 0))
    canvas.outline(ring, white[:3], 1)


def _lines(
    size: tuple[int, int], colour: Colour, scale: float, corner: tuple[int, int], strength: float = 1.0
) -> pygame.Surface:
    """Return a page of slanted lines over a tint; they keep their place when the sheet is moved."""
    page = pygame.Surface(size, pygame.SRCALPHA, 32)
    page.fill((*colour, round(56 * strength)))
    width, height = size
    step = max(4, round(HATCH * scale))
    first = -((corner[0] + corner[1]) % step)
    for x in range(first, width + height, step):
        pygame.draw.line(
            page, (*colour, round(235 * strength)), (x, 0), (x - height, height), max(1, round(1.2 * scale))
        )
    return page


def draw_gap(canvas: Canvas, gap: Gap, radius: float) -> None:
    """Draw the narrowest gap."""
    colour, a, b, across = _gap(canvas, gap, radius)
    canvas.line(a.tolist(), b.tolist(), colour, canvas.width(2))
    for end in (a, b):
        canvas.line((end - across).tolist(), (end + across).tolist(), colour, canvas.width(2))
        canvas.stamp(partial(sprites.dot, 2.2 * canvas.scale, colour), end.tolist())


def tag_gap(canvas: Canvas, gap: Gap, radius: float, cursor: tuple[float, float] | None = None) -> None:
    """Write the width of the narrowest gap against what a robot needs; above words at `cursor`, px."""
    _, a, b, across = _gap(canvas, gap, radius)
    scale = canvas.scale
    sign = "<" if gap.width < 2 * radius else "≥"
    words = f"gap {length_words(gap.width)} {sign} {length_words(2 * radius)}"
    side = 1.0 if abs(across[0]) < 1e-9 else float(np.sign(across[0]))
    at = (a + b) / 2 + across * side * 2.4
    x, y = float(at[0]) + 8 * scale, float(at[1]) - 16 * scale
    if cursor is not None:
        beside, level = cursor[0] + 18 * scale, cursor[1] - 22 * scale  # where tools write
        near = beside - canvas.text_width(words) - 20 * scale < x < beside + 200 * scale
        if near and abs(y - level) < 24 * scale:
            y = level - 24 * scale
    tag(canvas.surface, words, (x, y), canvas.theme, canvas.scale)


def _gap(canvas: Canvas, gap: Gap, radius: float) -> tuple[Colour, Array, Array, Array]:
    """Return colour, ends, and what leads 5 px across."""
    theme = canvas.theme
    a, b = canvas.camera.to_pixels(np.array(gap.between))
    length = max(float(np.hypot(*(b - a))), 1e-9)
    across = np.array([b[1] - a[1], a[0] - b[0]]) / length * 5 * canvas.scale
    return narrow_colour(theme) if gap.width < 2 * radius else theme.start, a, b, across


def badge_places(found: tuple[Problem, ...], view: View) -> list[tuple[Problem, tuple[float, float]]]:
    """Return where the badges of problems are, px."""
    places = []
    for problem in found[:MOST_BADGES]:
        if problem.where is not None and not problem.where.is_empty:
            spot = problem.where.representative_point()
            x, y = view.camera.to_pixels(np.array([spot.x, spot.y])).tolist()
            # above the place, which can be seen then
            places.append((problem, (x, y - STEM * view.scale)))
    return places


def draw_problems(
    canvas: Canvas, view: View, found: tuple[Problem, ...], told: Problem | None, hovered: Problem | None
) -> None:
    """Draw a badge for each problem, and the words of those that are asked about."""
    theme, scale = canvas.theme, canvas.scale
    for problem in found[:MOST_BADGES]:
        if problem.where is not None and (problem.grave or problem in (told, hovered)):
            _draw_place(canvas, problem)
    places = badge_places(found, view)
    for problem, (x, y) in reversed(places):
        colour = problem_colour(theme, grave=problem.grave)
        canvas.line((x, y), (x, y + STEM * scale), colour, canvas.width(1.5))
        canvas.stamp(partial(sprites.dot, 1.8 * scale, colour), (x, y + STEM * scale))
        draw_badge(canvas, x, y, grave=problem.grave)
    lone = found[0] if len(found) == 1 and found[0].grave else None
    for problem, (x, y) in places:
        if problem in (told, hovered) or problem is lone:
            beside = x + (BADGE + 10) * scale
            room = canvas.surface.get_width() - beside - 8 * scale > canvas.text_width(problem.words)
            # where there is no room beside the badge, above it
            tag(
                canvas.surface,
                problem.words,
                (beside, y) if room else (beside, y - (BADGE + 14) * scale),
                canvas.theme,
                canvas.scale,
            )
            if problem is told:
                ring = partial(sprites.ring, (BADGE + 4) * scale, theme.ink, 1.6 * scale)
                canvas.stamp(ring, (x, y))


def _draw_place(canvas: Canvas, problem: Problem) -> None:
    """Draw the place of a problem: lines along it."""
    colour = problem_colour(canvas.theme, grave=problem.grave)
    for part in shapely.get_parts(problem.where):
        rings = [part.exterior, *part.interiors] if isinstance(part, shapely.Polygon) else [part]
        for ring in rings:
            points = shapely.get_coordinates(ring)
            if len(points) > 1:
                canvas.outline(canvas.camera.to_pixels(points), colour, canvas.width(2), closed=False)


def problem_colour(theme: Theme, *, grave: bool) -> Colour:
    """Return the colour of a problem."""
    return theme.trajectory if grave else theme.others[1]


def draw_badge(canvas: Canvas, x: float, y: float, *, grave: bool) -> None:
    """Draw a disc with an exclamation mark."""
    theme, scale = canvas.theme, canvas.scale
    fill = problem_colour(theme, grave=grave)
    canvas.stamp(
        partial(
            sprites.disc, BADGE * scale, fill, theme.background, 1.4 * scale, mix(fill, theme.ink, 0.3), "!"
        ),
        (x, y),
    )


def legend_entries(
    measurement: Measurement | None, *, starts: bool, team: bool, unfree: bool
) -> list[LegendEntry]:
    """Return what the legend explains."""
    entries = [LegendEntry("obstacle", _obstacle_glyph), LegendEntry("boundary", _boundary_glyph)]
    if unfree:
        entries.append(LegendEntry("outside, in the robots' hull", _beyond_glyph))
    if starts:
        entries.append(LegendEntry("start", _start_glyph))
    if team:
        entries.append(LegendEntry("robot", _robot_glyph))
    if measurement is not None:
        if not measurement.impassable.is_empty:
            entries.append(LegendEntry("too narrow for a robot", partial(_hatch_glyph, narrow=True)))
        if not measurement.sealed.is_empty:
            entries.append(LegendEntry("cut off", partial(_hatch_glyph, narrow=False)))
        if measurement.problems:
            entries.append(LegendEntry("problem", partial(draw_badge_glyph, grave=True)))
    return entries


def draw_badge_glyph(canvas: Canvas, x: float, y: float, *, grave: bool) -> None:
    """Draw the legend's badge."""
    fill = problem_colour(canvas.theme, grave=grave)
    edge = mix(fill, canvas.theme.ink, 0.3)
    canvas.stamp(
        partial(sprites.disc, 6.5 * canvas.scale, fill, canvas.theme.background, canvas.scale, edge, "!"),
        (x, y),
    )


def _box(canvas: Canvas, x: float, y: float, fill: Colour, edge: Colour) -> None:
    size = 11 * canvas.scale
    box = pygame.Rect(round(x - size / 2), round(y - size / 2), round(size), round(size))
    pygame.draw.rect(canvas.surface, fill, box)
    pygame.draw.rect(canvas.surface, edge, box, canvas.width(1.0))


def _obstacle_glyph(canvas: Canvas, x: float, y: float) -> None:
    _box(canvas, x, y, canvas.theme.obstacle, canvas.theme.obstacle_edge)


def _beyond_glyph(canvas: Canvas, x: float, y: float) -> None:
    from robocov_app.editor.canvas.sheet import outside_colour

    fill = mix(outside_colour(canvas.theme), canvas.theme.obstacle, 0.55)
    _box(canvas, x, y, fill, mix(fill, canvas.theme.obstacle_edge, 0.5))


def _boundary_glyph(canvas: Canvas, x: float, y: float) -> None:
    half = 9 * canvas.scale
    canvas.line((x - half, y), (x + half, y), canvas.theme.boundary, canvas.width(canvas.theme.boundary_line))


def _start_glyph(canvas: Canvas, x: float, y: float) -> None:
    canvas.stamp(partial(sprites.ring, 5.0 * canvas.scale, canvas.theme.start, 1.6 * canvas.scale), (x, y))


def _robot_glyph(canvas: Canvas, x: float, y: float) -> None:
    theme, scale = canvas.theme, canvas.scale
    edge = mix(theme.background, theme.ink, 0.55)
    canvas.stamp(
        partial(sprites.disc, 6.5 * scale, theme.robots[0], theme.robot_ring, 1.4 * scale, edge, ""), (x, y)
    )


def _hatch_glyph(canvas: Canvas, x: float, y: float, *, narrow: bool) -> None:
    size = round(12 * canvas.scale)
    colour = narrow_colour(canvas.theme) if narrow else sealed_colour(canvas.theme)
    page = _lines((size, size), colour, canvas.scale, (0, 0))
    canvas.surface.blit(page, (round(x - size / 2), round(y - size / 2)))
