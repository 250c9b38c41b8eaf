"""Layers of arrows at robots: force terms and velocities."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from robocov.typing import FloatArray
from robocov_app.look.colors import Color
from robocov_app.look.theme import Theme
from robocov_app.render.canvas import ArrowHead, Canvas
from robocov_app.render.layers.layer import Layer, build_legend
from robocov_app.render.layers.robots import compute_drawn_radii
from robocov_app.render.scene import Scene
from robocov_app.render.sprites import Pixel

# Lengths in pixels at scale 1.
MAX_FORCE_ARROW_PX = 46.0
"""Length that the arrow approaches as the force grows."""
MAX_VELOCITY_ARROW_PX = 34.0
"""Length of the arrow of a robot at its maximum speed."""
_MIN_ARROW_PX = 3.0
"""Shorter arrows are left out, px of the surface."""
_RESULTANT_WIDTH_PX = 3.0
_VELOCITY_WIDTH_PX = 1.6
_MIN_FORCE_N = 1e-300

VectorFunction: TypeAlias = Callable[[Scene, float], FloatArray | None]
"""Returns the arrows of a scene at a scale, (n, 2) px with y down; None if it has none."""


@dataclass(frozen=True)
class _ArrowStyle:
    """Look of the arrows of a layer.

    Attributes
    ----------
    get_color : callable
        Returns the color in a theme.
    get_width : callable
        Returns the width in a theme, px at scale 1.
    head : ArrowHead
    """

    get_color: Callable[[Theme], Color]
    get_width: Callable[[Theme], float]
    head: ArrowHead

    def draw(self, canvas: Canvas, start: Pixel, end: Pixel) -> None:
        """Draw one arrow between two pixels."""
        width = canvas.scale * self.get_width(canvas.theme)
        canvas.draw_arrow(start, end, self.get_color(canvas.theme), width, self.head)


def _build_arrow_layer(
    name: str, title: str, text: str, compute_vectors: VectorFunction, style: _ArrowStyle
) -> Layer:
    """Build a layer of arrows that start at the edges of the robots.

    Parameters
    ----------
    name, title : str
        Identifier, and name in the window.
    text : str
        Text in the legend.
    compute_vectors : VectorFunction
    style : _ArrowStyle
    """

    def draw(canvas: Canvas, scene: Scene) -> None:
        """Draw the arrow of each robot, except for very short ones."""
        vectors = compute_vectors(scene, canvas.scale)
        if vectors is None:
            return
        centers = canvas.camera.to_pixels(scene.now.positions)
        lengths = np.hypot(vectors[:, 0], vectors[:, 1])
        radii = compute_drawn_radii(canvas, scene)
        for center, vector, length, radius in zip(centers, vectors, lengths, radii, strict=True):
            if length >= _MIN_ARROW_PX:
                start = center + vector * (radius / length)
                style.draw(canvas, start.tolist(), (start + vector).tolist())

    def draw_symbol(canvas: Canvas, x: float, y: float) -> None:
        start, end = canvas.get_symbol_line(x, y, 9)
        style.draw(canvas, start, end)

    legend = build_legend(text, draw_symbol, lambda scene: compute_vectors(scene, 1.0) is not None)
    return Layer(name, title, draw, ("snapshot",), legend, is_default=False)


def build_force_layer(term: str, title: str, head: ArrowHead) -> Layer:
    """Build the layer that shows one term of the forces on robots.

    Parameters
    ----------
    term : str
        Name of a term of the controller's decision, or "viscosity", or "resultant".
    title : str
        Name in the window and, in lower case, in the legend.
    head : ArrowHead

    Returns
    -------
    Layer
        Arrow lengths saturate: 63% of the maximum length (1 - 1/e) at the force that gives a robot its
        maximum acceleration.
    """

    def compute_vectors(scene: Scene, scale: float) -> FloatArray | None:
        """Return the arrows of the forces, (n, 2) px with y down; None if there are no such forces."""
        forces = _get_forces(scene, term)
        if forces is None:
            return None
        sizes = np.hypot(forces[:, 0], forces[:, 1])
        max_force = scene.team.mass * scene.team.max_acceleration
        lengths = MAX_FORCE_ARROW_PX * scale * -np.expm1(-sizes / max_force)
        with np.errstate(invalid="ignore"):
            unit_vectors = forces / np.maximum(sizes, _MIN_FORCE_N)[:, None]
            directions = np.where(sizes[:, None] > 0.0, unit_vectors, 0.0)
        # Pixels run downwards.
        return np.asarray(np.nan_to_num(directions * lengths[:, None]) * np.array([1.0, -1.0]))

    style = _ArrowStyle(
        get_color=lambda theme: theme.forces[term],
        get_width=lambda theme: _RESULTANT_WIDTH_PX if term == "resultant" else theme.arrow_line,
        head=head,
    )
    return _build_arrow_layer(f"force_{term}", title, title.lower(), compute_vectors, style)


def _get_forces(scene: Scene, term: str) -> FloatArray | None:
    """Return a term of the forces, (n, 2) N; None if the controller has no such term."""
    decision = scene.now.decision
    if term == "resultant":
        return decision.forces
    if term == "viscosity":
        return np.asarray(-scene.team.viscosity[:, None] * scene.now.velocities)
    return decision.terms.get(term)


def build_velocity_layer() -> Layer:
    """Build the layer of velocities."""

    def compute_vectors(scene: Scene, scale: float) -> FloatArray:
        fractions = scene.now.velocities / scene.team.max_speed[:, None]
        # Pixels run downwards.
        return np.asarray(fractions * np.array([1.0, -1.0]) * MAX_VELOCITY_ARROW_PX * scale)

    style = _ArrowStyle(
        get_color=lambda theme: theme.velocity, get_width=lambda theme: _VELOCITY_WIDTH_PX, head="open"
    )
    return _build_arrow_layer("velocities", "Velocities", "velocity", compute_vectors, style)
