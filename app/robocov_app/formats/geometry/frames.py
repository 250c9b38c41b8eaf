"""Frames in the plane: (3, 3) matrices that take homogeneous places to those of the frame around."""

import math

import numpy as np

from robocov.arrays import Array

UNIT_SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])  # about the origin


def build_frame(x: float, y: float, turn: float) -> Array:
    """Return the matrix of a frame at a place, turned by `turn`, rad."""
    cos, sin = math.cos(turn), math.sin(turn)
    return np.array([[cos, -sin, x], [sin, cos, y], [0.0, 0.0, 1.0]])


def transform_points(matrix: Array, points: Array) -> Array:
    """Return (k, 2) points under a matrix."""
    return np.asarray(points @ matrix[:2, :2].T + matrix[:2, 2])
