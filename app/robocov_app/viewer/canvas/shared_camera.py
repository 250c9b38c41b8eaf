"""The camera that all panes share: it shows the whole map, zooms, pans and glides."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robocov.environment import Point
from robocov.typing import FloatArray
from robocov_app.render.camera import Camera
from robocov_app.render.painter import Painter
from robocov_app.toolkit.tools.viewport import pan_within, zoom_about
from robocov_app.viewer.canvas.camera_glide import CameraGlide
from robocov_app.viewer.presenter import Presenter

MAX_GLIDE_STEP_S = 0.05
FOLLOW_ZOOM = 2.0
"""Factor by which the view zooms in when it starts to follow a robot and the whole map is shown."""


class SharedCamera:
    """Gives the painters of all panes the same camera.

    Parameters
    ----------
    viewer : Presenter
        The viewer.

    Attributes
    ----------
    is_animated : bool
        Whether the camera may glide; False while the window is unattended.
    """

    def __init__(self, viewer: Presenter) -> None:
        self.is_animated = False
        self._viewer = viewer
        self._painters: Sequence[Painter] = ()
        self._camera: Camera | None = None  # None while the whole map is shown
        self._glide: CameraGlide | None = None  # toward `_camera`, while it lasts

    def attach(self, painters: Sequence[Painter]) -> None:
        """Replace the painters, one for each pane; the new ones show the same section of the map."""
        self._painters = painters
        if self._camera is not None:
            self._pass_to_painters(self._camera)

    def fit(self) -> None:
        """Show the whole map at once, and stop following a robot."""
        self._viewer.inspection.followed = None
        self._glide = None
        self._camera = None
        for painter in self._painters:
            painter.fit()

    def show_whole_map(self) -> None:
        """Show the whole map, after a smooth change of the camera."""
        start = self._painters[0].camera
        self.fit()
        self._glide_from(start)

    def zoom(self, factor: float, pane: int, pixel: tuple[float, float]) -> None:
        """Zoom by a factor about a pixel of a pane."""
        start = self._painters[pane].camera
        # Quick turns of the wheel add up, although the map has not yet followed.
        target = start if self._glide is None else self._glide.end.with_view(start.view)
        map_size = float(np.ptp(self._get_bounds(), axis=0).max())
        self._show(zoom_about(target, factor, pixel, map_size))
        self._glide_from(start)

    def pan(self, dx: float, dy: float) -> None:
        """Move the map by dx and dy pixels, and stop following a robot.

        The center of the view stays within the bounds of the map.
        """
        self._viewer.inspection.followed = None
        bounds = self._viewer.session.displayed.environment.region.bounds
        self._show(pan_within(self._painters[0].camera, (dx, dy), bounds))

    def center_on(self, point: Point) -> None:
        """Move a point of the map, m, to the middle of the view; zoom in first if the whole map is shown."""
        camera = self._painters[0].camera
        if self._camera is None:
            camera = replace(camera, zoom=FOLLOW_ZOOM * camera.zoom)
        self._show(replace(camera, center=point))

    def follow(self, other: "SharedCamera") -> None:
        """Show the section of the map that the camera of another canvas shows."""
        if other._camera is None and other._glide is None:
            self._camera = None
            for painter in self._painters:
                painter.fit()
            return
        camera = other._painters[0].camera
        view = self._painters[0].camera.view
        scale = min(view[2] / camera.view[2], view[3] / camera.view[3])
        self._show(replace(camera, zoom=scale * camera.zoom))

    @property
    def is_moving(self) -> bool:
        """Whether the camera is gliding."""
        return self._glide is not None

    def update(self, seconds: float) -> None:
        """Advance a change of the camera by real time, s."""
        if self._glide is None:
            return
        # After a rest, the time since the previous frame may be longer than the whole change.
        camera = self._glide.advance(min(seconds, MAX_GLIDE_STEP_S))
        if self._glide.is_over:
            self._glide = None
        self._pass_to_painters(camera)
        if self._glide is None and self._camera is None:
            self.fit()

    def _show(self, camera: Camera) -> None:
        """Show the section of the map that a camera shows, at once."""
        self._glide = None
        self._camera = camera
        self._pass_to_painters(camera)

    def _glide_from(self, start: Camera) -> None:
        """Let the camera glide from `start` to the present one, unless the user prefers reduced motion."""
        view = self._viewer.view
        if self.is_animated and view.has_motion and not view.is_motion_reduced:
            self._glide = CameraGlide(start, self._painters[0].camera.with_view(start.view))
            self.update(0.0)

    def _pass_to_painters(self, camera: Camera) -> None:
        for painter in self._painters:
            painter.camera = camera.with_view(painter.camera.view)

    def _get_bounds(self) -> FloatArray:
        """Return the bounds of the map as rows (x_min, y_min) and (x_max, y_max), (2, 2) m."""
        return np.reshape(self._viewer.session.displayed.environment.region.bounds, (2, 2))
