"""How a team would stand at a start: drawn in a thread, so that the window does not wait. Knows no pygame."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING

from robocov.errors import RobocovError

if TYPE_CHECKING:
    from robocov.environment import Point
    from robocov_app.editor.model.sketch import Sketch


@dataclass(frozen=True)
class Team:
    """A team at a start.

    `start`: None for anywhere in the free space. `radius` in m. `places`, m: empty where it cannot stand
    there. `words`: why not.
    """

    start: str | None
    robots: int
    seed: int
    radius: float
    places: tuple[Point, ...] = ()
    words: str = ""


def placed(sketch: Sketch, start: str | None, robots: int, seed: int, radius: float) -> Team:
    """Return where a team would stand, or why it cannot."""
    try:
        points = sketch.environment().start(start).sample(robots, seed=seed, radius=radius)
    except RobocovError as error:
        return Team(start, robots, seed, radius, words=str(error).removeprefix("map: "))
    return Team(start, robots, seed, radius, tuple((x, y) for x, y in points.tolist()))


class TeamThread:
    """Asks `placed` in a thread; only the newest question counts."""

    def __init__(self) -> None:
        self._asked: tuple[Sketch, str | None, int, int, float] | None = None
        self._answer: Team | None = None
        self._waiting = threading.Event()
        self._lock = threading.Lock()
        self._ended = False
        self._last: object = None
        self._thread: threading.Thread | None = None

    def ask(self, sketch: Sketch, start: str | None, robots: int, seed: int, radius: float) -> None:
        """Ask where a team would stand; asking the same again does nothing."""
        question = (sketch, start, robots, seed, radius)
        last = self._last
        if isinstance(last, tuple) and last[0] is sketch and last[1:] == question[1:]:
            return
        self._last = question
        with self._lock:
            self._asked = question
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="team", daemon=True)
            self._thread.start()
        self._waiting.set()

    def poll(self) -> Team | None:
        """Return the newest answer since the last call."""
        with self._lock:
            answer, self._answer = self._answer, None
        return answer

    @property
    def busy(self) -> bool:
        """Whether an answer is to come."""
        with self._lock:
            return self._asked is not None

    def close(self) -> None:
        """End the thread."""
        self._ended = True
        self._waiting.set()
        if self._thread is not None:
            self._thread.join(5.0)

    def _work(self) -> None:
        while True:
            self._waiting.wait()
            self._waiting.clear()
            if self._ended:
                return
            with self._lock:
                question = self._asked
            if question is None:
                continue
            answer = placed(*question)
            with self._lock:
                if self._asked is question:
                    self._asked, self._answer = None, answer
