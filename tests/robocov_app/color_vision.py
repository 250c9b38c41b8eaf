"""Simulated color vision, and perceived differences between colors."""

import itertools
from collections.abc import Sequence

import numpy as np

VISIONS = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
}
"""Matrices on linear RGB: Machado, Oliveira and Fernandes (2009), complete deficiency."""

_TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
_WHITE = np.array([0.9505, 1.0, 1.089])


def compute_lab(color: Sequence[int], vision: str = "normal") -> np.ndarray:
    """Return the CIELAB coordinates of a color as a viewer with this vision sees it."""
    channels = np.asarray(color, dtype=float) / 255
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    perceived = np.clip(VISIONS[vision] @ linear, 0.0, 1.0)
    relative = _TO_XYZ @ perceived / _WHITE
    x, y, z = np.where(relative > 0.008856, np.cbrt(relative), 7.787 * relative + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def measure_difference(first: Sequence[int], second: Sequence[int], vision: str = "normal") -> float:
    """Return the color difference (CIE 1976): 2 is just visible, 100 separates black and white."""
    return float(np.linalg.norm(compute_lab(first, vision) - compute_lab(second, vision)))


def find_min_difference(colors: Sequence[Sequence[int]]) -> float:
    """Return the minimum difference between two of the colors over all pairs and visions."""
    differences = []
    for vision in VISIONS:
        for first, second in itertools.combinations(colors, 2):
            differences.append(measure_difference(first, second, vision))
    return min(differences)
