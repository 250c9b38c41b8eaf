"""The brush: paints how much places count, the density φ, while the run goes on. Coordinates are metres."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from robocov_app.viewer.tool import Point, Preview, Tool, apart

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.environment import Ring
    from robocov_app.viewer.session.session import Session

_SPACING = 0.25
"""Radii from one dab to the next."""

_PAUSE = 0.08
"""Seconds between two times that the robots get to know of what is being painted."""

_RING = 48
"""Corners of the circle that shows the brush's size."""


@dataclass
class Brush(Tool):
    """Paints the density: the left button raises it, the right one lowers it.

    Attributes
    ----------
    radius : float or None, m
        None until it is first needed: then a tenth of the map.
    lowers : bool
        What a press does.
    """

    name: str = "brush"
    title: str = "Brush"
    hint: str = "paint where more is needed; the right button takes away; the wheel, [ and ] change the size"
    radius: float | None = None
    lowers: bool = False
    clock: Callable[[], float] = field(default=perf_counter, repr=False)
    _dabs: list[Point] = field(default_factory=list, repr=False)
    _stroke: int = 0
    _painting: bool = False
    _boundary: Ring = ()
    _at: Point | None = None
    _shown: float = -1e9

    @property
    def painting(self) -> bool:
        """Whether a stroke has begun and not yet ended."""
        return self._painting

    def size(self, session: Session) -> float:
        """Return the radius, m."""
        if self.radius is None:
            self.radius = float(f"{0.1 * session.environment.region.diameter:.2g}")
        return self.radius

    def widen(self, session: Session, factor: float) -> str:
        """Take a larger brush, or a smaller one; return what to tell."""
        whole = session.environment.region.diameter
        self.radius = float(f"{np.clip(self.size(session) * factor, whole / 200, whole / 2):.3g}")
        return f"the brush has a radius of {self.radius:g} m"

    def press(self, session: Session, point: Point, reach: float, number: int | None) -> str | None:
        self._painting, self._at, self._shown = True, point, -1e9
        self._boundary = session.environment.boundary
        self._stroke += 1
        self._dabs = [point]
        self._show(session)
        return None

    def move(self, session: Session, point: Point) -> None:
        if not self._painting or self._at is None:
            self._at = point
            return
        if session.environment.boundary != self._boundary:
            self._painting = False  # meanwhile there is another map
            return
        spacing = _SPACING * self.size(session)
        count, begin = int(apart(self._at, point) / spacing), self._at
        for k in range(1, count + 1):
            part = k * spacing / apart(begin, point)
            x, y = (round(a + part * (b - a), 4) for a, b in zip(begin, point, strict=True))
            self._dabs.append((x, y))
            self._at = x, y
        if self._dabs and self.clock() - self._shown >= _PAUSE:
            self._show(session)

    def release(self, session: Session, point: Point) -> str | None:
        if not self._painting:
            return None
        self.move(session, point)
        painting, self._painting = self._painting, False
        if not painting:
            return None
        if self._dabs:
            self._show(session)
        return "density lowered" if self.lowers else "density raised"

    def cancel(self, session: Session) -> bool:
        painting, self._painting, self._at = self._painting, False, None
        if painting:
            session.undo()
        return painting

    def preview(self, session: Session) -> Preview | None:
        if self._at is None:
            return None
        turn = np.linspace(0.0, 2.0 * np.pi, _RING + 1)
        radius = self.size(session)
        x, y = self._at[0] + radius * np.cos(turn), self._at[1] + radius * np.sin(turn)
        outline = tuple(zip(x.tolist(), y.tolist(), strict=True))
        density = session.environment.density
        value = 1.0 if density is None else float(density.value(np.array([self._at]))[0])
        return Preview(outline, False, None, f"φ {value:.2g}", marks=False)

    def _show(self, session: Session) -> None:
        """Let the robots know of it."""
        dabs, self._dabs = tuple(self._dabs), []
        session.paint(dabs, self.size(session), lowers=self.lowers, stroke=self._stroke)
        self._shown = self.clock()
