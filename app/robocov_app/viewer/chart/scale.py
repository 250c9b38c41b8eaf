"""Conversion of times and values to pixels of the chart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robocov.typing import FloatArray
from robocov_app.look.axes import Axis, choose_growing_time_limit, choose_growing_value_axis
from robocov_app.render.fonts import measure_text
from robocov_app.toolkit.window.layout import Layout
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.past.curves import GhostCurve
from robocov_app.viewer.session.timeline import Timeline

LEFT_PX = 52
"""Space to the left of the curves, at scale 1, for the numbers of the value axis."""
RIGHT_PX = 70
"""Space to the right of a narrow chart, for the value of its curve."""
HEADLINE_PX = 140
"""Space to the right, for a large number: the value of the only curve."""
MIN_WIDTH_WITH_HEADLINE_PX = 420
"""Minimum width of a chart with a large number."""
TOP_PX = 26
"""Space above, for the title."""
BOTTOM_PX = 20
"""Space below, for the numbers of the time axis."""
MIN_TICK_GAP_PX = 22
"""Minimum distance between grid lines."""
_WIDEST_VALUE = "  8.888  +88.8%"
_MAX_NAMES_FRACTION = 0.4
"""Maximum fraction of the chart's width for captions with names of controllers."""


@dataclass(frozen=True)
class TimeScale:
    """The time axis: converts times to columns of the window.

    Attributes
    ----------
    left, right : float, px
        Columns at the ends of the axis.
    end : float, s
        Time at the right end; the left end is at time 0.
    """

    left: float
    right: float
    end: float

    @property
    def width(self) -> float:
        """Length of the axis, px."""
        return self.right - self.left

    def to_column(self, time: float) -> float:
        """Return the column, px, of a time, s."""
        return self.left + self.width * time / self.end

    def to_time(self, column: float) -> float:
        """Return the time, s, of a column, px; it may be outside the axis."""
        return (column - self.left) / max(self.width, 1.0) * self.end


def build_time_scale(
    layout: Layout, timeline: Timeline, ghosts: Sequence[GhostCurve], text_size: float
) -> TimeScale:
    """Build the time axis, which ends somewhat after the latest time of all curves.

    Parameters
    ----------
    layout : Layout
        Layout of the window.
    timeline : Timeline
    ghosts : sequence of GhostCurve
        Curves of other branches.
    text_size : float
        Size of the captions at scale 1.

    Returns
    -------
    TimeScale
    """
    left, _, width, _ = layout.chart
    caption_width = RIGHT_PX * layout.scale
    if has_headline(layout, timeline):
        caption_width = HEADLINE_PX * layout.scale
    elif len(timeline.panes) > 1:
        names_width = _measure_captions(timeline.panes, round(text_size * layout.scale))
        caption_width = min(names_width + 20 * layout.scale, _MAX_NAMES_FRACTION * width)
    ghost_ends = [float(ghost.times[-1]) for ghost in ghosts]
    end = choose_growing_time_limit(max([timeline.end_time, *ghost_ends]))
    return TimeScale(left + LEFT_PX * layout.scale, left + width - caption_width, end)


def has_headline(layout: Layout, timeline: Timeline) -> bool:
    """Return whether the value of the only curve is shown as a large number next to the chart."""
    is_wide = layout.chart.width >= MIN_WIDTH_WITH_HEADLINE_PX * layout.scale
    return is_wide and len(timeline.panes) == 1


def _measure_captions(panes: Sequence[Pane], text_size: int) -> int:
    """Return the width of the widest caption, a name with its value, px."""
    return max(
        measure_text(f"{pane.controller.label}{_WIDEST_VALUE}", text_size, bold=True) for pane in panes
    )


@dataclass(frozen=True)
class ChartScale:
    """Converts times and values to pixels of the chart's page.

    Attributes
    ----------
    times : TimeScale
    values : Axis
    top, bottom : float, px
        Rows of the largest and the smallest value of the value axis.
    """

    times: TimeScale
    values: Axis
    top: float
    bottom: float

    def to_row(self, value: float) -> float:
        """Return the row of a value, px."""
        fraction = (value - self.values.start) / (self.values.end - self.values.start)
        return self.bottom + (self.top - self.bottom) * fraction

    def to_points(self, times: FloatArray, values: FloatArray) -> FloatArray:
        """Return the points of a curve, (k, 2) px, for times, (k,) s, and values, (k,)."""
        columns = self.times.left + self.times.width * times / self.times.end
        fractions = (values - self.values.start) / (self.values.end - self.values.start)
        rows = self.bottom + (self.top - self.bottom) * fractions
        return np.column_stack([columns, rows])


def build_chart_scale(
    times: TimeScale, layout: Layout, curves: Sequence[FloatArray], tree_height: float = 0.0
) -> ChartScale:
    """Build the scale of a chart so that all values of its curves are visible.

    Parameters
    ----------
    times : TimeScale
    layout : Layout
    curves : sequence of (k,) arrays
        Values of the curves; they may be empty.
    tree_height : float
        Height of the tree of branches below the time axis, px at scale 1.

    Returns
    -------
    ChartScale
    """
    top = TOP_PX * layout.scale
    bottom = layout.chart.height - (BOTTOM_PX + tree_height) * layout.scale
    values = np.concatenate([*curves, np.empty(0)])
    low = high = np.nan
    if len(values):
        low = float(values.min())
        high = float(values.max())
    max_intervals = (bottom - top) / (MIN_TICK_GAP_PX * layout.scale)
    return ChartScale(times, choose_growing_value_axis(low, high, max_intervals), top, bottom)
