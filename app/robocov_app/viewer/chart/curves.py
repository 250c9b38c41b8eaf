"""Curves of the panes, and curves of other branches (ghosts)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely

from robocov.typing import FloatArray
from robocov_app.look.colors import Color, mix
from robocov_app.look.curve_styles import CurveStyle, choose_curve_styles
from robocov_app.look.theme import Theme
from robocov_app.render.canvas import Canvas
from robocov_app.render.dashes import cut_into_dashes
from robocov_app.viewer.chart.frame import ChartFrame
from robocov_app.viewer.chart.scale import ChartScale
from robocov_app.viewer.session.pane import Pane

GHOST_REACH_PX = 6.0
"""Maximum distance, at scale 1, of a click from the curve of another branch that it opens."""
MIN_THINNED_POINTS = 400
"""Curves with at least this many points are thinned."""
_MAX_POINTS_PER_PX = 1.5
_MAX_SIMPLIFICATION_PX = 0.2
"""Maximum distance of a point that is left out from the drawn curve."""
_CURVE_WIDTH_PX = 1.8
_DASH_STRETCH = 1.4  # dashes are longer than in figures, because the curves are short
_GHOST_STRENGTH = 0.45
_GHOST_WIDTH_PX = 1.5
_GHOST_DOTS_PX = (2.0, 3.0)  # lengths of a dot and of a gap


class GhostLine(NamedTuple):
    """Curve of another branch as it is drawn.

    Attributes
    ----------
    node : int
        Node at which the branch ends.
    points : (k, 2) array, px
        Points of the curve on the page of the chart.
    """

    node: int
    points: FloatArray


def draw_curves(canvas: Canvas, frame: ChartFrame, scale: ChartScale) -> None:
    """Draw the curve of each pane, with the color and the dashes of its controller."""
    panes = frame.timeline.panes
    styles = map_curve_styles(panes)
    width = canvas.scale_width(_CURVE_WIDTH_PX)
    for pane in panes:
        curve = pane.curves[frame.quantity.name]
        points = simplify_points(thin_points(scale.to_points(curve.times, curve.values)))
        if len(points) > 1:
            style = styles[pane.number]
            dashes = [_DASH_STRETCH * width * length for length in style.list_dash_lengths()]
            segments = cut_into_dashes(points, dashes)
            canvas.draw_segments(segments, style.get_color(frame.theme), width)


def draw_ghosts(canvas: Canvas, frame: ChartFrame, scale: ChartScale) -> list[GhostLine]:
    """Draw the curves of other branches, pale and dotted.

    Returns
    -------
    list of GhostLine
    """
    lines = []
    for ghost in frame.list_ghosts():
        points = scale.to_points(ghost.times, ghost.values)
        lines.append(GhostLine(ghost.node, points))
        controller_color = frame.theme.get_controller_color(ghost.controller)
        color = mix(frame.theme.panel, controller_color, _GHOST_STRENGTH)
        _draw_ghost_line(canvas, points, color)
    return lines


def _draw_ghost_line(canvas: Canvas, points: FloatArray, color: Color) -> None:
    width = canvas.scale_width(_GHOST_WIDTH_PX)
    dots = [length * canvas.scale for length in _GHOST_DOTS_PX]
    canvas.draw_segments(cut_into_dashes(points, dots), color, width)


def find_nearest_ghost(ghosts: Sequence[GhostLine], point: FloatArray, reach: float) -> int | None:
    """Return the last node of the branch whose curve is nearest to a point of the page.

    Parameters
    ----------
    ghosts : sequence of GhostLine
    point : (2,) array, px
    reach : float, px
        Maximum distance.

    Returns
    -------
    int or None
        Number of the node; None if no curve is within reach.
    """
    pointer = shapely.Point(point)
    nearest_node = None
    min_distance = reach
    for ghost in ghosts:
        distance = shapely.LineString(ghost.points).distance(pointer)
        if distance < min_distance:
            min_distance = distance
            nearest_node = ghost.node
    return nearest_node


def map_curve_colors(panes: Sequence[Pane], theme: Theme) -> dict[int, Color]:
    """Return the curve color of each pane, by the number of the pane."""
    return {number: style.get_color(theme) for number, style in map_curve_styles(panes).items()}


def map_curve_styles(panes: Sequence[Pane]) -> dict[int, CurveStyle]:
    """Return the curve style of each pane, by the number of the pane; no two styles are the same."""
    controllers = {pane.number: pane.controller.name for pane in panes}
    styles = choose_curve_styles(list(controllers.values()))
    return dict(zip(controllers, styles, strict=True))


def thin_points(points: FloatArray) -> FloatArray:
    """Drop points of a curve, (k, 2) px, that are indistinguishable from the next point.

    The last point is always kept, since the curve grows there.
    """
    if len(points) < MIN_THINNED_POINTS:
        return points
    # Keep the last point in each column of 1 / _MAX_POINTS_PER_PX pixels.
    columns = np.rint(points[:, 0] * _MAX_POINTS_PER_PX)
    is_last_in_column = np.append(columns[1:] != columns[:-1], True)
    return np.asarray(points[is_last_in_column])


def simplify_points(points: FloatArray) -> FloatArray:
    """Leave out points of a curve, (k, 2) px, that lie on a straight line between others.

    Antialiased segments overlap at their ends, which would be visible as dots along a straight section.
    """
    if len(points) < 3:
        return points
    curve = shapely.simplify(shapely.LineString(points), _MAX_SIMPLIFICATION_PX, preserve_topology=False)
    return np.asarray(shapely.get_coordinates(curve))
