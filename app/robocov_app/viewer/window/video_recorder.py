"""Recording a video of the window: starting, adding frames, stopping."""

from __future__ import annotations

import pygame

from robocov.errors import format_count
from robocov_app.terminal.output import find_free_path
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.window.screen_video import ScreenVideo


class VideoRecorder:
    """Starts and stops videos of a window, and adds the frames that the window shows.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    waits : bool
        Whether to wait for the encoder instead of dropping frames.

    Attributes
    ----------
    video : ScreenVideo or None
        The video being recorded.
    """

    def __init__(self, viewer: Presenter, *, waits: bool) -> None:
        self.video: ScreenVideo | None = None
        self._viewer = viewer
        self._waits = waits
        self._unrecorded_s = 0.0  # time since the last frame was added

    @property
    def duration(self) -> float | None:
        """Duration of the video so far, s; None if no video is being recorded."""
        if self.video is None:
            return None
        return self.video.duration

    def toggle(self, screen: pygame.Surface) -> str:
        """Start a video of a screen in a new file, or stop the current one; return a message.

        Raises
        ------
        OutputError
            If the file cannot be written, or the encoder is missing or has failed.
        """
        if self.video is None:
            return self._start(screen)
        return self._stop(self.video)

    def describe_toggle(self) -> str:
        """Describe what `toggle` does now."""
        if self.video is None:
            return "Start recording a video"
        return "Stop recording the video"

    def _start(self, screen: pygame.Surface) -> str:
        target = find_free_path(self._viewer.files.folder, "robocov", ".mp4")
        self.video = ScreenVideo(target, screen.get_size(), waits=self._waits)
        self._viewer.view.is_recording = True
        return f"recording {target}; F9 stops it"

    def _stop(self, video: ScreenVideo) -> str:
        self.video = None
        self._viewer.view.is_recording = False
        video.close()
        skipped = f", {format_count(video.skipped_count, 'frame')} skipped" if video.skipped_count else ""
        return f"video saved: {video.path} ({video.duration:.1f} s{skipped})"

    def pass_time(self, seconds: float) -> None:
        """Count the time, s, for which the next frame is shown in the video."""
        self._unrecorded_s += seconds

    def add_frame(self, screen: pygame.Surface) -> None:
        """Add a drawn frame to the video, if one is being recorded."""
        if self.video is not None:
            self.video.add(screen, self._unrecorded_s)
        self._unrecorded_s = 0.0

    def close(self) -> None:
        """Complete the video, if one is being recorded; errors are shown by the viewer."""
        if self.video is not None:
            video = self.video
            self._viewer.attempt(lambda: self._stop(video))
