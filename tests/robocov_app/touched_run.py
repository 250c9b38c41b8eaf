"""A hall and sessions in it, for the tests of the interactive window's model."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from robocov.environment import CircleObstacle, DiscStart, Environment, UniformStart, WallObstacle
from robocov_app.viewer.costs import Costs
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.scenario import SessionScenario
from robocov_app.viewer.session.session import Session

HALL = Environment(
    "hall",
    ((0, 0), (6, 0), (6, 4), (0, 4)),
    (CircleObstacle((4.2, 1.2), 0.5, "pillar"), WallObstacle(((2.5, 4), (2.5, 2.4)), 0.1)),
    {"corner": DiscStart((1.2, 1.2), 0.8), "far": DiscStart((5.2, 3.2), 0.5), "spread": UniformStart()},
)
PILLAR = CircleObstacle((3.5, 3.0), 0.3)
RAPF, RPF, LLOYD = ControllerChoice("rapf"), ControllerChoice("rpf"), ControllerChoice("lloyd")


def begun(*laws: ControllerChoice, robots: int = 3, environment: Environment = HALL, **changes) -> Session:
    """Return a session that is paused at its beginning."""
    session = Session(SessionScenario(environment, laws or (RAPF,), robots, **changes))
    session.playback.is_playing = False
    return session


def stepped(session: Session, steps: int) -> Session:
    """Let a session make so many steps."""
    for _ in range(steps):
        session.playback.step()
    return session


def robots_of(session: Session) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the numbers of the robots that work, and of those that failed."""
    there = session.displayed.get_setup(session.timeline.panes[0])
    return there.numbers, tuple(sorted(there.failed))


def all_told(session: Session) -> list[object]:
    """Return whatever can be told of a session, so that it can be compared."""
    told: list[object] = [
        session.timeline.scenario,
        session.timeline.drag,
        session.timeline.is_settled,
        session.playback.is_playing,
        session.timeline.past_version,
    ]
    told += [
        session.displayed.time,
        session.timeline.end_time,
        session.timeline.is_live,
        session.timeline.history.steps[:],
        session.timeline.history.thinned,
    ]
    told += [
        list(map(id, session.timeline.history.states)),
        list(session.timeline.events),
        list(session.timeline.ghosts),
    ]
    told += [
        session.timeline.head.number,
        session.timeline.head.parent is not None,
        session.timeline.head.redo is not None,
    ]
    for pane in session.timeline.panes:
        told += [pane.number, pane.setup, pane.time]
        told += [
            array.tobytes()
            for array in (
                *(pane.simulation.positions, pane.simulation.velocities, pane.starts),
                *(
                    pane.trail.positions,
                    pane.trail.times,
                    pane.distance_curve.times,
                    pane.distance_curve.values,
                ),
                *pane.sensed.until(np.inf),
            )
        ]
    return told


def too_deep(session: Session) -> float:
    """Return by how many meters some robot is too near to a wall or an obstacle, inf inside of one."""
    deepest = -np.inf
    for pane in session.timeline.panes:
        free = pane.setup.sensed_environment.free
        places = shapely.points(pane.simulation.positions)
        if not shapely.contains_properly(free, places).all():
            return np.inf
        rim = shapely.distance(free.boundary, places) - pane.simulation.team.radius
        deepest = max(deepest, float(-rim.min()))
    return deepest


def with_pillar(environment=HALL, pillar=PILLAR) -> Environment:
    """Return the hall with one more obstacle."""
    return replace(environment, obstacles=(*environment.obstacles, pillar))


def viewer_of(*laws: ControllerChoice, folder: Path = Path(), **changes) -> Presenter:
    """Return a desk in the hall, paused at its beginning."""
    return Presenter(begun(*laws, **changes), Costs(8, direct=True), {"cells", "robots"}, folder, "hall")


def positions_of(session) -> list[np.ndarray]:
    """Return where the robots of each pane are, (n, 2) m."""
    return [session.displayed.get_positions(pane).copy() for pane in session.timeline.panes]


def with_curves(session, steps) -> None:
    """Make steps, with a cost at each, as the window notes it."""
    for _ in range(steps):
        for pane in session.timeline.panes:
            pane.distance_curve.add(session.displayed.time, 3.0 - session.displayed.time)
        session.playback.step()
