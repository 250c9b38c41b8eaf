"""Marks of single robots: that one failed, that one is asked about."""

from __future__ import annotations

from functools import partial

import numpy as np

from robocov.arrays import Array
from robocov.observation import Snapshot
from robocov.voronoi import VoronoiPartition
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas
from robocov_app.render.layers import READABLE, SMALLEST, Layer, LegendEntry, drawn_radii
from robocov_app.render.scene import Scene
from robocov_app.render.spacing import fitted_radii
from robocov_app.render.theme import Colour, mix


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
