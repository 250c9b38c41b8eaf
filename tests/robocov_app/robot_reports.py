"""Reports on robots, for given observations and decisions, and after runs."""

import re

import numpy as np
import pytest
from drawn_run import SQUARE

from robocov import Simulation, Team
from robocov.metrics import SETTLED_WINDOW_S
from robocov.observation import Decision, Observations, Snapshot
from robocov.observation.neighbors import Neighbors
from robocov_app.viewer.explanation.explain import RobotReport, explain
from robocov_app.viewer.explanation.sentences import ReportLine


def build_report(
    positions,
    *,
    velocities=None,
    forces=None,
    goals=None,
    points=None,
    environment=SQUARE,
    cells=None,
    recent=None,
    robot=0,
    names=None,
    **terms,
) -> RobotReport:
    """Explain a robot with given observations and terms; by default its forces are the sum of the terms."""
    positions = np.array(positions, dtype=float)
    limits = {name: terms.pop(name) for name in tuple(terms) if name in Team.__dataclass_fields__}
    team = Team.homogeneous(len(positions), **limits)
    unknown = np.full_like(positions, np.nan)
    terms = {name: np.array(value, dtype=float) for name, value in terms.items()}
    if forces is None:
        forces = sum(terms.values(), np.zeros_like(positions))
    observations = Observations(
        positions,
        np.zeros_like(positions) if velocities is None else np.array(velocities, dtype=float),
        Neighbors.from_ranges(positions, team.communication_range),
        unknown if points is None else np.array(points, dtype=float),
        environment.region,
    )
    goals = None if goals is None else np.array(goals, dtype=float)
    snapshot = Snapshot(observations, Decision(np.array(forces, dtype=float), goals, terms, cells))
    return explain(snapshot, team, environment, robot, numbers=names, recent=recent)


def explain_run(simulation: Simulation, seconds: float) -> list[RobotReport]:
    """Continue a simulation, and explain all robots at its end with their recent positions."""
    past = [snapshot.positions for snapshot in simulation.snapshots(seconds)]
    recent = np.array(past[-round(SETTLED_WINDOW_S / simulation.dt) - 1 :: 8])
    team = simulation.team
    environment = simulation.environment
    return [
        explain(simulation.observe_and_decide(), team, environment, robot, recent=recent[:, robot])
        for robot in range(len(team))
    ]


def list_texts(report: RobotReport) -> list[str]:
    return [line.text for line in report.lines]


def get_line(report: RobotReport, kind: str) -> ReportLine:
    """Return the only line of a kind."""
    (line,) = [line for line in report.lines if line.kind == kind]
    return line


def assert_forces_sum_up(report: RobotReport) -> None:
    """Check that the resultant force is the sum of all terms, without the force of contacts."""
    total = np.array(get_line(report, "resultant").vector)
    others = ("resultant", "contact")
    terms = [line.vector for line in report.lines if line.vector is not None and line.kind not in others]
    scale = max((np.abs(term).max() for term in terms), default=0.0)
    assert np.sum(terms or [(0.0, 0.0)], axis=0) == pytest.approx(total, abs=1e-5 + 1e-8 * scale)


def assert_consistent(report: RobotReport) -> None:
    """Check that texts have no placeholders or raw numbers, and that forces are finite and sum up."""
    for text in (report.title, report.verdict, *list_texts(report)):
        assert text
        assert text == " ".join(text.split())
        assert not re.search(r"nan|inf|None|\de[+-]?\d|-0\.00|\bj\b", text), text
    vectors = [line.vector for line in report.lines if line.vector is not None]
    assert np.isfinite(vectors).all()
    assert report.lines[0].vector is None
    assert_forces_sum_up(report)
