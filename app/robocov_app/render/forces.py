"""Layers that explain a decision: force terms, velocities, ranges, neighbours, what was sensed."""

from functools import partial

import numpy as np

from robocov.arrays import Array
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas, LegendEntry
from robocov_app.render.layers import Layer, says
from robocov_app.render.marks import drawn_radii
from robocov_app.render.scene import Scene
from robocov_app.render.theme import Colour, mix

FORCE_LENGTH = 46.0  # longest arrow of a force in pixels at scale 1
VELOCITY_LENGTH = 34.0  # length of the arrow of a robot at its largest speed in pixels at scale 1


def _arrows(canvas: Canvas, scene: Scene, vectors: Array, colour: Colour, width: float, head: str) -> None:
    """Draw (n, 2) px arrows that begin at the edges of the discs; those below 3 px are left out."""
    centers = canvas.camera.to_pixels(scene.now.positions)
    lengths = np.hypot(vectors[:, 0], vectors[:, 1])
    radii = drawn_radii(canvas, scene)
    for center, vector, length, radius in zip(centers, vectors, lengths, radii, strict=True):
        if length >= 3.0:
            start = center + vector * (radius / length)
            canvas.arrow(start.tolist(), (start + vector).tolist(), colour, width, head)


def _level_arrow(canvas: Canvas, x: float, y: float, colour: Colour, width: float, head: str) -> None:
    half = 9 * canvas.scale
    canvas.arrow((x - half, y), (x + half, y), colour, width, head)


def force_layer(term: str, title: str, head: str) -> Layer:
    """Return arrows of a term of the force: the largest acceleration has 63 % of `FORCE_LENGTH`."""

    def forces_of(scene: Scene) -> Array | None:
        decision = scene.now.decision
        if term == "viscosity":
            return -scene.team.viscosity[:, None] * scene.now.velocities
        return decision.forces if term == "resultant" else decision.terms.get(term)

    def style(canvas: Canvas) -> tuple[Colour, float, str]:
        wide = 3.0 if term == "resultant" else canvas.theme.arrow_line
        return canvas.theme.forces[term], canvas.scale * wide, head

    def draw(canvas: Canvas, scene: Scene) -> None:
        forces = forces_of(scene)
        if forces is None:
            return
        size = np.hypot(forces[:, 0], forces[:, 1])
        full = scene.team.mass * scene.team.max_acceleration
        length = FORCE_LENGTH * canvas.scale * -np.expm1(-size / full)
        with np.errstate(invalid="ignore"):
            direction = np.where(size[:, None] > 0.0, forces / np.maximum(size, 1e-300)[:, None], 0.0)
        vectors = np.nan_to_num(direction * length[:, None]) * np.array([1.0, -1.0])
        _arrows(canvas, scene, vectors, *style(canvas))

    def legend(scene: Scene) -> list[LegendEntry]:
        entry = LegendEntry(title.lower(), lambda canvas, x, y: _level_arrow(canvas, x, y, *style(canvas)))
        return [] if forces_of(scene) is None else [entry]

    return Layer(f"force_{term}", title, draw, ("snapshot",), legend, default=False)


def draw_velocities(canvas: Canvas, scene: Scene) -> None:
    """Draw velocities as arrows, in proportion to each robot's largest speed."""
    part = scene.now.velocities / scene.team.max_speed[:, None]
    vectors = part * np.array([1.0, -1.0]) * VELOCITY_LENGTH * canvas.scale
    _arrows(canvas, scene, vectors, canvas.theme.velocity, 1.6 * canvas.scale, "open")


velocities_legend = says(
    "velocity",
    lambda canvas, x, y: _level_arrow(canvas, x, y, canvas.theme.velocity, 1.6 * canvas.scale, "open"),
)


def range_layer(kind: str, title: str) -> Layer:
    """Return circles of the sensor's range (full) or of communication (dashed); finite ones only."""
    dashed = kind != "sensing"

    def ranges(scene: Scene) -> Array:
        return scene.team.communication_range if dashed else scene.team.sensing_range

    def draw(canvas: Canvas, scene: Scene) -> None:
        centers = canvas.camera.to_pixels(scene.now.positions).tolist()
        for center, reach, hue in zip(centers, ranges(scene).tolist(), canvas.hues.tolist(), strict=True):
            if np.isfinite(reach):
                colour = mix(canvas.theme.robots[hue], canvas.theme.ink, 0.15)
                canvas.circle(center, reach * canvas.camera.zoom, colour, dashed)

    def legend(scene: Scene) -> list[LegendEntry]:
        def glyph(canvas: Canvas, x: float, y: float) -> None:
            canvas.circle((x, y), 6.5 * canvas.scale, canvas.theme.ink, dashed)

        return [LegendEntry(f"{kind} range", glyph)] if np.isfinite(ranges(scene)).any() else []

    return Layer(kind, title, draw, ("snapshot",), legend, default=False)


def draw_links(canvas: Canvas, scene: Scene) -> None:
    """Draw lines between neighbours; of a complete graph those whose cells share an edge."""
    neighbours = scene.now.seen.neighbours
    if neighbours.complete:
        pairs = scene.adjacency
    else:
        pairs = np.column_stack(neighbours.pairs())
        pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    if pairs is None:
        return
    for start, end in canvas.camera.to_pixels(scene.now.positions)[pairs].tolist():
        _link(canvas, start, end)


def _link(canvas: Canvas, start: list[float], end: list[float]) -> None:
    colour = mix(canvas.theme.background, canvas.theme.final, 0.7)
    canvas.line(start, end, colour, canvas.width(canvas.theme.line))


links_legend = says(
    "neighbours", lambda canvas, x, y: _link(canvas, [x - 9 * canvas.scale, y], [x + 9 * canvas.scale, y])
)


def draw_points(canvas: Canvas, scene: Scene) -> None:
    """Draw the single nearest obstacle point that each robot senses, and a line to it."""
    points = canvas.camera.to_pixels(scene.now.seen.obstacle_points)
    centers = canvas.camera.to_pixels(scene.now.positions)
    there = np.isfinite(points).all(axis=1)
    for point, center in zip(points[there].tolist(), centers[there].tolist(), strict=True):
        canvas.dashes(center, point, canvas.theme.forces["repulsion_obstacle"], dash=3.0)
        _point_glyph(canvas, *point)


def _point_glyph(canvas: Canvas, x: float, y: float) -> None:
    colour = canvas.theme.forces["repulsion_obstacle"]
    canvas.stamp(partial(sprites.dot, 3.0 * canvas.scale, colour), (x, y))


points_legend = says("nearest obstacle point", _point_glyph)
