"""Scenarios of sessions: controllers with gains, properties of robots, and starts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from sample_sessions import HALL, LLOYD, RAPF, RPF

from robocov.controllers import make_controller
from robocov.errors import ParameterError, StartError
from robocov.team import Team
from robocov_app.viewer.panel.parameters import list_limit_parameters, replace_limit
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import MAX_PANES, MAX_ROBOTS, SessionScenario

USER_CONTROLLER = """
from dataclasses import dataclass
with open({log!r}, "a") as log:
    log.write("run\\n")

@dataclass(frozen=True)
class Mine:
    stiffness: float = 1.0

    def force(self, own):
        return self.stiffness * (own.centroid - own.position)
"""


class TestControllerChoice:
    def test_it_builds_the_controller(self):
        controller = ControllerChoice("rapf", {"k_rep": 0.3}).build()
        assert controller == make_controller("rapf", {"k_rep": 0.3})
        assert [choice.label for choice in (RAPF, RPF, LLOYD)] == ["RAPF", "RPF", "Lloyd"]

    def test_gains_have_chosen_or_default_values(self):
        choice = ControllerChoice("rapf", {"k_rep": 0.7})
        assert choice.get_value("k_rep") == 0.7
        assert choice.get_value("k_att") == choice.available_gains["k_att"].default
        changed = choice.with_gain("k_att", 2.5)
        assert changed.get_value("k_rep") == 0.7
        assert changed.get_value("k_att") == 2.5
        assert choice.get_value("k_att") != 2.5

    def test_default_values_are_not_kept(self):
        default = RAPF.get_value("k_rep")
        assert RAPF.with_gain("k_rep", 2 * default).with_gain("k_rep", default) == RAPF
        assert RAPF.with_gain("k_rep", default).gains == {}

    @pytest.mark.parametrize(("gain", "value"), [("k_rap", 1.0), ("k_rep", -1.0), ("k_rep", math.nan)])
    def test_unknown_gains_and_values_are_rejected(self, gain, value):
        with pytest.raises(ParameterError):
            RAPF.with_gain(gain, value)

    def test_unknown_controllers_are_rejected(self):
        with pytest.raises(ParameterError, match="did you mean 'rapf'"):
            ControllerChoice("rapff").build()

    def test_the_file_of_a_controller_is_not_run_for_each_frame(self, tmp_path):
        log = tmp_path / "log"
        (tmp_path / "mine.py").write_text(USER_CONTROLLER.format(log=str(log)))
        choice = ControllerChoice(f"{tmp_path / 'mine.py'}:Mine")
        for _ in range(20):
            assert choice.label == "Mine"
            assert choice.get_value("stiffness") == 1.0
        assert len(log.read_text().splitlines()) <= 2

    def test_differences_are_described(self):
        stiff = ControllerChoice("rapf", {"k_rep": 0.123456})
        assert stiff.describe_changes(RAPF) == "k_rep = 0.123"
        assert stiff.with_gain("k_att", 2.0).describe_changes(stiff) == "k_att = 2"
        assert stiff.describe_changes(stiff) == ""
        assert RAPF.description == "RAPF"
        assert stiff.description == "RAPF, k_rep 0.123"

    def test_a_gain_without_a_value_is_described_as_unlimited(self):
        for name, gain in RAPF.available_gains.items():
            if gain.optional:
                limited = ControllerChoice("rapf", {name: 1.25})
                unlimited = ControllerChoice("rapf", {name: None})
                assert "no limit" in unlimited.describe_changes(limited) + unlimited.description


class TestRobotProperties:
    def test_they_are_those_of_a_team(self):
        properties = RobotProperties(radius=0.2, max_speed=0.5, sensing_range=math.inf)
        team = properties.build_team((1, 2, 3))
        assert len(team) == 3
        assert team.radius.tolist() == [0.2] * 3
        assert RobotProperties.from_team(team) == properties

    def test_robots_may_differ(self):
        radii = np.array([0.1, 0.1, 0.3])
        masses = np.array([2.0, 1.0, 1.0])
        team = replace(Team.homogeneous(3), radius=radii, mass=masses)
        properties = RobotProperties.from_team(team)
        assert properties.build_team((1, 2, 3)).to_dict() == team.to_dict()
        assert properties.get_radius(3) == 0.3
        assert properties.build_team((1, 3)).radius.tolist() == [0.1, 0.3]
        # A new robot has the properties of the first one.
        assert properties.build_team((1, 2, 3, 4)).mass.tolist() == [2.0, 1.0, 1.0, 2.0]
        numbered = RobotProperties.from_team(team, (2, 5, 7))
        assert numbered.build_team((7, 1)).radius.tolist() == [0.3, 0.1]

    def test_a_common_value_replaces_different_ones(self):
        team = replace(Team.homogeneous(3), radius=np.array([0.1, 0.1, 0.3]))
        properties = RobotProperties.from_team(team)
        labels = [parameter.label for parameter in list_limit_parameters(properties)]
        assert [label for label in labels if "≠" in label] == ["Radius ≠"]
        equal = replace_limit(properties, "team.radius", 0.2)
        assert equal.build_team((1, 2, 3)).radius.tolist() == [0.2] * 3

    def test_the_defaults_are_those_of_the_paper(self):
        assert RobotProperties.from_team(Team.homogeneous(2)) == RobotProperties()

    @pytest.mark.parametrize("name", ["radius", "mass", "max_speed", "max_acceleration"])
    @pytest.mark.parametrize("value", [0.0, -1.0, math.nan])
    def test_values_out_of_range_are_rejected(self, name, value):
        with pytest.raises(ParameterError, match=name):
            replace(RobotProperties(), **{name: value}).build_team((1,))

    def test_a_single_value_out_of_range_is_rejected(self):
        with pytest.raises(ParameterError, match="radius"):
            RobotProperties(values_by_robot={"radius": {1: -1.0}}).build_team((1,))


class TestSessionScenario:
    def test_starts_are_sampled_from_the_map(self):
        scenario = SessionScenario(HALL, robots=4, seed=3)
        assert scenario.start_name == "corner"
        np.testing.assert_array_equal(scenario.starts, HALL.start("corner").sample(4, seed=3))
        far = replace(scenario, start="far")
        assert far.start_name == "far"
        assert (far.starts[:, 0] > 4.0).all()

    def test_starts_can_be_given(self):
        starts = np.array([[1.0, 1.0], [2.0, 2.0]])
        scenario = SessionScenario(HALL, given_starts=starts, robots=2)
        np.testing.assert_array_equal(scenario.starts, starts)

    def test_larger_robots_start_farther_apart(self):
        starts = SessionScenario(HALL, robots=4, properties=RobotProperties(radius=0.3)).starts
        distances = np.hypot(*(starts[:, None] - starts[None]).transpose(2, 0, 1))
        assert distances[np.triu_indices(4, 1)].min() >= 0.6

    def test_there_is_a_scenario_for_each_controller(self):
        velocities = np.array([[0.1, 0.0], [0.0, 0.2]])
        starts = np.array([[1.0, 1.0], [2.0, 2.0]])
        scenario = SessionScenario(
            HALL,
            (RAPF, LLOYD),
            robots=2,
            properties=RobotProperties(radius=0.2),
            dt=0.02,
            given_starts=starts,
            velocities=velocities,
        )
        first = scenario.build_scenario(0)
        second = scenario.build_scenario(1)
        assert (first.controller, second.controller) == ("rapf", "lloyd")
        for single in (first, second):
            assert single.environment is HALL
            assert single.team.radius.tolist() == [0.2, 0.2]
            assert single.dt == 0.02
            np.testing.assert_array_equal(single.starts, starts)
            np.testing.assert_array_equal(single.velocities, velocities)

    @pytest.mark.parametrize("robots", [0, -1, MAX_ROBOTS + 1])
    def test_the_number_of_robots_is_limited(self, robots):
        with pytest.raises(ParameterError, match="whole number from 1 to 1000"):
            SessionScenario(HALL, robots=robots)

    @pytest.mark.parametrize("count", [0, MAX_PANES + 1])
    def test_the_number_of_controllers_is_limited(self, count):
        with pytest.raises(ParameterError, match="expected 1 to 4"):
            SessionScenario(HALL, (RAPF,) * count)

    def test_a_team_needs_space_and_a_start_that_exists(self):
        with pytest.raises(StartError, match="space for about"):
            _ = SessionScenario(HALL, robots=500).starts
        with pytest.raises(StartError, match="did you mean 'corner'"):
            _ = SessionScenario(HALL, start="cornre").starts
