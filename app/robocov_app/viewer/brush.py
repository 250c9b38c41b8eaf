"""The brush: paints how much places count, the density φ, while the run goes on. Coordinates are metres."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from robocov.density import Raster, sampled
from robocov_app.viewer.tool import Point, Preview, Tool, apart

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.arrays import Array
    from robocov.environment import Environment
    from robocov_app.viewer.session.session import Session

CELLS = 96
"""Cells along the longer side of a map that is painted."""

LEAST, MOST = 0.05, 50.0
"""Between these a place counts once it has been painted."""

_DAB = 1.15
"""What one dab makes of the density at its middle, times as much."""

_SPACING = 0.25
"""Radii from one dab to the next."""

_DECIMALS = 3
"""Of what is painted, so that a map that is saved stays short."""

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
    _before: Environment | None = None
    _values: Array = field(default_factory=lambda: np.zeros((0, 0)), repr=False)
    _extent: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)
    _at: Point | None = None
    _shown: float = -1e9
    _dirty: bool = False

    @property
    def painting(self) -> bool:
        """Whether a stroke has begun and not yet ended."""
        return self._before is not None

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
        environment = session.environment
        self._before, self._at, self._shown = environment, point, -1e9
        raster = painted_raster(environment)
        self._values, self._extent = np.array(raster.values), raster.extent
        self._dab(session, point)
        self._show(session)
        return None

    def move(self, session: Session, point: Point) -> None:
        if self._before is None or self._at is None:
            self._at = point
            return
        if session.environment.boundary != self._before.boundary:
            self._before = None  # meanwhile there is another map
            return
        spacing = _SPACING * self.size(session)
        count = int(apart(self._at, point) / spacing)
        for k in range(1, count + 1):
            part = k * spacing / apart(self._at, point)
            x, y = (a + part * (b - a) for a, b in zip(self._at, point, strict=True))
            self._dab(session, (x, y))
        if count:
            part = count * spacing / apart(self._at, point)
            x, y = (a + part * (b - a) for a, b in zip(self._at, point, strict=True))
            self._at = x, y
        if self._dirty and self.clock() - self._shown >= _PAUSE:
            self._show(session)

    def release(self, session: Session, point: Point) -> str | None:
        if self._before is None:
            return None
        self.move(session, point)
        before, self._before = self._before, None
        if before is None or session.environment.boundary != before.boundary:
            return None
        words = "density lowered" if self.lowers else "density raised"
        session.painted(before, self._painted(session), words)
        return words

    def cancel(self, session: Session) -> bool:
        before, self._before = self._before, None
        self._at = None
        if before is None:
            return False
        if session.environment.boundary == before.boundary:
            session.show_density(before)
        return True

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

    def _dab(self, session: Session, point: Point) -> None:
        """Raise or lower what is under the brush, most in its middle."""
        rows, columns = self._values.shape
        x_min, y_min, x_max, y_max = self._extent
        x = x_min + (np.arange(columns) + 0.5) * ((x_max - x_min) / columns) - point[0]
        y = y_min + (np.arange(rows) + 0.5) * ((y_max - y_min) / rows) - point[1]
        square = (x[None, :] ** 2 + y[:, None] ** 2) / self.size(session) ** 2
        soft = np.where(square < 1.0, (1.0 - np.minimum(square, 1.0)) ** 2, 0.0)
        change = np.exp((-1.0 if self.lowers else 1.0) * np.log(_DAB) * soft)
        values = np.clip(np.maximum(self._values, LEAST) * change, LEAST, MOST)
        self._values = np.where(soft > 0.0, values, self._values)
        self._dirty = True

    def _painted(self, session: Session) -> Environment:
        return session.environment.with_density(Raster(np.round(self._values, _DECIMALS), self._extent))

    def _show(self, session: Session) -> None:
        """Let the robots know of it."""
        session.show_density(self._painted(session))
        self._shown, self._dirty = self.clock(), False


def painted_raster(environment: Environment) -> Raster:
    """Return a map's density as a raster that can be painted: as it is where it is one, else sampled."""
    density = environment.density
    if isinstance(density, Raster) and density.interpolation == "bilinear" and min(density.values.shape) > 1:
        return density
    low_x, low_y, high_x, high_y = environment.region.bounds
    step = max(high_x - low_x, high_y - low_y) / CELLS
    columns, rows = (max(round(side / step), 2) for side in (high_x - low_x, high_y - low_y))
    return sampled(density, (low_x, low_y, high_x, high_y), columns, rows)
