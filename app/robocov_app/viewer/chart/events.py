"""Icons of events, such as edits and failures, at the top of the chart."""

import pygame

from robocov_app.look.colors import mix
from robocov_app.render.canvas import Canvas
from robocov_app.toolkit.overlay import draw_rounded_box
from robocov_app.toolkit.widgets.icons import render_icon
from robocov_app.viewer.chart.frame import ChartFrame
from robocov_app.viewer.chart.scale import ChartScale
from robocov_app.viewer.session.past.curves import SessionEvent

EVENT_REACH_PX = 8
"""Maximum distance, at scale 1, of the pointer from an event that its tag describes."""
_EVENT_ICONS = {
    "obstacle": "wall",
    "robot": "robot",
    "failure": "failure",
    "law": "tune",
    "limits": "tune",
    "hand": "hand",
    "density": "brush",
    "pane": "panel",
}
"""Icon of each kind of event."""
_OTHER_EVENT_ICON = "step"
_MAX_DESCRIBED_EVENTS = 3
_LINE_STRENGTH = 0.3
_BADGE_EDGE_STRENGTH = 0.4

# Lengths in pixels at scale 1.
_BADGE_PX = 18.0
_ICON_PX = 14.0
_BADGE_TOP_PX = 1.0


def draw_events(canvas: Canvas, frame: ChartFrame, scale: ChartScale) -> None:
    """Draw a line for each event, and a badge with its icon; of events close together, the last one's."""
    times = frame.times
    line_color = mix(frame.theme.panel, frame.theme.ink, _LINE_STRENGTH)
    for event in frame.timeline.events:
        frame.draw_rule(canvas.surface, times.to_column(event.time), line_color, top=0)
    for event in select_badges(frame):
        _draw_badge(canvas, frame, event, scale.top)


def select_badges(frame: ChartFrame) -> list[SessionEvent]:
    """Return the events whose badges do not overlap those of later events."""
    selected: list[SessionEvent] = []
    free_until = float("inf")
    for event in reversed(frame.timeline.events):
        column = frame.times.to_column(event.time)
        if column <= free_until:
            selected.append(event)
            free_until = column - _BADGE_PX * frame.scale
    return selected[::-1]


def _draw_badge(canvas: Canvas, frame: ChartFrame, event: SessionEvent, top: float) -> None:
    theme = frame.theme
    side = round(_BADGE_PX * frame.scale)
    box = pygame.Rect(0, round(top + _BADGE_TOP_PX * frame.scale), side, side)
    box.centerx = round(frame.times.to_column(event.time))
    edge = mix(theme.panel, theme.ink, _BADGE_EDGE_STRENGTH)
    draw_rounded_box(canvas.surface, box, theme.background, edge=edge, radius=side // 2)
    name = _EVENT_ICONS.get(event.kind, _OTHER_EVENT_ICON)
    icon = render_icon(name, round(_ICON_PX * frame.scale), theme.ink)
    canvas.surface.blit(icon, icon.get_rect(center=box.center), special_flags=pygame.BLEND_PREMULTIPLIED)


def describe_events_at(frame: ChartFrame, column: int) -> str:
    """Describe the last few events near a column of the window; empty if there are none."""
    reach = EVENT_REACH_PX * frame.scale
    times = frame.times
    events = [event for event in frame.timeline.events if abs(times.to_column(event.time) - column) < reach]
    return "; ".join(f"{event.time:.1f} s: {event.text}" for event in events[-_MAX_DESCRIBED_EVENTS:])
