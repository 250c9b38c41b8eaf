"""A film of the window while it is used: written beside it, and readable even if the window is killed."""

import queue
import threading
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen

import numpy as np
import pygame

from robocov.errors import OutputError
from robocov_app.runs.encoding import Frame, build_encoder_command

FPS = 30  # frames of a film per second
_WAITING = 45  # frames that may wait to be written; what comes when there are more is left out


class Film:
    """Writes frames to an MP4 film.

    The encoder is a process of its own, which ends the film properly when its input ends, however that comes
    about. Frames of other sizes than `size`, px, are fitted in; `patient`: none is left out. Raises
    OutputError when there is no encoder, the folder cannot be made, or `path` is there already.
    """

    def __init__(self, path: Path, size: tuple[int, int], *, patient: bool = False) -> None:
        self.path, self._patient = path, patient
        self.frames = self.left_out = 0
        self._size = size[0] // 2 * 2, size[1] // 2 * 2
        self._due = 0.0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            command = build_encoder_command(path, self._size, FPS, streamed=True)
            path.open("xb").close()  # a new file, and through no link
            self._process = Popen(command, stdin=PIPE, stdout=DEVNULL, stderr=DEVNULL, start_new_session=True)
        except OSError as error:
            raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error
        self._queue: queue.Queue[bytes | None] = queue.Queue(_WAITING)
        self._thread = threading.Thread(target=self._write, daemon=True)
        self._thread.start()

    def add(self, screen: pygame.Surface, seconds: float) -> None:
        self._due += seconds * FPS
        count = int(self._due + 1e-6)
        self._due -= count
        if count <= 0:
            return
        data = self._fitted(screen)
        for _ in range(min(count, FPS)):
            try:
                self._queue.put(data, block=self._patient)
                self.frames += 1
            except queue.Full:
                self.left_out += 1

    def close(self) -> None:
        self._queue.put(None)
        self._thread.join()
        if self._process.wait() != 0:
            raise OutputError(f"{self.path}: the film's encoder failed")

    def _fitted(self, screen: pygame.Surface) -> bytes:
        width, height = screen.get_size()
        if (width // 2 * 2, height // 2 * 2) == self._size:
            screen = screen.subsurface(pygame.Rect(0, 0, *self._size))
        else:
            part = min(self._size[0] / width, self._size[1] / height)
            small = pygame.transform.smoothscale(screen, (int(width * part), int(height * part)))
            screen = pygame.Surface(self._size, 0, 32)
            screen.blit(small, small.get_rect(center=screen.get_rect().center))
        return pygame.image.tobytes(screen, "RGB")

    def _write(self) -> None:
        assert self._process.stdin is not None
        try:
            while (data := self._queue.get()) is not None:
                self._process.stdin.write(data)
            self._process.stdin.close()
        except OSError:
            while self._queue.get() is not None:  # the encoder is gone: let nobody wait
                pass


def pixels(screen: pygame.Surface) -> Frame:
    width, height = screen.get_size()
    return np.frombuffer(pygame.image.tobytes(screen, "RGB"), dtype=np.uint8).reshape(height, width, 3)
