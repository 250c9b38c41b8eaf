"""Preview of a team at a start: drawn in a thread, so that the window does not wait. Knows no pygame."""

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

from robocov.environment import Point
from robocov_app.editor.model.sketch import Sketch


@dataclass(frozen=True)
class Team:
    """A team at a start."""

    start: str | None  # None for anywhere in the free space
    robots: int
    radius: float  # m
    places: tuple[Point, ...] = ()  # m; empty where it cannot stand there
    words: str = ""  # why not


def placed(sketch: Sketch, start: str | None, robots: int, seed: int, radius: float) -> Team:
    try:
        points = sketch.environment().start(start).sample(robots, seed=seed, radius=radius)
    except Exception as error:  # what nobody has foreseen must not end the window either
        return Team(start, robots, radius, words=str(error).removeprefix("map: "))
    return Team(start, robots, radius, tuple((x, y) for x, y in points.tolist()))


class TeamThread:
    """Asks `placed` in a thread; only the newest question counts."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, "team")
        self._asked: tuple[object, ...] = ()
        self._answer: Future[Team] | None = None

    def ask(self, sketch: Sketch, start: str | None, robots: int, seed: int, radius: float) -> None:
        """Ask where a team would stand; asking the same again does nothing."""
        team = start, robots, seed, radius
        if self._asked == (sketch, *team):
            return
        self._asked = sketch, *team
        if self._answer is not None:
            self._answer.cancel()
        self._answer = self._pool.submit(placed, sketch, *team)

    def poll(self) -> Team | None:
        """Return the answer to the newest question, once."""
        if self._answer is None or not self._answer.done():
            return None
        answer, self._answer = self._answer.result(), None
        return answer

    def close(self) -> None:
        self._pool.shutdown(cancel_futures=True)
