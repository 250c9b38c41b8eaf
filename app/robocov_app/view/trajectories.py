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
            # mostly below the robot's disc, where seams do not show
            canvas.outline(np.array([*path, end]), colour, canvas.width(width / canvas.scale), closed=False)

    def _lengthen(self, rows: Array) -> None:
        """Add the corners that lie far enough from the last of each path."""
        last = np.array([path[-1] for path in self._open])
        for row in rows:
            delta = row - last
            far = delta[:, 0] ** 2 + delta[:, 1] ** 2 >= PIECE * PIECE
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
        continues = (
            key == self._key
            and 0 < self._drawn <= len(trail)
            and np.array_equal(trail[self._drawn - 1], self._last_row)
        )
        if self._page is None or not continues:
            self._page = pygame.Surface(size, pygame.SRCALPHA, 32)
            self._key, self._drawn = key, 0
            self._open = [[point] for point in bounded(canvas.camera.to_pixels(trail[0])).tolist()]
        self._page.set_clip(canvas.surface.get_clip())
        return self._page, continues

    def _faded(self, canvas: Canvas, trail: Array, time: Array, colours: list[Colour], width: int) -> None:
        fade = self.fade or 0.0
        begin = int(np.searchsorted(time, time[-1] - fade))
        rows = np.unique(np.linspace(begin, len(trail) - 1, 40).astype(int))
        points = canvas.camera.to_pixels(trail[rows])
        age = (time[-1] - time[rows[:-1]]) / max(fade, 1e-9)
        for robot, colour in enumerate(colours):
            path = points[:, robot].tolist()
            for k, old in enumerate(age.tolist()):
                shade = mix(colour, canvas.theme.background, min(0.9, 0.9 * old))
                canvas.line(path[k], path[k + 1], shade, width)

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
