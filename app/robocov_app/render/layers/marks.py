"""Layers of marks: starts, contacts, goals and centroids of cells."""

from functools import partial

import numpy as np
import pygame

from robocov.typing import FloatArray
from robocov_app.look import legend
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas, Glyph, LegendEntry, PlacedSprites, Sprite
from robocov_app.render.crowding import MAX_MARKED_ROBOTS, fit_mark_size, is_crowd, round_to_half
from robocov_app.render.layers.layer import build_legend
from robocov_app.render.layers.robots import compute_drawn_radii
from robocov_app.render.scene import Scene, are_centroids
from robocov_app.render.surface_cache import LatestValue

# Lengths in pixels at scale 1.
_MIN_MARK_PX = 5.0
_START_SIZE_PX = 9.0
_CENTROID_SIZE_PX = 11.0
_START_SYMBOL_RADIUS_PX = 4.5
_GOAL_ARM_PX = 5.5
_CONTACT_ARM_PX = 5.5
_CONTACT_WIDTH_PX = 1.5
_CONTACT_GAP_PX = 2.5
_MIN_DISTANCE_PX = 1e-6
_RING_WIDTH_PX = 1.6
_MAX_RING_WIDTH_FRACTION = 0.4
"""Maximum width of the ring of a start, as a fraction of its radius."""
_GOAL_WIDTH_PX = 1.8
_MAX_GOAL_WIDTH_FRACTION = 0.4
_CENTROID_WIDTH_PX = 1.3
_MAX_CENTROID_WIDTH_FRACTION = 0.3
"""Maximum width of the lines of a cross, as a fraction of half its size."""


class StartsLayer:
    """Draws rings at the starts of robots; they are placed again only when the view changes."""

    def __init__(self) -> None:
        self._rings = LatestValue[PlacedSprites]()

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        """Draw the starts of a scene, unless there is a crowd of robots."""
        starts = scene.starts
        assert starts is not None
        if scene.snapshot is not None and is_crowd(scene.snapshot.positions, canvas.camera):
            return

        def place_rings() -> PlacedSprites:
            centers = canvas.camera.to_pixels(starts)
            size = fit_mark_size(centers, _MIN_MARK_PX * canvas.scale, _START_SIZE_PX * canvas.scale)
            return canvas.place_sprites([_build_start_ring(canvas, round_to_half(0.5 * size))], centers)

        key = (canvas.camera, canvas.scale, canvas.theme.name, canvas.surface.get_size())
        canvas.surface.fblits(
            self._rings.get_or_compute(starts, key, place_rings), pygame.BLEND_PREMULTIPLIED
        )


def _build_start_ring(canvas: Canvas, radius: float) -> Sprite:
    width = min(_RING_WIDTH_PX * canvas.scale, _MAX_RING_WIDTH_FRACTION * radius)
    return partial(sprites.render_ring, radius, canvas.theme.start, width)


def _draw_start_symbol(canvas: Canvas, x: float, y: float) -> None:
    canvas.draw_sprite(_build_start_ring(canvas, _START_SYMBOL_RADIUS_PX * canvas.scale), (x, y))


build_starts_legend = build_legend(
    legend.START, _draw_start_symbol, lambda scene: len(scene.team) <= MAX_MARKED_ROBOTS
)


def draw_centroids(canvas: Canvas, scene: Scene) -> None:
    """Draw a plus sign at each centroid, or an x at each goal, except where the robot has arrived.

    In a crowd of robots nothing is drawn.
    """
    name, targets = _choose_targets(scene)
    if not name or is_crowd(scene.now.positions, canvas.camera):
        return
    centers = canvas.camera.to_pixels(targets)
    distances = np.hypot(*(centers - canvas.camera.to_pixels(scene.now.positions)).T)
    has_target = np.isfinite(distances)
    size = fit_mark_size(centers[has_target], _MIN_MARK_PX * canvas.scale, _CENTROID_SIZE_PX * canvas.scale)
    is_away = distances > compute_drawn_radii(canvas, scene)
    cross = _build_cross(canvas, name, round_to_half(0.5 * size))
    canvas.draw_sprites([cross], centers[has_target & is_away])


def build_centroids_legend(scene: Scene) -> list[LegendEntry]:
    """Build the legend of centroids or goals, whichever are drawn."""
    name, _ = _choose_targets(scene)
    if not name or len(scene.team) > MAX_MARKED_ROBOTS:
        return []
    return [LegendEntry(name, _build_cross_glyph(name))]


def _choose_targets(scene: Scene) -> tuple[str, FloatArray]:
    """Return the name of the targets in the legend, and their positions, (n, 2) m.

    The targets are the centroids if they equal the goals, otherwise the goals. The name is empty if there are
    no goals.
    """
    if scene.snapshot is None or scene.centroids is None:
        return "", np.empty((0, 2))
    goals = scene.snapshot.decision.goals
    if goals is None:
        return "", np.empty((0, 2))
    centroids = scene.centroids
    cells = scene.snapshot.decision.cells
    if cells is not None:
        # A robot that misses messages computes a cell that differs from the drawn one. Goals are compared
        # with the centroids of computed cells, otherwise the name would change with each lost message.
        centroids = cells.centroids
    if centroids.shape == goals.shape and are_centroids(goals, centroids):
        return legend.CELL_CENTROID, scene.centroids
    return legend.GOAL, goals


def draw_contacts(canvas: Canvas, scene: Scene) -> None:
    """Draw a star at each point at which a robot touches something, unless there is a crowd of robots.

    Small robots are drawn larger than they are. The star of a contact with a wall is at the rim of the drawn
    robot, so that it does not cover its number.
    """
    contacts = scene.contacts
    assert contacts is not None
    if is_crowd(scene.now.positions, canvas.camera):
        return
    centers = canvas.camera.to_pixels(scene.now.positions)[contacts.rows]
    offsets = canvas.camera.to_pixels(contacts.points) - centers
    distances = np.hypot(*offsets.T)
    drawn_radii = np.array(compute_drawn_radii(canvas, scene))[contacts.rows]
    rim_distances = drawn_radii + _CONTACT_GAP_PX * canvas.scale
    factors = np.maximum(rim_distances / np.maximum(distances, _MIN_DISTANCE_PX), 1.0)
    stars = centers + factors[:, None] * offsets
    points_between_robots = canvas.camera.to_pixels(contacts.points_between_robots)
    canvas.draw_sprites([_build_contact_star(canvas)], np.concatenate([stars, points_between_robots]))


def _build_contact_star(canvas: Canvas) -> Sprite:
    theme = canvas.theme
    return partial(
        sprites.render_burst,
        _CONTACT_ARM_PX * canvas.scale,
        color=theme.error,
        halo=theme.background,
        width=_CONTACT_WIDTH_PX * canvas.scale,
    )


def _draw_contact_symbol(canvas: Canvas, x: float, y: float) -> None:
    canvas.draw_sprite(_build_contact_star(canvas), (x, y))


build_contacts_legend = build_legend(legend.CONTACT, _draw_contact_symbol)


def draw_goals(canvas: Canvas, scene: Scene) -> None:
    """Draw the mark of each goal, connected with its robot by a dashed line."""
    if scene.now.decision.goals is None:
        return
    goals = canvas.camera.to_pixels(scene.now.decision.goals)
    centers = canvas.camera.to_pixels(scene.now.positions)
    has_goal = np.isfinite(goals).all(axis=1)
    for center, goal in zip(centers[has_goal].tolist(), goals[has_goal].tolist(), strict=True):
        canvas.draw_dashed_line(center, goal, canvas.theme.faint)
    mark = _choose_goal_mark(scene)
    canvas.draw_sprites([_build_cross(canvas, mark, _GOAL_ARM_PX * canvas.scale)], goals)


def _choose_goal_mark(scene: Scene) -> str:
    """Return the name of the mark of goals: that of centroids if they are centroids.

    Both layers may be shown. An x over a plus sign would look like a star.
    """
    name, _ = _choose_targets(scene)
    return name or legend.GOAL


def _build_cross(canvas: Canvas, name: str, arm: float) -> Sprite:
    """Return the mark of a goal (an x) or a centroid (a plus sign); `arm` is half its size, px."""
    theme = canvas.theme
    is_goal = name == legend.GOAL
    if is_goal:
        color = theme.final
        width = min(_GOAL_WIDTH_PX * canvas.scale, _MAX_GOAL_WIDTH_FRACTION * arm)
    else:
        color = theme.ink
        width = min(_CENTROID_WIDTH_PX * canvas.scale, _MAX_CENTROID_WIDTH_FRACTION * arm)
    return partial(
        sprites.render_cross,
        arm,
        color=color,
        halo=theme.background,
        width=width,
        is_diagonal=is_goal,
    )


def _build_cross_glyph(name: str) -> Glyph:
    def draw_symbol(canvas: Canvas, x: float, y: float) -> None:
        canvas.draw_sprite(_build_cross(canvas, name, _GOAL_ARM_PX * canvas.scale), (x, y))

    return draw_symbol


def build_goals_legend(scene: Scene) -> list[LegendEntry]:
    """Build the legend of goals, with the mark that is drawn."""
    if scene.now.decision.goals is None:
        return []
    mark = _choose_goal_mark(scene)
    return [LegendEntry(legend.GOAL, _build_cross_glyph(mark), style=mark)]
