"""Layers that explain a decision: force terms, velocities, ranges, neighbours, what was sensed."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas
from robocov_app.render.layers import Layer, LegendEntry, drawn_radii
from robocov_app.render.scene import Scene
from robocov_app.render.theme import Colour, mix

FORCE_LENGTH = 46.0
"""Longest arrow of a force in pixels at scale 1."""

VELOCITY_LENGTH = 34.0
"""Length of the arrow of a robot at its largest speed in pixels at scale 1."""

_HEADS = {"attraction": "full", "repulsion_robots": "open", "repulsion_obstacle": "dot", "viscosity": "bar"}
_WORDS = {
    "attraction": "attraction",
    "repulsion_robots": "repulsion from robots",
    "repulsion_obstacle": "repulsion from obstacle",
    "viscosity": "viscosity",
    "resultant": "resultant force",
}


def _arrows(canvas: Canvas, scene: Scene, vectors: Array, colour: Colour, width: float, head: str) -> None:
    """Draw (n, 2) px arrows that begin at the edges of the discs; those below 3 px are left out."""
    if scene.snapshot is None:
        return
    centers = canvas.camera.to_pixels(scene.snapshot.positions)
    lengths = np.hypot(vectors[:, 0], vectors[:, 1])
    for center, vector, length, radius in zip(
        centers, vectors, lengths, drawn_radii(canvas, scene), strict=True
    ):
        if length >= 3.0:
            start = center + vector * (radius / length)
            _arrow(canvas, start, start + vector, colour, width, head)


def _arrow(canvas: Canvas, start: Array, end: Array, colour: Colour, width: float, head: str) -> None:
    """Draw an arrow as `Canvas.arrow`, or with ``bar`` for a head: what slows down pulls nowhere."""
    if head != "bar":
        canvas.arrow(start.tolist(), end.tolist(), colour, width, head)
        return
    if np.any(end < -500.0) or np.any(end > np.array(canvas.surface.get_size()) + 500.0):
        return
    along = end - start
    half = (1.1 * width + 1.7 * canvas.scale) / np.hypot(*along) * np.array([-along[1], along[0]])
    bar = [(end - half).tolist(), (end + half).tolist()]
    sketch = sprites.Sketch.around([start.tolist(), *bar], 2 * width)
    if sketch is not None:
        sketch.path([start.tolist(), end.tolist()], colour, width)
        sketch.path(bar, colour, width)
        sketch.onto(canvas.surface)


class ForceTerm(Layer):
    """One term of the controller's force as arrows, or their sum; or the world's viscosity.

    Lengths saturate, since repulsion grows without limit: a force that would give the largest
    acceleration has 63 % of `FORCE_LENGTH`.
    """

    default = False

    def __init__(self, term: str) -> None:
        self.term = term
        self.name = f"force_{term}"
        self.title = _WORDS.get(term, term.replace("_", " ")).capitalize()

    def _vectors(self, scene: Scene) -> Array | None:
        if scene.snapshot is None:
            return None
        decision = scene.snapshot.decision
        if self.term == "viscosity":
            return -scene.team.viscosity[:, None] * scene.snapshot.velocities
        return decision.forces if self.term == "resultant" else decision.terms.get(self.term)

    def _style(self, canvas: Canvas) -> tuple[Colour, float, str]:
        wide = 3.0 if self.term == "resultant" else canvas.theme.arrow_line
        colour = canvas.theme.forces.get(self.term, canvas.theme.other)
        return colour, canvas.scale * wide, _HEADS.get(self.term, "full")

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        forces = self._vectors(scene)
        if forces is None:
            return
        size = np.hypot(forces[:, 0], forces[:, 1])
        full = scene.team.mass * scene.team.max_acceleration
        length = FORCE_LENGTH * canvas.scale * -np.expm1(-size / full)
        with np.errstate(invalid="ignore"):
            direction = np.where(size[:, None] > 0.0, forces / np.maximum(size, 1e-300)[:, None], 0.0)
        vectors = np.nan_to_num(direction * length[:, None]) * np.array([1.0, -1.0])
        _arrows(canvas, scene, vectors, *self._style(canvas))

    def legend(self, scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            half = 9 * canvas.scale
            _arrow(canvas, np.array([x - half, y]), np.array([x + half, y]), *self._style(canvas))

        return [LegendEntry(self.title.lower(), glyph)] if self._vectors(scene) is not None else []


class Velocities(Layer):
    """Velocities as arrows, in proportion to each robot's largest speed."""

    name = "velocities"
    title = "Velocities"
    default = False

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        if scene.snapshot is None:
            return
        part = scene.snapshot.velocities / scene.team.max_speed[:, None]
        vectors = part * np.array([1.0, -1.0]) * VELOCITY_LENGTH * canvas.scale
        _arrows(canvas, scene, vectors, canvas.theme.velocity, 1.6 * canvas.scale, "open")

    def legend(self, scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            half = 9 * canvas.scale
            canvas.arrow((x - half, y), (x + half, y), canvas.theme.velocity, 1.6 * canvas.scale, "open")

        return [LegendEntry("velocity", glyph)] if scene.snapshot is not None else []


class Ranges(Layer):
    """Circles of the sensor's range (full) or of communication (dashed); unlimited ones are not drawn."""

    default = False

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.name = kind
        self.title = f"{kind.capitalize()} range"

    def _of(self, scene: Scene) -> Array:
        return scene.team.sensing_range if self.kind == "sensing" else scene.team.communication_range

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        if scene.snapshot is None:
            return
        centers = canvas.camera.to_pixels(scene.snapshot.positions).tolist()
        for center, reach, hue in zip(centers, self._of(scene).tolist(), canvas.hues.tolist(), strict=True):
            if np.isfinite(reach):
                colour = mix(canvas.theme.robots[hue], canvas.theme.ink, 0.15)
                canvas.circle(center, reach * canvas.camera.zoom, colour, dashed=self.kind != "sensing")

    def legend(self, scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            canvas.circle((x, y), 6.5 * canvas.scale, canvas.theme.ink, dashed=self.kind != "sensing")

        drawn = scene.snapshot is not None and bool(np.isfinite(self._of(scene)).any())
        return [LegendEntry(self.title.lower(), glyph)] if drawn else []


class Links(Layer):
    """Lines between neighbours.

    Where everybody hears everybody, those are drawn whose cells share an edge: the others change nothing.
    """

    name = "links"
    title = "Neighbours"
    default = False

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        if scene.snapshot is None:
            return
        neighbours = scene.snapshot.seen.neighbours
        if neighbours.indptr is not None and neighbours.indices is not None:
            first = np.repeat(np.arange(neighbours.count), np.diff(neighbours.indptr))
            pairs = np.column_stack([first, neighbours.indices])
            pairs = pairs[pairs[:, 0] < pairs[:, 1]]
        elif scene.adjacency is not None:
            pairs = scene.adjacency
        else:
            return
        colour = mix(canvas.theme.background, canvas.theme.final, 0.7)
        ends = canvas.camera.to_pixels(scene.snapshot.positions)[pairs]
        for start, end in ends.tolist():
            canvas.line(start, end, colour, canvas.width(canvas.theme.line))

    def legend(self, scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            half = 9 * canvas.scale
            colour = mix(canvas.theme.background, canvas.theme.final, 0.7)
            canvas.line((x - half, y), (x + half, y), colour, canvas.width(canvas.theme.line))

        return [LegendEntry("neighbours", glyph)] if scene.snapshot is not None else []


class ObstaclePoints(Layer):
    """The single nearest obstacle point that each robot senses, and a line to it."""

    name = "obstacle_points"
    title = "Nearest obstacle points"
    default = False

    def draw(self, canvas: Canvas, scene: Scene) -> None:
        if scene.snapshot is None:
            return
        points = canvas.camera.to_pixels(scene.snapshot.seen.obstacle_points)
        centers = canvas.camera.to_pixels(scene.snapshot.positions)
        for point, center in zip(points, centers, strict=True):
            if np.isfinite(point).all():
                colour = canvas.theme.forces["repulsion_obstacle"]
                canvas.dashes(center.tolist(), point.tolist(), colour, dash=3.0)
                self._dot(canvas, float(point[0]), float(point[1]))

    @staticmethod
    def _dot(canvas: Canvas, x: float, y: float) -> None:
        colour, radius = canvas.theme.forces["repulsion_obstacle"], 3.0 * canvas.scale
        canvas.stamp(lambda shift: sprites.dot(radius, colour, shift), (x, y))

    def legend(self, scene: Scene) -> list[LegendEntry]:
        return [LegendEntry("nearest obstacle point", self._dot)] if scene.snapshot is not None else []
