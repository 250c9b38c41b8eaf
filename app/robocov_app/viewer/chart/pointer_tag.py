"""The tag at the pointer, which shows events or values at the time under the pointer."""

import numpy as np
import pygame

from robocov_app.look.colors import mix
from robocov_app.toolkit.overlay import create_flat_canvas, draw_tag
from robocov_app.toolkit.window.layout import is_inside
from robocov_app.viewer.chart.events import describe_events_at
from robocov_app.viewer.chart.frame import ChartFrame
from robocov_app.viewer.chart.scale import TOP_PX

# Position of the tag relative to the pointer's column and the top of the curves, px at scale 1.
_LEFT_PX = 12
_TOP_GAP_PX = 32  # below the badges of events
_RULE_STRENGTH = 0.35


def draw_pointer_tag(
    screen: pygame.Surface, frame: ChartFrame, pixel: tuple[int, int], time: float, ghost: str = ""
) -> None:
    """Draw the tag onto the window, if the pointer is over the curves or the time slider.

    Parameters
    ----------
    screen : pygame.Surface
    frame : ChartFrame
    pixel : (int, int), px
        Position of the pointer in the window.
    time : float, s
        The time at the pointer.
    ghost : str
        Description of the branch whose curve is at the pointer, which takes precedence; empty without one.
    """
    if not _is_over_axis(frame, pixel):
        return
    theme = frame.theme
    scale = frame.scale
    times = frame.times
    top = frame.layout.chart.top
    column = round(times.to_column(time))
    frame.draw_rule(screen, column, mix(theme.panel, theme.ink, _RULE_STRENGTH), top=top)
    text = ghost or describe_events_at(frame, pixel[0]) or _describe_values(frame, time)
    text_width = create_flat_canvas(screen, theme, scale).measure_text(text)
    left = min(column + _LEFT_PX * scale, times.right - text_width)
    draw_tag(screen, text, (left, top + (TOP_PX + _TOP_GAP_PX) * scale), theme, scale)


def _is_over_axis(frame: ChartFrame, pixel: tuple[int, int]) -> bool:
    """Return whether a pixel of the window is over the curves or the time slider."""
    is_in_box = is_inside(frame.layout.chart, pixel) or is_inside(frame.layout.time_slider, pixel)
    times = frame.times
    return is_in_box and times.left <= pixel[0] <= times.right


def _describe_values(frame: ChartFrame, time: float) -> str:
    """Describe the values of all curves at a time, s."""
    texts = [f"{time:.1f} s"]
    for pane in frame.timeline.panes:
        value = pane.curves[frame.quantity.name].interpolate(time)
        if np.isfinite(value):
            texts.append(f"{pane.controller.label} {value:.3f} {frame.quantity.unit}")
    return "   ".join(texts)
