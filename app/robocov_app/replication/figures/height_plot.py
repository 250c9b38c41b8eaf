"""Plot of the best position of a sensor above a cell, depending on its height (equation 14).

The optimum of f = 1 / (r² + h²) moves from its limit for h → 0 to the centroid for h → ∞.
"""

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import ConnectionPatch, Polygon, Rectangle
from matplotlib.ticker import MaxNLocator

from robocov.locational_cost import Distance, Sensing, compute_locational_costs
from robocov.locational_cost.best_points import find_best_points
from robocov.observation.region import Region
from robocov.typing import FloatArray
from robocov.voronoi import VoronoiPartition, partition
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import SMALL_SIZE_PT, FigurePage, PageBox, style_axes, to_plot_color
from robocov_app.look.theme import Theme

PENTAGON = ((0.0, 0.0), (4.0, 0.0), (5.0, 2.0), (2.0, 4.0), (-1.0, 1.5))
"""Corners of a cell without symmetry, m."""
_MIN_LABEL_DISTANCE = 0.13
"""Minimum distance between labeled positions, relative to the length of the path."""
_MIN_HEIGHT_M = 0.01
_MAX_HEIGHT_M = 100.0
_PATH_POINTS = 240
_GROUND_HEIGHT = 1e-7
"""Height that stands for the limit h → 0, relative to the size of the cell."""
_FRAME_FACTORS = (1.9, 1.3)
"""Width and height of the enlarged frame, compared with those of the points in it."""
_FRAME_LEFT_FRACTION = 0.2
"""Space to the left of the points, as a fraction of the width of the frame."""
_PANELS = (
    (0.0, 0.30, "the cell (m)"),
    (0.37, 0.26, "the frame in it (m)"),
    (0.68, 0.32, "from the optimum to the centroid (mm)"),
)
"""Start and width of each panel, relative to the page, and its heading."""


class SensorOptimum(NamedTuple):
    """The best position of a sensor at some height."""

    height: float
    """m"""
    x: float
    y: float
    """m"""
    distance: float
    """Distance from the centroid of the cell, m."""
    loss: float
    """Relative loss if the sensor is above the centroid instead; nan in the limits."""


def find_sensor_optima(heights: Sequence[float]) -> list[SensorOptimum]:
    """Find the best positions of a sensor above the cell at several heights.

    Parameters
    ----------
    heights : sequence of float
        Heights in ascending order, m.

    Returns
    -------
    list of SensorOptimum
        Optima at these heights, preceded by the limit for h → 0 and followed by that for h → ∞.
    """
    cell = _build_cell()
    return [
        _find_ground_optimum(cell),
        *(_find_optimum(cell, height) for height in heights),
        _build_optimum(cell, np.inf, cell.centroids[0], float("nan")),
    ]


def _find_ground_optimum(cell: VoronoiPartition) -> SensorOptimum:
    """Find the limit of the best position for h → 0, from a height that is tiny compared with the cell."""
    size = float(np.sqrt(cell.masses[0]))
    position = find_best_points(cell, Sensing(_GROUND_HEIGHT * size))[0]
    return _build_optimum(cell, 0.0, position, float("nan"))


def _find_optimum(cell: VoronoiPartition, height: float) -> SensorOptimum:
    """Find the best position at a height, m, and the loss of a sensor above the centroid instead."""
    position = find_best_points(cell, Sensing(height))[0]
    best = _compute_cost(cell, position, height)
    at_centroid = _compute_cost(cell, cell.centroids[0], height)
    return _build_optimum(cell, height, position, float(1.0 - at_centroid / best))


def _compute_cost(cell: VoronoiPartition, position: FloatArray, height: float) -> float:
    """Compute the cost of a cell for a sensor at a position, (2,) m, and a height, m."""
    offsets = position[None] - cell.generators
    return float(compute_locational_costs(cell.edges, offsets, Sensing(height))[0])


def _build_optimum(cell: VoronoiPartition, height: float, position: FloatArray, loss: float) -> SensorOptimum:
    """Build the optimum at a position, (2,) m, with its distance from the centroid."""
    x, y = position.tolist()
    return SensorOptimum(height, x, y, float(np.hypot(*(position - cell.centroids[0]))), loss)


def _build_cell() -> VoronoiPartition:
    """Return the pentagon as the only cell of a partition."""
    region = Region(np.array(PENTAGON))
    return partition(region.centroid[None], region)


@plain_style()
def draw_heights(size: tuple[int, int], theme: Theme, scale: float) -> Figure:
    """Draw the cell, the path of the optimum in an enlarged frame, and its distance from the centroid.

    Parameters
    ----------
    size : (int, int)
        Size of the page, px.
    theme : Theme
    scale : float
        Scale of the page.

    Returns
    -------
    Figure
    """
    cell = _build_cell()
    path = find_sensor_optima(np.geomspace(_MIN_HEIGHT_M, _MAX_HEIGHT_M, _PATH_POINTS).tolist())
    # Heights of 0.1 m to 50 m are candidates for labels.
    labeled = _select_labeled_optima(path_heights=[n * 10.0**k for k in (-1, 0, 1) for n in (1, 2, 3, 5)])
    median = find_best_points(cell, Distance())[0]
    page = FigurePage(size, theme, scale)
    top = 44 * scale
    height = size[1] - top - 46 * scale
    left = page.margin + 26 * scale
    width = size[0] - page.margin - left
    panels = []
    for start, panel_width, heading in _PANELS:
        panels.append(page.add_axes(PageBox(left + start * width, top, panel_width * width, height)))
        page.write(heading, left + start * width, top - 16 * scale)
    points = np.array([[optimum.x, optimum.y] for optimum in path] + [median])
    frame = _find_frame(points, _PANELS[1][1] * width / height)
    cell_axes, frame_axes, distance_axes = panels
    _draw_cell(cell_axes, cell, frame, theme)
    _draw_path(frame_axes, path, labeled, median, theme)
    _set_frame(frame_axes, frame, theme)
    x, y, frame_width, frame_height = frame
    for side in (0.0, 1.0):
        connection = ConnectionPatch(
            xyA=(x + frame_width, y + side * frame_height),
            xyB=(0.0, side),
            coordsA=cell_axes.transData,
            coordsB=frame_axes.transAxes,
            color=to_plot_color(theme.faint),
            linewidth=0.8,
        )
        page.figure.add_artist(connection)
    _draw_distance(distance_axes, path, labeled, theme)
    return page.figure


def _select_labeled_optima(path_heights: Sequence[float]) -> list[SensorOptimum]:
    """Return the optima with labels: both limits, and those between them that are far enough apart."""
    first, *inner, last = find_sensor_optima(path_heights)
    min_distance = _MIN_LABEL_DISTANCE * first.distance
    labeled = [first]
    for optimum in inner:
        is_far_from_end = optimum.distance >= min_distance
        is_far_from_previous = labeled[-1].distance - optimum.distance >= min_distance
        if is_far_from_end and is_far_from_previous:
            labeled.append(optimum)
    return [*labeled, last]


class _Frame(NamedTuple):
    """The rectangle of the map that is enlarged, m."""

    low_x: float
    low_y: float
    width: float
    height: float


def _find_frame(points: FloatArray, aspect: float) -> _Frame:
    """Return the frame that is enlarged, with the given aspect ratio.

    The frame contains all points, (k, 2) m, and leaves space for labels, most of it on the right.
    """
    low = points.min(axis=0)
    high = points.max(axis=0)
    min_width, min_height = (high - low) * _FRAME_FACTORS
    # The frame is extended in one direction to have this aspect ratio.
    width = max(min_width, min_height * aspect)
    height = max(min_height, min_width / aspect)
    return _Frame(
        low_x=float(low[0] - _FRAME_LEFT_FRACTION * width),
        low_y=float((low[1] + high[1] - height) / 2.0),
        width=float(width),
        height=float(height),
    )


def _draw_cell(axes: Axes, cell: VoronoiPartition, frame: _Frame, theme: Theme) -> None:
    """Draw the cell, the only one of its partition, and the outline of the frame that is enlarged."""
    fill = to_plot_color(theme.get_cell_color(1))
    axes.add_patch(
        Polygon(cell.polygons[0], facecolor=fill, edgecolor=to_plot_color(theme.boundary), linewidth=1.6)
    )
    x, y, width, height = frame
    axes.add_patch(
        Rectangle((x, y), width, height, fill=False, edgecolor=to_plot_color(theme.ink), linewidth=1.2)
    )
    axes.set_aspect("equal")
    axes.margins(0.02)
    axes.autoscale_view()
    _simplify_axes(axes, theme)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(6, integer=True))


def _draw_path(
    axes: Axes,
    path: Sequence[SensorOptimum],
    labeled: Sequence[SensorOptimum],
    median: FloatArray,
    theme: Theme,
) -> None:
    """Draw the path of the optimum with labeled heights, and the geometric median."""
    line = to_plot_color(theme.final)
    faint = to_plot_color(theme.faint)
    label_style: Any = {"textcoords": "offset points", "va": "center", "fontsize": SMALL_SIZE_PT}
    axes.plot([row.x for row in path], [row.y for row in path], color=line, linewidth=2.4, zorder=2)
    first, *inner, last = labeled
    for optimum in inner:
        axes.plot(optimum.x, optimum.y, "o", color=line, markersize=5.5, markeredgewidth=0.0, zorder=3)
    for optimum, marker, face in ((first, "o", to_plot_color(theme.background)), (last, "P", line)):
        axes.plot(
            optimum.x,
            optimum.y,
            markersize=9.5,
            markeredgecolor=line,
            markeredgewidth=1.8,
            zorder=4,
            marker=marker,
            markerfacecolor=face,
        )
    labels = [(optimum, f"h = {optimum.height:g} m") for optimum in inner]
    labels += [(first, "h → 0"), (last, "h → ∞: the centroid")]
    for optimum, label in labels:
        axes.annotate(
            label, (optimum.x, optimum.y), (11, -1), color=to_plot_color(theme.ink), zorder=5, **label_style
        )
    x, y = median.tolist()
    axes.plot(x, y, "D", color=faint, markersize=6.0, zorder=3)
    axes.annotate("median\n(f = r)", (x, y), (-9, 0), ha="right", color=faint, **label_style)


def _set_frame(axes: Axes, frame: _Frame, theme: Theme) -> None:
    """Set the limits of axes to the enlarged frame, and outline it."""
    x, y, width, height = frame
    axes.set(xlim=(x, x + width), ylim=(y, y + height), aspect="equal")
    _simplify_axes(axes, theme)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(4, prune="both"))
    for side in axes.spines.values():
        side.set(visible=True, color=to_plot_color(theme.ink), linewidth=1.2)


def _draw_distance(
    axes: Axes, path: Sequence[SensorOptimum], labeled: Sequence[SensorOptimum], theme: Theme
) -> None:
    """Draw the distance of the optimum from the centroid against the height, and a note on the loss."""
    line = to_plot_color(theme.final)
    max_distance_mm = 1e3 * path[0].distance
    inner = path[1:-1]
    axes.axhline(max_distance_mm, color=to_plot_color(theme.faint), linewidth=1.0, linestyle=(0, (4, 3)))
    axes.plot(*_get_distance_curve(inner), color=line, linewidth=2.4)
    axes.plot(
        *_get_distance_curve(labeled[1:-1]),
        color=line,
        marker="o",
        linestyle="none",
        markersize=5.5,
        markeredgewidth=0.0,
    )
    axes.set(xscale="log", xlim=(inner[0].height, inner[-1].height), ylim=(0.0, 1.12 * max_distance_mm))
    axes.xaxis.set_major_formatter("{x:g}")
    _simplify_axes(axes, theme, "height h (m)", grid="y")
    worst = max(inner, key=lambda optimum: optimum.loss)
    note = (
        f"A sensor over the centroid loses\nat most {100.0 * worst.loss:.2g}% of the optimum,\n"
        f"at h = {worst.height:.2g} m."
    )
    axes.annotate(
        note,
        (0.04, 0.07),
        xycoords="axes fraction",
        fontsize=SMALL_SIZE_PT,
        color=to_plot_color(theme.ink),
        ha="left",
        va="bottom",
        bbox={"facecolor": to_plot_color(theme.background), "edgecolor": "none", "pad": 2.0},
    )


def _get_distance_curve(optima: Sequence[SensorOptimum]) -> tuple[list[float], list[float]]:
    """Return heights, m, and distances from the centroid, mm."""
    heights = [optimum.height for optimum in optima]
    distances = [1e3 * optimum.distance for optimum in optima]
    return heights, distances


def _simplify_axes(axes: Axes, theme: Theme, label: str = "", grid: Literal["y", ""] = "") -> None:
    """Style axes with short ticks and no minor ones."""
    style_axes(axes, theme, label, grid=grid)
    axes.tick_params(length=3.0, left=True)
    axes.minorticks_off()
