"""The plot of the cost against time, and the time line below it."""

import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np
import pygame

from robocov.arrays import Array
from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import Theme
from robocov_app.render import sprites
from robocov_app.render.camera import round_length
from robocov_app.render.canvas import Canvas
from robocov_app.render.density import density_label
from robocov_app.render.fonts import shortened, text_width
from robocov_app.toolkit.layout import Box, Layout, is_inside
from robocov_app.toolkit.overlay import create_flat_canvas, draw_tag
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.curves import DISTANCE, TIME, PlottedQuantity
from robocov_app.viewer.session.pane import Pane

LEFT, RIGHT, TOP, BOTTOM = 52, 70, 26, 20  # pixels at scale 1 round the plot
SHORTEST = 10.0  # seconds that the axis shows at least
REFRESHED = 0.1  # seconds after which growing curves are drawn anew
_GRASP = 6.0  # pixels at scale 1 from a ghost curve within which a click enters its branch
_TOUCHES = "obstacle", "robot", "failure", "law", "limits", "hand", "density"
_GLYPHS = dict(zip(_TOUCHES, "■+×◆◆●▲", strict=True))


def time_axis(end: float) -> float:
    """Return where the axis of time ends: a little beyond now, in steps, so that it rests mostly.

    >>> [time_axis(t) for t in (0.0, 9.0, 9.9, 61.0)]
    [10.0, 10.0, 15.0, 70.0]
    """
    if end <= 0.96 * SHORTEST:
        return SHORTEST
    step = max(round_length(max(end / 4.0, 1.0)) / 2.0 if end < 40.0 else round_length(end / 5.0), 5.0)
    return float(np.ceil((end * 1.03 + 1e-9) / step) * step)


def value_axis(low: float, high: float) -> tuple[float, float, float]:
    """Return begin, end and step of an axis that holds values between `low` and `high`.

    It begins at zero unless that would leave the curves in the upper fifth.

    >>> value_axis(0.9, 3.2)
    (0.0, 3.36, 1.0)
    """
    if not np.isfinite([low, high]).all() or high <= 0.0:
        return 0.0, 1.0, 0.5
    begin = 0.0 if low < 0.8 * high else max(low - 1.5 * (high - low) - 0.02 * high, 0.0)
    step = round_length(max((high - begin) / 2.5, 1e-6))
    begin = float(np.floor(begin / step) * step)
    return begin, float(f"{high + 0.05 * (high - begin):.6g}"), step


class Chart:
    """Draws the plot and the time line of a session; keeps what changes seldom."""

    def __init__(self, viewer: Presenter) -> None:
        self.viewer = viewer
        self._page: pygame.Surface | None = None
        self._place: Callable[[Array, Array], Array]
        self._key: object = None
        self._samples: object = None
        self._drawn_at, self._wanted = -1.0, DISTANCE
        self._other: Box | None = None
        self._ghosts: list[tuple[int, Array]] = []
        self.hover: tuple[int, int] | None = None  # where the cursor is in the window

    def arrange(self, layout: Layout, theme: Theme) -> None:
        self.layout, self.theme, self._page = layout, theme, None

    @property
    def plotted(self) -> PlottedQuantity:
        return self._wanted if self._timed else DISTANCE

    @property
    def _timed(self) -> bool:
        return any(len(pane.curves["time"]) for pane in self.viewer.session.timeline.panes)

    def switch(self) -> str:
        if not self._timed:
            return "all robots are equally fast: the mean time goes as the mean distance"
        self._wanted, self._page = TIME if self.plotted is DISTANCE else DISTANCE, None
        return f"plotted: {self._wanted.title[:1].lower()}{self._wanted.title[1:]}"

    def offers(self, at: tuple[int, int]) -> bool:
        return self._other is not None and is_inside(self._other, at)

    def ghost_at(self, at: tuple[int, int]) -> int | None:
        at = at[0], at[1] - self.layout.chart[1]
        near = [(float(np.hypot(*(points - at).T).min()), node) for node, points in self._ghosts]
        best = min(near, default=(np.inf, 0))
        return best[1] if best[0] < _GRASP * self.layout.scale else None

    @property
    def _span(self) -> tuple[float, float, float]:
        """Left and right of the axis in pixels of the window, and the time at its end."""
        left, _, width, _ = self.layout.chart
        scale, panes, beside = (
            self.layout.scale,
            self.viewer.session.timeline.panes,
            RIGHT * self.layout.scale,
        )
        if len(panes) > 1:  # their names stand there, too
            size = round(self.theme.small_text * scale)
            names = (text_width(f"{pane.controller.label}  8.888  +88.8 %", size, True) for pane in panes)
            beside = min(max(names) + 20 * scale, 0.4 * width)
        ghosts = max((float(ghost.times[-1]) for ghost in self.viewer.session.timeline.ghosts), default=0.0)
        return (
            left + LEFT * scale,
            left + width - beside,
            time_axis(max(self.viewer.session.timeline.end_time, ghosts)),
        )

    def time_at(self, x: float) -> float:
        left, right, end = self._span
        return float(
            np.clip((x - left) / max(right - left, 1.0) * end, 0.0, self.viewer.session.timeline.end_time)
        )

    def column(self, time: Any) -> Any:
        left, right, end = self._span
        return left + (right - left) * time / end

    def draw(self, screen: pygame.Surface) -> None:
        session, layout = self.viewer.session, self.layout
        curves = [pane.curves[self.plotted.name] for pane in session.timeline.panes]
        samples = [(len(curve), curve.last_time, curve.interpolate(np.inf)) for curve in curves]
        panes = tuple(pane.number for pane in session.timeline.panes)
        told = panes, len(session.timeline.events), len(session.timeline.ghosts), self._span, self.plotted
        rest = (
            *told,
            self.viewer.costs.state,
            None if session.timeline.is_live else session.displayed.time,
            session.timeline.past_version,
        )
        # curves grow sixty times a second, which nobody sees
        old = self.viewer.now - self._drawn_at >= REFRESHED
        if self._page is None or rest != self._key or (old and samples != self._samples):
            self._page = pygame.Surface((layout.chart[2], layout.chart[3] + layout.track[3]), 0, 32)
            self._key, self._samples, self._drawn_at = rest, samples, self.viewer.now
            canvas = create_flat_canvas(self._page, self.theme, layout.scale)
            self._plot(canvas)
            self._track(canvas)
        screen.blit(self._page, layout.chart[:2])
        self._values(screen)
        self._cursor(screen)
        self._hovered(screen)

    def _plot(self, canvas: Canvas) -> None:
        theme, scale, session, what = self.theme, self.layout.scale, self.viewer.session, self.plotted
        canvas.surface.fill(theme.panel)
        left, right, end = self._span
        height = self.layout.chart[3]
        top, bottom = TOP * scale, height - BOTTOM * scale
        weighed = ", weighed by φ" if density_label(session.displayed.environment) else ""
        title = f"{what.title}{weighed}, {what.unit}"
        canvas.text(title, (12 * scale, 0.5 * TOP * scale), bold=True)
        named = 12 * scale + canvas.text_width(title, bold=True)
        self._offer(canvas, named)
        state = self.viewer.costs.state
        if state and right - canvas.text_width(state) > named:
            canvas.text(state, (right, 0.5 * TOP * scale), color=theme.faint, anchor="right")
        ghosts = [ghost for ghost in session.timeline.ghosts if ghost.quantity == what.name]
        values = [pane.curves[what.name].values for pane in session.timeline.panes] + [
            ghost.values for ghost in ghosts
        ]
        some = np.concatenate([v for v in values if len(v)] or [np.array([np.nan])])
        low, high, step = value_axis(float(some.min()), float(some.max()))

        def place(time: Array, cost: Array) -> Array:
            return np.column_stack([self.column(time), bottom + (top - bottom) * (cost - low) / (high - low)])

        self._place, faint = place, mix(theme.panel, theme.ink, 0.12)
        note = partial(canvas.text, size=theme.small_text, color=theme.faint)
        for mark in np.arange(low, high, step):
            y = bottom - (bottom - top) * (mark - low) / (high - low)
            canvas.surface.fill(faint, (round(left), round(y), round(right - left), 1))
            note(f"{mark:.6g}", (left - 7 * scale, y), anchor="right")
        seconds = max(round_length(end / 6.0), 1.0)
        room = max(seconds * (right - left) / end, 1.0)  # px from one to the next
        seconds *= math.ceil((canvas.text_width(f"{end:.0f} s", theme.small_text) + 4 * scale) / room)
        for mark in np.arange(0.0, end + 1e-9, seconds):
            note(f"{mark:g} s", (self.column(mark), height - 0.5 * BOTTOM * scale), anchor="middle")
        for event in session.timeline.events:
            self._rule(canvas.surface, self.column(event.time), mix(theme.panel, theme.ink, 0.3), 0)
        free = left
        for event in session.timeline.events:  # in words where there is room
            x, glyph = self.column(event.time), _GLYPHS.get(event.kind, "•")
            words = f"{glyph} {event.text}"
            wide = canvas.text_width(words, theme.small_text)
            if x + wide > right:
                words, wide = glyph, round(8 * scale)
            if x >= free:
                note(words, (x + 3 * scale, top + 6 * scale))
                free = x + wide + 8 * scale
        self._ghosts = [(ghost.node, place(ghost.times, ghost.values)) for ghost in ghosts]
        for ghost, (_, points) in zip(ghosts, self._ghosts, strict=True):
            color = mix(theme.panel, theme.get_controller_color(ghost.controller), 0.45)
            for k in range(len(points) - 1):
                if k % 4 < 3 or len(points) < 12:
                    canvas.line(points[k].tolist(), points[k + 1].tolist(), color)
            if len(points):
                x = max(
                    points[-1][0] - 4 * scale, left + canvas.text_width(ghost.description, theme.small_text)
                )
                note(ghost.description, (x, points[-1][1] - 9 * scale), anchor="right", color=color)
        colors = curve_colors(session.timeline.panes, theme)
        for pane in session.timeline.panes:
            curve = pane.curves[what.name]
            points = _thinned(place(curve.times, curve.values))
            if len(points) > 1:
                canvas.segments(np.hstack([points[:-1], points[1:]]), colors[pane.number], canvas.width(1.8))

    def _offer(self, canvas: Canvas, left: float) -> None:
        """Name the other quantity beside the title, where there are two: a click plots it."""
        scale, size, self._other = self.layout.scale, self.theme.small_text, None
        if not self._timed:
            return
        words, left = f"{(DISTANCE if self.plotted is TIME else TIME).short_title} ›", left + 16 * scale
        canvas.text(words, (left, 0.5 * TOP * scale), color=self.theme.faint, size=size)
        (x, y, _, _), wide = self.layout.chart, canvas.text_width(words, size)
        self._other = round(x + left - 6 * scale), y, round(wide + 12 * scale), round(TOP * scale)

    def _values(self, screen: pygame.Surface) -> None:
        """Write the captions' values, newer than the page, at the right, with the gaps; none over another."""
        session, theme, scale = self.viewer.session, self.theme, self.layout.scale
        chart = screen.subsurface(pygame.Rect(self.layout.chart).clip(screen.get_rect()))
        canvas = create_flat_canvas(chart, theme, scale)
        (_, right, _), colors = self._span, curve_colors(session.timeline.panes, theme)
        time, known = session.displayed.get_costs(self.plotted.name)
        best = min(known.values(), default=0.0)
        panes = [pane for pane in session.timeline.panes if pane.number in known]
        panes.sort(key=lambda pane: -known[pane.number])
        values = np.array([known[pane.number] for pane in panes])
        wanted = self._place(np.full(len(panes), time), values)[:, 1]
        rows = spread(wanted, 15.0 * scale, self.layout.chart[3] - 8 * scale)
        for y, pane, value in zip(rows, panes, values.tolist(), strict=True):
            words = f"{value:.3f}"
            if len(known) > 1:
                more = 100 * (value / best - 1)
                gap = f"  +{more:.{1 if more < 99.95 else 0}f} %" if value > best else "  best"
                room = chart.get_width() - right - 15 * scale
                room -= canvas.text_width(f"  {words}{gap}", theme.small_text, bold=True)
                name = shortened(pane.controller.label, canvas.text_size(theme.small_text), room, True)
                words = f"{name}  {words}{gap}"
            at, color = (right + 9 * scale, y), colors[pane.number]
            canvas.text(words, at, color=color, bold=True, size=theme.small_text)

    def _track(self, canvas: Canvas) -> None:
        theme, scale, session = self.theme, self.layout.scale, self.viewer.session
        left, right, _ = self._span
        top = self.layout.chart[3]
        middle = top + 0.5 * self.layout.track[3]
        canvas.surface.fill(theme.panel, pygame.Rect(0, top, *self.layout.track[2:]))
        thick = max(4, round(5 * scale))
        box = pygame.Rect(round(left), round(middle - thick / 2), round(right - left), thick)
        pygame.draw.rect(canvas.surface, mix(theme.panel, theme.ink, 0.13), box, border_radius=thick)
        canvas.text("time", (12 * scale, middle), color=theme.faint, size=theme.small_text)
        words, color = ("live", theme.start) if session.timeline.is_live else ("past", theme.final)
        beside, size, thinned = (
            right + 9 * scale,
            theme.small_text,
            session.timeline.is_live and session.timeline.history.thinned,
        )
        if thinned:
            words = "live · past thinned"
            fits = beside + canvas.text_width(words, size=size) <= self.layout.track[2]
            words = words if fits else "thinned"
        canvas.text(words, (beside, middle), color=color, bold=not thinned, size=size)

    def _rule(self, screen: pygame.Surface, x: float, color: Color, top: int) -> None:
        height, scale = self.layout.chart[3], self.layout.scale
        screen.fill(color, (round(x), round(top + TOP * scale), 1, round(height - (TOP + BOTTOM) * scale)))

    def _cursor(self, screen: pygame.Surface) -> None:
        theme, scale, session = self.theme, self.layout.scale, self.viewer.session
        canvas = create_flat_canvas(screen, theme, scale)
        middle, thick = self.layout.track[1] + 0.5 * self.layout.track[3], max(4, round(5 * scale))
        x, begin = self.column(session.displayed.time), round(self.column(0.0))
        bars = [(self.column(session.timeline.end_time), mix(theme.panel, theme.ink, 0.4))]
        if not session.timeline.is_live:
            bars.append((x, theme.final))
            self._rule(screen, x, theme.final, self.layout.chart[1])
        for end, color in bars:
            bar = pygame.Rect(begin, round(middle - thick / 2), max(round(end) - begin, thick), thick)
            pygame.draw.rect(screen, color, bar, border_radius=thick)
        dot = partial(sprites.dot, max(2.0, round(5 * scale) / 2), theme.ink)
        for event in session.timeline.events:
            canvas.stamp(dot, (self.column(event.time), middle))
        fill, radius = theme.ink if session.timeline.is_live else theme.final, round(2 * 6.5 * scale) / 2
        handle = partial(sprites.disc, radius, fill, theme.background, 2.0 * scale, theme.faint, "")
        canvas.stamp(handle, (x, middle))

    def _hovered(self, screen: pygame.Surface) -> None:
        over, theme, scale, session = self.hover, self.theme, self.layout.scale, self.viewer.session
        (left, right, _), boxes = self._span, (self.layout.chart, self.layout.track)
        if over is None or not left <= over[0] <= right or not any(is_inside(box, over) for box in boxes):
            return
        time = self.time_at(over[0])
        near = [
            event for event in session.timeline.events if abs(self.column(event.time) - over[0]) < 5 * scale
        ]
        if near:
            words = "; ".join(f"{event.time:.1f} s: {event.text}" for event in near[-3:])
        else:
            what = self.plotted
            values = [
                (pane.controller.label, pane.curves[what.name].interpolate(time))
                for pane in session.timeline.panes
            ]
            known = [f"{name} {value:.3f} {what.unit}" for name, value in values if np.isfinite(value)]
            words = "   ".join([f"{time:.1f} s", *known])
        x = round(self.column(time))
        self._rule(screen, x, mix(theme.panel, theme.ink, 0.35), self.layout.chart[1])
        room = right - create_flat_canvas(screen, theme, scale).text_width(words)
        at = min(x + 12 * scale, room), self.layout.chart[1] + (TOP + 16) * scale
        draw_tag(screen, words, at, theme, scale)


def curve_colors(panes: Iterable[Pane], theme: Theme) -> dict[int, Color]:
    """Return the colors of curves by pane: the controller's, or another one where that is taken."""
    taken: dict[int, Color] = {}
    for pane in panes:
        wanted = [theme.controllers.get(pane.controller.name), *theme.others]
        taken[pane.number] = next(each for each in wanted if each and each not in taken.values())
    return taken


def spread(wanted: Array, gap: float, limit: float) -> list[float]:
    """Return heights near the wanted ones, ascending as those are, apart by a gap, none beyond a limit.

    >>> spread(np.array([10.0, 11.0, 40.0]), 5.0, 42.0)
    [10.0, 15.0, 40.0]
    """
    rows: list[float] = []
    for y in wanted.tolist():
        rows.append(max(y, rows[-1] + gap) if rows else y)
    for k in range(len(rows)):
        rows[-1 - k] = min(rows[-1 - k], limit - gap * k)
    return rows


def _thinned(points: Array) -> Array:
    """Return the points of a curve that differ by a pixel's part, the last one always."""
    if len(points) < 400:
        return points
    columns = np.rint(points[:, 0] * 1.5)
    return np.asarray(points[np.append(columns[1:] != columns[:-1], True)])
