"""Reports on robots in simulations: stuck, trembling, arrived."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import pytest
from robot_reports import assert_consistent, assert_forces_sum_up, explain_run, get_line, list_texts

from robocov import IndividualControllerAdapter, Lloyd, Rapf, Rpf, Simulation, Team, load_map
from robocov.controllers import make_controller
from robocov_app.viewer.explanation.explain import explain
from robocov_app.viewer.explanation.situation import UNEXPLAINED_FORCE

# runs


@pytest.mark.parametrize(
    ("controller", "reason"),
    [
        (Rapf(), "stuck: the pull to its centroid (2.0 N) and the repulsion of the wall (2.0 N) balance"),
        (Lloyd(), "stuck: the pull to its centroid (10 N) presses it against the wall"),
    ],
)
def test_a_robot_stuck_in_the_trap(controller, reason):
    trap = load_map("trap")
    reports = explain_run(Simulation(trap, controller, trap.start("inside").sample(3, seed=0)), 40.0)
    (stuck,) = [report for report in reports if "stuck" in report.verdict]
    assert stuck.title == "Robot 3"
    assert re.fullmatch(r"at rest, stuck: its centroid is 1\.\d m away, behind an obstacle", stuck.verdict)
    assert reason in list_texts(stuck)
    for report in reports:
        assert_forces_sum_up(report)


def test_the_force_of_a_contact_balances_the_resultant():
    trap = load_map("trap")
    reports = explain_run(Simulation(trap, Lloyd(), trap.start("inside").sample(3, seed=0)), 40.0)
    (stuck,) = [report for report in reports if "stuck" in report.verdict]
    contact = get_line(stuck, "contact")
    assert re.fullmatch(r"pushed \w+ with \d(\.\d+)? N by contact with the wall", contact.text)
    team = Team.homogeneous(3)
    # The robot is at rest, so the wall exerts the force to which the acceleration limits the motion.
    limit = team.mass[0] * team.max_acceleration[0]
    resultant = np.array(get_line(stuck, "resultant").vector)
    drive = resultant * min(1.0, limit / np.hypot(*resultant))
    assert np.array(contact.vector) == pytest.approx(-drive, abs=0.05 * limit)


def test_robots_without_contact_have_no_contact_force():
    square = load_map("square")
    reports = explain_run(Simulation(square, Lloyd(), square.start().sample(4, seed=0)), 10.0)
    assert not [line for report in reports for line in report.lines if line.kind == "contact"]


def test_robots_at_rest_on_their_centroids():
    square = load_map("square")
    reports = explain_run(Simulation(square, Lloyd(), square.start().sample(4, seed=0)), 40.0)
    assert {report.verdict for report in reports} == {"arrived: at rest on its centroid"}
    assert "not pulled toward its centroid, 0 mm away" in list_texts(reports[0])


def test_robots_without_goals():
    square = load_map("square")
    simulation = Simulation(square, Rpf(), square.start().sample(3, seed=1))
    (first, *_) = explain_run(simulation, 0.0)
    assert first.verdict.startswith("setting off ")
    for report in explain_run(simulation, 3.0):
        assert report.verdict.startswith(("moving ", "braking from "))
        assert not [text for text in list_texts(report) if "goal" in text or "centroid" in text]
        assert {"repulsion_robots", "repulsion_obstacle"} < {one.kind for one in report.lines}


def test_a_repulsive_team_trembles():
    rooms = load_map("rooms")
    reports = explain_run(Simulation(rooms, Rpf(), rooms.start().sample(6, seed=0)), 40.0)
    assert [report for report in reports if report.verdict == "trembling in place"]


def test_a_single_robot_that_senses_nothing():
    square = load_map("square")
    team = Team.homogeneous(1, sensing_range=0.5)
    simulation = Simulation(square, Rapf(), [[2.0, 3.0]], team)
    assert explain_run(simulation, 0.0)[0].verdict == "setting off northeast to its centroid"
    assert explain_run(simulation, 2.0)[0].verdict == "moving northeast to its centroid at 0.98 m/s"
    (report,) = explain_run(simulation, 60.0)
    assert report.verdict == "arrived: at rest on its centroid"
    assert {"no robot in communication range", "senses nothing within 50 cm", "not repelled by robots"} < {
        *list_texts(report)
    }


@dataclass(frozen=True)
class Home:
    """A controller that drives robots to their centroids, without terms."""

    def force(self, own):
        return 0.5 * (own.centroid - own.position)


def test_controllers_without_terms():
    simulation = Simulation(load_map("square"), IndividualControllerAdapter(Home()), [[2.0, 3.0], [7.0, 3.0]])
    report = explain_run(simulation, 1.0)[0]
    assert get_line(report, UNEXPLAINED_FORCE).text.endswith("by its controller")
    assert [text for text in list_texts(report) if re.fullmatch(r"its centroid is \d\.\d m away", text)]
    assert_forces_sum_up(report)


@pytest.mark.slow
@pytest.mark.parametrize("controller", ["rapf", "rpf", "lloyd"])
@pytest.mark.parametrize("name", ["rooms", "l-shape"])
def test_reports_along_a_run_are_consistent(controller, name):
    environment = load_map(name)
    simulation = Simulation(environment, make_controller(controller), environment.start().sample(4, seed=2))
    for snapshot in simulation.snapshots(4.0):
        for robot in range(4):
            assert_consistent(explain(snapshot, simulation.team, environment, robot))
