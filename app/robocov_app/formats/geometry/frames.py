"""Coordinate frames in the plane: (3, 3) matrices that transform homogeneous positions to a parent frame."""

import math

import numpy as np

from robocov.typing import FloatArray

UNIT_SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
"""Vertices of a square with side 1 around the origin, (4, 2)."""


def build_frame(x: float, y: float, angle: float) -> FloatArray:
    """Return the (3, 3) matrix of a frame at a position, rotated by an angle, rad."""
    cos = math.cos(angle)
    sin = math.sin(angle)
    return np.array([[cos, -sin, x], [sin, cos, y], [0.0, 0.0, 1.0]])


def transform_points(matrix: FloatArray, points: FloatArray) -> FloatArray:
    """Transform points, (k, 2), by a (3, 3) matrix."""
    return np.asarray(points @ matrix[:2, :2].T + matrix[:2, 2])
