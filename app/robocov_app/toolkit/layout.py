"""Window layout: arena, panel, plot, time line and status line. Pure arithmetic."""

from math import floor
from typing import NamedTuple, TypeAlias

from robocov_app.render.layout import columns_for

Box: TypeAlias = tuple[int, int, int, int]  # left, top, width and height in pixels
PANEL, CHART, TRACK, STATUS, GAP, LEGEND_ROW = 320, 150, 26, 26, 2, 22
SMALLEST = (900, 600)  # width and height at scale 1 that everything has room in,
UPRIGHT = (460, 600)  # and on a telephone that is held upright, where the panel takes most of the width


class Layout(NamedTuple):
    """Boxes of a window of some size."""

    size: tuple[int, int]
    scale: float  # as it was asked for, or what of it the window has room for
    arena: Box
    panel: Box  # of no width while it is hidden
    chart: Box
    track: Box
    status: Box
    panes: tuple[Box, ...]
    legend: Box  # above several panes, which share it; of no height above a single one


def laid_out(
    size: tuple[int, int],
    scale: float,
    panes: int = 1,
    aspect: float = 1.0,
    *,
    panel: bool = True,  # whether it is shown
    legend_rows: int = 1,  # of the legend that several panes share
    plot: bool = True,  # whether it is shown
) -> Layout:
    """Lay a window out, for panes of a map whose width by height is `aspect`."""
    width, height = size
    scale = min(scale, largest_scale(size))
    wide = min(round(PANEL * scale), width - 1) if panel else 0
    left, status = width - wide, round(STATUS * scale)
    track = round(TRACK * scale) if plot else 0
    chart = min(round(CHART * scale), height // 3) if plot else 0
    arena: Box = (0, 0, left, max(height - status - track - chart, 1))
    legend = round((6 + LEGEND_ROW * legend_rows) * scale) if panes > 1 else 0
    free = left, max(arena[3] - legend, 1)
    columns = columns_for(panes, aspect, free, around=68 * scale, beside=31 * scale)
    rows, pane_width = -(-panes // columns), (left - GAP * (columns - 1)) // columns
    pane_height = (arena[3] - legend - GAP * (rows - 1)) // rows
    boxes: list[Box] = []
    for row, k in (divmod(k, columns) for k in range(panes)):
        top = legend + row * (pane_height + GAP)
        boxes.append((k * (pane_width + GAP), top, pane_width, max(pane_height, 1)))
    return Layout(
        size=size,
        scale=scale,
        arena=arena,
        panel=(left, 0, wide, height),
        chart=(0, arena[3], left, chart),
        track=(0, arena[3] + chart, left, track),
        status=(0, arena[3] + chart + track, left, status),
        panes=tuple(boxes),
        legend=(0, 0, left, legend),
    )


def largest_scale(size: tuple[int, int]) -> float:
    """Return the largest scale that a window has room for: in steps, so that text does not tremble."""
    least = SMALLEST if size[0] >= size[1] else UPRIGHT
    return max(floor(8 * min(size[0] / least[0], size[1] / least[1])) / 8, 0.25)


def inside(box: tuple[float, float, float, float], pixel: tuple[float, float]) -> bool:
    left, top, width, height = box
    return left <= pixel[0] < left + width and top <= pixel[1] < top + height
