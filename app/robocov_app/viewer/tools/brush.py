"""The brush, which paints the density while the simulation runs."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import dist
from time import perf_counter

import numpy as np

from robocov.environment import Point, Ring
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.tools.tool import ViewerPointerEvent, ViewerTool, ViewerToolOverlay

DEFAULT_RADIUS_FRACTION = 0.1  # of the map's diameter
MIN_RADIUS_FRACTION = 1 / 200
MAX_RADIUS_FRACTION = 1 / 2
DAB_SPACING_FRACTION = 0.25  # distance between dabs as a fraction of the radius
APPLY_INTERVAL_S = 0.08  # minimum time between updates of the density during a stroke
_RING_POINTS = 48  # number of points of the circle that shows the brush


@dataclass
class BrushTool(ViewerTool):
    """Paints the density: the left button raises it, the right one lowers it.

    Attributes
    ----------
    radius : float or None
        Radius, m. It is None until it is first needed; then it is chosen by the size of the map.
    lowers : bool
        Whether the current stroke lowers the density.
    clock : callable
        Returns the time, s; replaced in tests.
    is_painting : bool
        Whether a stroke is in progress.
    """

    name = "brush"
    title = "Brush"
    key = "g"
    hint = "paint where coverage matters more; the right button lowers it; the wheel, [ and ] change the size"
    touch_hint = "paint where coverage matters more"
    uses_right_button = True
    uses_wheel = True
    is_resizable = True

    radius: float | None = None
    lowers: bool = False
    clock: Callable[[], float] = field(default=perf_counter, repr=False)
    is_painting: bool = False
    _dabs: list[Point] = field(default_factory=list, repr=False)  # not applied to the map yet
    _stroke: int = 0  # number of the stroke, whose dabs count as one edit
    _boundary: Ring = ()  # of the map when the stroke started
    _cursor: Point | None = None
    _applied_at: float = -1e9

    def get_radius(self, session: Session) -> float:
        """Return the radius, m; if there is none yet, choose one that suits the map."""
        if self.radius is None:
            diameter = session.displayed.environment.region.diameter
            self.radius = float(f"{DEFAULT_RADIUS_FRACTION * diameter:.2g}")
        return self.radius

    def resize(self, session: Session, factor: float) -> str:
        """Multiply the radius by a factor, and return a message."""
        diameter = session.displayed.environment.region.diameter
        min_radius = MIN_RADIUS_FRACTION * diameter
        max_radius = MAX_RADIUS_FRACTION * diameter
        radius = np.clip(self.get_radius(session) * factor, min_radius, max_radius)
        self.radius = float(f"{radius:.3g}")
        return f"the brush has a radius of {self.radius:g} m"

    def press(self, session: Session, event: ViewerPointerEvent) -> str | None:
        """Start a stroke; with the right button, it lowers the density."""
        self.lowers = event.is_right
        self.is_painting = True
        self._cursor = event.unsnapped_point
        self._dabs = [event.unsnapped_point]
        self._boundary = session.displayed.environment.boundary
        self._stroke += 1
        self._apply(session)
        return None

    def move(self, session: Session, event: ViewerPointerEvent) -> None:
        """Continue the stroke with equally spaced dabs. If no stroke is in progress, only move the brush."""
        if not self.is_painting or self._cursor is None:
            self._cursor = event.unsnapped_point
            return
        # Another map may have been opened during the stroke.
        if session.displayed.environment.boundary != self._boundary:
            self.is_painting = False
            return
        self._add_dabs(self._cursor, event.unsnapped_point, DAB_SPACING_FRACTION * self.get_radius(session))
        if self._dabs and self.clock() - self._applied_at >= APPLY_INTERVAL_S:
            self._apply(session)

    def _add_dabs(self, start: Point, end: Point, spacing: float) -> None:
        length = dist(start, end)
        for k in range(1, int(length / spacing) + 1):
            x = round(start[0] + k * spacing / length * (end[0] - start[0]), 4)
            y = round(start[1] + k * spacing / length * (end[1] - start[1]), 4)
            self._cursor = (x, y)
            self._dabs.append(self._cursor)

    def release(self, session: Session, event: ViewerPointerEvent, *, is_click: bool) -> str | None:
        """End the stroke."""
        if self.is_painting:
            self.move(session, event)
        if not self.is_painting:
            return None
        self.is_painting = False
        if self._dabs:
            self._apply(session)
        if self.lowers:
            return "density lowered"
        return "density raised"

    def cancel(self, session: Session) -> bool:
        """Undo the stroke in progress; return whether there was one."""
        was_painting = self.is_painting
        self.is_painting = False
        self._cursor = None
        if was_painting:
            session.undo()
        return was_painting

    def build_overlay(self, session: Session) -> ViewerToolOverlay:
        """Return the outline of the brush, labeled with the density at the cursor."""
        if self._cursor is None:
            return ViewerToolOverlay()
        angles = np.linspace(0.0, 2.0 * np.pi, _RING_POINTS + 1)
        radius = self.get_radius(session)
        x = self._cursor[0] + radius * np.cos(angles)
        y = self._cursor[1] + radius * np.sin(angles)
        ring = tuple(zip(x.tolist(), y.tolist(), strict=True))
        density = session.displayed.environment.density
        value = 1.0 if density is None else float(density.evaluate(np.array([self._cursor]))[0])
        return ViewerToolOverlay(ring, label=f"φ {value:.2g}", has_marks=False)

    def _apply(self, session: Session) -> None:
        """Apply the dabs that have not been applied yet."""
        dabs = tuple(self._dabs)
        self._dabs = []
        session.paint(dabs, self.get_radius(session), lowers=self.lowers, stroke=self._stroke)
        self._applied_at = self.clock()
