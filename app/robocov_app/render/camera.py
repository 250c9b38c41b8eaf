"""The camera: conversion between world coordinates, in meters with y up, and pixels, with y down."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from robocov.typing import FloatArray

MIN_ZOOM_PX_PER_M = 1e-4
"""A hundredth of the zoom that shows the largest map."""
MAX_ZOOM_PX_PER_M = 1e7
"""Ten times the zoom that shows the smallest map."""
MAX_PIXEL = 1e8
"""Maximum absolute coordinate that is passed to pygame."""
_MIN_SIZE_M = 1e-9
_MIN_SIZE_PX = 1.0
Box: TypeAlias = tuple[float, float, float, float]


@dataclass(frozen=True)
class Camera:
    """A view of the world.

    Attributes
    ----------
    center : (float, float), m
        The position in the middle of the view.
    zoom : float, px/m
    view : tuple of float, px
        Left, top, width and height of the area in which the world is drawn.
    """

    center: tuple[float, float]
    zoom: float
    view: Box

    @classmethod
    def fit(cls, bounds: Box, view: Box, margin: float = 0.0) -> Camera:
        """Build the camera that shows a rectangle of the world as large as the view permits.

        Parameters
        ----------
        bounds : tuple of float, m
            Low x, low y, high x and high y of the rectangle.
        view : tuple of float, px
            Left, top, width and height.
        margin : float, px
            Distance of the rectangle from the sides of the view.

        Returns
        -------
        Camera
        """
        low_x, low_y, high_x, high_y = bounds
        zoom_x = max(view[2] - 2 * margin, _MIN_SIZE_PX) / max(high_x - low_x, _MIN_SIZE_M)
        zoom_y = max(view[3] - 2 * margin, _MIN_SIZE_PX) / max(high_y - low_y, _MIN_SIZE_M)
        center = ((low_x + high_x) / 2, (low_y + high_y) / 2)
        return cls(center, _limit_zoom(min(zoom_x, zoom_y)), view)

    @property
    def middle(self) -> tuple[float, float]:
        """The middle of the view, px."""
        left, top, width, height = self.view
        return left + width / 2, top + height / 2

    def to_pixels(self, points: FloatArray) -> FloatArray:
        """Convert positions to pixels.

        Parameters
        ----------
        points : (..., 2) array, m

        Returns
        -------
        (..., 2) array, px
            Limited to `MAX_PIXEL`, because maps that are being edited may contain huge coordinates.
        """
        scale = np.array([self.zoom, -self.zoom])
        with np.errstate(over="ignore", invalid="ignore"):
            pixels = (points - np.array(self.center)) * scale + np.array(self.middle)
        return np.asarray(pixels).clip(-MAX_PIXEL, MAX_PIXEL)

    def to_world(self, pixels: FloatArray) -> FloatArray:
        """Convert pixels, (..., 2) px, to positions, (..., 2) m."""
        scale = np.array([1.0 / self.zoom, -1.0 / self.zoom])
        return np.asarray((pixels - np.array(self.middle)) * scale + np.array(self.center))

    def zoom_at(self, factor: float, pixel: tuple[float, float]) -> Camera:
        """Return the camera zoomed by a factor, with the same position of the world at `pixel`."""
        zoom = _limit_zoom(self.zoom * factor)
        x, y = pixel
        middle_x, middle_y = self.middle
        meters_per_px = 1.0 / self.zoom - 1.0 / zoom
        center_x = self.center[0] + (x - middle_x) * meters_per_px
        center_y = self.center[1] - (y - middle_y) * meters_per_px
        return replace(self, center=(center_x, center_y), zoom=zoom)

    def pan(self, dx: float, dy: float) -> Camera:
        """Return the camera that shows the world shifted by a number of pixels."""
        return replace(self, center=(self.center[0] - dx / self.zoom, self.center[1] + dy / self.zoom))

    def with_view(self, view: Box) -> Camera:
        """Return the camera with the same center and zoom in another view, px."""
        return replace(self, view=view)

    def compute_visible_bounds(self) -> Box:
        """Return low x, low y, high x and high y of the visible part of the world, m."""
        half_width = self.view[2] / 2 / self.zoom
        half_height = self.view[3] / 2 / self.zoom
        x, y = self.center
        return x - half_width, y - half_height, x + half_width, y + half_height


def _limit_zoom(zoom: float) -> float:
    return min(max(zoom, MIN_ZOOM_PX_PER_M), MAX_ZOOM_PX_PER_M)
