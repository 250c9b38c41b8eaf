"""Outlines of single obstacles: convex polygons, L and U shapes of a given area."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import shapely

if TYPE_CHECKING:
    from robocov.arrays import Array

_REDRAWS = 8
"""Draws of a shape that is better than the first, or possible at all."""

_ROUND = 0.52
"""Least area of a convex polygon in parts of a circle of the same length; a regular triangle has 0.6."""


def convex(rng: np.random.Generator, area: float) -> Array:
    """Return a convex polygon of 3 to 7 vertices on an ellipse, no needle, (k, 2) m."""
    for _ in range(_REDRAWS):
        count = int(rng.choice([3, 4, 5, 6, 7], p=[0.1, 0.25, 0.3, 0.2, 0.15]))
        between = 0.4 + rng.random(count)
        angle = np.cumsum(between) * (2.0 * np.pi / between.sum())
        stretch = rng.uniform(1.0, 1.7)
        outline = np.column_stack([stretch * np.cos(angle), np.sin(angle)])
        polygon = shapely.Polygon(outline)
        if 4.0 * math.pi * polygon.area >= _ROUND * polygon.length**2:
            break
    return _fitted(outline, area, rng)


def l_shape(rng: np.random.Generator, area: float) -> Array:
    """Return an L of two arms, 0.3 to 0.5 of its sides thick, (6, 2) m."""
    long = rng.uniform(1.0, 1.5)
    thick, thin = rng.uniform(0.3, 0.5, 2)
    right, top = long * thick, thin
    outline = [(0.0, 0.0), (long, 0.0), (long, top), (right, top), (right, 1.0), (0.0, 1.0)]
    return _fitted(np.array(outline), area, rng)


def u_shape(rng: np.random.Generator, area: float, opening: float) -> Array | None:
    """Return a U that is open by at least `opening` (m), (8, 2) m; None if that is too much for its area."""
    for _ in range(_REDRAWS):
        wide = rng.uniform(1.0, 1.6)
        left, right = rng.uniform(0.2, 0.3, 2)
        base = rng.uniform(0.22, 0.35)
        # arms may differ in length
        other = rng.uniform(0.7, 1.0)
        inner = wide - left - right
        outline = np.array(
            [
                *((0.0, 0.0), (wide, 0.0), (wide, other), (wide - right, other)),
                *((wide - right, base), (left, base), (left, 1.0), (0.0, 1.0)),
            ]
        )
        scale = math.sqrt(area / shapely.Polygon(outline).area)
        if inner * scale >= opening:
            return _fitted(outline, area, rng)
    return None


def _fitted(outline: Array, area: float, rng: np.random.Generator) -> Array:
    """Return an outline scaled to its area, turned by some angle, its box around the origin."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    outline = outline @ turn * math.sqrt(area / shapely.Polygon(outline).area)
    return np.asarray(outline - (outline.min(axis=0) + outline.max(axis=0)) / 2.0)
