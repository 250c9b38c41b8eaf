"""Captions to the right of the chart: the displayed value of each curve, and how far it is above the best."""

from collections.abc import Mapping

import pygame

from robocov_app.look.labels import spread_labels
from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import shorten_to_width
from robocov_app.toolkit.overlay import create_flat_canvas, wrap_text
from robocov_app.viewer.chart.curves import map_curve_colors
from robocov_app.viewer.chart.frame import ChartFrame
from robocov_app.viewer.chart.scale import ChartScale, has_headline
from robocov_app.viewer.session.pane import Pane

# Lengths in pixels at scale 1.
MIN_CAPTION_SPACING_PX = 15.0
"""Minimum distance between the centers of captions."""
_LEFT_PX = 9
_RIGHT_PX = 6
_BOTTOM_PX = 8
_NOTE_LINE_PX = 13.0
HEADLINE_TEXT_PX = 23.0
_MAX_HEADLINE_DECIMALS = 3
_HEADLINE_LEFT_PX = 16
_HEADLINE_TITLE_UP_PX = 22
_HEADLINE_NOTE_DOWN_PX = 22
_HEADLINE_NOTE_LINE_PX = 16
_MAX_PERCENT_WITH_DECIMAL = 99.95


def draw_captions(
    screen: pygame.Surface, frame: ChartFrame, value_scale: ChartScale, cut_off_notes: Mapping[int, str]
) -> None:
    """Draw the captions directly onto the window, since they change more often than the cached image.

    Parameters
    ----------
    screen : pygame.Surface
    frame : ChartFrame
    value_scale : ChartScale
        Scale of the value axis with which the image was drawn.
    cut_off_notes : mapping of int to str
        Text about the area that no robot reaches, by the number of the pane; empty where there is none.
    """
    chart = screen.subsurface(pygame.Rect(frame.layout.chart).clip(screen.get_rect()))
    canvas = create_flat_canvas(chart, frame.theme, frame.scale)
    _, values = frame.session.displayed.get_costs(frame.quantity.name)
    panes = [pane for pane in frame.timeline.panes if pane.number in values]
    if not panes:
        return
    if has_headline(frame.layout, frame.timeline):
        _draw_headline(canvas, frame, values[panes[0].number], cut_off_notes[panes[0].number])
        return
    # From top to bottom: the largest value is at the top of the chart.
    panes.sort(key=lambda pane: -values[pane.number])
    spacing = MIN_CAPTION_SPACING_PX * frame.scale
    if any(cut_off_notes.values()):
        spacing += _NOTE_LINE_PX * frame.scale
    if len(panes) == 1:
        _draw_only_caption(canvas, frame, panes[0], value_scale, cut_off_notes[panes[0].number])
        return
    rows = spread_labels(
        [value_scale.to_row(values[pane.number]) for pane in panes],
        gap=spacing,
        low=0.5 * spacing,
        high=frame.layout.chart.height - _BOTTOM_PX * frame.scale,
    )
    for row, pane in zip(rows, panes, strict=True):
        _draw_caption(canvas, frame, pane, values, row=row, note=cut_off_notes[pane.number])


def _draw_headline(canvas: Canvas, frame: ChartFrame, value: float, note: str) -> None:
    """Draw the value of the only curve as a large number, with its name above and a note below it."""
    theme = frame.theme
    left = frame.times.right + _HEADLINE_LEFT_PX * frame.scale
    middle = 0.5 * frame.layout.chart.height
    title = (left, middle - _HEADLINE_TITLE_UP_PX * frame.scale)
    canvas.draw_text(frame.quantity.short_title, title, color=theme.faint, size=theme.small_text)
    width = frame.layout.chart.width - left - _RIGHT_PX * frame.scale
    number = _fit_headline(canvas, value, frame.quantity.unit, width)
    canvas.draw_text(number, (left, middle), bold=True, size=HEADLINE_TEXT_PX)
    row = middle + _HEADLINE_NOTE_DOWN_PX * frame.scale
    for line in wrap_text(note, canvas.scale_text_size(theme.text), width, bold=True):
        canvas.draw_text(line, (left, row), color=theme.error, bold=True, size=theme.text)
        row += _HEADLINE_NOTE_LINE_PX * frame.scale


def _fit_headline(canvas: Canvas, value: float, unit: str, width: float) -> str:
    """Return a value with its unit, with as many decimals as fit into a width, px."""
    for decimals in range(_MAX_HEADLINE_DECIMALS, 0, -1):
        text = f"{value:.{decimals}f} {unit}"
        if canvas.measure_text(text, HEADLINE_TEXT_PX, bold=True) <= width:
            return text
    return f"{value:.0f} {unit}"


def _draw_only_caption(
    canvas: Canvas, frame: ChartFrame, pane: Pane, value_scale: ChartScale, note: str
) -> None:
    """Draw the value of the only curve next to its end, with a note below it in lines that fit."""
    theme = frame.theme
    _, values = frame.session.displayed.get_costs(frame.quantity.name)
    value = values[pane.number]
    left = frame.times.right + _LEFT_PX * frame.scale
    width = frame.layout.chart.width - left - _RIGHT_PX * frame.scale
    note_lines = wrap_text(note, canvas.scale_text_size(theme.small_text), width)
    line_height = _NOTE_LINE_PX * frame.scale
    # The note ends above the numbers of the time axis.
    row = min(value_scale.to_row(value), value_scale.bottom - line_height * len(note_lines))
    color = map_curve_colors(frame.timeline.panes, theme)[pane.number]
    canvas.draw_text(f"{value:.3f}", (left, row), color=color, bold=True, size=theme.small_text)
    for line in note_lines:
        row += line_height
        canvas.draw_text(line, (left, row), color=theme.error, size=theme.small_text)


def _draw_caption(
    canvas: Canvas, frame: ChartFrame, pane: Pane, values: Mapping[int, float], *, row: float, note: str
) -> None:
    """Draw the value of one of several curves, with the name of its controller, and a note below it."""
    size = frame.theme.small_text
    colors = map_curve_colors(frame.timeline.panes, frame.theme)
    left = frame.times.right + _LEFT_PX * frame.scale
    value = values[pane.number]
    width = frame.layout.chart.width - left - _RIGHT_PX * frame.scale
    text = f"{value:.3f}"
    if len(set(values.values())) > 1:
        text += format_above_best(value, min(values.values()))
    text = _add_name(canvas, pane.controller.label, text, width)
    canvas.draw_text(text, (left, row), color=colors[pane.number], bold=True, size=size)
    if note:
        position = (left, row + _NOTE_LINE_PX * frame.scale)
        short_note = shorten_to_width(note, canvas.scale_text_size(size), width)
        canvas.draw_text(short_note, position, color=frame.theme.error, size=size)


def _add_name(canvas: Canvas, name: str, text: str, width: float) -> str:
    """Return a name and `text` in one string; the name is shortened to fit into a width, px."""
    size = canvas.theme.small_text
    name_width = width - canvas.measure_text(f"  {text}", size, bold=True)
    short_name = shorten_to_width(name, canvas.scale_text_size(size), name_width, bold=True)
    return f"{short_name}  {text}"


def format_above_best(value: float, best: float) -> str:
    """Format how far a value is above the best one, in percent.

    Examples
    --------
    >>> format_above_best(2.2, 2.0), format_above_best(5.0, 2.0), format_above_best(2.0, 2.0)
    ('  +10.0%', '  +150%', '  best')
    """
    if value <= best:
        return "  best"
    percent = 100 * (value / best - 1)
    decimals = 1 if percent < _MAX_PERCENT_WITH_DECIMAL else 0
    return f"  +{percent:.{decimals}f}%"
