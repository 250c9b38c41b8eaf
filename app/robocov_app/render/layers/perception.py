"""Layers of perception: ranges, neighbors and nearest obstacle points."""

from functools import partial
from typing import Literal

import numpy as np

from robocov.typing import FloatArray, IntArray
from robocov_app.look.colors import mix
from robocov_app.render import sprites
from robocov_app.render.canvas import Canvas
from robocov_app.render.layers.layer import Layer, build_legend
from robocov_app.render.scene import Scene
from robocov_app.render.sprites import Pixel

# Lengths in pixels at scale 1.
_RANGE_SYMBOL_RADIUS_PX = 6.5
_POINT_RADIUS_PX = 3.0
_DASH_PX = 3.0
_LINK_SYMBOL_HALF_PX = 9.0
_RANGE_INK_FRACTION = 0.15
"""Fraction of ink in the colors of ranges, so that they contrast with the cells of the robots."""
_LINK_STRENGTH = 0.7
"""Fraction of the color of final positions in that of links, which are paler."""


def build_range_layer(kind: Literal["sensing", "communication"], title: str) -> Layer:
    """Build the layer of sensing ranges (solid circles) or communication ranges (dashed circles).

    Infinite ranges are not drawn.
    """
    is_dashed = kind == "communication"

    def get_ranges(scene: Scene) -> FloatArray:
        if kind == "communication":
            return scene.team.communication_range
        return scene.team.sensing_range

    def draw(canvas: Canvas, scene: Scene) -> None:
        centers = canvas.camera.to_pixels(scene.now.positions).tolist()
        radii = (get_ranges(scene) * canvas.camera.zoom).tolist()
        for center, radius, hue in zip(centers, radii, canvas.hues.tolist(), strict=True):
            if np.isfinite(radius):
                color = mix(canvas.theme.robots[hue], canvas.theme.ink, _RANGE_INK_FRACTION)
                canvas.draw_circle(center, radius, color, is_dashed=is_dashed)

    def draw_symbol(canvas: Canvas, x: float, y: float) -> None:
        radius = _RANGE_SYMBOL_RADIUS_PX * canvas.scale
        canvas.draw_circle((x, y), radius, canvas.theme.ink, is_dashed=is_dashed)

    legend = build_legend(
        f"{kind} range", draw_symbol, lambda scene: bool(np.isfinite(get_ranges(scene)).any())
    )
    # Positions and ranges are only known with a snapshot of the team.
    return Layer(kind, title, draw, ("snapshot",), legend, is_default=False)


def draw_links(canvas: Canvas, scene: Scene) -> None:
    """Draw lines between neighbors; if all robots are neighbors, only between adjacent cells."""
    pairs = _list_links(scene)
    if pairs is None:
        return
    for start, end in canvas.camera.to_pixels(scene.now.positions)[pairs].tolist():
        _draw_link(canvas, start, end)


def _list_links(scene: Scene) -> IntArray | None:
    """Return the connected pairs of robots, (k, 2); None if the adjacency of the cells is unknown."""
    neighbors = scene.now.seen.neighbors
    if neighbors.is_complete:
        return scene.adjacency
    # Neighbors are listed in both directions; each pair is kept once.
    pairs = np.column_stack(neighbors.list_pairs())
    return pairs[pairs[:, 0] < pairs[:, 1]]


def _draw_link(canvas: Canvas, start: Pixel, end: Pixel) -> None:
    """Draw the line between two neighbors."""
    color = mix(canvas.theme.background, canvas.theme.final, _LINK_STRENGTH)
    canvas.draw_line(start, end, color, canvas.scale_width(canvas.theme.line))


def _draw_link_symbol(canvas: Canvas, x: float, y: float) -> None:
    start, end = canvas.get_symbol_line(x, y, _LINK_SYMBOL_HALF_PX)
    _draw_link(canvas, start, end)


build_links_legend = build_legend("neighbors", _draw_link_symbol)


def draw_obstacle_points(canvas: Canvas, scene: Scene) -> None:
    """Draw the nearest obstacle point of each robot that senses one, connected with the robot."""
    points = canvas.camera.to_pixels(scene.now.seen.obstacle_points)
    centers = canvas.camera.to_pixels(scene.now.positions)
    is_sensed = np.isfinite(points).all(axis=1)
    color = canvas.theme.forces["repulsion_obstacle"]
    for point, center in zip(points[is_sensed].tolist(), centers[is_sensed].tolist(), strict=True):
        canvas.draw_dashed_line(center, point, color, dash=_DASH_PX)
        _draw_obstacle_point(canvas, point[0], point[1])


def _draw_obstacle_point(canvas: Canvas, x: float, y: float) -> None:
    color = canvas.theme.forces["repulsion_obstacle"]
    canvas.draw_sprite(partial(sprites.render_dot, _POINT_RADIUS_PX * canvas.scale, color), (x, y))


build_obstacle_points_legend = build_legend("nearest obstacle point", _draw_obstacle_point)
