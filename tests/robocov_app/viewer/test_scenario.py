from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from sample_sessions import HALL, LLOYD, RAPF, RPF

from robocov.controllers import make_controller
from robocov.errors import ParameterError, StartError
from robocov.team import Team
from robocov_app.viewer.parameters import limit_parameters, with_limit
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.robot_properties import RobotProperties
from robocov_app.viewer.session.scenario import MAX_PANES, MAX_ROBOTS, SessionScenario

MINE = """
from dataclasses import dataclass
with open({marks!r}, "a") as marks:
    marks.write("run\\n")

@dataclass(frozen=True)
class Mine:
    stiffness: float = 1.0

    def force(self, own):
        return self.stiffness * (own.centroid - own.position)
"""


class TestLaw:
    def test_its_controller(self):
        assert ControllerChoice("rapf", {"k_rep": 0.3}).build() == make_controller("rapf", {"k_rep": 0.3})
        assert [law.label for law in (RAPF, RPF, LLOYD)] == ["RAPF", "RPF", "Lloyd"]

    def test_its_gains(self):
        law = ControllerChoice("rapf", {"k_rep": 0.7})
        assert law.get_value("k_rep") == 0.7
        assert law.get_value("k_att") == law.available_gains["k_att"].default
        other = law.with_gain("k_att", 2.5)
        assert (other.get_value("k_rep"), other.get_value("k_att")) == (0.7, 2.5)
        assert law.get_value("k_att") != 2.5

    def test_gains_are_those_that_differ(self):
        default = RAPF.get_value("k_rep")
        assert RAPF.with_gain("k_rep", 2 * default).with_gain("k_rep", default) == RAPF
        assert RAPF.with_gain("k_rep", default).gains == {}

    @pytest.mark.parametrize(("gain", "value"), [("k_rap", 1.0), ("k_rep", -1.0), ("k_rep", math.nan)])
    def test_what_is_no_gain_is_refused(self, gain, value):
        with pytest.raises(ParameterError):
            RAPF.with_gain(gain, value)

    def test_there_is_no_such_law(self):
        with pytest.raises(ParameterError, match="did you mean 'rapf'"):
            ControllerChoice("rapff").build()

    def test_a_file_is_not_run_for_each_picture(self, tmp_path):
        marks = tmp_path / "marks"
        (tmp_path / "mine.py").write_text(MINE.format(marks=str(marks)))
        law = ControllerChoice(f"{tmp_path / 'mine.py'}:Mine")
        for _ in range(20):
            assert law.label == "Mine"
            assert law.get_value("stiffness") == 1.0
        assert len(marks.read_text().splitlines()) <= 2

    def test_what_differs_in_words(self):
        stiff = ControllerChoice("rapf", {"k_rep": 0.123456})
        assert stiff.describe_changes(RAPF) == "k_rep = 0.123"
        assert stiff.with_gain("k_att", 2.0).describe_changes(stiff) == "k_att = 2"
        assert stiff.describe_changes(stiff) == ""
        assert RAPF.description == "RAPF"
        assert stiff.description == "RAPF, k_rep 0.123"
        optional = [name for name, gain in RAPF.available_gains.items() if gain.optional]
        for name in optional:
            law = ControllerChoice("rapf", {name: 1.25})
            free = ControllerChoice("rapf", {name: None})
            assert "no limit" in free.describe_changes(law) + free.description


class TestLimits:
    def test_they_make_a_team_and_are_told_by_it(self):
        limits = RobotProperties(radius=0.2, max_speed=0.5, sensing_range=math.inf)
        team = limits.build_team(range(1, 4))
        assert len(team) == 3
        assert team.radius.tolist() == [0.2] * 3
        assert RobotProperties.from_team(team) == limits

    def test_robots_may_differ(self):
        team = replace(Team.homogeneous(3), radius=np.array([0.1, 0.1, 0.3]), mass=np.array([2.0, 1.0, 1.0]))
        limits = RobotProperties.from_team(team)
        assert limits.build_team(range(1, 4)).to_dict() == team.to_dict()
        # robots keep what is theirs under their numbers; a new one is as the first
        assert limits.build_team((1, 3)).radius.tolist() == [0.1, 0.3]
        assert limits.build_team(range(1, 5)).mass.tolist() == [2.0, 1.0, 1.0, 2.0]
        assert limits.get_radius(3) == 0.3
        assert RobotProperties.from_team(team, (2, 5, 7)).build_team((7, 1)).radius.tolist() == [0.3, 0.1]
        equal = with_limit(limits, "team.radius", 0.2)
        assert equal.build_team(range(1, 4)).radius.tolist() == [0.2] * 3
        assert equal.build_team(range(1, 4)).mass.tolist() == [2.0, 1.0, 1.0]
        assert [each.label for each in limit_parameters(limits) if "≠" in each.label] == ["radius ≠"]
        with pytest.raises(ParameterError, match="radius"):
            replace(limits, different={"radius": {1: -1.0}}).build_team(range(1, 2))

    def test_they_are_the_papers_by_default(self):
        assert RobotProperties.from_team(Team.homogeneous(2)) == RobotProperties()

    @pytest.mark.parametrize("name", ["radius", "mass", "max_speed", "max_acceleration"])
    @pytest.mark.parametrize("value", [0.0, -1.0, math.nan])
    def test_what_cannot_be_is_refused(self, name, value):
        with pytest.raises(ParameterError, match=name):
            replace(RobotProperties(), **{name: value}).build_team(range(1, 2))


class TestScenario:
    def test_starts_are_those_of_the_map(self):
        scenario = SessionScenario(HALL, robots=4, seed=3)
        assert scenario.start_name == "corner"
        np.testing.assert_array_equal(scenario.starts, HALL.start("corner").sample(4, seed=3))
        far = replace(scenario, start="far")
        assert far.start_name == "far"
        assert (far.starts[:, 0] > 4.0).all()

    def test_starts_that_are_given(self):
        given = np.array([[1.0, 1.0], [2.0, 2.0]])
        np.testing.assert_array_equal(SessionScenario(HALL, given_starts=given, robots=2).starts, given)

    def test_larger_robots_start_farther_apart(self):
        places = SessionScenario(HALL, robots=4, properties=RobotProperties(radius=0.3)).starts
        apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
        assert apart[np.triu_indices(4, 1)].min() >= 0.6

    @pytest.mark.parametrize("robots", [0, -1, MAX_ROBOTS + 1])
    def test_too_many_robots_or_none(self, robots):
        with pytest.raises(ParameterError, match="whole number from 1 to 1000"):
            SessionScenario(HALL, robots=robots)

    @pytest.mark.parametrize("count", [0, MAX_PANES + 1])
    def test_too_many_controllers_or_none(self, count):
        with pytest.raises(ParameterError, match="expected 1 to 4"):
            SessionScenario(HALL, (RAPF,) * count)

    def test_no_room_or_no_such_start(self):
        with pytest.raises(StartError, match="room for about"):
            SessionScenario(HALL, robots=500).starts
        with pytest.raises(StartError, match="did you mean 'corner'"):
            SessionScenario(HALL, start="cornre").starts
