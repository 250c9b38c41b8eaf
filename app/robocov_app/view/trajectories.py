"""The trajectories layer: what is old is kept on a page of its own, only new pieces are drawn."""

from __future__ import annotations

import numpy as np
import pygame

from robocov.arrays import Array
from robocov_app.view.canvas import Canvas
from robocov_app.view.layers import Layer, LegendEntry
from robocov_app.view.scene import Scene
from robocov_app.view.theme import ONE_HUE_EACH, Colour, mix

PIECE = 2.5
"""Pixels between the corners of a drawn trajectory: shorter pieces would look lumpy."""


class Trajectories(Layer):
    """Where the robots went.

    Parameters
    ----------
    colours : {"robots", "paper"}
        Each in its robot's colour (teams too large for that: in one quiet colour), or all red.
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
        self._first = np.empty((0, 2))
        self._last_row = np.empty((0, 2))
        self._corner = np.empty((0, 2))

    def draw(self, canvas: Canvas, scene: Scene) -> None:  # noqa: D102
        trail = scene.trail
        if trail is None or len(trail) == 0:
            return
        colours = self._of_robots(canvas)
        width = canvas.width(canvas.theme.trajectory_line if trail.shape[1] <= ONE_HUE_EACH else 1.0)
        if self.fade is not None and scene.trail_time is not None:
            self._faded(canvas, trail, scene.trail_time, colours, width)
            return
        page = self._page_for(canvas, trail)
        fresh = canvas.camera.to_pixels(trail[self._drawn :])
        for row in fresh:
            far = np.hypot(*(row - self._corner).T) >= PIECE
            for robot in np.nonzero(far)[0].tolist():
                start, end = self._corner[robot].tolist(), row[robot].tolist()
                pygame.draw.aaline(page, colours[robot], start, end, width)
            self._corner = np.where(far[:, None], row, self._corner)
        self._drawn = len(trail)
        self._last_row = trail[-1].copy()
        canvas.surface.blit(page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
        ends = canvas.camera.to_pixels(trail[-1]).tolist()
        for corner, end, colour in zip(self._corner.tolist(), ends, colours, strict=True):
            canvas.line(corner, end, colour, width)

    def _page_for(self, canvas: Canvas, trail: Array) -> pygame.Surface:
        """Return the page of old pieces, a fresh one when `trail` does not continue what is on it."""
        size = canvas.surface.get_size()
        key = (canvas.camera, canvas.theme.name, canvas.scale, size, self.colours, trail.shape[1])
        continues = (
            self._page is not None
            and key == self._key
            and 0 < self._drawn <= len(trail)
            and np.array_equal(trail[0], self._first)
            and np.array_equal(trail[self._drawn - 1], self._last_row)
        )
        if not continues or self._page is None:
            self._page = pygame.Surface(size, pygame.SRCALPHA, 32)
            self._key, self._drawn, self._first = key, 0, trail[0].copy()
            self._corner = canvas.camera.to_pixels(trail[0])
        self._page.set_clip(canvas.surface.get_clip())
        return self._page

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
            return [mix(theme.background, theme.ink, 0.6)] * n
        return [mix(theme.robots[hue], theme.ink, 0.12) for hue in canvas.hues.tolist()]

    def legend(self, scene: Scene) -> list[LegendEntry]:  # noqa: D102
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            angle = np.linspace(-np.pi, np.pi, 24)
            wave = np.column_stack([x + angle * 3.2 * canvas.scale, y - 3 * canvas.scale * np.sin(angle)])
            canvas.outline(wave, self._of_robots(canvas)[0], canvas.width(1.6), closed=False)

        return [LegendEntry("trajectory", glyph)] if scene.trail is not None else []
