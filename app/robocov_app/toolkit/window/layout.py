"""Layout of a window: boxes of top bar, tool rail, arena, panel, chart, time slider and status line."""

from math import ceil, floor
from typing import NamedTuple

from robocov_app.render.panel_grid import choose_column_count

# Lengths in pixels at scale 1.
PANEL_WIDTH_PX = 320
BAR_HEIGHT_PX = 44
RAIL_WIDTH_PX = 44
LABELED_RAIL_WIDTH_PX = 136
"""Width of a tool rail that shows the names of the tools next to their icons."""
MIN_LABELED_WINDOW_PX = 1100
"""Width of a window from which on the tool rail shows names."""
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
MIN_PORTRAIT_SIZE_PX = (360, 600)
"""The same in portrait orientation, where the panel is a sheet over the lower part of the window."""
MIN_COMPACT_SIDE_PX = 300
"""The same for the shorter side of a compact window."""
COMPACT_PANEL_WIDTH_PX = 384
"""Width of the panel at the side of a compact window, whose widgets are larger."""
MAX_SHEET_WIDTH_PX = 700
"""Width at scale 1 below which the panel of a window in portrait orientation is a sheet."""
SHEET_HEIGHT_FRACTION = 0.6
"""Height of the sheet, including its handle, in heights of the window."""
HANDLE_HEIGHT_PX = 28
_COMPACT_SLIDER_HEIGHT_PX = 36
"""Height of the time slider for a finger."""
_MIN_CHART_WINDOW_PX = 480
"""Height at scale 1 from which on a compact window has a chart."""

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

    def clamp(self, pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the pixel of the box that is nearest to a pixel."""
        x = min(max(pixel[0], self.left), self.left + self.width - 1.0)
        y = min(max(pixel[1], self.top), self.top + self.height - 1.0)
        return x, y


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
    handle : Box
        The strip above the panel by which it is closed, if the panel is a sheet; otherwise of height 0.
    is_compact : bool
        Whether the window is on a phone, whose page has the buttons of the bar and of the rail.
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
    handle: Box = Box(0, 0, 0, 0)
    is_compact: bool = False

    @property
    def has_panel(self) -> bool:
        """Whether the panel is shown."""
        return self.panel.width > 0

    @property
    def has_sheet(self) -> bool:
        """Whether the panel is shown for fingers: as a sheet, or at the side of a compact window."""
        return self.has_panel and (self.is_compact or self.handle.height > 0)


def build_layout(
    size: tuple[int, int],
    scale: float,
    panes: int = 1,
    aspect: float = 1.0,
    *,
    panel: bool = True,
    plot: bool = True,
    is_compact: bool = False,
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
    is_compact : bool
        Whether the window is on a phone, whose page has the buttons of the bar and of the rail.

    Returns
    -------
    Layout
    """
    width, height = size
    scale = min(scale, find_max_scale(size, is_compact=is_compact))
    handle, panel_box = _place_panel(size, scale, is_shown=panel, is_compact=is_compact)
    legend_height = 0
    if panes > 1:
        legend_height = round(LEGEND_HEIGHT_PX * scale)
    rail_width = _choose_rail_width(width, scale, is_compact=is_compact)
    if handle.height:
        left_width = width
        rows = _choose_rows_above_sheet(handle.top, scale, is_compact=is_compact)
    else:
        left_width = width - panel_box.width
        rows = _choose_row_heights(height, scale, plot=plot, is_compact=is_compact)
    arena = Box(rail_width, rows.bar, max(left_width - rail_width, 1), rows.arena)
    chart_top = rows.bar + rows.arena
    slider_top = chart_top + rows.chart
    return Layout(
        size=size,
        scale=scale,
        bar=Box(0, 0, width, rows.bar),
        rail=Box(0, rows.bar, rail_width, rows.arena),
        arena=arena,
        panel=panel_box,
        chart=Box(0, chart_top, left_width, rows.chart),
        time_slider=Box(0, slider_top, left_width, rows.time_slider),
        status=Box(0, slider_top + rows.time_slider, left_width, rows.status),
        panes=_arrange_panes(panes, aspect, scale, arena, legend_height),
        legend=Box(rail_width, rows.bar, arena.width, legend_height),
        handle=handle,
        is_compact=is_compact,
    )


def compute_aspect(bounds: tuple[float, float, float, float]) -> float:
    """Return the width of a map divided by its height, from its bounds (x, y, x, y), m."""
    low_x, low_y, high_x, high_y = bounds
    return (high_x - low_x) / (high_y - low_y)


def find_scroll_box(size: tuple[int, int], layout: Layout, *, is_covered: bool) -> Box | None:
    """Return the part of a window that a vertical drag of a finger scrolls.

    Parameters
    ----------
    size : (width, height), px
    layout : Layout
    is_covered : bool
        Whether a dialog or a menu covers the window.

    Returns
    -------
    Box or None
        The whole window if it is covered, or else the panel; None if there is neither.
    """
    if is_covered:
        return Box(0, 0, *size)
    if layout.has_panel:
        return layout.panel
    return None


def uses_sheet(size: tuple[int, int], scale: float, *, is_compact: bool = False) -> bool:
    """Return whether the panel of a window is a sheet over its lower part; see `build_layout`."""
    width, height = size
    scale = min(scale, find_max_scale(size, is_compact=is_compact))
    return width < height and width < MAX_SHEET_WIDTH_PX * scale


def _choose_rail_width(window_width: int, scale: float, *, is_compact: bool) -> int:
    """Return the width of the tool rail, px; wide windows have space for the names of the tools."""
    if is_compact:
        return 0
    if window_width >= MIN_LABELED_WINDOW_PX * scale:
        return round(LABELED_RAIL_WIDTH_PX * scale)
    return round(RAIL_WIDTH_PX * scale)


def _place_panel(size: tuple[int, int], scale: float, *, is_shown: bool, is_compact: bool) -> tuple[Box, Box]:
    """Return the boxes of the handle and of the panel: a sheet at the bottom, or a column at the right."""
    width, height = size
    bar_height = 0 if is_compact else round(BAR_HEIGHT_PX * scale)
    if not is_shown:
        return Box(0, height, 0, 0), Box(width, bar_height, 0, height - bar_height)
    if not uses_sheet(size, scale, is_compact=is_compact):
        panel_width = min(round(PANEL_WIDTH_PX * scale), width - 1)
        if is_compact:
            panel_width = min(round(COMPACT_PANEL_WIDTH_PX * scale), width // 2)
        return Box(0, height, 0, 0), Box(width - panel_width, bar_height, panel_width, height - bar_height)
    sheet_height = round(SHEET_HEIGHT_FRACTION * height)
    handle = Box(0, height - sheet_height, width, min(round(HANDLE_HEIGHT_PX * scale), sheet_height))
    panel_top = handle.top + handle.height
    return handle, Box(0, panel_top, width, height - panel_top)


class _RowHeights(NamedTuple):
    """Heights of the rows of a window from top to bottom, px."""

    bar: int
    arena: int
    chart: int
    time_slider: int
    status: int


def _choose_row_heights(height: int, scale: float, *, plot: bool, is_compact: bool) -> _RowHeights:
    """Choose the heights of the rows; the arena gets the space that the others leave."""
    bar = round(BAR_HEIGHT_PX * scale)
    status = round(STATUS_HEIGHT_PX * scale)
    slider_px = TIME_SLIDER_HEIGHT_PX
    has_chart = plot
    if is_compact:
        bar = 0
        status = 0
        slider_px = _COMPACT_SLIDER_HEIGHT_PX
        has_chart = plot and height >= _MIN_CHART_WINDOW_PX * scale
    chart = 0
    if has_chart:
        # In small windows, the chart takes at most a third of the height.
        chart = min(round(CHART_HEIGHT_PX * scale), height // 3)
    time_slider = 0
    if plot:
        time_slider = round(slider_px * scale)
    arena = max(height - bar - status - time_slider - chart, 1)
    return _RowHeights(bar=bar, arena=arena, chart=chart, time_slider=time_slider, status=status)


def _choose_rows_above_sheet(sheet_top: int, scale: float, *, is_compact: bool) -> _RowHeights:
    """Choose the heights of the rows above a sheet, which covers the chart and all below it."""
    bar = 0 if is_compact else round(BAR_HEIGHT_PX * scale)
    return _RowHeights(bar=bar, arena=max(sheet_top - bar, 1), chart=0, time_slider=0, status=0)


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


def find_max_scale(size: tuple[int, int], *, is_compact: bool = False) -> float:
    """Return the largest scale at which everything fits into a window."""
    width, height = size
    if is_compact:
        return max(floor(_SCALE_STEPS * min(size) / MIN_COMPACT_SIDE_PX) / _SCALE_STEPS, _MIN_SCALE)
    min_width, min_height = _get_min_size(size)
    scale = floor(_SCALE_STEPS * min(width / min_width, height / min_height)) / _SCALE_STEPS
    return max(scale, _MIN_SCALE)


def _get_min_size(size: tuple[int, int]) -> tuple[int, int]:
    """Return the minimum width and height, at scale 1, of a window with the orientation of a given size."""
    width, height = size
    return MIN_PORTRAIT_SIZE_PX if width < height else MIN_SIZE_PX


def explain_reduced_scale(requested: float | None, size: tuple[int, int]) -> str:
    """Return a message that a window is too small for the requested scale; empty if it is large enough.

    Parameters
    ----------
    requested : float or None
        The requested scale; None for any scale.
    size : (width, height), px
        Size of the window.

    Returns
    -------
    str
    """
    max_scale = find_max_scale(size)
    if requested is None or requested <= max_scale:
        return ""
    min_width, min_height = _get_min_size(size)
    # Scales are rounded down to multiples of 1 / _SCALE_STEPS.
    needed_scale = ceil(_SCALE_STEPS * requested) / _SCALE_STEPS
    width = ceil(min_width * needed_scale)
    height = ceil(min_height * needed_scale)
    return f"scale {requested:g} needs a window of {width} × {height}; using {max_scale:g}"


def is_inside(box: tuple[float, float, float, float], pixel: tuple[float, float]) -> bool:
    """Return whether a pixel is in a box."""
    left, top, width, height = box
    x, y = pixel
    return left <= x < left + width and top <= y < top + height
