"""A short, smooth change from one camera to another."""

import math
from dataclasses import replace

from robocov_app.render.camera import Camera

GLIDE_S = 0.15
"""Duration of a change: long enough to be followed by eye, too short to wait for."""
_MIN_RELATIVE_CHANGE = 1e-9
"""Below this relative change of the zoom, the center moves linearly."""


class CameraGlide:
    """Moves smoothly from one camera to another within `GLIDE_S`; fast at first, then slower.

    The point of the world that both cameras show at the same pixel stays there all the time.

    Parameters
    ----------
    start, end : Camera
        Cameras with the same view.
    """

    def __init__(self, start: Camera, end: Camera) -> None:
        self.end = end
        self._start = start
        self._elapsed_s = 0.0

    @property
    def is_over(self) -> bool:
        """Whether the end has been reached."""
        return self._elapsed_s >= GLIDE_S

    def advance(self, seconds: float) -> Camera:
        """Return the camera after some more time, s."""
        self._elapsed_s += seconds
        if self.is_over:
            return self.end
        progress = 1.0 - (1.0 - self._elapsed_s / GLIDE_S) ** 3
        start = self._start
        end = self.end
        zoom = start.zoom * (end.zoom / start.zoom) ** progress
        start_width = 1.0 / start.zoom
        end_width = 1.0 / end.zoom
        fraction = progress
        if not math.isclose(start_width, end_width, rel_tol=_MIN_RELATIVE_CHANGE):
            # The center moves along with the width of the view, 1 / zoom, not with the logarithm of the zoom.
            fraction = (1.0 / zoom - start_width) / (end_width - start_width)
        x = start.center[0] + fraction * (end.center[0] - start.center[0])
        y = start.center[1] + fraction * (end.center[1] - start.center[1])
        return replace(start, center=(x, y), zoom=zoom)
