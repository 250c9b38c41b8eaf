"""Title and axes of the chart."""

from pygame import Rect

from robocov_app.look.axes import MAX_TIME_INTERVALS, choose_tick_step, list_ticks
from robocov_app.look.colors import mix
from robocov_app.render.canvas import Canvas
from robocov_app.render.density_text import describe_density
from robocov_app.toolkit.window.layout import Box
from robocov_app.viewer.chart.frame import ChartFrame
from robocov_app.viewer.chart.scale import BOTTOM_PX, TOP_PX, ChartScale, TimeScale
from robocov_app.viewer.session.past.curves import DISTANCE, TIME

# Lengths in pixels at scale 1.
_TITLE_LEFT_PX = 12
_SWITCH_GAP_PX = 16
_SWITCH_PADDING_PX = 6
_VALUE_GAP_PX = 7
_TIME_GAP_PX = 4
_WAITING_MARGIN_PX = 10
_WAITING_HEIGHT_PX = 22
_MIN_TIME_STEP_S = 1.0
_GRID_STRENGTH = 0.12


def draw_title(canvas: Canvas, frame: ChartFrame) -> float:
    """Draw the name and unit of the plotted quantity, and return the right end of the text, px."""
    left = _TITLE_LEFT_PX * frame.scale
    row = 0.5 * TOP_PX * frame.scale
    density = describe_density(frame.session.displayed.environment)
    weighted = ", weighted by φ" if density else ""
    title = f"{frame.quantity.title}{weighted}, {frame.quantity.unit}"
    canvas.draw_text(title, (left, row), bold=True)
    return left + canvas.measure_text(title, bold=True)


def draw_computation_state(
    canvas: Canvas, frame: ChartFrame, state: str, *, left: float, right: float
) -> None:
    """Draw the progress of the cost computation, if there is space between columns `left` and `right`, px."""
    if state and right - canvas.measure_text(state) > left:
        row = 0.5 * TOP_PX * frame.scale
        canvas.draw_text(state, (right, row), color=frame.theme.faint, anchor="right")


def draw_waiting_text(canvas: Canvas, frame: ChartFrame, scale: ChartScale, text: str) -> None:
    """Draw what the chart waits for in the middle of the empty plot."""
    middle = (scale.times.left + 0.5 * scale.times.width, 0.5 * (TOP_PX * frame.scale + scale.bottom))
    width = canvas.measure_text(text) + 2 * _WAITING_MARGIN_PX * frame.scale
    height = _WAITING_HEIGHT_PX * frame.scale
    box = Rect(0, 0, round(width), round(height))
    box.center = round(middle[0]), round(middle[1])
    canvas.surface.fill(frame.theme.panel, box)
    canvas.draw_text(text, middle, color=frame.theme.ink, anchor="middle")


def draw_switch(canvas: Canvas, frame: ChartFrame, title_end: float) -> Box:
    """Draw a link next to the title: the name of the other quantity, which a click on it plots.

    Parameters
    ----------
    canvas : Canvas
    frame : ChartFrame
    title_end : float, px
        Right end of the title.

    Returns
    -------
    Box
        Area in the window that reacts to a click.
    """
    scale = frame.scale
    size = frame.theme.small_text
    other = DISTANCE if frame.quantity is TIME else TIME
    text = f"{other.short_title} ›"
    left = title_end + _SWITCH_GAP_PX * scale
    canvas.draw_text(text, (left, 0.5 * TOP_PX * scale), color=frame.theme.faint, size=size)
    chart_left, chart_top, _, _ = frame.layout.chart
    padding = _SWITCH_PADDING_PX * scale
    width = canvas.measure_text(text, size) + 2 * padding
    return Box(
        left=round(chart_left + left - padding),
        top=chart_top,
        width=round(width),
        height=round(TOP_PX * scale),
    )


def draw_axes(canvas: Canvas, frame: ChartFrame, scale: ChartScale) -> None:
    """Draw the horizontal grid lines, the values to the left of them and the times below."""
    times = scale.times
    size = frame.theme.small_text
    line_color = mix(frame.theme.panel, frame.theme.ink, _GRID_STRENGTH)
    for value in scale.values.ticks.tolist():
        row = scale.to_row(value)
        canvas.surface.fill(line_color, (round(times.left), round(row), round(times.width), 1))
        position = (times.left - _VALUE_GAP_PX * frame.scale, row)
        canvas.draw_text(f"{value:.6g}", position, size=size, color=frame.theme.faint, anchor="right")
    row = scale.bottom + 0.5 * BOTTOM_PX * frame.scale
    step = _choose_time_step(canvas, frame, times)
    for time in list_ticks(0.0, times.end, step).tolist():
        position = (times.to_column(time), row)
        canvas.draw_text(f"{time:g} s", position, size=size, color=frame.theme.faint, anchor="middle")


def _choose_time_step(canvas: Canvas, frame: ChartFrame, times: TimeScale) -> float:
    """Return the interval of the time labels, s, at which they do not overlap."""
    widest_label = f"{times.end:.0f} s"
    label_width = canvas.measure_text(widest_label, frame.theme.small_text) + _TIME_GAP_PX * frame.scale
    max_intervals = min(MAX_TIME_INTERVALS, times.width / label_width)
    return max(choose_tick_step(times.end, max_intervals), _MIN_TIME_STEP_S)
