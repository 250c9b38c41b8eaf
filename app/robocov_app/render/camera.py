"""The camera: world meters, y up, to pixels, y down, and back."""

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from robocov.arrays import Array

SMALLEST, LARGEST = 1e-4, 1e7  # zoom, px/m: from a hundred times the largest map to a tenth of the smallest
FARTHEST_PIXEL = 1e8
Box: TypeAlias = tuple[float, float, float, float]


@dataclass(frozen=True)
class Camera:
    """A view of the world: `center`, m, in the middle of `view` (left, top, width, height), `zoom` px/m."""

    center: tuple[float, float]
    zoom: float
    view: Box

    @classmethod
    def fit(cls, bounds: Box, view: Box, margin: float = 0.0) -> "Camera":
        """Return the camera that shows `bounds`, m, as large as possible, `margin` px from the sides."""
        low_x, low_y, high_x, high_y = bounds
        width, height = max(high_x - low_x, 1e-9), max(high_y - low_y, 1e-9)
        room_x, room_y = max(view[2] - 2 * margin, 1.0), max(view[3] - 2 * margin, 1.0)
        zoom = min(max(min(room_x / width, room_y / height), SMALLEST), LARGEST)
        return cls(((low_x + high_x) / 2, (low_y + high_y) / 2), zoom, view)

    @property
    def middle(self) -> tuple[float, float]:
        left, top, width, height = self.view
        return left + width / 2, top + height / 2

    def to_pixels(self, points: Array) -> Array:
        """Return the pixels of (..., 2) points in meters.

        Drafts of maps may hold any number: what is too far away for pygame is moved to `FARTHEST_PIXEL`.
        """
        scale = np.array([self.zoom, -self.zoom])
        with np.errstate(over="ignore", invalid="ignore"):
            found = np.asarray((points - np.array(self.center)) * scale + np.array(self.middle))
        return found.clip(-FARTHEST_PIXEL, FARTHEST_PIXEL)

    def to_world(self, pixels: Array) -> Array:
        scale = np.array([1.0 / self.zoom, -1.0 / self.zoom])
        return np.asarray((pixels - np.array(self.middle)) * scale + np.array(self.center))

    def zoomed(self, factor: float, at: tuple[float, float]) -> "Camera":
        """Return the camera that magnifies by `factor` and keeps what is under pixel `at` there."""
        zoom = min(max(self.zoom * factor, SMALLEST), LARGEST)
        (x, y), (middle_x, middle_y) = at, self.middle
        shrink = 1.0 / self.zoom - 1.0 / zoom
        center = (self.center[0] + (x - middle_x) * shrink, self.center[1] - (y - middle_y) * shrink)
        return replace(self, center=center, zoom=zoom)

    def panned(self, dx: float, dy: float) -> "Camera":
        return replace(self, center=(self.center[0] - dx / self.zoom, self.center[1] + dy / self.zoom))

    def within(self, view: Box) -> "Camera":
        return replace(self, view=view)

    def visible(self) -> Box:
        half_x, half_y = self.view[2] / 2 / self.zoom, self.view[3] / 2 / self.zoom
        x, y = self.center
        return x - half_x, y - half_y, x + half_x, y + half_y


def round_length(at_most: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above `at_most`."""
    power = float(10.0 ** np.floor(np.log10(at_most) + 1e-12))
    step = max(s for s in (1.0, 2.0, 5.0) if s * power <= at_most * (1 + 1e-9))
    return float(f"{step * power:.12g}")


def length_label(meters: float) -> str:
    if meters >= 1000:
        return f"{meters / 1000:g} km"
    return f"{meters * 100:g} cm" if meters < 0.1 else f"{meters:g} m"
