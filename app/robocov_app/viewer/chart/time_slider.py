"""The time slider below the chart."""

from functools import partial

import pygame

from robocov_app.look.colors import Color, mix
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas
from robocov_app.toolkit.overlay import create_flat_canvas
from robocov_app.viewer.chart.frame import ChartFrame
from robocov_app.viewer.chart.scale import TimeScale

# Lengths in pixels at scale 1.
_THICKNESS_PX = 5
_MIN_THICKNESS_PX = 4
_TITLE_LEFT_PX = 12
_STATE_GAP_PX = 9
_EVENT_DOT_PX = 5
_MIN_EVENT_DOT_RADIUS_PX = 2.0
_HANDLE_RADIUS_PX = 6.5
_HANDLE_RING_PX = 2.0
_EMPTY_BAR_STRENGTH = 0.13
_SIMULATED_BAR_STRENGTH = 0.4


def draw_empty_slider(canvas: Canvas, frame: ChartFrame, times: TimeScale) -> None:
    """Draw the empty bar of the time slider, and a label that shows whether the past is displayed.

    Parameters
    ----------
    canvas : Canvas
        Canvas of the page, on which the time slider is below the chart.
    frame : ChartFrame
    times : TimeScale
        Time axis of the page.
    """
    theme = frame.theme
    top = frame.layout.chart.height
    middle = top + 0.5 * frame.layout.time_slider.height
    canvas.surface.fill(theme.panel, pygame.Rect(0, top, *frame.layout.time_slider.size))
    thickness = _get_thickness(frame)
    bar = pygame.Rect(
        round(times.left), round(middle - thickness / 2), round(times.right - times.left), thickness
    )
    color = mix(theme.panel, theme.ink, _EMPTY_BAR_STRENGTH)
    pygame.draw.rect(canvas.surface, color, bar, border_radius=thickness)
    title_position = (_TITLE_LEFT_PX * frame.scale, middle)
    canvas.draw_text("Time", title_position, color=theme.faint, size=theme.small_text)
    _draw_state(canvas, frame, times.right + _STATE_GAP_PX * frame.scale, middle)


def _draw_state(canvas: Canvas, frame: ChartFrame, left: float, middle: float) -> None:
    """Draw a label: whether the past is shown, or the present, which may be paused or have a thinned past."""
    theme = frame.theme
    size = theme.small_text
    if not frame.timeline.is_live:
        canvas.draw_text("Past", (left, middle), color=theme.accent, bold=True, size=size)
        return
    state = "Live" if frame.session.playback.is_playing else "Paused"
    color = theme.start if frame.session.playback.is_playing else theme.faint
    if not frame.timeline.history.thinned:
        canvas.draw_text(state, (left, middle), color=color, bold=True, size=size)
        return
    text = f"{state} (older history is coarser)"
    if left + canvas.measure_text(text, size=size) > frame.layout.time_slider.width:
        text = f"{state} (coarser)"
    canvas.draw_text(text, (left, middle), color=color, size=size)


def draw_slider_state(screen: pygame.Surface, frame: ChartFrame) -> None:
    """Draw the changing parts of the time slider onto the window: bar, events, and handle."""
    theme = frame.theme
    times = frame.times
    timeline = frame.timeline
    canvas = create_flat_canvas(screen, theme, frame.scale)
    middle = frame.layout.time_slider.top + 0.5 * frame.layout.time_slider.height
    column = times.to_column(frame.session.displayed.time)
    end_column = times.to_column(timeline.end_time)
    # Gray up to the simulated time; if the past is displayed, colored up to the displayed time.
    _fill_bar(screen, frame, end_column, mix(theme.panel, theme.ink, _SIMULATED_BAR_STRENGTH))
    if not timeline.is_live:
        _fill_bar(screen, frame, column, theme.accent)
        frame.draw_rule(screen, column, theme.accent, top=frame.layout.chart.top)
    dot_radius = max(_MIN_EVENT_DOT_RADIUS_PX, round(_EVENT_DOT_PX * frame.scale) / 2)
    dot = partial(sprites.render_dot, dot_radius, theme.ink)
    for event in timeline.events:
        canvas.draw_sprite(dot, (times.to_column(event.time), middle))
    handle = partial(
        sprites.render_disc,
        round(2 * _HANDLE_RADIUS_PX * frame.scale) / 2,
        fill=theme.ink if timeline.is_live else theme.accent,
        ring=theme.background,
        ring_width=_HANDLE_RING_PX * frame.scale,
        edge=theme.faint,
    )
    canvas.draw_sprite(handle, (column, middle))


def _fill_bar(screen: pygame.Surface, frame: ChartFrame, end: float, color: Color) -> None:
    """Fill the bar of the time slider from its start to column `end` of the window."""
    thickness = _get_thickness(frame)
    middle = frame.layout.time_slider.top + 0.5 * frame.layout.time_slider.height
    left = round(frame.times.to_column(0.0))
    width = max(round(end) - left, thickness)
    bar = pygame.Rect(left, round(middle - thickness / 2), width, thickness)
    pygame.draw.rect(screen, color, bar, border_radius=thickness)


def _get_thickness(frame: ChartFrame) -> int:
    """Return the thickness of the bar, px."""
    return max(_MIN_THICKNESS_PX, round(_THICKNESS_PX * frame.scale))
