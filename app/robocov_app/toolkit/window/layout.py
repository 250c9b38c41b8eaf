"""Layout of a window: boxes of top bar, tool rail, arena, panel, chart, time slider and status line."""

from math import ceil, floor
from typing import NamedTuple

from robocov_app.render.panel_grid import choose_column_count

# Lengths in pixels at scale 1.
PANEL_WIDTH_PX = 320
BAR_HEIGHT_PX = 44
RAIL_WIDTH_PX = 44
CHART_HEIGHT_PX = 118
TIME_SLIDER_HEIGHT_PX = 26
STATUS_HEIGHT_PX = 26
PANE_GAP_PX = 2
LEGEND_HEIGHT_PX = 28
"""Height of the legend that several panes share."""
_PANE_MARGINS_PX = (31, 68)
"""Width and height of a pane in addition to those of its map."""
MIN_SIZE_PX = (900, 600)
"""Minimum width and height of a window in which everything fits at scale 1."""
MIN_PORTRAIT_SIZE_PX = (460, 600)
"""The same for a phone in portrait orientation, where the panel takes most of the width."""

_MIN_SCALE = 0.25
_SCALE_STEPS = 8
"""Scales are multiples of 1 / 8, so that text does not jitter while the window is resized."""


class Box(NamedTuple):
    """A rectangle of a window, px; y points down."""

    left: int
    top: int
    width: int
    height: int

    @property
    def position(self) -> tuple[int, int]:
        """Left and top, px."""
        return self.left, self.top

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, px."""
        return self.width, self.height


class Layout(NamedTuple):
    """Boxes of a window.

    Attributes
    ----------
    size : (width, height), px
    scale : float
        The requested scale, or the largest one at which everything fits into the window.
    bar : Box
        The top bar.
    rail : Box
        The tool rail to the left of the arena.
    arena, chart, time_slider, status : Box
        The time slider is below the chart.
    panel : Box
        Its width is 0 while the panel is hidden.
    panes : tuple of Box
        Part of the arena for each pane.
    legend : Box
        The legend that several panes share, above them; its height is 0 for a single pane.
    """

    size: tuple[int, int]
    scale: float
    bar: Box
    rail: Box
    arena: Box
    panel: Box
    chart: Box
    time_slider: Box
    status: Box
    panes: tuple[Box, ...]
    legend: Box

    @property
    def has_panel(self) -> bool:
        """Whether the panel is shown."""
        return self.panel.width > 0


def build_layout(
    size: tuple[int, int],
    scale: float,
    panes: int = 1,
    aspect: float = 1.0,
    *,
    panel: bool = True,
    plot: bool = True,
) -> Layout:
    """Lay out a window.

    Parameters
    ----------
    size : (width, height), px
    scale : float
        Requested scale of texts and widgets.
    panes : int
        Number of panes; all show the same map.
    aspect : float
        Width of the map divided by its height.
    panel : bool
        Whether the panel is shown.
    plot : bool
        Whether chart and time slider are shown.

    Returns
    -------
    Layout
    """
    width, height = size
    scale = min(scale, find_max_scale(size))
    panel_width = 0
    if panel:
        panel_width = min(round(PANEL_WIDTH_PX * scale), width - 1)
    legend_height = 0
    if panes > 1:
        legend_height = round(LEGEND_HEIGHT_PX * scale)
    left_width = width - panel_width
    rail_width = round(RAIL_WIDTH_PX * scale)
    rows = _choose_row_heights(height, scale, plot=plot)
    arena = Box(rail_width, rows.bar, max(left_width - rail_width, 1), rows.arena)
    chart_top = rows.bar + rows.arena
    slider_top = chart_top + rows.chart
    return Layout(
        size=size,
        scale=scale,
        bar=Box(0, 0, width, rows.bar),
        rail=Box(0, rows.bar, rail_width, rows.arena),
        arena=arena,
        panel=Box(left_width, rows.bar, panel_width, height - rows.bar),
        chart=Box(0, chart_top, left_width, rows.chart),
        time_slider=Box(0, slider_top, left_width, rows.time_slider),
        status=Box(0, slider_top + rows.time_slider, left_width, rows.status),
        panes=_arrange_panes(panes, aspect, scale, arena, legend_height),
        legend=Box(rail_width, rows.bar, arena.width, legend_height),
    )


class _RowHeights(NamedTuple):
    """Heights of the rows of a window from top to bottom, px."""

    bar: int
    arena: int
    chart: int
    time_slider: int
    status: int


def _choose_row_heights(height: int, scale: float, *, plot: bool) -> _RowHeights:
    """Choose the heights of the rows; the arena gets the space that the others leave."""
    bar = round(BAR_HEIGHT_PX * scale)
    status = round(STATUS_HEIGHT_PX * scale)
    chart = 0
    time_slider = 0
    if plot:
        # In small windows, the chart takes at most a third of the height.
        chart = min(round(CHART_HEIGHT_PX * scale), height // 3)
        time_slider = round(TIME_SLIDER_HEIGHT_PX * scale)
    arena = max(height - bar - status - time_slider - chart, 1)
    return _RowHeights(bar=bar, arena=arena, chart=chart, time_slider=time_slider, status=status)


def build_map_layout(size: tuple[int, int], scale: float, panes: int, aspect: float) -> Layout:
    """Lay out a picture that consists of the panes alone.

    Parameters
    ----------
    size, scale, panes, aspect
        See `build_layout`; the scale is not reduced.

    Returns
    -------
    Layout
        All boxes other than those of the panes are empty.
    """
    arena = Box(0, 0, *size)
    empty = Box(0, 0, 0, 0)
    return Layout(
        size=size,
        scale=scale,
        bar=empty,
        rail=empty,
        arena=arena,
        panel=empty,
        chart=empty,
        time_slider=empty,
        status=empty,
        panes=_arrange_panes(panes, aspect, scale, arena, 0),
        legend=empty,
    )


def _arrange_panes(
    count: int, aspect: float, scale: float, arena: Box, legend_height: int
) -> tuple[Box, ...]:
    """Return the boxes of the panes, arranged in a grid below the legend."""
    arena_left, arena_top, width, arena_height = arena
    free_size = width, max(arena_height - legend_height, 1)
    margin_width, margin_height = _PANE_MARGINS_PX
    columns = choose_column_count(
        count, aspect, free_size, row_margin=margin_height * scale, column_margin=margin_width * scale
    )
    rows = ceil(count / columns)
    pane_width = (width - PANE_GAP_PX * (columns - 1)) // columns
    pane_height = (arena_height - legend_height - PANE_GAP_PX * (rows - 1)) // rows
    boxes: list[Box] = []
    for number in range(count):
        row, column = divmod(number, columns)
        left = arena_left + column * (pane_width + PANE_GAP_PX)
        top = arena_top + legend_height + row * (pane_height + PANE_GAP_PX)
        boxes.append(Box(left, top, pane_width, max(pane_height, 1)))
    return tuple(boxes)


def find_max_scale(size: tuple[int, int]) -> float:
    """Return the largest scale at which everything fits into a window."""
    width, height = size
    min_width, min_height = MIN_SIZE_PX
    if width < height:
        min_width, min_height = MIN_PORTRAIT_SIZE_PX
    scale = floor(_SCALE_STEPS * min(width / min_width, height / min_height)) / _SCALE_STEPS
    return max(scale, _MIN_SCALE)


def is_inside(box: tuple[float, float, float, float], pixel: tuple[float, float]) -> bool:
    """Return whether a pixel is in a box."""
    left, top, width, height = box
    x, y = pixel
    return left <= x < left + width and top <= y < top + height
