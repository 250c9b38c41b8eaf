"""Icons of events, such as edits and failures, at the top of the chart."""

from dataclasses import dataclass

import pygame

from robocov_app.look.colors import mix
from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import render_text
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
_MAX_BADGE_ICONS = 2
"""Maximum number of icons in a badge; of more events, the number replaces the second icon."""

# Lengths in pixels at scale 1.
_BADGE_PX = 18.0
_WIDE_BADGE_PX = 34.0
"""Width of the badge of several events."""
_ICON_PX = 14.0
_BADGE_TOP_PX = 1.0


@dataclass(frozen=True)
class EventBadge:
    """The badge of an event, or of several events that are so close together that their icons would overlap.

    Attributes
    ----------
    events : tuple of SessionEvent
        The events, in the order in which they happened.
    left, right : float, px
        Columns of the window between which the badge is.
    """

    events: tuple[SessionEvent, ...]
    left: float
    right: float


def draw_events(canvas: Canvas, frame: ChartFrame, scale: ChartScale) -> None:
    """Draw a line for each event, and a badge with its icon; events close together share a badge."""
    times = frame.times
    line_color = mix(frame.theme.panel, frame.theme.ink, _LINE_STRENGTH)
    for event in frame.timeline.events:
        frame.draw_rule(canvas.surface, times.to_column(event.time), line_color, top=0)
    for badge in list_badges(frame):
        _draw_badge(canvas, frame, badge, scale.top)


def list_badges(frame: ChartFrame) -> list[EventBadge]:
    """Return the badges of all events, which do not overlap, from left to right."""
    badges: list[EventBadge] = []
    half_width = _BADGE_PX * frame.scale / 2
    for event in sorted(frame.timeline.events, key=lambda event: event.time):
        column = frame.times.to_column(event.time)
        left = column - half_width
        if badges and left < badges[-1].right:
            last = badges[-1]
            right = last.left + _WIDE_BADGE_PX * frame.scale
            badges[-1] = EventBadge((*last.events, event), last.left, right)
        else:
            badges.append(EventBadge((event,), left, column + half_width))
    return badges


def _draw_badge(canvas: Canvas, frame: ChartFrame, badge: EventBadge, top: float) -> None:
    """Draw the icons of the events, or the first icon and the number of the other events."""
    theme = frame.theme
    height = round(_BADGE_PX * frame.scale)
    box = pygame.Rect(0, round(top + _BADGE_TOP_PX * frame.scale), round(badge.right - badge.left), height)
    box.left = round(badge.left)
    edge = mix(theme.panel, theme.ink, _BADGE_EDGE_STRENGTH)
    draw_rounded_box(canvas.surface, box, theme.background, edge=edge, radius=height // 2)
    first_center = (box.left + height / 2, box.centery)
    last_center = (box.right - height / 2, box.centery)
    _draw_icon(canvas, frame, badge.events[0], first_center)
    if len(badge.events) > _MAX_BADGE_ICONS:
        size = round(theme.small_text * frame.scale)
        image = render_text(f"+{len(badge.events) - 1}", size, theme.ink, bold=True)
        canvas.surface.blit(image, image.get_rect(center=last_center))
    elif len(badge.events) > 1:
        _draw_icon(canvas, frame, badge.events[1], last_center)


def _draw_icon(canvas: Canvas, frame: ChartFrame, event: SessionEvent, center: tuple[float, float]) -> None:
    """Draw the icon of an event at a position of the page, px."""
    name = _EVENT_ICONS.get(event.kind, _OTHER_EVENT_ICON)
    icon = render_icon(name, round(_ICON_PX * frame.scale), frame.theme.ink)
    canvas.surface.blit(icon, icon.get_rect(center=center), special_flags=pygame.BLEND_PREMULTIPLIED)


def describe_events_at(frame: ChartFrame, column: int) -> str:
    """Describe the last few events whose badge or line is near a column of the window; empty without any."""
    events: list[SessionEvent] = []
    for badge in list_badges(frame):
        if badge.left <= column <= badge.right:
            events.extend(badge.events)
        else:
            events.extend(event for event in badge.events if _is_near(frame, event, column))
    described = events[-_MAX_DESCRIBED_EVENTS:]
    text = "; ".join(f"{event.time:.1f} s: {event.text}" for event in described)
    if len(events) > len(described):
        return f"{len(events) - len(described)} earlier; {text}"
    return text


def _is_near(frame: ChartFrame, event: SessionEvent, column: int) -> bool:
    """Return whether the line of an event is near a column of the window."""
    return abs(frame.times.to_column(event.time) - column) < EVENT_REACH_PX * frame.scale
