"""The trajectories layer: what is old is kept on a page of its own, only new pieces are drawn."""

from __future__ import annotations

import numpy as np
import pygame

from robocov.arrays import Array
from robocov_app.view.canvas import Canvas
from robocov_app.view.clipping import bounded
from robocov_app.view.layers import Layer, LegendEntry
from robocov_app.view.scene import Scene
from robocov_app.view.spacing import line_crowding
from robocov_app.view.sprites import Sketch
from robocov_app.view.theme import ONE_HUE_EACH, Colour, mix

PIECE = 2.0
"""Pixels between the corners of a drawn trajectory."""

SECTION = 16.0
"""Pixels of path that are added to the page at once; what is newer is drawn anew each time."""


FADE_STEPS = 12
"""Shades of a trajectory that fades."""


class Trajectories(Layer):
    """Where the robots went.

    Parameters
    ----------
    colours : {"robots", "paper"}
        Each in its robot's colour (large teams: all in a quiet red), or all red.
    fade : float or None, s
        Show the last so many seconds only, fading into the past; needs `Scene.trail_time`.
    """

    name = "trajectories"
    title = "Trajectories"

    def __init__(self, colours: str = "robots", fade: float | None = None) -> None:
        self.colours = colours
        self.fade = fade
        self._page: pygame.Surface | None = None
        self._key: object = None
        self._drawn = 0
        self._last_row = np.empty((0, 2))
        self._open: list[list[list[float]]] = []
        self._fading: tuple[object, pygame.Surface] | None = None

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        trail = scene.trail
        if trail is None or len(trail) == 0:
            return
        colours = self._of_robots(canvas)
        width = canvas.scale * canvas.theme.trajectory_line * line_crowding(trail.shape[1])
        if self.fade is not None and scene.trail_time is not None:
            self._faded(canvas, trail, scene.trail_time, colours, canvas.width(width / canvas.scale))
            return
        page, continues = self._page_for(canvas, trail)
        self._lengthen(bounded(canvas.camera.to_pixels(trail[self._drawn :])))
        self._drawn, self._last_row = len(trail), trail[-1].copy()
        self._finish_sections(page, colours, width, together=not continues)
        canvas.surface.blit(page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
        ends = bounded(canvas.camera.to_pixels(trail[-1])).tolist()
        for path, end, colour in zip(self._open, ends, colours, strict=True):
            if path[-1][0] != path[-1][0]:  # nan: not there yet
                continue
            # mostly below the robot's disc, where seams do not show
            canvas.outline(np.array([*path, end]), colour, canvas.width(width / canvas.scale), closed=False)

    def _lengthen(self, rows: Array) -> None:
        """Add the corners that lie far enough from the last of each path."""
        last = np.array([path[-1] for path in self._open])
        for row in rows:
            delta = row - last
            far = delta[:, 0] ** 2 + delta[:, 1] ** 2 >= PIECE * PIECE
            joins = np.isnan(last[:, 0]) & ~np.isnan(row[:, 0])
            if joins.any():
                for robot in np.nonzero(joins)[0].tolist():
                    self._open[robot] = [row[robot].tolist()]
                last[joins] = row[joins]
            if far.any():
                for robot in np.nonzero(far)[0].tolist():
                    self._open[robot].append(row[robot].tolist())
                last[far] = row[far]

    def _finish_sections(
        self, page: pygame.Surface, colours: list[Colour], width: float, together: bool
    ) -> None:
        """Draw what is long enough on the page, and begin anew at its end."""
        whole = self._sketch_of_all(page) if together else None
        for robot, path in enumerate(self._open):
            if len(path) < 2 or (whole is None and PIECE * (len(path) - 1) < SECTION):
                continue
            sketch = whole if whole is not None else Sketch.around(path, width)
            if sketch is not None:
                sketch.path(path, colours[robot], width)
                if sketch is not whole:
                    sketch.onto(page)
            self._open[robot] = path[-1:]
        if whole is not None:
            whole.onto(page)

    def _sketch_of_all(self, page: pygame.Surface) -> Sketch | None:
        """Return a sketch that holds all of the paths that can be seen, None when nothing moved."""
        moved = [np.array(path) for path in self._open if len(path) > 1]
        if not moved:
            return None
        points = np.concatenate(moved)
        low, high = np.floor(points.min(axis=0)) - 5, np.ceil(points.max(axis=0)) + 5
        box = pygame.Rect(*low.astype(int).tolist(), *(high - low).astype(int).tolist()).clip(page.get_clip())
        return Sketch(box) if box.width and box.height else None

    def _page_for(self, canvas: Canvas, trail: Array) -> tuple[pygame.Surface, bool]:
        """Return the page of old sections and whether `trail` continues them; if not, the page is fresh."""
        size = canvas.surface.get_size()
        key = (canvas.camera, canvas.theme.name, canvas.scale, size, self.colours, trail.shape[1])
        continues = key == self._key and self._drawn > 0 and self._found(trail)
        if self._page is None or not continues:
            self._page = pygame.Surface(size, pygame.SRCALPHA, 32)
            self._key, self._drawn = key, 0
            self._open = [[point] for point in bounded(canvas.camera.to_pixels(trail[0])).tolist()]
        self._page.set_clip(canvas.surface.get_clip())
        return self._page, continues

    def _found(self, trail: Array) -> bool:
        """Look for the row that was drawn last; where old rows were thinned it has come forward."""
        if self._drawn <= len(trail) and _same(trail[self._drawn - 1], self._last_row):
            return True
        rows = np.flatnonzero(_same_rows(trail[: self._drawn], self._last_row))
        if len(rows):
            self._drawn = int(rows[-1]) + 1
        return len(rows) > 0

    def _faded(self, canvas: Canvas, trail: Array, time: Array, colours: list[Colour], width: int) -> None:
        """Draw the last seconds; what is a little older than now stays on a page for a moment."""
        fade = self.fade or 0.0
        refreshed = int(np.floor(time[-1] / (fade / FADE_STEPS)))
        size = canvas.surface.get_size()
        key = (canvas.camera, canvas.theme.name, canvas.scale, size, trail.shape[1], refreshed, len(colours))
        if self._fading is None or self._fading[0] != key:
            page = pygame.Surface(size, pygame.SRCALPHA, 32)
            page.set_clip(canvas.surface.get_clip())
            begin = int(np.searchsorted(time, time[-1] - fade))
            self._fade_onto(page, canvas, trail[begin:], time[begin:], colours, width)
            self._fading = (key, page)
            self._drawn = len(trail)
        canvas.surface.blit(self._fading[1], (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
        fresh = bounded(canvas.camera.to_pixels(trail[min(self._drawn, len(trail)) - 1 :: 2]))
        ends = bounded(canvas.camera.to_pixels(trail[-1:]))
        paths = np.concatenate([fresh, ends])
        for robot, colour in enumerate(colours):
            if np.isfinite(paths[:, robot]).all():
                canvas.outline(paths[:, robot], colour, width, closed=False)

    def _fade_onto(
        self,
        page: pygame.Surface,
        canvas: Canvas,
        trail: Array,
        time: Array,
        colours: list[Colour],
        width: int,
    ) -> None:
        rows = np.unique(np.linspace(0, len(trail) - 1, 4 * FADE_STEPS + 1).astype(int))
        points = bounded(canvas.camera.to_pixels(trail[rows]))
        age = np.clip((time[-1] - time[rows]) / max(self.fade or 0.0, 1e-9), 0.0, 1.0)
        for first in range(0, len(rows) - 1, 4):
            last = min(first + 4, len(rows) - 1)
            part = 1.0 - age[first : last + 1].mean()
            for robot, colour in enumerate(colours):
                path = points[first : last + 1, robot]
                if not np.isfinite(path).all() or np.ptp(path, axis=0).max() < 0.5:
                    continue
                shade = mix(canvas.theme.background, colour, 0.1 + 0.9 * part)
                pygame.draw.lines(page, shade, False, path.tolist(), width)

    def _of_robots(self, canvas: Canvas) -> list[Colour]:
        theme, n = canvas.theme, len(canvas.hues)
        if self.colours == "paper":
            return [theme.trajectory] * n
        if n > ONE_HUE_EACH:
            return [mix(theme.trajectory, theme.background, 0.25)] * n
        return [theme.trail(hue) for hue in canvas.hues.tolist()]

    def legend(self, scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            angle = np.linspace(-np.pi, np.pi, 24)
            wave = np.column_stack([x + angle * 2.9 * canvas.scale, y - 3 * canvas.scale * np.sin(angle)])
            sketch = Sketch.around(wave.tolist(), 3.0)
            if sketch is not None:
                width = canvas.theme.trajectory_line * canvas.scale
                sketch.path(wave.tolist(), self._of_robots(canvas)[0], width)
                sketch.onto(canvas.surface)

        return [LegendEntry("trajectory", glyph, self.colours)] if scene.trail is not None else []


def _same(row: Array, other: Array) -> bool:
    return row.shape == other.shape and np.array_equal(row, other, equal_nan=True)


def _same_rows(rows: Array, other: Array) -> Array:
    if rows.shape[1:] != other.shape:
        return np.zeros(len(rows), dtype=bool)
    return np.asarray(((rows == other) | (np.isnan(rows) & np.isnan(other))).all(axis=(1, 2)))
