"""Functions that draw single elements on the sheet: handles, guides, starts, paths, previews, problems."""

from collections.abc import Iterable, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pygame
import shapely
from pygame import Rect, Surface

from robocov.environment import DiscStart, Gap, ObstaclePath, Point, PointsStart, StartSpec
from robocov.typing import FloatArray
from robocov_app.editor.canvas.outlines import build_outline
from robocov_app.editor.canvas.sheet_view import View, compute_pixel_box
from robocov_app.editor.model.geometry import distance, format_compared_lengths, format_length
from robocov_app.editor.model.measurement import compute_shown_width, is_too_narrow
from robocov_app.editor.model.selection import Vertex
from robocov_app.editor.model.validation import Problem
from robocov_app.editor.tools.handles import KNOB_HEIGHT_PX, Handle
from robocov_app.editor.tools.tool_overlay import EditorToolOverlay
from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import Theme
from robocov_app.render import sprites
from robocov_app.render.camera import MAX_PIXEL
from robocov_app.render.canvas import Canvas
from robocov_app.toolkit.overlay import draw_tag
from robocov_app.toolkit.tools.snapping import Guide

# Lengths in pixels at scale 1.
HANDLE_HALF_PX = 3.5  # half the side of a handle
LARGE_HANDLE_FACTOR = 1.4
BADGE_RADIUS_PX = 8.0  # badge of a problem
SMALL_BADGE_RADIUS_PX = 6.5
STEM_PX = 17.0  # between a problem and its badge
ARROW_MIN_LEG_PX = 24  # shorter legs of a path have no arrow
LABEL_OFFSET_PX = (18, -22)  # from the cursor to a tool's label
MARK_RADIUS_PX = 5.0  # rings at positions of a start, and at positions to which the cursor has snapped
MARK_WIDTH_PX = 1.6
SELECTED_LINE_PX = 2.2  # selected start or chosen outline
LINE_PX = 1.6  # start or leg of a path
THIN_LINE_PX = 1.2  # outline that is not chosen
EDGE_LINE_PX = 1.5  # edges of handles, previews and text boxes
KNOB_RADIUS_PX = 4.5
LARGE_KNOB_RADIUS_PX = 5.5
KNOB_RING_PX = 1.6
GUIDE_LABEL_OFFSET_PX = (11, 15)  # from the end of a guide to its label
PATH_DASH_PX = 4.0
WAYPOINT_RADIUS_PX = 2.5
ARROW_AHEAD_PX = 4  # from the middle of a leg to the tip of its arrow
ARROW_LENGTH_PX = 7
ARROW_HALF_WIDTH_PX = 4
LENGTH_OFFSET_PX = 9  # from an edge to the label with its length
TEXT_BOX_HEIGHT_PX = 26
TEXT_BOX_OFFSET_PX = 14  # from the cursor to a box with typed text
TEXT_BOX_PADDING_PX = 8
TEXT_BOX_SPACE_PX = 26  # to the left and right of the text and between it and the hint, together
TEXT_BOX_RADIUS_PX = 5
GAP_END_HALF_PX = 5  # half the length of the lines across the ends of a gap
GAP_DOT_RADIUS_PX = 2.2
GAP_LABEL_ENDS = 2.4  # from the middle of a gap to its label, relative to GAP_END_HALF_PX
GAP_LABEL_OFFSET_PX = (8, -16)  # from there
CURSOR_LABEL_WIDTH_PX = 200  # assumed width of a tool's label
CURSOR_LABEL_HEIGHT_PX = 24
LABEL_SEPARATION_PX = 20  # between labels side by side
STEM_FOOT_RADIUS_PX = 1.8
CHOSEN_RING_GAP_PX = 4  # between a badge and the ring around the chosen one
MESSAGE_GAP_PX = 10  # between a badge and its message to the right
MESSAGE_RISE_PX = 14  # between a badge and its message above
MESSAGE_EDGE_PX = 8  # between a message and the edge of the view
WARNING_SIDE_RADII = 1.75  # side of the triangle of a warning, relative to the radius of a badge
WARNING_HEIGHT_RADII = 1.55
WARNING_TEXT_RADII = 1.5
WARNING_TEXT_DROP_RADII = 0.18  # from the middle of the triangle down to that of its text
WARNING_CORNER_PX = 1.5  # radius of the corners
BADGE_RING_PX = 1.4
SMALL_BADGE_RING_PX = 1.0

# Shares of the second color in mixes.
GHOST_ACCENT_SHARE = 0.35
LENGTH_INK_SHARE = 0.85
BADGE_EDGE_INK_SHARE = 0.3

GHOST_OPACITY = 130  # of 255
SELECTION_BOX_OPACITY = 34  # of 255
_TRANSPARENT = (0, 0, 0, 0)
TYPED_TEXT_FACTOR = 1.1  # size of typed text, relative to other texts
TEXT_CURSOR = "▏"
MAX_SPRITE_RADIUS_PX = 300.0  # larger circles are polygons; sprites are smoother, but large images
MAX_CIRCLE_SIDES = 720
MAX_EDGE_LABELS = 40  # edges of an unfinished line with labels of their lengths
MAX_BADGES = 200
MAX_POLYGON_PX = 30_000  # maximum coordinates with which pygame fills polygons
MIN_LENGTH_PX = 1e-9  # avoids division by zero


class DiscColors(NamedTuple):
    """Colors of a disc.

    Attributes
    ----------
    fill, ring, edge : tuple of int
        Colors of the inside, of the ring around it, and of the thin line around the ring.
    """

    fill: Color
    ring: Color
    edge: Color


def get_problem_color(theme: Theme, *, is_error: bool) -> Color:
    """Return the color of errors or of warnings."""
    if is_error:
        return theme.error
    return theme.warning


def to_pixels(canvas: Canvas, points: Iterable[Point]) -> FloatArray:
    """Convert positions of the map to pixels.

    Parameters
    ----------
    canvas : Canvas
        The canvas.
    points : iterable of Point
        Positions, m. Those of an unfinished map may be infinite or nan.

    Returns
    -------
    (k, 2) array
        Positions, px. A nan, such as the center of an infinite box, becomes a pixel far outside the window.
    """
    coordinates = np.array(list(points), dtype=float).reshape(-1, 2)
    return np.nan_to_num(canvas.camera.to_pixels(coordinates), nan=-MAX_PIXEL)


def draw_ring(canvas: Canvas, pixel: Point, radius: float, color: Color, width: float) -> None:
    """Draw a ring centered at a pixel; radius and line width in px at scale 1."""
    sprite = partial(sprites.render_ring, radius * canvas.scale, color, width * canvas.scale)
    canvas.draw_sprite(sprite, pixel)


def draw_disc(
    canvas: Canvas, pixel: Point, radius: float, colors: DiscColors, *, ring_width: float, text: str = ""
) -> None:
    """Draw a disc with an optional label, centered at a pixel; radius and ring width in px at scale 1."""
    scale = canvas.scale
    sprite = partial(
        sprites.render_disc,
        radius * scale,
        fill=colors.fill,
        ring=colors.ring,
        ring_width=ring_width * scale,
        edge=colors.edge,
        text=text,
    )
    canvas.draw_sprite(sprite, pixel)


def draw_dashes(canvas: Canvas, points: Iterable[sprites.Pixel], color: Color, dash: float = 4.0) -> None:
    """Draw a dashed line through a sequence of pixels."""
    for start, end in pairwise(points):
        canvas.draw_dashed_line(start, end, color, canvas.scale_width(1.0), dash=dash)


def draw_handles(
    canvas: Canvas, handles: Sequence[Handle], selected: frozenset[Vertex], hovered: Handle | None
) -> None:
    """Draw the handles of a selection.

    Parameters
    ----------
    canvas : Canvas
        The canvas.
    handles : sequence of Handle
        The handles.
    selected : frozenset of Vertex
        Selected vertices. Their handles are filled.
    hovered : Handle or None
        Handle under the cursor. It is drawn larger.
    """
    background = canvas.theme.background
    accent = canvas.theme.accent
    positions = to_pixels(canvas, (handle.position for handle in handles)).tolist()
    for handle, (x, y) in zip(handles, positions, strict=True):
        is_large = handle == hovered
        if handle.kind == "rotate":
            canvas.draw_line((x, y), (x, y + KNOB_HEIGHT_PX * canvas.scale), accent, canvas.scale_width(1.0))
            radius = LARGE_KNOB_RADIUS_PX if is_large else KNOB_RADIUS_PX
            draw_disc(canvas, (x, y), radius, DiscColors(background, accent, accent), ring_width=KNOB_RING_PX)
        elif handle.kind == "scale":
            _draw_square(canvas, (x, y), background, is_large=is_large)
        else:
            fill = background
            if handle.vertex in selected:
                fill = accent
            _draw_square(canvas, (x, y), fill, is_large=is_large, is_rounded=True)


def _draw_square(
    canvas: Canvas, pixel: Point, fill: Color, *, is_large: bool = False, is_rounded: bool = False
) -> None:
    """Draw the square of a handle, centered at a pixel; that of a vertex has rounded corners."""
    half = HANDLE_HALF_PX * canvas.scale
    if is_large:
        half *= LARGE_HANDLE_FACTOR
    side = round(2 * half) + 1
    box = Rect(round(pixel[0] - half), round(pixel[1] - half), side, side)
    if canvas.surface.get_rect().colliderect(box):
        radius = round(half) if is_rounded else 0
        pygame.draw.rect(canvas.surface, fill, box, border_radius=radius)
        accent = canvas.theme.accent
        pygame.draw.rect(canvas.surface, accent, box, canvas.scale_width(EDGE_LINE_PX), border_radius=radius)


def draw_guides(canvas: Canvas, guides: Iterable[Guide]) -> None:
    """Draw the guides of a snap as dashed lines, and name the snap targets next to the cursor."""
    color = canvas.theme.forces["repulsion_obstacle"]
    labels: list[str] = []
    end: Point | None = None
    for guide in guides:
        line = to_pixels(canvas, guide.line).tolist()
        draw_dashes(canvas, line, color)
        if line:
            end = (line[-1][0], line[-1][1])
            if guide.kind in ("vertex", "midpoint", "center", "intersection", "edge"):
                draw_ring(canvas, end, MARK_RADIUS_PX, color, MARK_WIDTH_PX)
        if guide.kind != "grid" and guide.label not in labels:
            labels.append(guide.label)
    if end is not None and labels:
        dx, dy = GUIDE_LABEL_OFFSET_PX
        position = (end[0] + dx * canvas.scale, end[1] + dy * canvas.scale)
        canvas.draw_text(" · ".join(labels), position, size=canvas.theme.small_text, color=color)


def draw_start(canvas: Canvas, start: StartSpec, *, is_selected: bool, dot_scale: float = 1.0) -> None:
    """Draw a start; nothing for a start that is uniform over the free space.

    Parameters
    ----------
    canvas : Canvas
        The canvas.
    start : StartSpec
        The start.
    is_selected : bool
        Whether the start is selected, which makes its lines thicker.
    dot_scale : float
        Factor by which the rings at the positions are enlarged.
    """
    width = SELECTED_LINE_PX if is_selected else LINE_PX
    if isinstance(start, DiscStart):
        ((x, y),) = to_pixels(canvas, (start.center,)).tolist()
        _draw_circle(canvas, (x, y), start.radius * canvas.camera.zoom, width)
    elif isinstance(start, PointsStart):
        for position in to_pixels(canvas, start.positions).tolist():
            draw_ring(canvas, position, MARK_RADIUS_PX * dot_scale, canvas.theme.start, width)


def _draw_circle(canvas: Canvas, center: Point, radius: float, width: float) -> None:
    """Draw the circle of a start; center and radius in px, width in px at scale 1."""
    color = canvas.theme.start
    if radius < MAX_SPRITE_RADIUS_PX:
        sprite = partial(sprites.render_ring, round(2 * radius) / 2, color, width * canvas.scale)
        canvas.draw_sprite(sprite, center)
        return
    sides = int(min(radius, MAX_CIRCLE_SIDES))
    angles = np.arange(sides) * (2 * np.pi / sides)
    corners = center + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    canvas.draw_outline(corners, color, canvas.scale_width(width))


def draw_path(canvas: Canvas, path: ObstaclePath, color: Color) -> None:
    """Draw the path of a moving obstacle, with an arrow on each leg and a dot at each waypoint."""
    points = to_pixels(canvas, path.points)
    legs = list(pairwise(points))
    if path.repeat == "loop" and len(points) > 2:
        legs.append((points[-1], points[0]))
    for index, (start, end) in enumerate(legs):
        # The leg of a loop from the last waypoint back to the first one.
        is_closing = index == len(points) - 1
        width = canvas.scale_width(1.0 if is_closing else LINE_PX)
        canvas.draw_dashed_line(start.tolist(), end.tolist(), color, width, dash=PATH_DASH_PX)
        _draw_arrow(canvas, start, end, color)
    for point in points.tolist():
        canvas.draw_sprite(partial(sprites.render_dot, WAYPOINT_RADIUS_PX * canvas.scale, color), point)


def _draw_arrow(canvas: Canvas, start: FloatArray, end: FloatArray, color: Color) -> None:
    """Draw an arrow in the middle of a leg from start to end, px, unless the leg is too short."""
    scale = canvas.scale
    length = float(np.hypot(*(end - start)))
    if length < ARROW_MIN_LEG_PX * scale:
        return
    along = (end - start) / length
    across = np.array([-along[1], along[0]])
    tip = (start + end) / 2 + ARROW_AHEAD_PX * scale * along
    for side in (1.0, -1.0):
        wing = tip - ARROW_LENGTH_PX * scale * along + side * ARROW_HALF_WIDTH_PX * scale * across
        canvas.draw_line(tip.tolist(), wing.tolist(), color, canvas.scale_width(LINE_PX))


def draw_ghost(canvas: Canvas, geometry: shapely.Geometry) -> None:
    """Draw a translucent obstacle: one that is being drawn, or one that is shown in motion."""
    accent = canvas.theme.accent
    fill = (*mix(canvas.theme.obstacle, accent, GHOST_ACCENT_SHARE), GHOST_OPACITY)
    for part in shapely.get_parts(geometry):
        if isinstance(part, shapely.Polygon):
            _fill_translucent_polygon(canvas, part, fill)
    for ring in build_outline(geometry).rings:
        canvas.draw_outline(canvas.camera.to_pixels(ring), accent, canvas.scale_width(EDGE_LINE_PX))


def _fill_translucent_polygon(
    canvas: Canvas, polygon: shapely.Polygon, color: tuple[int, int, int, int]
) -> None:
    """Fill a polygon, m, without its holes, with an RGBA color."""
    box = compute_pixel_box(canvas.camera, polygon.bounds).clip(canvas.surface.get_clip())
    if not box:
        return
    image = Surface(box.size, pygame.SRCALPHA, 32)
    # The polygon has an image of its own, so that the map shows through its holes.
    rings = [polygon.exterior, *polygon.interiors]
    colors = [color] + [_TRANSPARENT] * len(polygon.interiors)
    for ring, ring_color in zip(rings, colors, strict=True):
        corners = canvas.camera.to_pixels(np.asarray(ring.coords)[:-1])
        shifted = np.clip(corners - np.array(box.topleft), -MAX_POLYGON_PX, MAX_POLYGON_PX)
        pygame.draw.polygon(image, ring_color, np.rint(shifted).tolist())
    canvas.surface.blit(image, box)


def draw_preview(canvas: Canvas, tool_overlay: EditorToolOverlay, cursor: Point | None) -> None:
    """Draw the preview of a tool.

    Parameters
    ----------
    canvas : Canvas
        The canvas.
    tool_overlay : EditorToolOverlay
        Overlay of the active tool.
    cursor : Point or None
        Position of the cursor, px. The label of the tool is drawn next to it, if there is one.
    """
    background = canvas.theme.background
    accent = canvas.theme.accent
    for shape in tool_overlay.shapes:
        draw_ghost(canvas, shape.polygon)
    if tool_overlay.start is not None:
        draw_start(canvas, tool_overlay.start, is_selected=True)
    _draw_preview_line(canvas, tool_overlay)
    for index, ring in enumerate(tool_overlay.outlines):
        width = SELECTED_LINE_PX if index == tool_overlay.chosen else THIN_LINE_PX
        canvas.draw_outline(to_pixels(canvas, ring), accent, canvas.scale_width(width))
    for index, (x, y) in enumerate(to_pixels(canvas, tool_overlay.markers).tolist()):
        _draw_square(canvas, (x, y), background, is_large=index == tool_overlay.chosen, is_rounded=True)
    if tool_overlay.box is not None:
        _draw_selection_box(canvas, tool_overlay.box, selects_partial=tool_overlay.box_selects_partial)
    if tool_overlay.label and cursor is not None:
        position = _place_cursor_label(canvas, cursor)
        draw_tag(canvas.surface, tool_overlay.label, position, canvas.theme, canvas.scale)


def _place_cursor_label(canvas: Canvas, cursor: Point) -> Point:
    dx, dy = LABEL_OFFSET_PX
    return cursor[0] + dx * canvas.scale, cursor[1] + dy * canvas.scale


def _draw_preview_line(canvas: Canvas, tool_overlay: EditorToolOverlay) -> None:
    """Draw the line that is being drawn, with its vertices, closing edge and lengths."""
    accent = canvas.theme.accent
    line = to_pixels(canvas, tool_overlay.line)
    if len(line) > 1:
        canvas.draw_outline(line, accent, canvas.scale_width(EDGE_LINE_PX), is_closed=False)
        if tool_overlay.is_closed:
            canvas.draw_dashed_line(line[-1].tolist(), line[0].tolist(), accent, canvas.scale_width(1.0))
    for x, y in line.tolist():
        _draw_square(canvas, (x, y), canvas.theme.background, is_rounded=True)
    if tool_overlay.shows_lengths:
        _draw_lengths(canvas, tool_overlay.line)


def _draw_lengths(canvas: Canvas, line: tuple[Point, ...]) -> None:
    """Write the length of each edge next to it, except for the last edge, which follows the cursor."""
    color = mix(canvas.theme.background, canvas.theme.ink, LENGTH_INK_SHARE)
    size = canvas.theme.small_text
    for start, end in list(pairwise(line[:-1]))[-MAX_EDGE_LABELS:]:
        start_pixel, end_pixel = to_pixels(canvas, (start, end))
        along = end_pixel - start_pixel
        label = format_length(distance(start, end))
        label_width = canvas.measure_text(label, size)
        length = float(np.hypot(*along))
        if length < label_width:
            continue
        across = np.array([along[1], -along[0]]) / max(length, MIN_LENGTH_PX)
        # The label is above the edge, or to the right of a vertical one; pixel rows count downwards.
        points_down = across[1] > 0 or (across[1] == 0 and across[0] < 0)
        if points_down:
            across = -across
        offset = LENGTH_OFFSET_PX * canvas.scale + abs(float(across[0])) * label_width / 2
        position = (start_pixel + end_pixel) / 2 + offset * across
        canvas.draw_text(label, position.tolist(), size=size, color=color, anchor="middle")


def _draw_selection_box(canvas: Canvas, corners: tuple[Point, Point], *, selects_partial: bool) -> None:
    """Draw the selection box between two corners, m; dashed if it selects objects partly inside."""
    ends = to_pixels(canvas, corners)
    low = ends.min(axis=0)
    high = ends.max(axis=0)
    left, top, width, height = np.rint([*low, *(high - low)]).astype(int).tolist()
    box = Rect(left, top, width, height).clip(canvas.surface.get_clip())
    color = canvas.theme.accent
    if selects_partial:
        color = canvas.theme.start
    if box:
        image = Surface(box.size, pygame.SRCALPHA, 32)
        image.fill((*color, SELECTION_BOX_OPACITY))
        canvas.surface.blit(image, box)
    outline = shapely.get_coordinates(shapely.box(*low, *high, ccw=False))
    if selects_partial:
        draw_dashes(canvas, outline.tolist(), color)
    else:
        canvas.draw_outline(outline, color, canvas.scale_width(1.0), is_closed=False)


def draw_typed_text(canvas: Canvas, text: str, pixel: Point) -> None:
    """Draw a box next to a pixel with the value that is being typed, and the hint to press Enter."""
    theme = canvas.theme
    scale = canvas.scale
    surface = canvas.surface
    value = text + TEXT_CURSOR
    hint = "Enter"
    value_size = theme.text * TYPED_TEXT_FACTOR
    width = canvas.measure_text(value, value_size, bold=True) + canvas.measure_text(hint, theme.small_text)
    box = Rect(0, 0, width + round(TEXT_BOX_SPACE_PX * scale), round(TEXT_BOX_HEIGHT_PX * scale))
    offset = TEXT_BOX_OFFSET_PX * scale
    box.topleft = (round(pixel[0] + offset), round(pixel[1] + offset))
    box.clamp_ip(surface.get_clip())  # the texts below the map would cover it
    radius = round(TEXT_BOX_RADIUS_PX * scale)
    pygame.draw.rect(surface, theme.panel, box, border_radius=radius)
    pygame.draw.rect(surface, theme.accent, box, canvas.scale_width(EDGE_LINE_PX), border_radius=radius)
    size = canvas.scale_text_size(value_size) / scale
    y = box.centery
    canvas.draw_text(value, (box.left + TEXT_BOX_PADDING_PX * scale, y), size=size, bold=True)
    hint_position = (box.right - TEXT_BOX_PADDING_PX * scale, y)
    canvas.draw_text(hint, hint_position, size=theme.small_text, color=theme.faint, anchor="right")


def draw_gap(canvas: Canvas, gap: Gap, radius: float) -> None:
    """Draw the narrowest gap, in the warning color if robots of the given radius, m, do not fit through."""
    start, end, across = _locate_gap(canvas, gap)
    color = canvas.theme.start
    if is_too_narrow(gap, radius):
        color = canvas.theme.warning
    # A line along the gap, and a short one across it at each end.
    for line_start, line_end in (
        (start, end),
        (start - across, start + across),
        (end - across, end + across),
    ):
        canvas.draw_line(line_start.tolist(), line_end.tolist(), color, canvas.scale_width(2))
    for point in (start, end):
        canvas.draw_sprite(
            partial(sprites.render_dot, GAP_DOT_RADIUS_PX * canvas.scale, color), point.tolist()
        )


def draw_gap_label(canvas: Canvas, gap: Gap, radius: float, cursor: Point | None = None) -> None:
    """Write the width of the narrowest gap next to it.

    Parameters
    ----------
    canvas : Canvas
        The canvas.
    gap : Gap
        The gap.
    radius : float
        Radius of a robot, m. The label compares the width with the diameter.
    cursor : Point, optional
        Position of the cursor, px, if a tool has a label next to it. The label of the gap is moved above that
        label if they would overlap.
    """
    start, end, across = _locate_gap(canvas, gap)
    scale = canvas.scale
    label = build_gap_label(gap, radius)
    side = 1.0
    if abs(across[0]) >= MIN_LENGTH_PX:
        # The label is to the right of the gap.
        side = float(np.sign(across[0]))
    x, y = ((start + end) / 2 + across * side * GAP_LABEL_ENDS).tolist()
    dx, dy = GAP_LABEL_OFFSET_PX
    position = (x + dx * scale, y + dy * scale)
    if cursor is not None:
        position = _move_above_cursor_label(canvas, label, position, cursor)
    draw_tag(canvas.surface, label, position, canvas.theme, scale)


def build_gap_label(gap: Gap, radius: float) -> str:
    """Build the label of the narrowest gap, which compares its width with the diameter of a robot.

    Parameters
    ----------
    gap : Gap
        The gap.
    radius : float
        Radius of a robot, m.

    Returns
    -------
    str
    """
    shown_width = compute_shown_width(gap, radius)
    width = format_length(shown_width)
    diameter = format_length(2 * radius)
    has_one_unit = width.split()[1] == diameter.split()[1]
    if width == diameter or not has_one_unit:
        width, diameter = format_compared_lengths(shown_width, 2 * radius)
    sign = "<" if is_too_narrow(gap, radius) else "≥"
    return f"passage {width} {sign} {diameter}"


def _move_above_cursor_label(canvas: Canvas, label: str, position: Point, cursor: Point) -> Point:
    """Return the position of a label, px, moved up if it would overlap the label of a tool at the cursor."""
    scale = canvas.scale
    x, y = position
    cursor_label_x, cursor_label_y = _place_cursor_label(canvas, cursor)
    low_x = cursor_label_x - canvas.measure_text(label) - LABEL_SEPARATION_PX * scale
    high_x = cursor_label_x + CURSOR_LABEL_WIDTH_PX * scale
    height = CURSOR_LABEL_HEIGHT_PX * scale
    if low_x < x < high_x and abs(y - cursor_label_y) < height:
        return x, cursor_label_y - height
    return position


def _locate_gap(canvas: Canvas, gap: Gap) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the ends of a gap, px, and a vector perpendicular to it with a length of `GAP_END_HALF_PX`."""
    start, end = canvas.camera.to_pixels(np.array(gap.between))
    length = max(float(np.hypot(*(end - start))), MIN_LENGTH_PX)
    normal = np.array([end[1] - start[1], start[0] - end[0]]) / length
    return start, end, normal * GAP_END_HALF_PX * canvas.scale


def select_drawn_problems(problems: tuple[Problem, ...], chosen: Problem | None) -> tuple[Problem, ...]:
    """Return the first `MAX_BADGES` problems, and the chosen one if it is not among them."""
    if chosen is not None and chosen in problems[MAX_BADGES:]:
        return (*problems[:MAX_BADGES], chosen)
    return problems[:MAX_BADGES]


def place_badges(problems: tuple[Problem, ...], view: View) -> list[tuple[Problem, Point]]:
    """Return each problem that has a position, with the center of its badge, px."""
    badges = []
    for problem in problems:
        if problem.geometry is not None and not problem.geometry.is_empty:
            point = problem.geometry.representative_point()
            x, y = view.camera.to_pixels(np.array([point.x, point.y])).tolist()
            badges.append((problem, (x, y - STEM_PX * view.scale)))
    return badges


def draw_problems(
    canvas: Canvas,
    view: View,
    problems: tuple[Problem, ...],
    chosen: Problem | None,
    hovered: Problem | None,
) -> None:
    """Draw the outlines and badges of problems, and the messages of the chosen and the hovered one.

    Warnings have outlines only if chosen or hovered. A single error always has its message.
    """
    noted = (chosen, hovered)
    drawn_problems = select_drawn_problems(problems, chosen)
    for problem in drawn_problems:
        if problem.geometry is not None and (problem.is_error or problem in noted):
            _draw_problem_outline(canvas, problem)
    badges = place_badges(drawn_problems, view)
    # Earlier problems are drawn on top of later ones.
    for problem, (x, y) in reversed(badges):
        color = get_problem_color(canvas.theme, is_error=problem.is_error)
        foot = y + STEM_PX * canvas.scale
        canvas.draw_line((x, y), (x, foot), color, canvas.scale_width(EDGE_LINE_PX))
        canvas.draw_sprite(partial(sprites.render_dot, STEM_FOOT_RADIUS_PX * canvas.scale, color), (x, foot))
        draw_badge(canvas, x, y, is_error=problem.is_error)
    is_single_error = len(problems) == 1 and problems[0].is_error
    for problem, position in badges:
        if problem in noted or is_single_error:
            _draw_problem_message(canvas, problem, position)
            if problem is chosen:
                radius = BADGE_RADIUS_PX + CHOSEN_RING_GAP_PX
                draw_ring(canvas, position, radius, canvas.theme.ink, MARK_WIDTH_PX)


def _draw_problem_outline(canvas: Canvas, problem: Problem) -> None:
    color = get_problem_color(canvas.theme, is_error=problem.is_error)
    for part in shapely.get_parts(problem.geometry):
        lines = [part]
        if isinstance(part, shapely.Polygon):
            lines = [part.exterior, *part.interiors]
        for line in lines:
            points = canvas.camera.to_pixels(shapely.get_coordinates(line))
            if len(points) > 1:
                canvas.draw_outline(points, color, canvas.scale_width(2), is_closed=False)


def _draw_problem_message(canvas: Canvas, problem: Problem, badge: Point) -> None:
    """Write the message of a problem to the right of its badge, or above it if there is too little space."""
    x, y = badge
    scale = canvas.scale
    text_x = x + (BADGE_RADIUS_PX + MESSAGE_GAP_PX) * scale
    free_width = canvas.surface.get_width() - text_x - MESSAGE_EDGE_PX * scale
    text_y = y
    if free_width <= canvas.measure_text(problem.message):
        text_y = y - (BADGE_RADIUS_PX + MESSAGE_RISE_PX) * scale
    draw_tag(canvas.surface, problem.message, (text_x, text_y), canvas.theme, scale)


def draw_badge(canvas: Canvas, x: float, y: float, *, is_error: bool, is_small: bool = False) -> None:
    """Draw the badge of a problem at a pixel: an exclamation mark in a disc or, for a warning, a triangle."""
    theme = canvas.theme
    fill = get_problem_color(theme, is_error=is_error)
    colors = DiscColors(fill, theme.background, mix(fill, theme.ink, BADGE_EDGE_INK_SHARE))
    radius = SMALL_BADGE_RADIUS_PX if is_small else BADGE_RADIUS_PX
    ring_width = SMALL_BADGE_RING_PX if is_small else BADGE_RING_PX
    if is_error:
        draw_disc(canvas, (x, y), radius, colors, ring_width=ring_width, text="!")
    else:
        _draw_warning_triangle(canvas, (x, y), radius, colors, ring_width)


def _draw_warning_triangle(
    canvas: Canvas, center: Point, radius: float, colors: DiscColors, ring_width: float
) -> None:
    """Draw a triangle with an exclamation mark; radius of the badge and ring width in px at scale 1."""
    x, y = center
    scale = canvas.scale
    side_px = WARNING_SIDE_RADII * radius * scale
    height_px = WARNING_HEIGHT_RADII * radius * scale
    corners = [
        (x, y - height_px / 2),
        (x + side_px / 2, y + height_px / 2),
        (x - side_px / 2, y + height_px / 2),
    ]
    ring_px = ring_width * scale
    sketch = sprites.Sketch.from_points(corners, WARNING_CORNER_PX * scale + 2 * ring_px)
    if sketch is None:
        return
    outline = [*corners, corners[0]]
    corner_px = 2 * WARNING_CORNER_PX * scale
    # Wide lines around the triangle, for the edge, for the ring and for the inside, have round corners.
    sketch.draw_path(outline, colors.edge, corner_px + 4 * ring_px)
    sketch.draw_path(outline, colors.ring, corner_px + 2 * ring_px)
    sketch.draw_path(outline, colors.fill, corner_px)
    sketch.fill_polygon(corners, colors.fill)
    sketch.draw_on(canvas.surface)
    text_y = y + WARNING_TEXT_DROP_RADII * radius * scale
    size = WARNING_TEXT_RADII * radius
    canvas.draw_text("!", (x, text_y), size=size, color=colors.ring, bold=True, anchor="middle")
