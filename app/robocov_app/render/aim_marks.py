"""Layers of where robots head: the centroids of their cells, or goals of another kind."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from robocov.arrays import Array
from robocov_app.render import sprites
from robocov_app.render.aims import CENTROID, GOAL, are_centroids
from robocov_app.render.canvas import Canvas, Sprite
from robocov_app.render.layers import Layer, LegendEntry, drawn_radii, rounded
from robocov_app.render.scene import Scene
from robocov_app.render.spacing import mark_size


class Centroids(Layer):
    """A plus at the centroid of each cell, where RAPF and Lloyd's algorithm usually head for.

    Controllers without goals, as RPF, do not know of centroids: nothing is drawn for them. Those that head
    for something else, as Atlas, do not either: their goals are drawn, as a times sign. Nor is anything drawn
    where a robot has arrived: only the ends of the sign would stick out from under its disc.
    """

    name = "centroids"
    title = "Centroids"

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        known, goals = _shown(scene)
        if scene.snapshot is None or not known:
            return
        sign = _times if known == GOAL else _plus
        centers = canvas.camera.to_pixels(goals)
        away = np.hypot(*(centers - canvas.camera.to_pixels(scene.snapshot.positions)).T)
        there = np.isfinite(away)
        arm = rounded(0.5 * mark_size(centers[there], 5.0 * canvas.scale, 11.0 * canvas.scale))
        seen = centers[there & (away > drawn_radii(canvas, scene))]
        canvas.stamps([sign(canvas, arm)], seen)

    def legend(self, scene: Scene) -> list[LegendEntry]:
        known, _ = _shown(scene)
        return [LegendEntry(known, _glyph(_times if known == GOAL else _plus))] if known else []


class Goals(Layer):
    """A times sign where each robot is drawn to, and a dashed line to it."""

    name = "goals"
    title = "Goals"
    default = False

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        if scene.snapshot is None or scene.snapshot.decision.goals is None:
            return
        goals = canvas.camera.to_pixels(scene.snapshot.decision.goals)
        centers = canvas.camera.to_pixels(scene.snapshot.positions)
        there = np.isfinite(goals).all(axis=1)
        for center, goal in zip(centers[there].tolist(), goals[there].tolist(), strict=True):
            canvas.dashes(center, goal, canvas.theme.faint)
        canvas.stamps([_times(canvas)], goals)

    def legend(self, scene: Scene) -> list[LegendEntry]:
        known = scene.snapshot is not None and scene.snapshot.decision.goals is not None
        return [LegendEntry(GOAL, _glyph(_times))] if known else []


def _shown(scene: Scene) -> tuple[str, Array]:
    """Return what the crosses are called, and where they are, (n, 2) m; an empty word for none."""
    goals = None if scene.snapshot is None else scene.snapshot.decision.goals
    if scene.snapshot is None or goals is None or scene.centroids is None:
        return "", np.empty((0, 2))
    cells = scene.snapshot.decision.cells
    # those of what robots take for their cells, where they hear only some of the others: else the word would
    # change with each message that gets lost
    believed = scene.centroids if cells is None else cells.centroid
    if believed.shape == goals.shape and are_centroids(goals, believed):
        return CENTROID, scene.centroids
    return GOAL, goals


def _plus(canvas: Canvas, arm: float | None = None) -> Sprite:
    arm = 5.5 * canvas.scale if arm is None else arm
    theme = canvas.theme
    return partial(sprites.cross, arm, theme.ink, theme.background, min(1.3 * canvas.scale, 0.3 * arm), False)


def _times(canvas: Canvas, arm: float | None = None) -> Sprite:
    arm = 5.5 * canvas.scale if arm is None else arm
    theme = canvas.theme
    return partial(
        sprites.cross, arm, theme.final, theme.background, min(1.8 * canvas.scale, 0.4 * arm), True
    )


def _glyph(sign: Callable[[Canvas], Sprite]) -> Callable[[Canvas, float, float], None]:
    return lambda canvas, x, y: canvas.stamp(sign(canvas), (x, y))
