"""Entries of the editor's legend."""

from functools import partial

from pygame import Rect

from robocov_app.editor.canvas import overlay
from robocov_app.editor.canvas.hatching import render_hatch_pattern
from robocov_app.editor.canvas.sheet_view import choose_hull_excess_color, choose_hull_excess_edge
from robocov_app.editor.model.measurement import Measurement
from robocov_app.look.colors import Color, mix
from robocov_app.render.canvas import Canvas, Glyph, LegendEntry

# Lengths in pixels at scale 1.
_BOUNDARY_HALF_LENGTH_PX = 9
_START_RADIUS_PX = 5.0
_START_WIDTH_PX = 1.6
_ROBOT_RADIUS_PX = 6.5
_ROBOT_RING_PX = 1.4
_HATCHING_SIDE_PX = 12

_ROBOT_EDGE_SHARE = 0.55
"""Fraction of the ink in the color of a robot's edge; the rest is the color of the background."""


def build_legend_entries(
    measurement: Measurement | None, *, has_starts: bool, has_team: bool, has_hull_excess: bool
) -> list[LegendEntry]:
    """Build the legend entries of the sheet.

    Parameters
    ----------
    measurement : Measurement or None
        Measurement of the map; None if passages that are too narrow are not shown.
    has_starts : bool
        Whether the map has starts.
    has_team : bool
        Whether a team is shown.
    has_hull_excess : bool
        Whether the convex hull of the boundary is larger than the area inside the boundary.

    Returns
    -------
    list of LegendEntry
        Entries in the order in which they are shown.
    """
    # Whether each entry is shown, its text, and the function that draws its symbol.
    rows: list[tuple[bool, str, Glyph]] = [
        (True, "obstacle", _draw_obstacle),
        (True, "boundary", _draw_boundary),
        (has_hull_excess, "inside hull, outside map", _draw_hull_excess),
        (has_starts, "start", _draw_start),
        (has_team, "robot", _draw_robot),
    ]
    if measurement is not None:
        errors = [problem for problem in measurement.problems if problem.is_error]
        has_warnings = len(errors) < len(measurement.problems)
        error_badge = partial(overlay.draw_badge, is_error=True, is_small=True)
        warning_badge = partial(overlay.draw_badge, is_error=False, is_small=True)
        rows.append((bool(measurement.impassable), "too narrow for a robot", _draw_narrow_area))
        rows.append((bool(measurement.cut_off), "cut off", _draw_cut_off_area))
        rows.append((bool(errors), "error", error_badge))
        rows.append((has_warnings, "warning", warning_badge))
    return [LegendEntry(text, glyph) for is_present, text, glyph in rows if is_present]


def _draw_obstacle(canvas: Canvas, x: float, y: float) -> None:
    canvas.draw_swatch(x, y, canvas.theme.obstacle, canvas.theme.obstacle_edge)


def _draw_boundary(canvas: Canvas, x: float, y: float) -> None:
    half = _BOUNDARY_HALF_LENGTH_PX * canvas.scale
    width = canvas.scale_width(canvas.theme.boundary_line)
    canvas.draw_line((x - half, y), (x + half, y), canvas.theme.boundary, width)


def _draw_hull_excess(canvas: Canvas, x: float, y: float) -> None:
    theme = canvas.theme
    canvas.draw_swatch(x, y, choose_hull_excess_color(theme), choose_hull_excess_edge(theme))


def _draw_start(canvas: Canvas, x: float, y: float) -> None:
    overlay.draw_ring(canvas, (x, y), _START_RADIUS_PX, canvas.theme.start, _START_WIDTH_PX)


def _draw_robot(canvas: Canvas, x: float, y: float) -> None:
    theme = canvas.theme
    edge = mix(theme.background, theme.ink, _ROBOT_EDGE_SHARE)
    colors = overlay.DiscColors(theme.robots[0], theme.robot_ring, edge)
    overlay.draw_disc(canvas, (x, y), _ROBOT_RADIUS_PX, colors, ring_width=_ROBOT_RING_PX)


def _draw_narrow_area(canvas: Canvas, x: float, y: float) -> None:
    _draw_hatching(canvas, x, y, canvas.theme.warning)


def _draw_cut_off_area(canvas: Canvas, x: float, y: float) -> None:
    _draw_hatching(canvas, x, y, canvas.theme.cut_off)


def _draw_hatching(canvas: Canvas, x: float, y: float, color: Color) -> None:
    size = round(_HATCHING_SIDE_PX * canvas.scale)
    pattern = render_hatch_pattern(Rect(0, 0, size, size), color, canvas.scale)
    canvas.surface.blit(pattern, (round(x - size / 2), round(y - size / 2)))
