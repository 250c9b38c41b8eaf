"""Teams: limits of robots, JSON and rejected values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.errors import ParameterError
from robocov.team import Team


def test_a_homogeneous_team_has_the_limits_of_the_paper() -> None:
    team = Team.homogeneous(6)
    assert len(team) == 6
    assert (team.mass == 1.0).all()
    assert (team.max_speed == 1.0).all()


@pytest.mark.parametrize("radius", [[0.1, 0.2], [0.1, 0.2, 0.3], "large", None])
def test_a_homogeneous_team_has_one_value_of_each_parameter(radius: object) -> None:
    with pytest.raises(ParameterError, match=r"team\.radius: expected a number, got"):
        Team.homogeneous(2, radius=radius)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "value"),
    [("radius", "large"), ("radius", None), ("track_width", [0.1, 0.2]), ("track_width", "wide")],
)
@pytest.mark.parametrize("kinematics", ["point", "unicycle"])
def test_a_size_of_a_robot_is_a_number_with_any_kinematics(kinematics: str, name: str, value: object) -> None:
    with pytest.raises(ParameterError, match=rf"team\.{name}: expected a number, got"):
        Team.homogeneous(2, kinematics=kinematics, **{name: value})  # type: ignore[arg-type]


@given(
    st.lists(
        st.tuples(st.floats(0.01, 1), st.one_of(st.just(np.inf), st.floats(0, 50))), min_size=1, max_size=9
    )
)
def test_teams_are_unchanged_by_json(robots: list[tuple[float, float]]) -> None:
    n = len(robots)
    team = Team(
        radius=np.array([r for r, _ in robots]),
        mass=np.ones(n),
        max_speed=np.ones(n),
        max_acceleration=np.full(n, 2.0),
        viscosity=np.full(n, 2.0),
        sensing_range=np.full(n, 3.0),
        communication_range=np.array([c for _, c in robots]),
    )
    loaded = Team.from_dict(team.to_dict())
    for name in Team.__slots__:
        np.testing.assert_array_equal(getattr(loaded, name), getattr(team, name))


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"radius": 0.0}, r"team.radius: expected a number from 0.001 to 1000, got 0.0 m"),
        ({"max_speed": -1.0}, r"team.max_speed: expected .* got -1.0 m/s"),
        ({"max_speed": float("inf")}, r"team.max_speed: expected .* got inf m/s"),
        ({"viscosity": float("nan")}, r"team.viscosity: expected .* got nan N s/m"),
        ({"communication_range": -2.0}, r"or null for no limit, got -2.0 m"),
    ],
)
def test_limits_out_of_range_are_rejected(limits: dict[str, float], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Team.homogeneous(3, **limits)


def test_teams_without_robots_or_with_missing_values_are_rejected() -> None:
    with pytest.raises(ParameterError, match="robots: expected a whole number from 1 to 10000, got 0"):
        Team.homogeneous(0)
    ones = np.ones(2)
    with pytest.raises(
        ParameterError, match=r"team.mass: expected a value for each of 2 robots, got shape \(3,\)"
    ):
        Team(ones, np.ones(3), ones, ones, ones, ones, ones)
    with pytest.raises(ParameterError, match=r"team.radius_m: expected a number .* got nothing"):
        Team.from_dict({"robots": 2})


def test_the_repr_is_short() -> None:
    team = Team.homogeneous(3, max_speed=0.5)
    assert repr(team) == (
        "<Team of 3 robots: radius 0.1 m, mass 1 kg, max_speed 0.5 m/s, max_acceleration 2 m/s², "
        "viscosity 2 N s/m, sensing_range 3 m, communication_range inf m>"
    )
    assert "radius 0.1 to 0.3 m," in repr(replace(team, radius=np.array([0.1, 0.3, 0.2])))
