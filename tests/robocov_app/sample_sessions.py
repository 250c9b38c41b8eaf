"""A hall and sessions in it, for the tests of the interactive window."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from robocov.environment import CircleObstacle, DiscStart, Environment, UniformStart, WallObstacle
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.scenario import SessionScenario

HALL = Environment(
    "hall",
    ((0, 0), (6, 0), (6, 4), (0, 4)),
    (CircleObstacle((4.2, 1.2), 0.5, "pillar"), WallObstacle(((2.5, 4), (2.5, 2.4)), 0.1)),
    {"corner": DiscStart((1.2, 1.2), 0.8), "far": DiscStart((5.2, 3.2), 0.5), "spread": UniformStart()},
)
PILLAR = CircleObstacle((3.5, 3.0), 0.3)
RAPF = ControllerChoice("rapf")
RPF = ControllerChoice("rpf")
LLOYD = ControllerChoice("lloyd")
LATTICE = 8


def start_session(
    *controllers: ControllerChoice, robots: int = 3, environment: Environment = HALL, **changes
) -> Session:
    """Start a session, which is paused at time 0."""
    scenario = SessionScenario(environment, controllers or (RAPF,), robots, **changes)
    session = Session(scenario)
    session.playback.is_playing = False
    return session


def advance_session(session: Session, steps: int) -> Session:
    """Advance a session by a number of steps, and return it."""
    for _ in range(steps):
        session.playback.step()
    return session


def advance_with_costs(session: Session, steps: int) -> None:
    """Advance a session, with a sample of the cost curves at each step as in the window."""
    for _ in range(steps):
        for pane in session.timeline.panes:
            time = session.displayed.time
            pane.distance_curve.add(time, 3.0 - time)
        session.playback.step()


def get_robot_numbers(session: Session) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the numbers of the working and of the failed robots."""
    setup = session.displayed.get_setup(session.timeline.panes[0])
    return setup.numbers, tuple(sorted(setup.failed))


def get_positions(session: Session) -> list[np.ndarray]:
    """Return the displayed positions of the robots of each pane, (n, 2) m."""
    return [session.displayed.get_positions(pane).copy() for pane in session.timeline.panes]


def describe_state(session: Session) -> list[object]:
    """Return all values of the state of a session, for comparisons."""
    timeline = session.timeline
    state: list[object] = [
        timeline.scenario,
        timeline.run.drag,
        timeline.is_settled,
        timeline.past_version,
        timeline.end_time,
        timeline.is_live,
        timeline.history.steps[:],
        timeline.history.thinned,
        list(map(id, timeline.history.states)),
        list(timeline.events),
        list(timeline.ghosts),
        timeline.head.number,
        timeline.head.parent is not None,
        timeline.head.redo_child is not None,
        session.playback.is_playing,
        session.displayed.time,
    ]
    for pane in timeline.panes:
        arrays = [
            pane.simulation.positions,
            pane.simulation.velocities,
            pane.starts,
            pane.trail.positions,
            pane.trail.times,
            pane.distance_curve.times,
            pane.distance_curve.values,
            *pane.sensed.get_until(np.inf),
        ]
        state += [pane.number, pane.setup, pane.time]
        state += [array.tobytes() for array in arrays]
    return state


def compute_penetration(session: Session) -> float:
    """Return the maximum overlap of a robot with a wall or an obstacle, m; inf for a robot inside one."""
    max_overlap = -np.inf
    for pane in session.timeline.panes:
        free_area = pane.setup.sensed_environment.free
        centers = shapely.points(pane.simulation.positions)
        if not shapely.contains_properly(free_area, centers).all():
            return np.inf
        distances = shapely.distance(free_area.boundary, centers)
        overlaps = pane.simulation.team.radius - distances
        max_overlap = max(max_overlap, float(overlaps.max()))
    return max_overlap


def add_pillar(environment: Environment = HALL, pillar: CircleObstacle = PILLAR) -> Environment:
    """Return a map with one more obstacle."""
    return replace(environment, obstacles=(*environment.obstacles, pillar))


def build_presenter(
    *controllers: ControllerChoice, folder: Path = Path(), draft_folder: Path | None = None, **changes
) -> Presenter:
    """Build a presenter of a session in the hall, which is paused at time 0."""
    session = start_session(*controllers, **changes)
    costs = Costs(LATTICE, direct=True)
    return Presenter(session, costs, {"cells", "robots"}, folder, "hall", draft_folder=draft_folder)
