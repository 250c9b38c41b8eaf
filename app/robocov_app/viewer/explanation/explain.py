"""The report on a robot: why it moves, or why it does not."""

from collections.abc import Sequence
from dataclasses import dataclass

from robocov.defaults import DEFAULT_DT_S
from robocov.environment import Environment
from robocov.observation import Snapshot
from robocov.team import Team
from robocov.typing import FloatArray
from robocov_app.viewer.explanation.contact_force import compute_contact_force
from robocov_app.viewer.explanation.motion_classification import classify_motion
from robocov_app.viewer.explanation.motion_sentence import describe_motion
from robocov_app.viewer.explanation.sentences import (
    ReportLine,
    build_position_line,
    list_contact_lines,
    list_force_lines,
    list_reasons,
    list_surroundings,
)
from robocov_app.viewer.explanation.situation import RobotSituation
from robocov_app.viewer.presenter import Presenter


@dataclass(frozen=True)
class RobotReport:
    """Report on a robot.

    Attributes
    ----------
    title : str
        Name of the robot.
    verdict : str
        Its motion and its goal, in one sentence.
    lines : tuple of ReportLine
        Position, forces, reasons and surroundings.
    """

    title: str
    verdict: str
    lines: tuple[ReportLine, ...]


def explain_robot(viewer: Presenter, number: int) -> RobotReport:
    """Build the report on a robot of the active pane, given by its number, at the displayed step."""
    displayed = viewer.session.displayed
    pane = viewer.pane
    setup = displayed.get_setup(pane)
    if number in setup.failed:
        x, y = setup.failed[number]
        verdict = f"failed: it stays at ({x:z.2f}, {y:z.2f}) m, and the others sense it as an obstacle"
        return RobotReport(f"Robot {number}", verdict, ())
    return explain(
        displayed.get_snapshot(pane),
        setup.team,
        setup.sensed_environment,
        setup.numbers.index(number),
        numbers=setup.numbers,
        recent=displayed.get_recent_positions(pane, number),
        dt=viewer.session.timeline.scenario.dt,
    )


def explain(
    snapshot: Snapshot,
    team: Team,
    environment: Environment,
    robot: int,
    *,
    numbers: Sequence[int] | None = None,
    recent: FloatArray | None = None,
    dt: float = DEFAULT_DT_S,
) -> RobotReport:
    """Explain why a robot moves, or why it does not.

    Parameters
    ----------
    snapshot : Snapshot
        What all robots observed and decided.
    team : Team
        The team.
    environment : Environment
        The map, with failed robots as obstacles.
    robot : int
        Row of the robot in arrays.
    numbers : sequence of int, optional
        Numbers of the robots; by default 1, 2, ...
    recent : (k, 2) array, m, optional
        Positions of the robot during the last `SETTLED_WINDOW_S` seconds, oldest first. Without them its
        speed alone decides whether it is at rest.
    dt : float, s
        Control period, over which the force of contacts is averaged.

    Returns
    -------
    RobotReport
    """
    if numbers is None:
        numbers = range(1, len(team) + 1)
    situation = RobotSituation(snapshot, team, environment, robot, numbers)
    motion = classify_motion(situation, recent)
    contact_force = 0j
    if situation.touched and situation.forces:
        contact_force = compute_contact_force(snapshot, team, environment, robot, dt=dt)
    sentences = [*list_reasons(situation, motion), *list_surroundings(situation)]
    lines = (
        build_position_line(situation),
        *list_force_lines(situation),
        *list_contact_lines(situation, contact_force),
        *map(ReportLine, sentences),
    )
    return RobotReport(f"Robot {situation.number}", describe_motion(situation, motion), lines)
