"""The view of a map in a window: the reach of the pointer, limits of zooming, and the steps of keys."""

from robocov_app.render.camera import Camera

REACH_PX = 12.0
"""Distance within which the pointer takes hold of something at scale 1: the width of a finger."""
ZOOM_STEP = 1.25
"""Magnification of one press of a key."""
PAN_STEP_PX = 60
"""Distance by which one press of a key moves the map."""
MAX_MAP_ZOOM_PX_PER_M = 2e4
MIN_MAP_PX = 20.0
"""Size of the map at the smallest magnification."""


def zoom_about(camera: Camera, factor: float, pixel: tuple[float, float], map_size: float) -> Camera:
    """Return the camera that magnifies by a factor, within limits, so that a position stays at its pixel.

    Parameters
    ----------
    camera : Camera
        The present camera.
    factor : float
        Magnification.
    pixel : (x, y), px
        The pixel at which the position stays.
    map_size : float, m
        Longest side of the map, of which at least `MIN_MAP_PX` pixels are shown.
    """
    min_zoom = MIN_MAP_PX / map_size
    zoom = min(max(camera.zoom * factor, min_zoom), MAX_MAP_ZOOM_PX_PER_M)
    return camera.zoom_at(zoom / camera.zoom, pixel)
