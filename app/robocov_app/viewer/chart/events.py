"""Marks of events, such as edits and failures, on the chart."""

from robocov_app.look.colors import mix
from robocov_app.render.canvas import Canvas
from robocov_app.viewer.chart.frame import ChartFrame
from robocov_app.viewer.chart.scale import ChartScale

EVENT_REACH_PX = 5
"""Maximum distance, at scale 1, of the pointer from an event that its tag describes."""
_EVENT_SIGNS = {
    "obstacle": "■",
    "robot": "+",
    "failure": "×",
    "law": "◆",
    "limits": "◆",
    "hand": "●",
    "density": "▲",
}
"""Symbol of each kind of event."""
_OTHER_EVENT_SIGN = "•"
_MAX_DESCRIBED_EVENTS = 3
_LINE_STRENGTH = 0.3

# Lengths in pixels at scale 1.
_TEXT_TOP_PX = 6
_TEXT_GAP_PX = 3
_NEXT_TEXT_GAP_PX = 8
_SIGN_WIDTH_PX = 8


def draw_events(canvas: Canvas, frame: ChartFrame, scale: ChartScale) -> None:
    """Draw a line for each event, with its text if there is space, or else with its symbol alone."""
    events = frame.timeline.events
    times = frame.times
    line_color = mix(frame.theme.panel, frame.theme.ink, _LINE_STRENGTH)
    for event in events:
        frame.draw_rule(canvas.surface, times.to_column(event.time), line_color, top=0)
    size = frame.theme.small_text
    row = scale.top + _TEXT_TOP_PX * frame.scale
    free_from = scale.times.left  # column from which on there is space for the next text
    for event in events:
        column = times.to_column(event.time)
        sign = _EVENT_SIGNS.get(event.kind, _OTHER_EVENT_SIGN)
        text = f"{sign} {event.text}"
        width = canvas.measure_text(text, size)
        if column + width > scale.times.right:
            text = sign
            width = round(_SIGN_WIDTH_PX * frame.scale)
        if column >= free_from:
            position = (column + _TEXT_GAP_PX * frame.scale, row)
            canvas.draw_text(text, position, size=size, color=frame.theme.faint)
            free_from = column + width + _NEXT_TEXT_GAP_PX * frame.scale


def describe_events_at(frame: ChartFrame, column: int) -> str:
    """Describe the last few events near a column of the window; empty if there are none."""
    reach = EVENT_REACH_PX * frame.scale
    times = frame.times
    events = [event for event in frame.timeline.events if abs(times.to_column(event.time) - column) < reach]
    return "; ".join(f"{event.time:.1f} s: {event.text}" for event in events[-_MAX_DESCRIBED_EVENTS:])
