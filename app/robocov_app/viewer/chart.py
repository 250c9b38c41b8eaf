"""The plot of the cost against time, and the time line below it."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pygame

from robocov.arrays import Array
from robocov_app.render import sprites
from robocov_app.render.camera import round_length
from robocov_app.render.canvas import Canvas
from robocov_app.render.density import density_label
from robocov_app.render.fonts import shortened, text_width
from robocov_app.render.theme import Colour, Theme, mix
from robocov_app.toolkit.layout import Box, Layout, inside
from robocov_app.toolkit.overlay import flat_canvas, tag
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.curves import DISTANCE, TIME, Event, Plotted, chosen, compared
from robocov_app.viewer.session.pane import Pane

LEFT, RIGHT, TOP, BOTTOM = 52, 70, 26, 20
"""Pixels at scale 1 round the plot."""

SHORTEST = 10.0  # seconds that the axis shows at least
REFRESHED = 0.1  # seconds after which growing curves are drawn anew

_GRASP = 6.0  # pixels at scale 1 from a ghost curve within which a click enters its branch

_GLYPHS = dict(
    zip(["obstacle", "robot", "failure", "law", "limits", "hand", "density"], "■+×◆◆●▲", strict=True)
)


def time_axis(end: float) -> float:
    """Return where the axis of time ends: a little beyond now, in steps, so that it rests mostly.

    >>> [time_axis(t) for t in (0.0, 9.0, 9.9, 61.0)]
    [10.0, 10.0, 15.0, 70.0]
    """
    if end <= 0.96 * SHORTEST:
        return SHORTEST
    step = round_length(max(end / 4.0, 1.0)) / 2.0 if end < 40.0 else round_length(end / 5.0)
    step = max(step, 5.0)
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
        self._drawn_at = -1.0
        self._wanted = DISTANCE
        self._other: Box | None = None
        self._ghosts: list[tuple[int, Array]] = []
        self.hover: tuple[int, int] | None = None
        """Cursor position in the window."""

    def arrange(self, layout: Layout, theme: Theme) -> None:
        """Take another layout and theme."""
        self.layout, self.theme = layout, theme
        self._page = None

    # what is plotted

    @property
    def plotted(self) -> Plotted:
        """The quantity that is plotted now."""
        return chosen(self.viewer.session, self._wanted)

    def switch(self) -> str:
        """Plot the other quantity, if there are two."""
        wanted = TIME if self.plotted is DISTANCE else DISTANCE
        if wanted is TIME and chosen(self.viewer.session, TIME) is not TIME:
            return "all robots are equally fast: the mean time goes as the mean distance"
        self._wanted, self._page = wanted, None
        return f"plotted: {wanted.title[:1].lower()}{wanted.title[1:]}"

    def offers(self, at: tuple[int, int]) -> bool:
        """Return whether the name of the other quantity is at a pixel of the window."""
        return self._other is not None and inside(self._other, at)

    def ghost_at(self, at: tuple[int, int]) -> int | None:
        """Return the node of the document whose branch has a ghost curve at a pixel of the window."""
        at = at[0], at[1] - self.layout.chart[1]
        near = [(float(np.hypot(*(points - at).T).min()), node) for node, points in self._ghosts]
        best = min(near, default=(np.inf, 0))
        return best[1] if best[0] < _GRASP * self.layout.scale else None

    # where time is

    @property
    def _span(self) -> tuple[float, float, float]:
        """Left and right of the axis in pixels of the window, and the time at its end."""
        left, _, width, _ = self.layout.chart
        scale, panes, beside = self.layout.scale, self.viewer.session.panes, RIGHT * self.layout.scale
        if len(panes) > 1:  # their names stand there, too
            size = round(self.theme.small_text * scale)
            names = (text_width(f"{pane.law.label}  8.888  +88.8 %", size, True) for pane in panes)
            beside = min(max(names) + 20 * scale, 0.4 * width)
        ghosts = max((float(ghost.time[-1]) for ghost in self.viewer.session.ghosts), default=0.0)
        end = time_axis(max(self.viewer.session.end, ghosts))
        return left + LEFT * scale, left + width - beside, end

    def time_at(self, x: float) -> float:
        """Return the time at a pixel's column, s, within the run."""
        left, right, end = self._span
        time = (x - left) / max(right - left, 1.0) * end
        return float(np.clip(time, 0.0, self.viewer.session.end))

    def column(self, time: float) -> float:
        """Return the pixel's column of a time."""
        left, right, end = self._span
        return left + (right - left) * time / end

    # drawing

    def draw(self, screen: pygame.Surface) -> None:
        """Draw both."""
        session, layout = self.viewer.session, self.layout
        curves = [pane.curves[self.plotted.name] for pane in session.panes]
        samples = [(len(curve), curve.last_time, curve.at(np.inf)) for curve in curves]
        panes = tuple(pane.number for pane in session.panes)
        rest = (
            *(panes, len(session.events), len(session.ghosts), self._span, self.plotted),
            *(self.viewer.costs.state, None if session.live else session.time, session.serial),
        )
        # curves grow sixty times a second, which nobody sees
        old = self.viewer.now - self._drawn_at >= REFRESHED
        if self._page is None or rest != self._key or (old and samples != self._samples):
            _, _, width, height = layout.chart
            self._page = pygame.Surface((width, height + layout.track[3]), 0, 32)
            self._key, self._samples, self._drawn_at = rest, samples, self.viewer.now
            canvas = flat_canvas(self._page, self.theme, layout.scale)
            self._plot(canvas)
            self._track(canvas)
        screen.blit(self._page, layout.chart[:2])
        self._values(screen)
        self._cursor(screen)
        self._hovered(screen)

    def _note(
        self,
        canvas: Canvas,
        words: str,
        at: tuple[float, float],
        anchor: str = "left",
        colour: Colour | None = None,
        *,
        bold: bool = False,
    ) -> None:
        colour = colour or self.theme.faint
        canvas.text(words, at, anchor=anchor, colour=colour, bold=bold, size=self.theme.small_text)

    def _plot(self, canvas: Canvas) -> None:
        theme, scale, session, what = self.theme, self.layout.scale, self.viewer.session, self.plotted
        canvas.surface.fill(theme.panel)
        left, right, end = self._span
        height = self.layout.chart[3]
        top, bottom = TOP * scale, height - BOTTOM * scale
        weighed = ", weighed by φ" if density_label(session.environment) else ""
        title = f"{what.title}{weighed}, {what.unit}"
        canvas.text(title, (12 * scale, 0.5 * TOP * scale), bold=True)
        named = 12 * scale + canvas.text_width(title, bold=True)
        self._offer(canvas, named)
        state = self.viewer.costs.state
        if state and right - canvas.text_width(state) > named:
            canvas.text(state, (right, 0.5 * TOP * scale), colour=theme.faint, anchor="right")
        ghosts = [ghost for ghost in session.ghosts if ghost.of == what.name]
        values = [pane.curves[what.name].value for pane in session.panes] + [ghost.value for ghost in ghosts]
        some = np.concatenate([v for v in values if len(v)] or [np.array([np.nan])])
        low, high, step = value_axis(float(some.min()), float(some.max()))

        def place(time: Array, value: Array) -> Array:
            x = left + (right - left) * time / end
            return np.column_stack([x, bottom - (bottom - top) * (value - low) / (high - low)])

        self._place = place
        for mark in np.arange(low, high, step):
            y = bottom - (bottom - top) * (mark - low) / (high - low)
            line = pygame.Rect(round(left), round(y), round(right - left), 1)
            canvas.surface.fill(mix(theme.panel, theme.ink, 0.12), line)
            self._note(canvas, f"{mark:.6g}", (left - 7 * scale, y), "right")
        for mark in np.arange(0.0, end + 1e-9, max(round_length(end / 6.0), 1.0)):
            x = left + (right - left) * mark / end
            self._note(canvas, f"{mark:g} s", (x, height - 0.5 * BOTTOM * scale), "middle")
        for event in session.events:
            x = round(left + (right - left) * event.time / end)
            line = pygame.Rect(x, round(top), 1, round(bottom - top))
            canvas.surface.fill(mix(theme.panel, theme.ink, 0.3), line)
        self._event_words(canvas, list(session.events), left, right, end, top)
        self._ghosts = [(ghost.node, place(ghost.time, ghost.value)) for ghost in ghosts]
        for ghost, (_, points) in zip(ghosts, self._ghosts, strict=True):
            colour = mix(theme.panel, theme.controller(ghost.law), 0.45)
            for k in range(len(points) - 1):
                if k % 4 < 3 or len(points) < 12:
                    canvas.line(points[k].tolist(), points[k + 1].tolist(), colour)
            if len(points):
                x = max(points[-1][0] - 4 * scale, left + canvas.text_width(ghost.words, theme.small_text))
                self._note(canvas, ghost.words, (x, points[-1][1] - 9 * scale), "right", colour)
        for pane in session.panes:
            curve = pane.curves[what.name]
            points = _thinned(place(curve.time, curve.value))
            if len(points) > 1:
                ends = np.hstack([points[:-1], points[1:]])
                canvas.segments(ends, curve_colour(self.viewer, theme, pane), canvas.width(1.8))

    def _offer(self, canvas: Canvas, left: float) -> None:
        """Name the other quantity beside the title, where there are two: a click plots it."""
        self._other = None
        if chosen(self.viewer.session, TIME) is DISTANCE:
            return
        scale, words = self.layout.scale, f"{(DISTANCE if self.plotted is TIME else TIME).short} ›"
        left += 16 * scale
        self._note(canvas, words, (left, 0.5 * TOP * scale))
        x, y, _, _ = self.layout.chart
        wide = canvas.text_width(words, self.theme.small_text)
        self._other = round(x + left - 6 * scale), y, round(wide + 12 * scale), round(TOP * scale)

    def _event_words(
        self, canvas: Canvas, events: list[Event], left: float, right: float, end: float, top: float
    ) -> None:
        """Write what happened beside its line, where there is room."""
        scale, free = self.layout.scale, left
        for event in events:
            x = left + (right - left) * event.time / end
            words = f"{_GLYPHS.get(event.kind, '•')} {event.text}"
            wide = canvas.text_width(words, self.theme.small_text)
            if x < free or x + wide > right:
                words, wide = _GLYPHS.get(event.kind, "•"), round(8 * scale)
                if x < free:
                    continue
            self._note(canvas, words, (x + 3 * scale, top + 6 * scale))
            free = x + wide + 8 * scale

    def _values(self, screen: pygame.Surface) -> None:
        """Write each pane's value at the right, with the gap to the best; none over another.

        They are those of the captions, which are newer than a page that is drawn ten times a second.
        """
        session, theme, scale = self.viewer.session, self.theme, self.layout.scale
        chart = screen.subsurface(pygame.Rect(self.layout.chart).clip(screen.get_rect()))
        canvas = flat_canvas(chart, theme, scale)
        _, right, _ = self._span
        time, known = compared(session, self.plotted)
        if not known:
            return
        best = min(known.values())
        panes = [pane for pane in session.panes if pane.number in known]
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
                name = shortened(pane.law.label, canvas.text_size(theme.small_text), room, True)
                words = f"{name}  {words}{gap}"
            colour = curve_colour(self.viewer, theme, pane)
            self._note(canvas, words, (right + 9 * scale, y), colour=colour, bold=True)

    def _track(self, canvas: Canvas) -> None:
        """Draw the time line."""
        theme, scale, session = self.theme, self.layout.scale, self.viewer.session
        left, right, _ = self._span
        top = self.layout.chart[3]
        middle = top + 0.5 * self.layout.track[3]
        canvas.surface.fill(theme.panel, pygame.Rect(0, top, *self.layout.track[2:]))
        thick = max(4, round(5 * scale))
        box = pygame.Rect(round(left), round(middle - thick / 2), round(right - left), thick)
        pygame.draw.rect(canvas.surface, mix(theme.panel, theme.ink, 0.13), box, border_radius=thick)
        self._note(canvas, "time", (12 * scale, middle))
        thinned = session.live and session.history.thinned
        words = "live" if session.live else "past"
        if thinned:
            words = "live · past thinned"
            if right + 9 * scale + canvas.text_width(words, size=theme.small_text) > self.layout.track[2]:
                words = "thinned"
        colour = theme.start if session.live else theme.final
        self._note(canvas, words, (right + 9 * scale, middle), colour=colour, bold=not thinned)

    def _rule(self, screen: pygame.Surface, x: float, colour: Colour) -> None:
        """Draw an upright line through the plot."""
        _, top, _, height = self.layout.chart
        scale = self.layout.scale
        line = pygame.Rect(round(x), round(top + TOP * scale), 1, round(height - (TOP + BOTTOM) * scale))
        screen.fill(colour, line)

    def _cursor(self, screen: pygame.Surface) -> None:
        """Draw how far the run has come, the handle on the time line, and the line through the plot."""
        theme, scale, session = self.theme, self.layout.scale, self.viewer.session
        canvas = flat_canvas(screen, theme, scale)
        middle = self.layout.track[1] + 0.5 * self.layout.track[3]
        thick = max(4, round(5 * scale))
        x, begin = self.column(session.time), round(self.column(0.0))
        bars = [(self.column(session.end), mix(theme.panel, theme.ink, 0.4))]
        if not session.live:
            bars.append((x, theme.final))
            self._rule(screen, x, theme.final)
        for end, colour in bars:
            bar = pygame.Rect(begin, round(middle - thick / 2), max(round(end) - begin, thick), thick)
            pygame.draw.rect(screen, colour, bar, border_radius=thick)
        dot = partial(sprites.dot, max(2.0, round(5 * scale) / 2), theme.ink)
        for event in session.events:
            canvas.stamp(dot, (self.column(event.time), middle))
        fill, radius = theme.ink if session.live else theme.final, round(2 * 6.5 * scale) / 2
        handle = partial(sprites.disc, radius, fill, theme.background, 2.0 * scale, theme.faint, "")
        canvas.stamp(handle, (x, middle))

    def _hovered(self, screen: pygame.Surface) -> None:
        """Tell what was at the time under the cursor: an event near it, or the values."""
        over, theme, scale, session = self.hover, self.theme, self.layout.scale, self.viewer.session
        left, right, _ = self._span
        if over is None or not left <= over[0] <= right:
            return
        if not (inside(self.layout.chart, over) or inside(self.layout.track, over)):
            return
        time = self.time_at(over[0])
        near = [event for event in session.events if abs(self.column(event.time) - over[0]) < 5 * scale]
        if near:
            words = "; ".join(f"{event.time:.1f} s: {event.text}" for event in near[-3:])
        else:
            what = self.plotted
            values = [(pane.law.label, pane.curves[what.name].at(time)) for pane in session.panes]
            known = [f"{name} {value:.3f} {what.unit}" for name, value in values if np.isfinite(value)]
            words = "   ".join([f"{time:.1f} s", *known])
        x = round(self.column(time))
        self._rule(screen, x, mix(theme.panel, theme.ink, 0.35))
        room = right - flat_canvas(screen, theme, scale).text_width(words)
        at = min(x + 12 * scale, room), self.layout.chart[1] + (TOP + 16) * scale
        tag(screen, words, at, theme, scale)


def curve_colour(viewer: Presenter, theme: Theme, pane: Pane) -> Colour:
    """Return the colour of a pane's curve: its controller's, another one where that is taken."""
    taken: list[Colour] = []
    for other in viewer.session.panes:
        own = theme.controllers.get(other.law.name)
        free = [colour for colour in theme.others if colour not in taken]
        taken.append(own if own is not None and own not in taken else free[0])
        if other is pane:
            break
    return taken[-1]


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
    keep = np.append(columns[1:] != columns[:-1], True)
    return np.asarray(points[keep])
