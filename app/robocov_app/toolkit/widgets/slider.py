"""Sliders."""

from dataclasses import dataclass

import pygame
from pygame import Rect

from robocov_app.look.colors import mix
from robocov_app.toolkit.widgets.appearance import draw_box, draw_focus_ring, is_visible, shade
from robocov_app.toolkit.widgets.page import Page, Widget

# Lengths in pixels at scale 1.
_TRACK_HEIGHT_PX = 14
_KNOB_WIDTH_PX = 12
_KNOB_RADIUS_PX = 5
_GROOVE_INSET_PX = 4
"""Distance from the edge of the track to the groove, at the top and at the bottom."""

_GROOVE_SHADE = 0.18
_DISABLED_SHADE = 0.35
_FILL_STRENGTH = 0.6
"""Fraction of the accent color in the groove to the left of the knob."""
_HOVERED_STRENGTH = 0.2
"""Fraction of the color of text in the knob under the mouse."""
_HELD_STRENGTH = 0.3
"""The same while the knob is held."""
_MIN_SPAN = 1e-300
"""Avoids a division by zero."""

_KEY_STEPS = {"left": -1, "down": -1, "right": 1, "up": 1}
_KEY_PRESSES_PER_RANGE = 50
"""Number of arrow key presses from one end to the other, if `step` is 0."""
FINE_FRACTION = 0.1
"""Fraction by which drags and arrow keys move a slider while Shift is held down, if `step` is 0."""


@dataclass(frozen=True)
class _Range:
    """Range of values of a slider, and its areas in the window."""

    low: float
    high: float
    step: float  # spacing of the values; 0 if any value is possible
    track: Rect
    target: Rect  # area in which a press moves the knob
    knob_width: int

    @property
    def span(self) -> float:
        """Difference of the values at the ends."""
        return max(self.high - self.low, _MIN_SPAN)

    @property
    def free_width(self) -> int:
        """Distance over which the knob can move, px."""
        return max(self.track.width - self.knob_width, 1)

    def compute_fraction(self, value: float) -> float:
        """Return the position of a value between the ends, from 0 to 1."""
        return min(max((value - self.low) / self.span, 0.0), 1.0)

    def limit(self, value: float) -> float:
        """Return the nearest value that the slider allows."""
        value = min(max(value, self.low), self.high)
        if not self.step:
            return value
        rounded = self.low + round((value - self.low) / self.step) * self.step
        return min(max(rounded, self.low), self.high)


def show_slider(
    page: Page,
    key: str,
    value: float,
    low: float,
    high: float,
    *,
    step: float = 0.0,
    tip: str = "",
    disabled_reason: str = "",
) -> float | None:
    """Show a slider.

    Parameters
    ----------
    page : Page
    key : str
    value, low, high : float
        The current value, and the values at the left and right end.
    step : float
        Spacing of the possible values; 0 if any value is possible.
    tip : str
        Tooltip.
    disabled_reason : str
        Why it cannot be moved; empty if it can.

    Returns
    -------
    float or None
        The new value if the slider was just moved; otherwise None.
    """
    rect = page.cell()
    track = Rect(rect.left, 0, rect.width, page.px(_TRACK_HEIGHT_PX))
    track.centery = rect.centery
    values = _Range(low, high, step, track, rect, page.px(_KNOB_WIDTH_PX))
    new_value = value
    if not disabled_reason:
        new_value = _read_input(page, key, value, values)
    if new_value != value:
        new_value = values.limit(new_value)
    page.add_widget(Widget("slider", key, track, value=new_value, tip=tip), disabled_reason)
    if is_visible(page, rect):
        _draw_slider(page, key, values, values.compute_fraction(new_value), enabled=not disabled_reason)
    if new_value == value:
        return None
    return new_value


def _read_input(page: Page, key: str, value: float, values: _Range) -> float:
    """Return the value after the current mouse or key event; it may lie beyond the ends."""
    track = values.track
    knob_left = track.left + values.free_width * values.compute_fraction(value)
    is_pressed = page.is_pressed(values.target)
    is_knob_press = is_pressed and knob_left <= page.pointer[0] <= knob_left + values.knob_width
    if is_pressed:
        page.active = key
        page.consume_event()
        page.grab_offset = values.knob_width / 2
        page.drag_value = value
        if is_knob_press:
            page.grab_offset = page.pointer[0] - knob_left
    is_dragged = page.active == key and page.is_event(pygame.MOUSEMOTION)
    is_fine = not values.step and bool(pygame.key.get_mods() & pygame.KMOD_SHIFT)
    if is_dragged and is_fine:
        return _drag_finely(page, values)
    if is_dragged or (is_pressed and not is_knob_press):
        fraction = (page.pointer[0] - page.grab_offset - track.left) / values.free_width
        page.drag_value = values.low + values.span * fraction
        return page.drag_value
    name = page.get_key(key)
    steps: float = _KEY_STEPS.get(name.removeprefix("shift+"), 0)
    if is_fine:
        steps *= FINE_FRACTION
    return value + steps * (values.step or values.span / _KEY_PRESSES_PER_RANGE)


def _drag_finely(page: Page, values: _Range) -> float:
    """Return the value after a drag with Shift, which moves the knob by a fraction of the mouse's motion."""
    event = page.get_event()
    if event is not None:
        change = FINE_FRACTION * values.span * event.rel[0] / values.free_width
        page.drag_value = min(max(page.drag_value + change, values.low), values.high)
    # If Shift is released later, the drag continues from the new position of the knob.
    knob_left = values.track.left + values.free_width * values.compute_fraction(page.drag_value)
    page.grab_offset = page.pointer[0] - knob_left
    return page.drag_value


def _draw_slider(page: Page, key: str, values: _Range, fraction: float, *, enabled: bool) -> None:
    """Draw the track, filled up to the knob, and the knob of a slider."""
    theme = page.theme
    track = values.track
    knob_offset = round(fraction * (track.width - values.knob_width))
    groove = track.inflate(0, -page.px(2 * _GROOVE_INSET_PX))
    radius = groove.height // 2 / page.scale
    draw_box(page, groove, shade(page, _GROOVE_SHADE), radius=radius)
    groove.width = max(knob_offset + page.px(_KNOB_WIDTH_PX / 2), groove.height)
    accent = shade(page, _DISABLED_SHADE)
    if enabled:
        accent = theme.accent
    draw_box(page, groove, mix(theme.panel, accent, _FILL_STRENGTH), radius=radius)
    strength = 0.0
    if page.active == key:
        strength = _HELD_STRENGTH
    elif enabled and page.is_hovered(values.target):
        strength = _HOVERED_STRENGTH
    knob = Rect(track.left + knob_offset, track.top, values.knob_width, page.px(_TRACK_HEIGHT_PX))
    draw_box(page, knob, mix(accent, theme.ink, strength), radius=_KNOB_RADIUS_PX)
    draw_focus_ring(page, track, key)
