"""Overlay of the sheet: selection and its handles, guides, what is drawn; what validation found."""

from collections.abc import Iterable, Sequence
from functools import partial
from itertools import pairwise

import numpy as np
import pygame
import shapely
from pygame import Rect, Surface

from robocov.arrays import Array
from robocov.environment import DiscStart, Gap, ObstaclePath, Point, PointsStart, StartSpec
from robocov_app.editor.canvas.map_layers import View, outline_of, outside_colour, pixel_box
from robocov_app.editor.model.geometry import distance, length_words
from robocov_app.editor.model.measurement import Measurement
from robocov_app.editor.model.selection import Vertex
from robocov_app.editor.model.validation import Problem
from robocov_app.editor.tools.snapping import Guide
from robocov_app.editor.tools.tool import KNOB, Handle, Preview
from robocov_app.render import sprites
from robocov_app.render.camera import FARTHEST_PIXEL
from robocov_app.render.canvas import Canvas, Glyph, LegendEntry
from robocov_app.render.theme import Colour, Theme, mix
from robocov_app.toolkit.overlay import tag

# pixels at scale 1
SQUARE = 3.5  # half the side of a handle
MOST_RADIUS = 300.0  # up to which circles are sprites, which are smoother than many short lines
HATCH = 7  # from one slanted line to the next
BADGE = 8.0  # radius of a problem's badge
STEM = 17.0  # that it is above its place
MOST_LENGTHS = 40  # edges of what is drawn whose lengths are told
MOST_BADGES = 200
SEALED = "repulsion_robots"  # the force with the colour of what no robot comes to from the largest part


def problem_colour(theme: Theme, *, grave: bool) -> Colour:
    return theme.trajectory if grave else theme.others[1]


def pixels(canvas: Canvas, points: Iterable[Point]) -> Array:
    """Return the pixels of points in metres, (k, 2).

    A draft may hold any number. What has no place, as the middle of an endless box, is far away.
    """
    found = canvas.camera.to_pixels(np.array(list(points), dtype=float).reshape(-1, 2))
    return np.nan_to_num(found, nan=-FARTHEST_PIXEL)


def _ring(canvas: Canvas, at: Point, radius: float, colour: Colour, width: float) -> None:
    canvas.stamp(partial(sprites.ring, radius * canvas.scale, colour, width * canvas.scale), at)


def _disc(canvas: Canvas, at: Point, radius: float, colours: Sequence[Colour], rim: float, text: str) -> None:
    """Draw a disc: colours of its inside, of the ring around it, of what is around that."""
    fill, ring, edge = colours
    canvas.stamp(partial(sprites.disc, radius * canvas.scale, fill, ring, rim * canvas.scale, edge, text), at)


def dashed(canvas: Canvas, points: Iterable[sprites.Pixel], colour: Colour, dash: float = 4.0) -> None:
    for a, b in pairwise(points):
        canvas.dashes(a, b, colour, canvas.width(1.0), dash=dash)


def draw_grips(canvas: Canvas, found: Sequence[Handle], solid: frozenset[Vertex], hot: Handle | None) -> None:
    floor, edge = canvas.theme.background, canvas.theme.final
    for handle, (x, y) in zip(found, pixels(canvas, (each.at for each in found)).tolist(), strict=True):
        large = handle == hot
        if handle.kind == "turn":
            canvas.line((x, y), (x, y + KNOB * canvas.scale), edge, canvas.width(1.0))
            _disc(canvas, (x, y), 5.5 if large else 4.5, (floor, edge, edge), 1.6, "")
        elif handle.kind == "scale":
            _square(canvas, (x, y), floor, large=large)
        else:
            _square(canvas, (x, y), edge if handle.vertex in solid else floor, large=large, rounded=True)


def _square(canvas: Canvas, at: Point, fill: Colour, *, large: bool = False, rounded: bool = False) -> None:
    half = SQUARE * canvas.scale * (1.4 if large else 1.0)
    box = Rect(round(at[0] - half), round(at[1] - half), round(2 * half) + 1, round(2 * half) + 1)
    if canvas.surface.get_rect().colliderect(box):
        radius = round(half) if rounded else 0
        pygame.draw.rect(canvas.surface, fill, box, border_radius=radius)
        pygame.draw.rect(canvas.surface, canvas.theme.final, box, canvas.width(1.5), border_radius=radius)


def draw_guides(canvas: Canvas, guides: Iterable[Guide]) -> None:
    colour = canvas.theme.forces["repulsion_obstacle"]
    words: list[str] = []
    last: Point | None = None
    for guide in guides:
        line = pixels(canvas, guide.line).tolist()
        dashed(canvas, line, colour)
        if line:
            last = line[-1][0], line[-1][1]
            if guide.kind in ("vertex", "middle", "centre", "crossing", "edge"):
                _ring(canvas, last, 5.0, colour, 1.6)
        if guide.kind != "grid" and guide.words not in words:
            words.append(guide.words)
    if last is not None and words:
        at = (last[0] + 11 * canvas.scale, last[1] + 15 * canvas.scale)
        canvas.text(" · ".join(words), at, size=canvas.theme.small_text, colour=colour)


def draw_start(
    canvas: Canvas, spec: StartSpec, name: str, *, chosen: bool, first: bool = False, dots: float = 1.0
) -> None:
    theme, scale, width = canvas.theme, canvas.scale, 2.2 if chosen else 1.6
    if isinstance(spec, DiscStart):
        ((x, y),) = pixels(canvas, (spec.center,)).tolist()
        radius = spec.radius * canvas.camera.zoom
        if radius < MOST_RADIUS:
            canvas.stamp(partial(sprites.ring, round(2 * radius) / 2, theme.start, width * scale), (x, y))
        else:
            sides = int(min(radius, 720))
            angle = np.arange(sides) * (2 * np.pi / sides)
            rim = (x, y) + radius * np.column_stack([np.cos(angle), np.sin(angle)])
            canvas.outline(rim, theme.start, canvas.width(width))
        at, anchor = (x, y - radius - 10 * scale), "middle"  # above, where no robot stands
    elif isinstance(spec, PointsStart) and spec.positions:
        places = pixels(canvas, spec.positions).tolist()
        for place in places:
            _ring(canvas, place, 5.0 * dots, theme.start, width)
        at, anchor = (places[0][0] - 5 * scale, places[0][1] - 14 * scale), "left"
    else:
        return
    if name:
        words, ink = f"{name}, default" if first else name, mix(theme.start, theme.ink, 0.45)
        canvas.text(words, at, size=theme.small_text, colour=ink, anchor=anchor)


def draw_path(canvas: Canvas, path: ObstaclePath, colour: Colour) -> None:
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
    for at in points.tolist():
        canvas.stamp(partial(sprites.dot, 2.5 * canvas.scale, colour), at)


def draw_ghost(canvas: Canvas, geometry: shapely.Geometry) -> None:
    colour = canvas.theme.final
    for ring in outline_of(geometry).rings:
        corners = canvas.camera.to_pixels(ring)
        box = pixel_box(canvas.camera, [*ring.min(axis=0), *ring.max(axis=0)]).clip(canvas.surface.get_clip())
        if box:
            page = Surface(box.size, pygame.SRCALPHA, 32)
            shifted = np.rint(np.clip(corners - np.array(box.topleft), -30000, 30000)).tolist()
            pygame.draw.polygon(page, (*mix(canvas.theme.obstacle, colour, 0.35), 130), shifted)
            canvas.surface.blit(page, box)
        canvas.outline(corners, colour, canvas.width(1.5))


def draw_preview(canvas: Canvas, preview: Preview, at: Point | None) -> None:
    floor, scale, colour = canvas.theme.background, canvas.scale, canvas.theme.final
    for shape in preview.shapes:
        draw_ghost(canvas, shape.polygon)
    if preview.start is not None:
        draw_start(canvas, preview.start, "", chosen=True)
    line = pixels(canvas, preview.line)
    if len(line) > 1:
        canvas.outline(line, colour, canvas.width(1.5), closed=False)
        if preview.closed:
            canvas.dashes(line[-1].tolist(), line[0].tolist(), colour, canvas.width(1.0))
    for x, y in line.tolist():
        _square(canvas, (x, y), floor, rounded=True)
    if preview.lengths:
        _draw_lengths(canvas, preview.line)
    for k, rim in enumerate(preview.rings):
        canvas.outline(pixels(canvas, rim), colour, canvas.width(2.2 if k == preview.chosen else 1.2))
    for k, (x, y) in enumerate(pixels(canvas, preview.dots).tolist()):
        _square(canvas, (x, y), floor, large=k == preview.chosen, rounded=True)
    if preview.box is not None:
        _draw_selecting(canvas, preview.box, touched=preview.touched)
    if preview.words and at is not None:
        tag(canvas.surface, preview.words, (at[0] + 18 * scale, at[1] - 22 * scale), canvas.theme, scale)


def _draw_lengths(canvas: Canvas, line: tuple[Point, ...]) -> None:
    ink, size = mix(canvas.theme.background, canvas.theme.ink, 0.85), canvas.theme.small_text
    for a, b in list(pairwise(line[:-1]))[-MOST_LENGTHS:]:
        ends, words = pixels(canvas, (a, b)), length_words(distance(a, b))
        along, wide = ends[1] - ends[0], canvas.text_width(words, size)
        if (length := float(np.hypot(*along))) < wide:
            continue
        across = np.array([along[1], -along[0]]) / max(length, 1e-9)
        if across[1] > 0 or (across[1] == 0 and across[0] < 0):
            across = -across
        far = 9 * canvas.scale + abs(float(across[0])) * wide / 2
        at = (ends[0] + ends[1]) / 2 + far * across
        canvas.text(words, at.tolist(), size=size, colour=ink, anchor="middle")


def _draw_selecting(canvas: Canvas, corners: tuple[Point, Point], *, touched: bool) -> None:
    ends = pixels(canvas, corners)
    low, high = ends.min(axis=0), ends.max(axis=0)
    box = Rect(*np.rint([*low, *(high - low)]).astype(int).tolist()).clip(canvas.surface.get_clip())
    colour = canvas.theme.start if touched else canvas.theme.final
    if box:
        page = Surface(box.size, pygame.SRCALPHA, 32)
        page.fill((*colour, 34))
        canvas.surface.blit(page, box)
    rim = shapely.get_coordinates(shapely.box(*low, *high, ccw=False))
    if touched:
        dashed(canvas, rim.tolist(), colour)
    else:
        canvas.outline(rim, colour, canvas.width(1.0), closed=False)


def draw_typed(canvas: Canvas, text: str, at: Point) -> None:
    theme, scale, surface = canvas.theme, canvas.scale, canvas.surface
    words, hint, large = f"{text}▏", "Enter", theme.text * 1.1
    wide = canvas.text_width(words, large, bold=True) + canvas.text_width(hint, theme.small_text)
    box = Rect(0, 0, wide + round(26 * scale), round(26 * scale))
    box.topleft = round(at[0] + 14 * scale), round(at[1] + 14 * scale)
    box.clamp_ip(surface.get_rect())
    pygame.draw.rect(surface, theme.panel, box, border_radius=round(5 * scale))
    pygame.draw.rect(surface, theme.final, box, canvas.width(1.5), border_radius=round(5 * scale))
    size, y = canvas.text_size(large) / scale, box.centery
    canvas.text(words, (box.left + 8 * scale, y), size=size, bold=True)
    canvas.text(hint, (box.right - 8 * scale, y), size=theme.small_text, colour=theme.faint, anchor="right")


def hatched(view: View, measurement: Measurement) -> tuple[Surface, Rect] | None:
    """Return a picture of where robots do not pass, and of what is cut off, and its place, px."""
    theme, white = view.theme, (255, 255, 255)
    areas = ((measurement.sealed, theme.forces[SEALED], 0.5), (measurement.impassable, theme.trajectory, 1.0))
    parts = [(outline_of(area), colour, strength) for area, colour, strength in areas if not area.is_empty]
    if not parts:
        return None
    bounds = shapely.total_bounds([outline.geometry for outline, _, _ in parts])
    box = pixel_box(view.camera, bounds).clip(view.clip)
    if not box:
        return None
    patch = Surface(box.size, pygame.SRCALPHA, 32)
    edged = view.canvas(patch)
    for outline, colour, strength in parts:
        mask = view.canvas(Surface(box.size, pygame.SRCALPHA, 32))
        rings = [view.camera.to_pixels(ring) - np.array(box.topleft) for ring in outline.rings]
        for ring, outer in zip(rings, outline.outer, strict=True):
            mask.polygon(ring, (*white, 255) if outer else (0, 0, 0, 0))
            if outer:  # what is thinner than a pixel is a line
                mask.outline(ring, white, 1)
        lines = _lines(box, colour, view.scale, strength)
        mask.surface.blit(lines, (0, 0), special_flags=pygame.BLEND_RGBA_MULT)
        patch.blit(mask.surface.premul_alpha(), (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
        for ring, outer in zip(rings, outline.outer, strict=True):
            if outer:
                edged.outline(ring, colour, edged.width(1.0))
    return patch, box


def _lines(box: Rect, colour: Colour, scale: float, strength: float = 1.0) -> Surface:
    """Return a page of slanted lines over a tint; they keep their place when the sheet is moved."""
    page = Surface(box.size, pygame.SRCALPHA, 32)
    page.fill((*colour, round(56 * strength)))
    step, thick, ink = max(4, round(HATCH * scale)), max(1, round(1.2 * scale)), round(235 * strength)
    for x in range(-((box.left + box.top) % step), box.width + box.height, step):
        pygame.draw.line(page, (*colour, ink), (x, 0), (x - box.height, box.height), thick)
    return page


def draw_gap(canvas: Canvas, gap: Gap, radius: float) -> None:
    a, b, across = _gap(canvas, gap)
    colour = canvas.theme.trajectory if gap.width < 2 * radius else canvas.theme.start
    for start, end in ((a, b), (a - across, a + across), (b - across, b + across)):
        canvas.line(start.tolist(), end.tolist(), colour, canvas.width(2))
    for at in (a, b):
        canvas.stamp(partial(sprites.dot, 2.2 * canvas.scale, colour), at.tolist())


def tag_gap(canvas: Canvas, gap: Gap, radius: float, cursor: Point | None = None) -> None:
    """Write the width of the narrowest gap against what a robot needs; above words at `cursor`, px."""
    a, b, across = _gap(canvas, gap)
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
    tag(canvas.surface, words, (x, y), canvas.theme, scale)


def _gap(canvas: Canvas, gap: Gap) -> tuple[Array, Array, Array]:
    """Return the ends of a gap, px, and what leads 5 px across."""
    a, b = canvas.camera.to_pixels(np.array(gap.between))
    length = max(float(np.hypot(*(b - a))), 1e-9)
    return a, b, np.array([b[1] - a[1], a[0] - b[0]]) / length * 5 * canvas.scale


def badge_places(found: tuple[Problem, ...], view: View) -> list[tuple[Problem, Point]]:
    places = []
    for problem in found[:MOST_BADGES]:
        if problem.where is not None and not problem.where.is_empty:
            spot = problem.where.representative_point()
            x, y = view.camera.to_pixels(np.array([spot.x, spot.y])).tolist()
            places.append((problem, (x, y - STEM * view.scale)))
    return places


def draw_problems(
    canvas: Canvas, view: View, found: tuple[Problem, ...], told: Problem | None, hovered: Problem | None
) -> None:
    theme, scale = canvas.theme, canvas.scale
    for problem in found[:MOST_BADGES]:
        colour = problem_colour(theme, grave=problem.grave)
        shown = problem.grave or problem in (told, hovered)
        for part in shapely.get_parts(problem.where) if problem.where is not None and shown else ():
            for ring in [part.exterior, *part.interiors] if isinstance(part, shapely.Polygon) else [part]:
                points = canvas.camera.to_pixels(shapely.get_coordinates(ring))
                if len(points) > 1:
                    canvas.outline(points, colour, canvas.width(2), closed=False)
    places = badge_places(found, view)
    for problem, (x, y) in reversed(places):
        colour, foot = problem_colour(theme, grave=problem.grave), y + STEM * scale
        canvas.line((x, y), (x, foot), colour, canvas.width(1.5))
        canvas.stamp(partial(sprites.dot, 1.8 * scale, colour), (x, foot))
        draw_badge(canvas, x, y, grave=problem.grave)
    lone = found[0] if len(found) == 1 and found[0].grave else None
    for problem, (x, y) in places:
        if problem in (told, hovered) or problem is lone:
            beside = x + (BADGE + 10) * scale
            room = canvas.surface.get_width() - beside - 8 * scale > canvas.text_width(problem.words)
            # where there is no room beside the badge, above it
            at = beside, y if room else y - (BADGE + 14) * scale
            tag(canvas.surface, problem.words, at, theme, scale)
            if problem is told:
                _ring(canvas, (x, y), BADGE + 4, theme.ink, 1.6)


def draw_badge(canvas: Canvas, x: float, y: float, *, grave: bool, small: bool = False) -> None:
    theme, fill = canvas.theme, problem_colour(canvas.theme, grave=grave)
    radius, rim = (6.5, 1.0) if small else (BADGE, 1.4)
    _disc(canvas, (x, y), radius, (fill, theme.background, mix(fill, theme.ink, 0.3)), rim, "!")


def legend_entries(found: Measurement | None, *, starts: bool, team: bool, unfree: bool) -> list[LegendEntry]:
    def boundary(canvas: Canvas, x: float, y: float) -> None:
        half, width = 9 * canvas.scale, canvas.width(canvas.theme.boundary_line)
        canvas.line((x - half, y), (x + half, y), canvas.theme.boundary, width)

    def beyond(canvas: Canvas, x: float, y: float) -> None:
        fill = mix(outside_colour(canvas.theme), canvas.theme.obstacle, 0.55)
        canvas.swatch(x, y, fill, mix(fill, canvas.theme.obstacle_edge, 0.5))

    def robot(canvas: Canvas, x: float, y: float) -> None:
        edge = mix(canvas.theme.background, canvas.theme.ink, 0.55)
        _disc(canvas, (x, y), 6.5, (canvas.theme.robots[0], canvas.theme.robot_ring, edge), 1.4, "")

    def hatch(canvas: Canvas, x: float, y: float, *, narrow: bool) -> None:
        size = round(12 * canvas.scale)
        colour = canvas.theme.trajectory if narrow else canvas.theme.forces[SEALED]
        page = _lines(Rect(0, 0, size, size), colour, canvas.scale)
        canvas.surface.blit(page, (round(x - size / 2), round(y - size / 2)))

    rows: tuple[tuple[object, str, Glyph], ...] = (
        (True, "obstacle", lambda on, x, y: on.swatch(x, y, on.theme.obstacle, on.theme.obstacle_edge)),
        (True, "boundary", boundary),
        (unfree, "outside, in the robots' hull", beyond),
        (starts, "start", lambda on, x, y: _ring(on, (x, y), 5.0, on.theme.start, 1.6)),
        (team, "robot", robot),
        (found and found.impassable, "too narrow for a robot", partial(hatch, narrow=True)),
        (found and found.sealed, "cut off", partial(hatch, narrow=False)),
        (found and found.problems, "problem", partial(draw_badge, grave=True, small=True)),
    )
    return [LegendEntry(text, glyph) for is_there, text, glyph in rows if is_there]
