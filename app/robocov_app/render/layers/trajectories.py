"""The layer of trajectories: finished sections stay on a page, so that only new ones have to be drawn."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import pygame

from robocov.typing import FloatArray
from robocov_app.look import legend
from robocov_app.look.colors import Color
from robocov_app.look.hues import ColorScheme, choose_trail_colors
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.clipping import limit_pixels
from robocov_app.render.crowding import choose_width_factor
from robocov_app.render.layers.fading_trails import FADE_STEPS, MARGIN_PX, Pen, draw_fading_trails
from robocov_app.render.scene import Scene
from robocov_app.render.sprites import Sketch, find_visible_box
from robocov_app.render.surface_cache import LatestValue

MIN_STEP_PX = 2.0
"""Minimum distance between the corners of a drawn trajectory."""
SECTION_PX = 16.0
"""Length of the sections that are added to the page; shorter ends are drawn again in each frame."""
MAX_ANTIALIASED_ENDS = 399
"""Maximum number of robots whose trajectories have antialiased ends; with more, this would take too long."""
_WAVE_PX_PER_RAD = 2.9
_WAVE_HEIGHT_PX = 3
"""Length per radian and amplitude of the wave in the legend, at scale 1."""
_MIN_MOVE_PX = 1.0
"""Robots that have moved less have no trajectory yet."""

Path: TypeAlias = list[list[float]]
"""Corners of a trajectory, px; the path of an absent robot is a single corner at nan."""


class _Section(NamedTuple):
    """A finished section of a trajectory.

    Attributes
    ----------
    robot : int
        Row of the robot.
    path : Path
    """

    robot: int
    path: Path


class TrajectoriesLayer:
    """Draws the trajectories of robots; positions of absent robots are nan.

    Finished sections are drawn on a page, which is kept from frame to frame while the view and the first part
    of the trail stay the same. The open path of each robot continues its last section and is drawn again in
    each frame.

    Parameters
    ----------
    colors : {"robots", "paper"}
        Whether each trajectory has the color of its robot, or all have the same.
    """

    def __init__(self, colors: ColorScheme = "robots") -> None:
        self._color_scheme: ColorScheme = colors
        self._page = pygame.Surface((0, 0))
        self._key: object = None
        self._n_drawn_rows = 0
        self._last_row = np.empty((0, 2))
        self._open_paths: list[Path] = []
        self._ended: list[_Section] = []
        self._colors = LatestValue[list[Color]]()

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        """Draw the trail of a scene; if the page can be continued, add only the new rows."""
        trail = scene.trail
        if trail is None or len(trail) == 0:
            return
        n_robots = trail.shape[1]
        width = canvas.scale * canvas.theme.trajectory_line * choose_width_factor(n_robots)
        pen = Pen(self._choose_colors(canvas, n_robots), width)
        key = _build_key(canvas, scene, pen, n_robots)
        self._n_drawn_rows = self._count_drawn_rows(trail)
        is_continued = key == self._key and self._n_drawn_rows > 0
        is_fading = False
        if not is_continued:
            self._start_page(canvas, trail, key)
            is_fading = self._draw_fading_trails(canvas, scene, trail, pen)
        self._extend_paths(_to_limited_pixels(canvas, trail[self._n_drawn_rows :]))
        self._n_drawn_rows = len(trail)
        self._last_row = trail[-1].copy()
        is_new_page = not is_continued and not is_fading
        min_corners = 1 + SECTION_PX / MIN_STEP_PX
        # On a new page, all paths so far are finished at once, however short.
        if is_new_page:
            min_corners = 2
        self._draw_sections(self._finish_sections(min_corners), pen, can_merge=is_new_page)
        canvas.surface.blit(self._page, (0, 0), special_flags=pygame.BLEND_PREMULTIPLIED)
        self._draw_ends(canvas, _to_limited_pixels(canvas, trail[-1]).tolist(), pen)

    def _count_drawn_rows(self, trail: FloatArray) -> int:
        """Return the number of rows of a trail that are on the page: those up to the row drawn last.

        They are fewer than in the last frame if older rows were removed since, and 0 if the trail does not
        contain the row that was drawn last.
        """
        n_rows = self._n_drawn_rows
        if n_rows == 0 or trail.shape[1:] != self._last_row.shape:
            return 0
        if n_rows <= len(trail) and _are_same_rows(trail[[n_rows - 1]], self._last_row).all():
            return n_rows
        rows = np.flatnonzero(_are_same_rows(trail[:n_rows], self._last_row))
        if not len(rows):
            return 0
        return int(rows[-1]) + 1

    def _start_page(self, canvas: Canvas, trail: FloatArray, key: object) -> None:
        """Start an empty page, and open paths at the first positions of the trail."""
        self._key = key
        self._page = pygame.Surface(canvas.surface.get_size(), pygame.SRCALPHA, 32)
        self._page.set_clip(canvas.surface.get_clip())
        self._n_drawn_rows = 0
        self._ended.clear()
        self._start_paths(canvas, trail[0])

    def _start_paths(self, canvas: Canvas, positions: FloatArray) -> None:
        self._open_paths = [[pixel] for pixel in _to_limited_pixels(canvas, positions).tolist()]

    def _draw_fading_trails(self, canvas: Canvas, scene: Scene, trail: FloatArray, pen: Pen) -> bool:
        """Draw the whole trail on the page if trails fade, and return whether they do."""
        if not scene.trail_fade or scene.trail_time is None:
            return False
        draw_fading_trails(self._page, canvas, trail, scene.trail_time, fade=scene.trail_fade, pen=pen)
        self._n_drawn_rows = len(trail)
        self._start_paths(canvas, trail[-1])
        return True

    def _extend_paths(self, rows: FloatArray) -> None:
        """Extend the open paths by new positions, (k, n, 2) px; end those of robots that fail."""
        last = np.array([path[-1] for path in self._open_paths])
        has_absent = bool(np.isnan(last).any() or np.isnan(rows).any())
        for row in rows:
            if has_absent:
                # A path starts when its robot joins, and ends when the robot fails.
                is_changed = np.isnan(last[:, 0]) != np.isnan(row[:, 0])
                for robot in np.nonzero(is_changed)[0].tolist():
                    self._ended.append(_Section(robot, self._open_paths[robot]))
                    self._open_paths[robot] = [row[robot].tolist()]
                last[is_changed] = row[is_changed]
            delta = row - last
            has_moved = delta[:, 0] ** 2 + delta[:, 1] ** 2 >= MIN_STEP_PX * MIN_STEP_PX
            if has_moved.any():
                for robot in np.nonzero(has_moved)[0].tolist():
                    self._open_paths[robot].append(row[robot].tolist())
                last[has_moved] = row[has_moved]

    def _finish_sections(self, min_corners: float) -> list[_Section]:
        """Return the sections to draw on the page: ended paths, and open ones with enough corners.

        An open path continues at the last corner of its section.
        """
        sections = [section for section in self._ended if len(section.path) > 1]
        self._ended.clear()
        for robot, path in enumerate(self._open_paths):
            if len(path) >= min_corners:
                sections.append(_Section(robot, path))
                self._open_paths[robot] = path[-1:]
        return sections

    def _draw_sections(self, sections: list[_Section], pen: Pen, *, can_merge: bool) -> None:
        """Draw sections on the page: each in its own sketch, or in one if `can_merge` and that is smaller."""
        groups = [[section] for section in sections]
        boxes = [self._find_box(group, pen.width) for group in groups]
        if can_merge:
            box = self._find_box(sections, pen.width)
            if box is not None and _sum_areas(boxes) > box.width * box.height:
                groups = [sections]
                boxes = [box]
        for group, box in zip(groups, boxes, strict=True):
            if box is None:
                continue
            sketch = Sketch(box)
            for section in group:
                sketch.draw_path(section.path, pen.colors[section.robot], pen.width)
            sketch.draw_on(self._page)

    def _find_box(self, sections: Sequence[_Section], width: float) -> pygame.Rect | None:
        """Return the visible box around sections drawn with a line width, px; None if nothing is visible."""
        paths = [section.path for section in sections]
        points = np.concatenate([np.empty((0, 2)), *paths])
        return find_visible_box(points, MARGIN_PX + width, self._page)

    def _draw_ends(self, canvas: Canvas, ends: list[list[float]], pen: Pen) -> None:
        """Draw the open path of each robot up to its current position, which is given in pixels.

        The robots cover most of these lines, so seams and jagged edges do not show.
        """
        width = canvas.scale_width(pen.width / canvas.scale)
        is_antialiased = len(ends) <= MAX_ANTIALIASED_ENDS
        for path, end, color in zip(self._open_paths, ends, pen.colors, strict=True):
            if _is_absent(path) or _is_at_start(path, end):
                continue
            points = [*path, end]
            if width > 1:
                canvas.draw_outline(np.array(points), color, width, is_closed=False)
            elif is_antialiased:
                canvas.draw_thin_path(points, color)
            else:
                pygame.draw.lines(canvas.surface, color, False, points)

    def _choose_colors(self, canvas: Canvas, n_robots: int) -> list[Color]:
        """Return the color of each trajectory: working robots first, then failed ones."""
        theme = canvas.theme
        hues = canvas.hues.tolist()
        working = self._colors.get_or_compute(
            None, (theme.name, hues), lambda: choose_trail_colors(theme, hues, self._color_scheme)
        )
        return working + [theme.failed_trajectory] * (n_robots - len(working))

    def build_legend(self, scene: Scene) -> list[LegendEntry]:
        """Build the legend, whose symbol is a wave in the color of the first robot."""

        def draw_symbol(canvas: Canvas, x: float, y: float) -> None:
            angles = np.linspace(-np.pi, np.pi, 24)
            columns = x + angles * _WAVE_PX_PER_RAD * canvas.scale
            rows = y - _WAVE_HEIGHT_PX * canvas.scale * np.sin(angles)
            wave = np.column_stack([columns, rows]).tolist()
            sketch = Sketch.from_points(wave, 3.0)
            if sketch is not None:
                width = canvas.theme.trajectory_line * canvas.scale
                sketch.draw_path(wave, self._choose_colors(canvas, 1)[0], width)
                sketch.draw_on(canvas.surface)

        return [LegendEntry(legend.TRAJECTORY, draw_symbol, self._color_scheme)]


def _build_key(canvas: Canvas, scene: Scene, pen: Pen, n_robots: int) -> tuple[object, ...]:
    """Return all that the page depends on, apart from the trail; the time step too if trails fade."""
    fade_step = None
    if scene.trail_fade and scene.trail_time is not None:
        step = int(np.floor(scene.trail_time[-1] / scene.trail_fade * FADE_STEPS))
        fade_step = (scene.trail_fade, step)
    return (
        canvas.camera,
        canvas.theme.name,
        canvas.scale,
        canvas.surface.get_size(),
        tuple(canvas.surface.get_clip()),
        tuple(pen.colors),
        n_robots,
        fade_step,
    )


def _to_limited_pixels(canvas: Canvas, positions: FloatArray) -> FloatArray:
    """Convert positions, (..., 2) m, to pixels that pygame can draw."""
    return limit_pixels(canvas.camera.to_pixels(positions))


def _is_absent(path: Path) -> bool:
    """Return whether a path is that of an absent robot."""
    return math.isnan(path[-1][0])


def _is_at_start(path: Path, end: list[float]) -> bool:
    """Return whether a robot has hardly moved since the start of its path."""
    if len(path) > 1:
        return False
    return max(abs(path[0][0] - end[0]), abs(path[0][1] - end[1])) < _MIN_MOVE_PX


def _sum_areas(boxes: Iterable[pygame.Rect | None]) -> int:
    return sum(box.width * box.height for box in boxes if box is not None)


def _are_same_rows(rows: FloatArray, row: FloatArray) -> FloatArray:
    """Return a mask of the rows, (k, n, 2), that equal a given row, (n, 2); nan equals nan."""
    is_same = (rows == row) | (np.isnan(rows) & np.isnan(row))
    return np.asarray(is_same.all(axis=(1, 2)))
