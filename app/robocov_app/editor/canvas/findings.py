"""What was found out about the map, drawn where it is: what is too narrow, the narrowest gap, problems."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pygame
import shapely

from robocov_app.editor.tools.tool import length_words
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas, bounded
from robocov_app.render.layers import LegendEntry
from robocov_app.render.theme import mix
from robocov_app.viewer.overlays import tag

if TYPE_CHECKING:
    from robocov.arrays import Array
    from robocov.environment import Gap
    from robocov_app.editor.canvas.sheet import View
    from robocov_app.editor.model.measurement import Measurement
    from robocov_app.editor.model.validation import Problem
    from robocov_app.render.theme import Colour, Theme

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
    words = f"{length_words(gap.width)} {sign} {length_words(2 * radius)}"
    side = 1.0 if abs(across[0]) < 1e-9 else float(np.sign(across[0]))
    at = (a + b) / 2 + across * side * 2.4
    x, y = float(at[0]) + 8 * scale, float(at[1]) - 16 * scale
    if cursor is not None:
        beside, level = cursor[0] + 18 * scale, cursor[1] - 22 * scale  # where tools write
        near = beside - canvas.text_width(words) - 20 * scale < x < beside + 200 * scale
        if near and abs(y - level) < 24 * scale:
            y = level - 24 * scale
    tag(canvas, words, (x, y))


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
            tag(canvas, problem.words, (beside, y) if room else (beside, y - (BADGE + 14) * scale))
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
