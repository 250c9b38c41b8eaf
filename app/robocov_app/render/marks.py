"""Marks of single robots: where they head, which failed, which one is selected."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from robocov.arrays import Array
from robocov.observation import Snapshot
from robocov.voronoi import VoronoiPartition
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas, Sprite
from robocov_app.render.layers import READABLE, SMALLEST, Layer, LegendEntry, drawn_radii, rounded
from robocov_app.render.layout import fitted_radii, mark_size
from robocov_app.render.scene import CENTROID, GOAL, Scene, are_centroids
from robocov_app.render.theme import Colour, mix


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


class Failed(Layer):
    """Robots that do not work any more: grey discs, crossed out, with their numbers beside them."""

    name = "failed"
    title = "Failed robots"

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        if not scene.failed:
            return
        failed = canvas.camera.to_pixels(np.array(list(scene.failed.values())))
        working = canvas.camera.to_pixels(scene.snapshot.positions) if scene.snapshot else np.empty((0, 2))
        centers = np.concatenate([failed, working])
        own = [scene.failed_radius(number) for number in scene.failed]
        true = np.array([*own, *(scene.team.radius if scene.snapshot else ())]) * canvas.camera.zoom
        fitted = fitted_radii(centers, true, SMALLEST * canvas.scale, 0.85 * READABLE * canvas.scale)
        radii = (np.round(2 * np.minimum(fitted[: len(failed)], 400.0)) / 2).tolist()
        around = np.concatenate([radii, drawn_radii(canvas, scene)])
        for row, (number, (x, y)) in enumerate(zip(scene.failed, failed.tolist(), strict=True)):
            self._disc(canvas, x, y, radii[row])
            self._label(canvas, str(number), failed[row], radii[row], centers, around)

    @staticmethod
    def _label(canvas: Canvas, text: str, at: Array, radius: float, centers: Array, around: Array) -> None:
        """Write the number beside the disc, where it has most room."""
        size = canvas.theme.small_text
        wide, high = canvas.text_width(text, size, bold=True), canvas.text_size(size)
        gap = 3.0 * canvas.scale
        best: tuple[float, Array] | None = None
        for side, up in ((1, 0), (-1, 0), (0, -1), (0, 1)):
            middle = at + np.array([side * (radius + gap + wide / 2), up * (radius + gap + 0.4 * high)])
            apart = np.maximum(np.abs(centers - middle) - np.array([wide / 2, 0.4 * high]), 0.0)
            room = float((np.hypot(apart[:, 0], apart[:, 1]) - around).min())
            # the first that is good enough: numbers do not hop as others pass by
            room = min(room, 0.5 * gap)
            if best is None or room > best[0]:
                best = room, middle
        assert best is not None
        canvas.text(text, best[1].tolist(), size=size, colour=canvas.theme.ink, bold=True, anchor="middle")

    @staticmethod
    def _disc(canvas: Canvas, x: float, y: float, radius: float | None = None) -> None:
        radius = 6.5 * canvas.scale if radius is None else radius
        theme, scale = canvas.theme, canvas.scale
        fill, edge = _fill(canvas), mix(theme.background, theme.ink, 0.75)
        ring = min(1.2 * scale, 0.25 * radius)
        canvas.stamp(lambda shift: sprites.disc(radius, fill, edge, ring, edge, "", shift), (x, y))
        # beyond the edge: crossed out, not a sign on a button
        arm, width = round(2 * 1.1 * radius) / 2, min(1.7 * scale, 0.35 * radius)
        canvas.stamp(
            lambda shift: sprites.cross(arm, theme.ink, theme.background, width, True, shift), (x, y)
        )

    def legend(self, scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            self._disc(canvas, x, y, 6.0 * canvas.scale)

        return [LegendEntry("failed robot", glyph)] if scene.failed else []


def _fill(canvas: Canvas) -> Colour:
    return mix(canvas.theme.background, canvas.theme.ink, 0.3)


class Selection(Layer):
    """A ring around the robot that is asked about, and where it believes itself and the others to be.

    Only where that is not where they are: messages are late, get lost, or tell what is not so. Its own cell
    is then drawn as it takes it to be; those of others overlap it, or leave gaps.
    """

    name = "selection"
    title = "Selection"

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        if scene.snapshot is None or scene.selected is None:
            return
        if scene.snapshot.seen.reported_positions is not None:
            self._draw_belief(canvas, scene.snapshot, scene.selected)
        radius = drawn_radii(canvas, scene)[scene.selected] + 4.0 * canvas.scale
        center = canvas.camera.to_pixels(scene.snapshot.positions[scene.selected]).tolist()
        width, colour = 2.2 * canvas.scale, canvas.theme.ink
        canvas.stamp(lambda shift: sprites.ring(radius, colour, width, shift), center)

    def legend(self, scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            colour = mix(canvas.theme.robots[0], canvas.theme.ink, 0.2)
            canvas.stamp(partial(sprites.ring, 5.0 * canvas.scale, colour, 1.6 * canvas.scale), (x, y))

        if scene.snapshot is None or scene.selected is None or scene.snapshot.seen.reported_positions is None:
            return []
        return [LegendEntry(f"as robot {scene.number(scene.selected)} believes", glyph)]

    @staticmethod
    def _draw_belief(canvas: Canvas, snapshot: Snapshot, robot: int) -> None:
        """Draw the cell and the places of others as a robot believes them to be."""
        seen, cells, theme = snapshot.seen, snapshot.decision.cells, canvas.theme
        if isinstance(cells, VoronoiPartition) and len(cells.polygons[robot]) > 2:
            corners = canvas.camera.to_pixels(cells.polygons[robot])
            canvas.outline(corners, theme.ink, canvas.width(1.6 * theme.line))
        others = seen.neighbours.of(robot).tolist()
        believed = canvas.camera.to_pixels(seen.neighbour_positions(robot)).tolist()
        there = canvas.camera.to_pixels(snapshot.positions).tolist()
        for other, place in zip(
            [robot, *others],
            [canvas.camera.to_pixels(seen.positions[robot]).tolist(), *believed],
            strict=True,
        ):
            colour = mix(theme.robots[canvas.hues[other]], theme.ink, 0.2)
            canvas.dashes(there[other], place, colour, dash=3.0)
            canvas.stamp(partial(sprites.ring, 5.0 * canvas.scale, colour, 1.6 * canvas.scale), place)
