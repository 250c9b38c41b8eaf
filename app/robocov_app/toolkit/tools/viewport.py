"""The view of a map in a window: reach of the pointer, zoom limits, and steps of the zoom and pan keys."""

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
