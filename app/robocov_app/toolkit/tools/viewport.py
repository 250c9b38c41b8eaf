"""The view of a map in a window: reach of the pointer, limits of zooming and panning, steps of their keys."""

from dataclasses import replace

import numpy as np

from robocov_app.render.camera import Camera

REACH_PX = 12.0
"""Distance within which the pointer grabs an object, at scale 1: about the width of a fingertip."""
ZOOM_STEP = 1.25
"""Magnification by one key press."""
PAN_STEP_PX = 60
"""Distance by which one key press pans the map."""
MAX_MAP_ZOOM_PX_PER_M = 2e4
MIN_MAP_PX = 20.0
"""Longest side of the map when zoomed out as far as possible."""


def zoom_about(camera: Camera, factor: float, pixel: tuple[float, float], map_size: float) -> Camera:
    """Return a camera zoomed by a factor, within limits, about a fixed pixel.

    Parameters
    ----------
    camera : Camera
        The present camera.
    factor : float
        Magnification relative to the present camera.
    pixel : (x, y), px
        Pixel whose map position does not change.
    map_size : float, m
        Longest side of the map. It is never shown smaller than `MIN_MAP_PX`.
    """
    min_zoom = MIN_MAP_PX / map_size
    zoom = min(max(camera.zoom * factor, min_zoom), MAX_MAP_ZOOM_PX_PER_M)
    return camera.zoom_at(zoom / camera.zoom, pixel)


def pan_within(
    camera: Camera,
    shift: tuple[float, float],
    bounds: tuple[float, float, float, float],
    *,
    margin_fraction: float = 0.0,
) -> Camera:
    """Return a camera panned by a number of pixels, whose center stays on the map or near it.

    Parameters
    ----------
    camera : Camera
        The present camera.
    shift : (dx, dy), px
        Shift of the map in the window.
    bounds : (low x, low y, high x, high y), m
        Bounding box of the map.
    margin_fraction : float
        Maximum distance of the center of the view from the bounding box, as a fraction of the view.
    """
    panned = camera.pan(*shift)
    low_x, low_y, high_x, high_y = bounds
    _, _, width, height = camera.view
    margin_x = margin_fraction * width / camera.zoom
    margin_y = margin_fraction * height / camera.zoom
    low = (low_x - margin_x, low_y - margin_y)
    high = (high_x + margin_x, high_y + margin_y)
    x, y = np.clip(panned.center, low, high).tolist()
    return replace(panned, center=(x, y))
