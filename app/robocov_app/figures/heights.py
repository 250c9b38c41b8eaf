"""The best place for a sensor over a cell, by its height: the optimum of equation (14)."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import ConnectionPatch, Polygon, Rectangle
from matplotlib.ticker import MaxNLocator

from robocov.arrays import Array
from robocov.locational import Distance, Sensing, value
from robocov.locational.best_points import best_points
from robocov.observation.region import Region
from robocov.voronoi import VoronoiPartition, partition
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import SMALL, Box, Page, quiet_axes, tone
from robocov_app.render.theme import Theme, mix

PENTAGON = ((0.0, 0.0), (4.0, 0.0), (5.0, 2.0), (2.0, 4.0), (-1.0, 1.5))  # a cell without any symmetry, m
# heights are written beside the path, rounded, where their places are so far apart, as a part of it
_APART = 0.13
_LOW, _HIGH = 0.01, 100.0  # the range of the plot, m
_LIMIT = 1e-7  # so high, relative to the cell's size, a sensor is as good as on the ground


class AtHeight(NamedTuple):
    """The best place, m, at a height, m; `missed`: the part of its value missed over the centroid."""

    height: float
    x: float
    y: float
    from_centroid: float
    missed: float


def best_at_heights(heights: Sequence[float]) -> list[AtHeight]:
    """Return the best places over the cell at ascending heights, m, and in the limits 0, inf."""
    cell = _cell()
    size, (centroid,) = float(np.sqrt(cell.mass[0])), cell.centroid
    rows = []
    for height in (0.0, *heights, np.inf):
        place, missed = centroid, float("nan")
        if height < np.inf:
            place = best_points(cell, Sensing(height or _LIMIT * size))[0]
            if height > 0.0:
                offsets = np.array([place, centroid])[:, None] - cell.generators
                best, plain = (value(cell.edges, each, Sensing(height))[0] for each in offsets)
                missed = float(1.0 - plain / best)
        away = float(np.hypot(*(place - centroid)))
        rows.append(AtHeight(height, float(place[0]), float(place[1]), away, missed))
    return rows


@plain_style()
def plot_heights(size: tuple[int, int], theme: Theme, scale: float) -> Figure:
    """Plot the path of the optimum of f = 1/(r²+h²) over a cell, from h → 0 to the centroid for h → ∞.

    From left to right: the cell; what happens in it, enlarged; how far the optimum is from the centroid.
    """
    cell = _cell()
    path = best_at_heights(np.geomspace(_LOW, _HIGH, 240).tolist())
    marked = _apart(best_at_heights([n * 10.0**k for k in (-1, 0, 1) for n in (1, 2, 3, 5)]))
    median = best_points(cell, Distance())[0]
    page = Page(size, theme, scale)
    wide, high = size
    top, bottom = 44 * scale, 46 * scale
    tall, begin = high - top - bottom, page.margin + 26 * scale
    room = wide - page.margin - begin
    left, middle, right = (
        page.axes((begin + part * room, top, share * room, tall))
        for part, share in ((0.0, 0.30), (0.37, 0.26), (0.68, 0.32))
    )
    heads = "the cell (m)", "the frame in it (m)", "from the optimum to the centroid (mm)"
    for part, words in zip((0.0, 0.37, 0.68), heads, strict=True):
        page.text(words, begin + part * room, top - 16 * scale)
    window = _window(np.array([[row.x, row.y] for row in path] + [median]), 0.26 * room / tall)
    _draw_cell(left, cell, window, theme)
    _draw_path(middle, path, marked, median, window, theme)
    x, y, width, height = window
    for part in (0.0, 1.0):
        ray: Any = {"xyA": (x + width, y + part * height), "xyB": (0.0, part)}
        ray |= {"coordsA": left.transData, "coordsB": middle.transAxes, "color": tone(theme.faint)}
        page.figure.add_artist(ConnectionPatch(**ray, linewidth=0.8))
    _draw_distance(right, path, marked, theme)
    return page.figure


def _apart(rows: Sequence[AtHeight]) -> list[AtHeight]:
    """Return the limits, and what is far enough from them and from each other to have words beside it."""
    first, *inner, last = rows
    least = _APART * first.from_centroid
    kept = [first]
    for row in inner:
        if row.from_centroid >= least and kept[-1].from_centroid - row.from_centroid >= least:
            kept.append(row)
    return [*kept, last]


def _cell() -> VoronoiPartition:
    region = Region(np.array(PENTAGON))
    return partition(region.centroid[None], region)


def _window(points: Array, aspect: float) -> Box:
    """Return x, y, width and height of what is enlarged: all points, with room for words at the right."""
    low, high = points.min(axis=0), points.max(axis=0)
    width, height = (high - low) * (1.9, 1.3)
    width, height = max(width, height * aspect), max(height, width / aspect)
    return float(low[0] - 0.2 * width), float((low[1] + high[1] - height) / 2.0), float(width), float(height)


def _draw_cell(axes: Axes, cell: VoronoiPartition, window: Box, theme: Theme) -> None:
    ring = cell.polygons[0]
    fill = tone(mix(theme.background, theme.robots[1], theme.tint))
    axes.add_patch(Polygon(ring, facecolor=fill, edgecolor=tone(theme.boundary), linewidth=1.6))
    x, y, width, height = window
    axes.add_patch(Rectangle((x, y), width, height, fill=False, edgecolor=tone(theme.ink), linewidth=1.2))
    axes.set_aspect("equal")
    axes.margins(0.02)
    axes.autoscale_view()
    _plain(axes, theme)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(6, integer=True))


def _draw_path(
    axes: Axes, path: Sequence[AtHeight], marked: Sequence[AtHeight], median: Array, window: Box, theme: Theme
) -> None:
    line, faint = tone(theme.final), tone(theme.faint)
    axes.plot([row.x for row in path], [row.y for row in path], color=line, linewidth=2.4, zorder=2)
    for row in marked[1:-1]:
        axes.plot(row.x, row.y, "o", color=line, markersize=5.5, markeredgewidth=0.0, zorder=3)
    ends: list[tuple[AtHeight, str, Any]] = [
        (marked[0], "h → 0", {"marker": "o", "markerfacecolor": tone(theme.background)}),
        (marked[-1], "h → ∞: the centroid", {"marker": "P", "markerfacecolor": line}),
    ]
    for row, _, look in ends:
        axes.plot(row.x, row.y, markersize=9.5, markeredgecolor=line, markeredgewidth=1.8, zorder=4, **look)
    beside: Any = {"textcoords": "offset points", "va": "center", "fontsize": SMALL}
    words = [(row, f"h = {row.height:g} m") for row in marked[1:-1]] + [(row, text) for row, text, _ in ends]
    for row, text in words:
        axes.annotate(text, (row.x, row.y), (11, -1), color=tone(theme.ink), zorder=5, **beside)
    x, y = median.tolist()
    axes.plot(x, y, "D", color=faint, markersize=6.0, zorder=3)
    axes.annotate("median\n(f = r)", (x, y), (-9, 0), ha="right", color=faint, **beside)
    x, y, width, height = window
    axes.set_xlim(x, x + width)
    axes.set_ylim(y, y + height)
    axes.set_aspect("equal")
    _plain(axes, theme)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(4, prune="both"))
    for side in axes.spines.values():
        side.set(visible=True, color=tone(theme.ink), linewidth=1.2)


def _draw_distance(axes: Axes, path: Sequence[AtHeight], marked: Sequence[AtHeight], theme: Theme) -> None:
    line, highest = tone(theme.final), 1e3 * path[0].from_centroid
    inner = path[1:-1]
    axes.axhline(highest, color=tone(theme.faint), linewidth=1.0, linestyle=(0, (4, 3)))
    style: Any = {"marker": "o", "linestyle": "none", "markersize": 5.5, "markeredgewidth": 0.0}
    for rows, look in ((inner, {"linewidth": 2.4}), (marked[1:-1], style)):
        millimetres = [1e3 * row.from_centroid for row in rows]
        axes.plot([row.height for row in rows], millimetres, color=line, **look)
    axes.set_xscale("log")
    axes.set_xlim(inner[0].height, inner[-1].height)
    axes.set_ylim(0.0, 1.12 * highest)
    axes.xaxis.set_major_formatter("{x:g}")
    quiet_axes(axes, theme, "height h (m)", grid="y")
    axes.tick_params(length=3.0, left=True)
    axes.minorticks_off()
    worst = max(inner, key=lambda row: row.missed)
    style = {"fontsize": SMALL, "color": tone(theme.ink), "ha": "left", "va": "bottom"}
    style |= {"bbox": {"facecolor": tone(theme.background), "edgecolor": "none", "pad": 2.0}}
    words = f"A sensor over the centroid misses\nat most {100.0 * worst.missed:.2g} % of what it could\n"
    words += f"tell, at h = {worst.height:.2g} m."
    axes.annotate(words, (0.04, 0.07), xycoords="axes fraction", **style)


def _plain(axes: Axes, theme: Theme) -> None:
    quiet_axes(axes, theme)
    axes.tick_params(length=3.0, left=True)
    axes.minorticks_off()
