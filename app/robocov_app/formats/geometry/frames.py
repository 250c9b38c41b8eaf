"""Frames in the plane: (3, 3) matrices that transform homogeneous positions to the surrounding frame."""

import math

import numpy as np

from robocov.arrays import Array

UNIT_SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
"""Vertices of a square with side 1 around the origin, (4, 2)."""


def build_frame(x: float, y: float, turn: float) -> Array:
    """Return the matrix, (3, 3), of a frame at a position and turned by an angle, rad."""
    cos = math.cos(turn)
    sin = math.sin(turn)
    return np.array([[cos, -sin, x], [sin, cos, y], [0.0, 0.0, 1.0]])


def transform_points(matrix: Array, points: Array) -> Array:
    """Return points, (k, 2), transformed by a matrix, (3, 3)."""
    return np.asarray(points @ matrix[:2, :2].T + matrix[:2, 2])
