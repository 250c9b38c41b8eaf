"""A video of the window in use, which is encoded in another process and readable even after a crash."""

import queue
import threading
from contextlib import suppress
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen

import numpy as np
import pygame

from robocov.errors import OutputError
from robocov_app.runs.encoding import Frame, build_encoder_command

VIDEO_FPS = 30
_FRAME_TOLERANCE = 1e-6  # a frame that is due up to rounding errors is added
_MAX_FRAME_REPEATS = VIDEO_FPS  # one second; a longer stall of the window is shortened in the video
MAX_WAITING_FRAMES = 45  # frames that wait for the encoder; further ones are dropped


class ScreenVideo:
    """Records a window as an MP4 video.

    The encoder is a process of its own, which completes the video when its input ends, even after a crash.

    Parameters
    ----------
    path : Path
        File of the video, which must not exist yet.
    size : tuple of int
        Width and height of the window, px. Frames of other sizes are scaled to fit.
    waits : bool
        Whether to wait for the encoder instead of dropping frames.

    Attributes
    ----------
    path : Path
        File of the video.
    frame_count : int
        Number of frames passed to the encoder.
    skipped_count : int
        Number of frames dropped because the encoder was too slow.

    Raises
    ------
    OutputError
        If there is no encoder or it cannot be started, the folder cannot be created, or the file exists.
    """

    def __init__(self, path: Path, size: tuple[int, int], *, waits: bool = False) -> None:
        """Create the file, and start the encoder."""
        self.path = path
        self.frame_count = 0
        self.skipped_count = 0
        self._waits = waits
        self._size = (_make_even(size[0]), _make_even(size[1]))
        self._due_frames = 0.0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            command = build_encoder_command(path, self._size, VIDEO_FPS, is_streamed=True)
            # Opening with "x" fails if the file exists, so that nothing is written through a symbolic link.
            path.open("xb").close()
            self._process = _start_encoder(command, path)
        except OSError as error:
            raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error
        self._queue: queue.Queue[bytes | None] = queue.Queue(MAX_WAITING_FRAMES)
        self._thread = threading.Thread(target=self._write, daemon=True)
        self._thread.start()

    @property
    def duration(self) -> float:
        """Duration of the video, s."""
        return self.frame_count / VIDEO_FPS

    def add(self, screen: pygame.Surface, seconds: float) -> None:
        """Add the frame that the window has shown for a time, s, as often as the frame rate requires.

        A frame is added for one second at most, so that a stall of the window does not fill the queue.
        """
        self._due_frames += seconds * VIDEO_FPS
        count = int(self._due_frames + _FRAME_TOLERANCE)
        self._due_frames -= count
        if count <= 0:
            return
        data = self._fit(screen)
        for _ in range(min(count, _MAX_FRAME_REPEATS)):
            try:
                self._queue.put(data, block=self._waits)
                self.frame_count += 1
            except queue.Full:
                self.skipped_count += 1

    def close(self) -> None:
        """Complete the video.

        Raises
        ------
        OutputError
            If the encoder has failed.
        """
        self._queue.put(None)
        self._thread.join()
        if self._process.wait() != 0:
            raise OutputError(f"{self.path}: the video encoder failed")

    def _fit(self, screen: pygame.Surface) -> bytes:
        """Return the RGB bytes of a window, scaled to the size of the video if the window was resized."""
        width, height = screen.get_size()
        if (_make_even(width), _make_even(height)) == self._size:
            screen = screen.subsurface(pygame.Rect(0, 0, *self._size))
        else:
            factor = min(self._size[0] / width, self._size[1] / height)
            small = pygame.transform.smoothscale(screen, (int(width * factor), int(height * factor)))
            screen = pygame.Surface(self._size, 0, 32)
            screen.blit(small, small.get_rect(center=screen.get_rect().center))
        return pygame.image.tobytes(screen, "RGB")

    def _write(self) -> None:
        assert self._process.stdin is not None
        try:
            while (data := self._queue.get()) is not None:
                self._process.stdin.write(data)
        except OSError:
            # The encoder is gone. Empty the queue, so that `add` and `close` do not wait forever.
            while self._queue.get() is not None:
                pass
        # Closing may write buffered bytes, which fails as well if the encoder is gone; `close` reports that.
        with suppress(OSError):
            self._process.stdin.close()


def _start_encoder(command: list[str], path: Path) -> Popen[bytes]:
    """Start the encoder; if that fails, remove the empty file of the video."""
    try:
        return Popen(command, stdin=PIPE, stdout=DEVNULL, stderr=DEVNULL, start_new_session=True)
    except OSError:
        path.unlink()
        raise


def _make_even(length: int) -> int:
    """Return the largest even number up to a length, because video encoders require even sizes."""
    return length // 2 * 2


def copy_pixels(screen: pygame.Surface) -> Frame:
    """Return the RGB values of a surface, (height, width, 3) array of uint8."""
    width, height = screen.get_size()
    data = pygame.image.tobytes(screen, "RGB")
    return np.frombuffer(data, dtype=np.uint8).reshape(height, width, 3)
