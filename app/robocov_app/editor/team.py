"""The team shown at a start of the map, sampled in a thread so that the window does not block."""

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

from robocov.environment import Point
from robocov_app.editor.model.sketch import Sketch


@dataclass(frozen=True)
class TeamRequest:
    """Request to place a team at a start.

    Attributes
    ----------
    sketch : Sketch
        The map.
    start : str or None
        Name of the start; None for random positions in the free space.
    robots : int
        Number of robots.
    seed : int
        Seed of the positions.
    radius : float
        Radius of a robot, m.
    """

    sketch: Sketch
    start: str | None
    robots: int
    seed: int
    radius: float


@dataclass(frozen=True)
class Team:
    """A team with the positions of its robots at a start.

    Attributes
    ----------
    start : str or None
        Name of the start; None for random positions in the free space.
    robots : int
        Number of robots.
    radius : float
        Radius of a robot, m.
    positions : tuple of Point
        Positions of the robots, m; empty if they do not fit.
    message : str
        Reason why the robots do not fit; empty if they do.
    """

    start: str | None
    robots: int
    radius: float
    positions: tuple[Point, ...] = ()
    message: str = ""


def sample_team(request: TeamRequest) -> Team:
    """Sample the positions of a team; if that fails, return a team without positions and with a message."""
    try:
        start = request.sketch.build_environment().start(request.start)
        positions = start.sample(request.robots, seed=request.seed, radius=request.radius)
    except Exception as error:  # An unexpected error must not crash the window.
        message = str(error).removeprefix("map: ")
        return Team(request.start, request.robots, request.radius, message=message)
    points = tuple((x, y) for x, y in positions.tolist())
    return Team(request.start, request.robots, request.radius, points)


class TeamSampler:
    """Samples teams in a thread; only the newest request counts."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, "team")
        self._request: TeamRequest | None = None
        self._future: Future[Team] | None = None

    def poll(self, request: TeamRequest) -> Team | None:
        """Start to sample a team if the request is new; return the team once it is ready, otherwise None.

        Call this regularly. Each team is returned only once.
        """
        if self._request != request:
            self._request = request
            if self._future is not None:
                self._future.cancel()
            self._future = self._pool.submit(sample_team, request)
        if self._future is None or not self._future.done():
            return None
        team = self._future.result()
        self._future = None
        return team

    def close(self) -> None:
        """End the thread."""
        self._pool.shutdown(wait=False, cancel_futures=True)
