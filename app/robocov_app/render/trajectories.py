"""The trajectories layer: what is old is kept on a page of its own, only new pieces are drawn."""

from itertools import pairwise
from typing import TypeAlias

import numpy as np
import pygame

from robocov.arrays import Array, IntArray
from robocov_app.look import legend
from robocov_app.look.colors import Color
from robocov_app.look.robot_colors import ColorScheme, choose_trail_colors
from robocov_app.render.canvas import Canvas, LegendEntry, premultiply
from robocov_app.render.clipping import limit_pixels
from robocov_app.render.layout import line_crowding
from robocov_app.render.scene import Scene
from robocov_app.render.sprites import Sketch, find_visible_box
from robocov_app.render.surface_cache import LatestValue

PIECE = 2.0  # pixels between the corners of a drawn trajectory
SECTION = 16.0  # pixels of path that are added to the page at once; what is newer is drawn anew each time
CROWD = 400  # from so many robots on what is drawn anew is not smooth
FADE_STEPS = 24  # shades of a trajectory that fades; its page is drawn anew as often while it fades
FADE_PIECE = 4.0  # pixels at scale 1 that the fastest robot goes between the corners of those that fade
_FADE_FINE = 2  # they are drawn so many times larger, and shrunk

Pen: TypeAlias = tuple[list[Color], float]  # colors of robots, width in pixels


class Trajectories:
    """Trajectories, nan where there is none; each in its robot's color, or all red (`colors` "paper")."""

    def __init__(self, colors: ColorScheme = "robots") -> None:
        self.colors = colors
        self._page = pygame.Surface((0, 0))
        self._key: object = None
        self._drawn = 0
        self._last_row = np.empty((0, 2))
        self._open: list[list[list[float]]] = []
        self._ended: list[tuple[int, list[list[float]]]] = []
        self._trail_colors = LatestValue[list[Color]]()

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        trail = scene.trail
        if trail is None or len(trail) == 0:
            return
        colors = self._of_robots(canvas)
        width = canvas.scale * canvas.theme.trajectory_line * line_crowding(trail.shape[1])
        continues = self._continued(canvas, scene, trail, (colors, width))
        self._lengthen(limit_pixels(canvas.camera.to_pixels(trail[self._drawn :])))
        self._drawn, self._last_row = len(trail), trail[-1].copy()
        self._finish_sections((colors, width), together=not continues)
        canvas.surface.blit(self._page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
        ends = limit_pixels(canvas.camera.to_pixels(trail[-1])).tolist()
        whole = canvas.scale_width(width / canvas.scale)
        # mostly below the robot's disc, where seams do not show, nor steps in a crowd
        smooth = len(ends) < CROWD
        for path, end, color in zip(self._open, ends, colors, strict=True):
            still = len(path) == 1 and max(abs(path[0][0] - end[0]), abs(path[0][1] - end[1])) < 1.0
            if still or path[-1][0] != path[-1][0]:  # nan: not there yet
                continue
            if whole == 1 and smooth:
                canvas.draw_thin_path([*path, end], color)
            elif whole == 1:
                pygame.draw.lines(canvas.surface, color, False, [*path, end])
            else:
                canvas.draw_outline(np.array([*path, end]), color, whole, is_closed=False)

    def _lengthen(self, rows: Array) -> None:
        last = np.array([path[-1] for path in self._open])
        gaps = bool(np.isnan(last).any() or np.isnan(rows).any())
        for row in rows:
            if gaps:  # a robot that comes begins a path, and ends it when it goes
                changed = np.isnan(last[:, 0]) != np.isnan(row[:, 0])
                for robot in np.nonzero(changed)[0].tolist():
                    self._ended.append((robot, self._open[robot]))
                    self._open[robot] = [row[robot].tolist()]
                last[changed] = row[changed]
            delta = row - last
            far = delta[:, 0] ** 2 + delta[:, 1] ** 2 >= PIECE * PIECE
            if far.any():
                for robot in np.nonzero(far)[0].tolist():
                    self._open[robot].append(row[robot].tolist())
                last[far] = row[far]

    def _finish_sections(self, pen: Pen, together: bool) -> None:
        """Draw what is long enough on the page, and begin anew at its end."""
        colors, width = pen
        corners = 2 if together else 1 + SECTION / PIECE
        done = [(robot, path) for robot, path in self._ended if len(path) > 1]
        self._ended.clear()
        for robot, path in enumerate(self._open):
            if len(path) >= corners:
                done.append((robot, path))
                self._open[robot] = path[-1:]
        groups = [(self._box(group, width), group) for group in ([each] for each in done)]
        apart = sum(box.width * box.height for box, _ in groups if box)
        if together and (whole := self._box(done, width)) and apart > whole.width * whole.height:
            groups = [(whole, done)]
        for box, group in groups:
            if box is not None:
                sketch = Sketch(box)
                for robot, path in group:
                    sketch.draw_path(path, colors[robot], width)
                sketch.draw_on(self._page)

    def _box(self, group: list[tuple[int, list[list[float]]]], width: float) -> pygame.Rect | None:
        points = np.concatenate([np.empty((0, 2)), *(path for _, path in group)])
        return find_visible_box(points, 5.0 + width, self._page)

    def _continued(self, canvas: Canvas, scene: Scene, trail: Array, pen: Pen) -> bool:
        """Return whether a trail continues the page of old sections; if not, that is fresh from now on."""
        size, clip = canvas.surface.get_size(), canvas.surface.get_clip()
        fade, time, step = scene.trail_fade, scene.trail_time, None
        if fade and time is not None:
            step = fade, int(np.floor(time[-1] / fade * FADE_STEPS))
        view = canvas.camera, canvas.theme.name, canvas.scale, size, tuple(clip)
        key = *view, tuple(pen[0]), trail.shape[1], step
        continues = key == self._key and self._drawn > 0 and self._found(trail)
        if not continues:
            self._page = pygame.Surface(size, pygame.SRCALPHA, 32)
            self._page.set_clip(clip)
            self._key, self._drawn = key, 0
            self._ended.clear()
            if fade and time is not None:
                _fade_on(self._page, canvas, trail, time, fade, pen)
                self._drawn, continues = len(trail), True
            row = trail[self._drawn - 1 if self._drawn else 0]
            self._open = [[point] for point in limit_pixels(canvas.camera.to_pixels(row)).tolist()]
        return continues

    def _found(self, trail: Array) -> bool:
        """Look for the row that was drawn last; where old rows were thinned it has come forward."""
        if self._drawn <= len(trail) and _same_rows(trail[[self._drawn - 1]], self._last_row).all():
            return True
        rows = np.flatnonzero(_same_rows(trail[: self._drawn], self._last_row))
        if len(rows):
            self._drawn = int(rows[-1]) + 1
        return len(rows) > 0

    def _of_robots(self, canvas: Canvas) -> list[Color]:
        hues = canvas.hues.tolist()
        look = canvas.theme.name, hues
        return self._trail_colors.get(
            None, look, lambda: choose_trail_colors(canvas.theme, hues, self.colors)
        )

    def legend(self, scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            angle = np.linspace(-np.pi, np.pi, 24)
            wave = np.column_stack([x + angle * 2.9 * canvas.scale, y - 3 * canvas.scale * np.sin(angle)])
            sketch = Sketch.from_points(wave.tolist(), 3.0)
            if sketch is not None:
                width = canvas.theme.trajectory_line * canvas.scale
                sketch.draw_path(wave.tolist(), self._of_robots(canvas)[0], width)
                sketch.draw_on(canvas.surface)

        return [LegendEntry(legend.TRAJECTORY, glyph, self.colors)]


def _fade_on(page: pygame.Surface, canvas: Canvas, trail: Array, time: Array, fade: float, pen: Pen) -> None:
    begin, (colors, width) = int(np.searchsorted(time, time[-1] - fade)), pen
    points = limit_pixels(canvas.camera.to_pixels(trail[begin:]))
    box = find_visible_box(points, 5.0 + width, page)
    if box is None:
        return
    shade = np.ceil((time[-1] - time[begin:]) / fade * FADE_STEPS)
    shade = np.minimum(shade, FADE_STEPS).astype(int)  # rounding may say one more
    rows = _corners(points, shade, FADE_PIECE * canvas.scale)
    points = (points[rows] - np.array(box.topleft) + 0.5) * _FADE_FINE
    shade = shade[rows]
    sketch = Sketch(box, _FADE_FINE)
    wide = max(1, round(width * _FADE_FINE))
    tips = np.full((len(colors), 2), np.nan)
    # the older ones first: where paths cross, the newer ones are on top
    for first, last in pairwise([0, *(np.flatnonzero(np.diff(shade)) + 1).tolist(), len(rows) - 1]):
        # slowly at first: what is half forgotten can still be followed
        part = (1.0 - max(float(shade[first]) - 0.5, 0.0) / FADE_STEPS) ** 0.7
        shades = {color: premultiply(color, part) for color in set(colors)}
        paths = points[first : last + 1]
        moves = ~(np.abs(paths - tips).max(axis=(0, 2)) < _FADE_FINE)
        gone = np.isnan(paths).any(axis=(0, 2)).tolist()
        tip, lines = tips.tolist(), paths.swapaxes(0, 1).tolist()
        for robot in np.flatnonzero(moves).tolist():
            color = shades[colors[robot]]
            if tip[robot][0] == tip[robot][0]:  # not nan
                lines[robot][0] = tip[robot]
            for run in _runs(paths[:, robot]) if gone[robot] else [lines[robot]]:
                if len(run) > 1:
                    pygame.draw.lines(sketch.large, color, False, run, wide)
                # lines have straight ends: fill the corners' notches
                for point in run if len(run) > 1 and wide > 2.5 * _FADE_FINE else ():
                    pygame.draw.circle(sketch.large, color, point, wide / 2)
        tips[moves] = paths[-1, moves]
    sketch.draw_on(page)


def _corners(points: Array, shade: IntArray, piece: float) -> IntArray:
    """Return the rows of (k, n, 2) px that are needed to draw all paths: few where all robots are slow."""
    gone = np.isnan(points[..., 0])
    steps = np.hypot(*np.moveaxis(np.diff(points, axis=0), -1, 0))
    way = np.floor(np.cumsum(np.where(np.isnan(steps), 0.0, steps).max(axis=1)) / piece)
    changes = (gone[1:] != gone[:-1]).any(axis=1)
    needed = np.append(True, (np.diff(way, prepend=0.0) > 0) | (np.diff(shade) != 0) | changes)
    needed[:-1] |= changes
    needed[-1] = True
    return np.flatnonzero(needed)


def _runs(path: Array) -> list[list[list[float]]]:
    """Return the pieces of (k, 2) between those where the robot is not there."""
    pieces = np.split(path, np.flatnonzero(np.diff(np.isfinite(path[:, 0]))) + 1)
    return [piece.tolist() for piece in pieces if np.isfinite(piece[0, 0])]


def _same_rows(rows: Array, other: Array) -> Array:
    return np.asarray(((rows == other) | (np.isnan(rows) & np.isnan(other))).all(axis=(1, 2)))
