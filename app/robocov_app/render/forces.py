"""Layers that explain a decision: force terms, velocities, ranges, neighbors, what was sensed."""

from collections.abc import Callable
from functools import partial

import numpy as np

from robocov.arrays import Array
from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import Theme
from robocov_app.render import sprites
from robocov_app.render.canvas import ArrowHead, Canvas
from robocov_app.render.layers import Layer, says
from robocov_app.render.marks import drawn_radii
from robocov_app.render.scene import Scene
from robocov_app.render.sprites import Pixel

FORCE_LENGTH = 46.0  # longest arrow of a force in pixels at scale 1
VELOCITY_LENGTH = 34.0  # length of the arrow of a robot at its largest speed in pixels at scale 1


def _arrow_layer(
    name: str,
    title: str,
    words: str,
    vectors_of: Callable[[Scene, float], Array | None],
    style: Callable[[Theme], tuple[Color, float]],
    head: ArrowHead,
) -> Layer:
    """Return arrows that begin at the edges of the discs; those below 3 px are left out.

    `vectors_of`: (n, 2) px at a scale, y down; None for none. `style`: color, and width at scale 1.
    """

    def arrow(canvas: Canvas, start: Pixel, end: Pixel) -> None:
        color, width = style(canvas.theme)
        canvas.draw_arrow(start, end, color, canvas.scale * width, head)

    def draw(canvas: Canvas, scene: Scene) -> None:
        vectors = vectors_of(scene, canvas.scale)
        if vectors is None:
            return
        centers = canvas.camera.to_pixels(scene.now.positions)
        lengths = np.hypot(vectors[:, 0], vectors[:, 1])
        radii = drawn_radii(canvas, scene)
        for center, vector, length, radius in zip(centers, vectors, lengths, radii, strict=True):
            if length >= 3.0:
                start = center + vector * (radius / length)
                arrow(canvas, start.tolist(), (start + vector).tolist())

    legend = says(
        words,
        lambda canvas, x, y: arrow(canvas, *canvas.get_symbol_line(x, y, 9)),
        lambda scene: vectors_of(scene, 1.0) is not None,
    )
    return Layer(name, title, draw, ("snapshot",), legend, default=False)


def force_layer(term: str, title: str, head: ArrowHead) -> Layer:
    """Return arrows of a term of the force: the largest acceleration has 63 % of `FORCE_LENGTH`."""

    def vectors(scene: Scene, scale: float) -> Array | None:
        decision = scene.now.decision
        forces = decision.forces if term == "resultant" else decision.terms.get(term)
        if term == "viscosity":
            forces = -scene.team.viscosity[:, None] * scene.now.velocities
        if forces is None:
            return None
        size = np.hypot(forces[:, 0], forces[:, 1])
        full = scene.team.mass * scene.team.max_acceleration
        length = FORCE_LENGTH * scale * -np.expm1(-size / full)
        with np.errstate(invalid="ignore"):
            direction = np.where(size[:, None] > 0.0, forces / np.maximum(size, 1e-300)[:, None], 0.0)
        return np.asarray(np.nan_to_num(direction * length[:, None]) * np.array([1.0, -1.0]))

    def style(theme: Theme) -> tuple[Color, float]:
        return theme.forces[term], 3.0 if term == "resultant" else theme.arrow_line

    return _arrow_layer(f"force_{term}", title, title.lower(), vectors, style, head)


def velocity_layer() -> Layer:
    def vectors(scene: Scene, scale: float) -> Array:
        part = scene.now.velocities / scene.team.max_speed[:, None]
        return np.asarray(part * np.array([1.0, -1.0]) * VELOCITY_LENGTH * scale)

    return _arrow_layer(
        "velocities", "Velocities", "velocity", vectors, lambda theme: (theme.velocity, 1.6), "open"
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
                color = mix(canvas.theme.robots[hue], canvas.theme.ink, 0.15)
                canvas.draw_circle(center, reach * canvas.camera.zoom, color, is_dashed=dashed)

    legend = says(
        f"{kind} range",
        lambda canvas, x, y: canvas.draw_circle(
            (x, y), 6.5 * canvas.scale, canvas.theme.ink, is_dashed=dashed
        ),
        lambda scene: bool(np.isfinite(ranges(scene)).any()),
    )
    return Layer(kind, title, draw, ("snapshot",), legend, default=False)


def draw_links(canvas: Canvas, scene: Scene) -> None:
    """Draw lines between neighbors; of a complete graph those whose cells share an edge."""
    neighbors = scene.now.seen.neighbors
    if neighbors.is_complete:
        pairs = scene.adjacency
    else:
        pairs = np.column_stack(neighbors.list_pairs())
        pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    for start, end in () if pairs is None else canvas.camera.to_pixels(scene.now.positions)[pairs].tolist():
        _link(canvas, start, end)


def _link(canvas: Canvas, start: Pixel, end: Pixel) -> None:
    color = mix(canvas.theme.background, canvas.theme.final, 0.7)
    canvas.draw_line(start, end, color, canvas.scale_width(canvas.theme.line))


links_legend = says("neighbors", lambda canvas, x, y: _link(canvas, *canvas.get_symbol_line(x, y, 9)))


def draw_points(canvas: Canvas, scene: Scene) -> None:
    points = canvas.camera.to_pixels(scene.now.seen.obstacle_points)
    centers = canvas.camera.to_pixels(scene.now.positions)
    there = np.isfinite(points).all(axis=1)
    for point, center in zip(points[there].tolist(), centers[there].tolist(), strict=True):
        canvas.draw_dashed_line(center, point, canvas.theme.forces["repulsion_obstacle"], dash=3.0)
        _point_glyph(canvas, *point)


def _point_glyph(canvas: Canvas, x: float, y: float) -> None:
    canvas.draw_sprite(
        partial(sprites.render_dot, 3.0 * canvas.scale, canvas.theme.forces["repulsion_obstacle"]), (x, y)
    )


points_legend = says("nearest obstacle point", _point_glyph)
