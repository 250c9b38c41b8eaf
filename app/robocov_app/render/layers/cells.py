"""The layer of Voronoi cells."""

import numpy as np

from robocov.typing import FloatArray, IntArray
from robocov_app.look.colors import Color
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.scene import Scene

_MIN_SMOOTH_WIDTH_PX = 20.0
"""Mean width of cells, at scale 1, below which edges are not antialiased: the difference hardly shows."""
_EDGE_STEPS_PER_PX = 16.0
"""Corners count as equal if they are equal after rounding to this many steps per pixel."""


def _is_colored_by_distance(canvas: Canvas, scene: Scene) -> bool:
    """Return whether another layer colors the map by distance, so that cells must not be filled."""
    return scene.field is not None and bool({"distances", "geodesic_cells"} & canvas.visible_layers)


def draw_cells(canvas: Canvas, scene: Scene) -> None:
    """Draw the cells in the colors of their robots, and each edge once."""
    assert scene.cells is not None
    sizes = np.array([len(cell) for cell in scene.cells])
    ends = np.cumsum(sizes)
    corners = canvas.camera.to_pixels(np.concatenate(scene.cells))
    fills = _choose_fills(canvas, scene)
    edge_color = canvas.theme.cell_edge
    mean_width = canvas.camera.zoom * (scene.environment.region.area / len(sizes)) ** 0.5
    if mean_width < _MIN_SMOOTH_WIDTH_PX * canvas.scale:
        canvas.draw_polygons(corners, ends.tolist(), fills, edge_color)
        return
    canvas.draw_polygons(corners, ends.tolist(), fills)
    edges = np.hstack([corners, corners[_find_successors(sizes, ends)]])
    if "boundary" in canvas.visible_layers:
        edges = _select_one_direction(edges)
    else:
        edges = _remove_duplicates(edges)
    canvas.draw_segments(edges, edge_color, canvas.scale_width(canvas.theme.line))


def _choose_fills(canvas: Canvas, scene: Scene) -> list[Color | None]:
    """Return the color of each cell; None for cells without a color."""
    assert scene.cells is not None
    if _is_colored_by_distance(canvas, scene):
        return [None] * len(scene.cells)
    tints = [canvas.theme.get_cell_color(hue) for hue in range(len(canvas.theme.robots))]
    hues = canvas.hues
    if scene.cell_owners is not None:
        hues = hues[scene.cell_owners]
    return [tints[hue] for hue in hues.tolist()]


def _find_successors(sizes: IntArray, ends: IntArray) -> IntArray:
    """Return, for the corners of all cells in one array, the row of the next corner of the same cell.

    Parameters
    ----------
    sizes : (n,) int array
        Number of corners of each cell.
    ends : (n,) int array
        Row after the last corner of each cell.

    Returns
    -------
    (k,) int array
    """
    next_rows = np.arange(1, int(ends[-1]) + 1)
    has_corners = sizes > 0
    next_rows[ends[has_corners] - 1] = (ends - sizes)[has_corners]
    return next_rows


def _select_one_direction(edges: FloatArray) -> FloatArray:
    """Return the edges, (k, 4) px, that go to the right or straight down.

    An edge between two cells is in the list in both directions; drawn twice, it would lose its antialiasing.
    Edges on the boundary are in the list once and may be dropped, because the boundary is drawn over them.
    """
    x1, y1, x2, y2 = np.rint(edges * _EDGE_STEPS_PER_PX).T
    return np.asarray(edges[(x1 < x2) | ((x1 == x2) & (y1 < y2))])


def _remove_duplicates(edges: FloatArray) -> FloatArray:
    """Return each edge, (k, 4) px, once, regardless of its direction."""
    x1, y1, x2, y2 = edges.T
    is_backward = (x1 > x2) | ((x1 == x2) & (y1 > y2))
    directed = np.where(is_backward[:, None], edges[:, [2, 3, 0, 1]], edges)
    _, rows = np.unique(np.rint(directed * _EDGE_STEPS_PER_PX), axis=0, return_index=True)
    return directed[rows]


def build_cells_legend(scene: Scene) -> list[LegendEntry]:
    """Build the legend of the cells, with a symbol that is filled only if the cells are."""

    def draw_symbol(canvas: Canvas, x: float, y: float) -> None:
        fill = None if _is_colored_by_distance(canvas, scene) else canvas.theme.legend_cell
        canvas.draw_swatch(x, y, fill, canvas.theme.cell_edge)

    return [LegendEntry("Voronoi cell", draw_symbol)]
