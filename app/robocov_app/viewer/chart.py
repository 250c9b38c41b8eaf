"""The chart of the cost against time, and the time line below it."""

from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

import numpy as np
import pygame

from robocov.arrays import Array
from robocov_app.look.axes import MAX_TIME_INTERVALS, choose_tick_step, list_ticks
from robocov_app.look.colors import Color, mix
from robocov_app.look.labels import spread_labels
from robocov_app.look.robot_colors import choose_curve_colors
from robocov_app.look.theme import Theme
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas
from robocov_app.render.density_text import describe_density
from robocov_app.render.fonts import shorten_to_width
from robocov_app.toolkit.layout import Box, Layout, is_inside
from robocov_app.toolkit.overlay import create_flat_canvas, draw_tag
from robocov_app.viewer.chart_scale import (
    BOTTOM_PX,
    TOP_PX,
    ChartScale,
    TimeScale,
    build_chart_scale,
    build_time_scale,
)
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.pane import Pane
from robocov_app.viewer.session.past.curves import DISTANCE, TIME, Curve, GhostCurve, PlottedQuantity

REFRESH_INTERVAL_S = 0.1
"""Curves that grow are drawn again after this time, not in each frame."""
LABEL_GAP_PX = 15.0
"""Minimum distance of the captions at the right, at scale 1."""
EVENT_REACH_PX = 5
"""The pointer shows an event within this distance, at scale 1."""
GHOST_REACH_PX = 6.0
"""A click within this distance of the curve of another branch opens it, at scale 1."""
MAX_GHOST_POINTS_WITHOUT_GAPS = 12
"""Curves of other branches with at least this many points are dashed."""
MIN_POINTS_TO_THIN = 400
_SAMPLES_PER_PX = 1.5
_SMALL_GAP_PERCENT = 99.95
"""Gaps to the best curve below this have a decimal."""
_EVENT_GLYPHS = {
    "obstacle": "■",
    "robot": "+",
    "failure": "×",
    "law": "◆",
    "limits": "◆",
    "hand": "●",
    "density": "▲",
}
"""Sign of each kind of event."""
_OTHER_EVENT_GLYPH = "•"


class GhostLine(NamedTuple):
    """Curve of another branch as it is drawn.

    Attributes
    ----------
    node : int
        Node at which the branch ends.
    points : (k, 2) array, px
        On the page of the chart.
    """

    node: int
    points: Array


class Chart:
    """Chart and time line of a session. The parts that seldom change are drawn once, on a page.

    Parameters
    ----------
    viewer : Presenter

    Attributes
    ----------
    hover : (x, y) or None, px
        Position of the pointer in the window.
    ghosts : list of GhostLine
        Curves of other branches on the page.
    switch_box : Box or None
        Box in the window that switches to the other quantity; None if there is none.
    """

    def __init__(self, viewer: Presenter) -> None:
        self.viewer = viewer
        self.hover: tuple[int, int] | None = None
        self.ghosts: list[GhostLine] = []
        self.switch_box: Box | None = None
        self._quantity = DISTANCE
        self._page: pygame.Surface | None = None
        self._scale: ChartScale
        self._page_key: object = None
        self._page_samples: object = None
        self._page_time = -1.0

    def arrange(self, layout: Layout, theme: Theme) -> None:
        """Adopt the layout and the theme of the window."""
        self.layout = layout
        self.theme = theme
        self._page = None

    @property
    def plotted(self) -> PlottedQuantity:
        """The quantity that the chart shows."""
        return self._quantity if self._has_times else DISTANCE

    @property
    def times(self) -> TimeScale:
        """The axis of times, in pixels of the window."""
        return build_time_scale(self.layout, self.viewer.session.timeline, self.theme.small_text)

    @property
    def _has_times(self) -> bool:
        """Whether mean times are known, since robots are not equally fast."""
        return any(len(pane.curves["time"]) for pane in self.viewer.session.timeline.panes)

    @property
    def _ghost_curves(self) -> list[GhostCurve]:
        """Curves of the plotted quantity in other branches."""
        ghosts = self.viewer.session.timeline.ghosts
        return [ghost for ghost in ghosts if ghost.quantity == self.plotted.name]

    def switch_quantity(self) -> str:
        """Show the other quantity, and return the status message."""
        if not self._has_times:
            return "all robots are equally fast: the mean time is proportional to the mean distance"
        self._quantity = TIME if self.plotted is DISTANCE else DISTANCE
        self._page = None
        title = self._quantity.title
        return f"plotted: {title[:1].lower()}{title[1:]}"

    def is_on_switch(self, pixel: tuple[int, int]) -> bool:
        """Return whether a click at a pixel of the window switches the quantity."""
        return self.switch_box is not None and is_inside(self.switch_box, pixel)

    def find_ghost(self, pixel: tuple[int, int]) -> int | None:
        """Return the node of the branch whose curve is at a pixel of the window; None without one."""
        point = np.array([pixel[0], pixel[1] - self.layout.chart[1]])
        nearest_node = None
        nearest_distance = GHOST_REACH_PX * self.layout.scale
        for ghost in self.ghosts:
            distance = float(np.hypot(*(ghost.points - point).T).min())
            if distance < nearest_distance:
                nearest_distance = distance
                nearest_node = ghost.node
        return nearest_node

    def to_time(self, column: float) -> float:
        """Return the time, s, of a column of the window, within the session."""
        end_time = self.viewer.session.timeline.end_time
        return float(np.clip(self.times.to_time(column), 0.0, end_time))

    def to_column(self, time: float) -> float:
        """Return the column of a time, s, in the window."""
        return self.times.to_column(time)

    def draw(self, screen: pygame.Surface) -> None:
        """Draw the chart and the time line onto the window."""
        if self._update_page_key():
            self._draw_page()
        assert self._page is not None
        screen.blit(self._page, self.layout.chart[:2])
        self._draw_values(screen)
        self._draw_present(screen)
        self._draw_hover(screen)

    def _update_page_key(self) -> bool:
        """Update the key of what the page shows; return whether the page has to be drawn again."""
        timeline = self.viewer.session.timeline
        curves = self._list_curves()
        samples = [(len(curve), curve.last_time, curve.interpolate(np.inf)) for curve in curves]
        key = (
            tuple(pane.number for pane in timeline.panes),
            len(timeline.events),
            len(timeline.ghosts),
            self.times,
            self.plotted,
            self.viewer.costs.state,
            None if timeline.is_live else self.viewer.session.displayed.time,
            timeline.past_version,
        )
        is_old = self.viewer.now - self._page_time >= REFRESH_INTERVAL_S
        has_grown = is_old and samples != self._page_samples
        if self._page is not None and key == self._page_key and not has_grown:
            return False
        self._page_key = key
        self._page_samples = samples
        return True

    def _list_curves(self) -> list[Curve]:
        """Return each pane's curve of the plotted quantity."""
        return [pane.curves[self.plotted.name] for pane in self.viewer.session.timeline.panes]

    def _draw_page(self) -> None:
        """Draw the parts that seldom change: axes, events, curves and the time line."""
        layout = self.layout
        size = (layout.chart[2], layout.chart[3] + layout.track[3])
        self._page = pygame.Surface(size, 0, 32)
        self._page_time = self.viewer.now
        canvas = create_flat_canvas(self._page, self.theme, layout.scale)
        canvas.surface.fill(self.theme.panel)
        values = [curve.values for curve in self._list_curves()]
        values += [ghost.values for ghost in self._ghost_curves]
        self._scale = build_chart_scale(self.times, layout, values)
        self._draw_title(canvas)
        self._draw_axes(canvas)
        self._draw_events(canvas)
        self._draw_ghosts(canvas)
        self._draw_curves(canvas)
        self._draw_time_line(canvas)

    def _draw_title(self, canvas: Canvas) -> None:
        """Write the names of the plotted quantity and of the other one, and the state of the computation."""
        scale = self.layout.scale
        row = 0.5 * TOP_PX * scale
        density = describe_density(self.viewer.session.displayed.environment)
        weighted = ", weighed by φ" if density else ""
        title = f"{self.plotted.title}{weighted}, {self.plotted.unit}"
        canvas.draw_text(title, (12 * scale, row), bold=True)
        title_end = 12 * scale + canvas.measure_text(title, bold=True)
        self._draw_switch(canvas, title_end + 16 * scale)
        state = self.viewer.costs.state
        right = self._scale.times.right
        if state and right - canvas.measure_text(state) > title_end:
            canvas.draw_text(state, (right, row), color=self.theme.faint, anchor="right")

    def _draw_switch(self, canvas: Canvas, left: float) -> None:
        """Write the name of the other quantity next to the title, if there is one; a click plots it."""
        self.switch_box = None
        if not self._has_times:
            return
        scale = self.layout.scale
        size = self.theme.small_text
        other = DISTANCE if self.plotted is TIME else TIME
        text = f"{other.short_title} ›"
        canvas.draw_text(text, (left, 0.5 * TOP_PX * scale), color=self.theme.faint, size=size)
        chart_left, chart_top, _, _ = self.layout.chart
        width = canvas.measure_text(text, size) + 12 * scale
        self.switch_box = (
            round(chart_left + left - 6 * scale),
            chart_top,
            round(width),
            round(TOP_PX * scale),
        )

    def _draw_axes(self, canvas: Canvas) -> None:
        """Draw the grid, its values at the left and the times below it."""
        scale = self.layout.scale
        times = self._scale.times
        size = self.theme.small_text
        faint = self.theme.faint
        line_color = mix(self.theme.panel, self.theme.ink, 0.12)
        for value in self._scale.values.ticks.tolist():
            row = self._scale.to_row(value)
            canvas.surface.fill(line_color, (round(times.left), round(row), round(times.width), 1))
            label = f"{value:.6g}"
            canvas.draw_text(label, (times.left - 7 * scale, row), size=size, color=faint, anchor="right")
        label_width = canvas.measure_text(f"{times.end:.0f} s", size) + 4 * scale
        max_intervals = min(MAX_TIME_INTERVALS, times.width / label_width)
        step = max(choose_tick_step(times.end, max_intervals), 1.0)
        row = self.layout.chart[3] - 0.5 * BOTTOM_PX * scale
        for time in list_ticks(0.0, times.end, step).tolist():
            center = (times.to_column(time), row)
            canvas.draw_text(f"{time:g} s", center, size=size, color=faint, anchor="middle")

    def _draw_events(self, canvas: Canvas) -> None:
        """Draw a line for each event, with its text if there is space, otherwise with its sign alone."""
        events = self.viewer.session.timeline.events
        line_color = mix(self.theme.panel, self.theme.ink, 0.3)
        for event in events:
            self._draw_rule(canvas.surface, self.to_column(event.time), line_color, top=0)
        scale = self.layout.scale
        size = self.theme.small_text
        row = self._scale.top + 6 * scale
        free_from = self._scale.times.left
        for event in events:
            column = self.to_column(event.time)
            glyph = _EVENT_GLYPHS.get(event.kind, _OTHER_EVENT_GLYPH)
            text = f"{glyph} {event.text}"
            width = canvas.measure_text(text, size)
            if column + width > self._scale.times.right:
                text = glyph
                width = round(8 * scale)
            if column >= free_from:
                canvas.draw_text(text, (column + 3 * scale, row), size=size, color=self.theme.faint)
                free_from = column + width + 8 * scale

    def _draw_ghosts(self, canvas: Canvas) -> None:
        """Draw the curves of other branches, pale and dashed, with their names at their ends."""
        scale = self.layout.scale
        size = self.theme.small_text
        self.ghosts = []
        for ghost in self._ghost_curves:
            points = self._scale.to_points(ghost.times, ghost.values)
            self.ghosts.append(GhostLine(ghost.node, points))
            color = mix(self.theme.panel, self.theme.get_controller_color(ghost.controller), 0.45)
            is_dashed = len(points) >= MAX_GHOST_POINTS_WITHOUT_GAPS
            for k in range(len(points) - 1):
                if not is_dashed or k % 4 < 3:
                    canvas.draw_line(points[k].tolist(), points[k + 1].tolist(), color)
            if len(points):
                name_width = canvas.measure_text(ghost.description, size)
                right = max(points[-1][0] - 4 * scale, self._scale.times.left + name_width)
                place = (right, points[-1][1] - 9 * scale)
                canvas.draw_text(ghost.description, place, size=size, color=color, anchor="right")

    def _draw_curves(self, canvas: Canvas) -> None:
        """Draw the curve of each pane."""
        panes = self.viewer.session.timeline.panes
        colors = map_curve_colors(panes, self.theme)
        for pane in panes:
            curve = pane.curves[self.plotted.name]
            points = thin_points(self._scale.to_points(curve.times, curve.values))
            if len(points) > 1:
                segments = np.hstack([points[:-1], points[1:]])
                canvas.draw_segments(segments, colors[pane.number], canvas.scale_width(1.8))

    def _draw_time_line(self, canvas: Canvas) -> None:
        """Draw the empty bar of the time line, and whether the present or the past is shown."""
        theme = self.theme
        scale = self.layout.scale
        times = self._scale.times
        top = self.layout.chart[3]
        middle = top + 0.5 * self.layout.track[3]
        canvas.surface.fill(theme.panel, pygame.Rect(0, top, *self.layout.track[2:]))
        thickness = self._bar_thickness
        bar = pygame.Rect(
            round(times.left), round(middle - thickness / 2), round(times.right - times.left), thickness
        )
        bar_color = mix(theme.panel, theme.ink, 0.13)
        pygame.draw.rect(canvas.surface, bar_color, bar, border_radius=thickness)
        canvas.draw_text("time", (12 * scale, middle), color=theme.faint, size=theme.small_text)
        self._draw_state(canvas, times.right + 9 * scale, middle)

    def _draw_state(self, canvas: Canvas, left: float, middle: float) -> None:
        """Write whether the present is shown, and whether the past is coarser than it was."""
        timeline = self.viewer.session.timeline
        size = self.theme.small_text
        if not timeline.is_live:
            canvas.draw_text("past", (left, middle), color=self.theme.final, bold=True, size=size)
            return
        if not timeline.history.thinned:
            canvas.draw_text("live", (left, middle), color=self.theme.start, bold=True, size=size)
            return
        text = "live · past thinned"
        if left + canvas.measure_text(text, size=size) > self.layout.track[2]:
            text = "thinned"
        canvas.draw_text(text, (left, middle), color=self.theme.start, size=size)

    @property
    def _bar_thickness(self) -> int:
        """Thickness of the time line, px."""
        return max(4, round(5 * self.layout.scale))

    def _draw_values(self, screen: pygame.Surface) -> None:
        """Write the current value of each curve at the right, with the gap to the best.

        Values are newer than the page, so they are not part of it.
        """
        session = self.viewer.session
        scale = self.layout.scale
        chart = screen.subsurface(pygame.Rect(self.layout.chart).clip(screen.get_rect()))
        canvas = create_flat_canvas(chart, self.theme, scale)
        _, values = session.displayed.get_costs(self.plotted.name)
        colors = map_curve_colors(session.timeline.panes, self.theme)
        panes = [pane for pane in session.timeline.panes if pane.number in values]
        panes.sort(key=lambda pane: -values[pane.number])
        rows = spread_labels(
            [self._scale.to_row(values[pane.number]) for pane in panes],
            gap=LABEL_GAP_PX * scale,
            low=0.5 * LABEL_GAP_PX * scale,
            high=self.layout.chart[3] - 8 * scale,
        )
        left = self.times.right + 9 * scale
        for row, pane in zip(rows, panes, strict=True):
            text = f"{values[pane.number]:.3f}"
            if len(values) > 1:
                text = f"{text}{format_gap(values[pane.number], min(values.values()))}"
                free_width = chart.get_width() - left - 6 * scale
                text = self._add_name(canvas, pane.controller.label, text, free_width)
            color = colors[pane.number]
            canvas.draw_text(text, (left, row), color=color, bold=True, size=self.theme.small_text)

    def _add_name(self, canvas: Canvas, name: str, text: str, width: float) -> str:
        """Return a name and a text, the name shortened so that both fit into a width, px."""
        size = self.theme.small_text
        name_width = width - canvas.measure_text(f"  {text}", size, bold=True)
        return f"{shorten_to_width(name, canvas.scale_text_size(size), name_width, True)}  {text}"

    def _draw_rule(self, surface: pygame.Surface, column: float, color: Color, *, top: int) -> None:
        """Draw a vertical line over the curves; the chart is at row `top` of the surface."""
        scale = self.layout.scale
        height = self.layout.chart[3] - (TOP_PX + BOTTOM_PX) * scale
        surface.fill(color, (round(column), round(top + TOP_PX * scale), 1, round(height)))

    def _draw_present(self, screen: pygame.Surface) -> None:
        """Draw the end of the session, the displayed time and the events on the time line."""
        theme = self.theme
        scale = self.layout.scale
        timeline = self.viewer.session.timeline
        canvas = create_flat_canvas(screen, theme, scale)
        middle = self.layout.track[1] + 0.5 * self.layout.track[3]
        column = self.to_column(self.viewer.session.displayed.time)
        end_column = self.to_column(timeline.end_time)
        self._draw_bar(screen, end_column, middle, mix(theme.panel, theme.ink, 0.4))
        if not timeline.is_live:
            self._draw_bar(screen, column, middle, theme.final)
            self._draw_rule(screen, column, theme.final, top=self.layout.chart[1])
        dot = partial(sprites.render_dot, max(2.0, round(5 * scale) / 2), theme.ink)
        for event in timeline.events:
            canvas.draw_sprite(dot, (self.to_column(event.time), middle))
        fill = theme.ink if timeline.is_live else theme.final
        radius = round(2 * 6.5 * scale) / 2
        handle = partial(
            sprites.render_disc,
            radius,
            fill=fill,
            ring=theme.background,
            ring_width=2.0 * scale,
            edge=theme.faint,
        )
        canvas.draw_sprite(handle, (column, middle))

    def _draw_bar(self, screen: pygame.Surface, end: float, middle: float, color: Color) -> None:
        """Fill the time line from its start to a column."""
        thickness = self._bar_thickness
        left = round(self.to_column(0.0))
        width = max(round(end) - left, thickness)
        bar = pygame.Rect(left, round(middle - thickness / 2), width, thickness)
        pygame.draw.rect(screen, color, bar, border_radius=thickness)

    def _draw_hover(self, screen: pygame.Surface) -> None:
        """Write the events or the values at the pointer."""
        if self.hover is None or not self._is_over_axis(self.hover):
            return
        theme = self.theme
        scale = self.layout.scale
        top = self.layout.chart[1]
        time = self.to_time(self.hover[0])
        text = self._describe_events(self.hover[0]) or self._describe_values(time)
        column = round(self.to_column(time))
        self._draw_rule(screen, column, mix(theme.panel, theme.ink, 0.35), top=top)
        text_width = create_flat_canvas(screen, theme, scale).measure_text(text)
        left = min(column + 12 * scale, self.times.right - text_width)
        draw_tag(screen, text, (left, top + (TOP_PX + 16) * scale), theme, scale)

    def _is_over_axis(self, pixel: tuple[int, int]) -> bool:
        """Return whether a pixel of the window is over the curves or the time line."""
        times = self.times
        is_in_box = is_inside(self.layout.chart, pixel) or is_inside(self.layout.track, pixel)
        return is_in_box and times.left <= pixel[0] <= times.right

    def _describe_events(self, column: int) -> str:
        """Return the last events near a column of the window as text; empty if there are none."""
        reach = EVENT_REACH_PX * self.layout.scale
        events = self.viewer.session.timeline.events
        near = [event for event in events if abs(self.to_column(event.time) - column) < reach]
        return "; ".join(f"{event.time:.1f} s: {event.text}" for event in near[-3:])

    def _describe_values(self, time: float) -> str:
        """Return the values of all curves at a time, s, as text."""
        texts = [f"{time:.1f} s"]
        for pane in self.viewer.session.timeline.panes:
            value = pane.curves[self.plotted.name].interpolate(time)
            if np.isfinite(value):
                texts.append(f"{pane.controller.label} {value:.3f} {self.plotted.unit}")
        return "   ".join(texts)


def format_gap(value: float, best: float) -> str:
    """Return how much a value is above the best one, as text.

    Examples
    --------
    >>> format_gap(2.2, 2.0), format_gap(5.0, 2.0), format_gap(2.0, 2.0)
    ('  +10.0 %', '  +150 %', '  best')
    """
    if value <= best:
        return "  best"
    percent = 100 * (value / best - 1)
    decimals = 1 if percent < _SMALL_GAP_PERCENT else 0
    return f"  +{percent:.{decimals}f} %"


def map_curve_colors(panes: Iterable[Pane], theme: Theme) -> dict[int, Color]:
    """Return the color of the curve of each pane by its number."""
    controllers = {pane.number: pane.controller.name for pane in panes}
    colors = choose_curve_colors(list(controllers.values()), theme)
    return dict(zip(controllers, colors, strict=True))


def thin_points(points: Array) -> Array:
    """Drop points of a curve, (k, 2) px, that are too close to the next one to be told apart.

    The last point always stays, since the curve grows there.
    """
    if len(points) < MIN_POINTS_TO_THIN:
        return points
    columns = np.rint(points[:, 0] * _SAMPLES_PER_PX)
    is_last_in_column = np.append(columns[1:] != columns[:-1], True)
    return np.asarray(points[is_last_in_column])
