"""The inspector on robots that really run: stuck, trembling, arrived."""

from __future__ import annotations

import re
from dataclasses import dataclass

import pytest
from explained_moments import line, run, says_no_nonsense, sums_up, texts

from robocov import IndividualControllerAdapter, Lloyd, Rapf, Rpf, Simulation, Team, load_map
from robocov.controllers import make_controller
from robocov_app.viewer.explanation.explain import explain
from robocov_app.viewer.explanation.situation import UNEXPLAINED_FORCE

# runs


@pytest.mark.parametrize(
    ("controller", "reason"),
    [
        (Rapf(), "stuck: the pull to its centroid (2.0 N) and the push of the wall (2.0 N) balance"),
        (Lloyd(), "stuck: the pull to its centroid (10 N) presses it against the wall"),
    ],
)
def test_stuck_in_the_trap(controller, reason):
    trap = load_map("trap")
    reports = run(Simulation(trap, controller, trap.start("inside").sample(3, seed=0)), 40.0)
    (stuck,) = (report for report in reports if "stuck" in report.verdict)
    assert stuck.title == "Robot 3"
    assert re.fullmatch(r"at rest, stuck: its centroid is 1\.\d m away, behind an obstacle", stuck.verdict)
    assert reason in texts(stuck)
    for report in reports:
        sums_up(report)


def test_at_rest_on_the_centroid_of_the_square():
    square = load_map("square")
    reports = run(Simulation(square, Lloyd(), square.start().sample(4, seed=0)), 40.0)
    assert {report.verdict for report in reports} == {"arrived: at rest on its centroid"}
    assert "not pulled to its centroid, 0 mm away" in texts(reports[0])


def test_robots_without_goals():
    square = load_map("square")
    simulation = Simulation(square, Rpf(), square.start().sample(3, seed=1))
    (first, *_) = run(simulation, 0.0)
    assert first.verdict.startswith("setting off ")
    for report in run(simulation, 3.0):
        assert report.verdict.startswith(("moving ", "braking from "))
        assert not [text for text in texts(report) if "goal" in text or "centroid" in text]
        assert {"repulsion_robots", "repulsion_obstacle"} < {one.kind for one in report.lines}


def test_a_repulsive_team_trembles():
    rooms = load_map("rooms")
    reports = run(Simulation(rooms, Rpf(), rooms.start().sample(6, seed=0)), 40.0)
    assert [report for report in reports if report.verdict == "trembling in place"]


def test_a_single_robot_that_senses_nothing():
    square = load_map("square")
    team = Team.homogeneous(1, sensing_range=0.5)
    simulation = Simulation(square, Rapf(), [[2.0, 3.0]], team)
    assert run(simulation, 0.0)[0].verdict == "setting off north-east to its centroid"
    assert run(simulation, 2.0)[0].verdict == "moving 0.98 m/s north-east to its centroid"
    (report,) = run(simulation, 60.0)
    assert report.verdict == "arrived: at rest on its centroid"
    assert {"no robot in communication range", "senses nothing within 50 cm", "not pushed by robots"} < {
        *texts(report)
    }


@dataclass(frozen=True)
class Home:
    """Goes to its centroid, and says no more."""

    def force(self, own):
        return 0.5 * (own.centroid - own.position)


def test_laws_that_tell_no_terms():
    simulation = Simulation(load_map("square"), IndividualControllerAdapter(Home()), [[2.0, 3.0], [7.0, 3.0]])
    report = run(simulation, 1.0)[0]
    assert line(report, UNEXPLAINED_FORCE).text.endswith("by its controller")
    assert [text for text in texts(report) if re.fullmatch(r"its centroid is \d\.\d m away", text)]
    sums_up(report)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["rapf", "rpf", "lloyd"])
@pytest.mark.parametrize("name", ["rooms", "l-shape"])
def test_all_along_a_run(law, name):
    environment = load_map(name)
    simulation = Simulation(environment, make_controller(law), environment.start().sample(4, seed=2))
    for snapshot in simulation.snapshots(4.0):
        for robot in range(4):
            says_no_nonsense(explain(snapshot, simulation.team, environment, robot))
