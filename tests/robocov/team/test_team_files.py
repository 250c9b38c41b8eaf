"""Team files: groups of robots, default values and rejected files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.errors import InputError, RobocovError
from robocov.team import Team
from robocov.team_files import build_team, read_team

TEAM = """
[[group]]
count = 2
max_speed = 1.5
communication_range = "null"

[[group]]          # slow robots
count = 3
max_speed = 0.5
radius = 0.2
communication_range = 4.0
"""


def write_file(folder: Path, text: str, name: str = "team.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_robots_have_the_order_of_their_groups(tmp_path: Path) -> None:
    team = read_team(write_file(tmp_path, TEAM))
    assert team.max_speed.tolist() == [1.5, 1.5, 0.5, 0.5, 0.5]
    assert team.radius.tolist() == [0.1, 0.1, 0.2, 0.2, 0.2]
    assert team.communication_range.tolist() == [np.inf, np.inf, 4.0, 4.0, 4.0]
    assert team.mass.tolist() == [1.0] * 5
    assert team.has_mixed_speeds
    assert not Team.homogeneous(3).has_mixed_speeds


def test_teams_may_be_json(tmp_path: Path) -> None:
    groups = [{"count": 1, "sensing_range": None}, {"count": 1, "mass": 2.5}]
    team = read_team(write_file(tmp_path, json.dumps({"group": groups}), "team.json"))
    assert team.sensing_range.tolist() == [np.inf, 3.0]
    assert team.mass.tolist() == [1.0, 2.5]


def test_missing_values_of_groups_are_the_defaults(tmp_path: Path) -> None:
    team = read_team(write_file(tmp_path, TEAM), {"radius": 0.3, "viscosity": 1.0, "sensing_range": None})
    assert team.radius.tolist() == [0.3, 0.3, 0.2, 0.2, 0.2]
    assert team.viscosity.tolist() == [1.0] * 5
    assert np.isinf(team.sensing_range).all()


@settings(max_examples=count_examples(20))
@given(
    st.lists(
        st.fixed_dictionaries(
            {
                "count": st.integers(1, 4),
                "max_speed": st.sampled_from([0.5, 1.0]),
                "radius": st.floats(0.05, 0.5),
            }
        ),
        min_size=1,
        max_size=5,
    )
)
def test_teams_of_groups_are_unchanged_by_json(groups: list[dict[str, float]]) -> None:
    team = build_team(groups, ("group",))
    expected = np.repeat([group["radius"] for group in groups], [group["count"] for group in groups])
    assert team.radius.tolist() == expected.tolist()
    assert Team.from_dict(team.to_dict()).to_dict() == team.to_dict()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"team.toml: group: expected at least one table \[\[group\]\], got nothing"),
        ("group = 3", r"group: expected at least one table .* got 3"),
        ("group = [4]", r"group\[0\]: expected a table, got 4"),
        (
            "[[group]]\nmax_speed = 1",
            r"group\[0\].count: expected a whole number from 1 to 10000, got nothing",
        ),
        ("[[group]]\ncount = 0", r"group\[0\].count: expected .* got 0"),
        ("[[group]]\ncount = true", r"group\[0\].count: expected .* got True"),
        (
            "[[group]]\ncount = 1\n[[group]]\ncount = 2\nmax_sped = 1",
            r"group\[1\]: unknown key 'max_sped': did",
        ),
        (
            "[[group]]\ncount = 1\nmax_speed = -1",
            r"group\[0\].max_speed: expected a number from 0.000001 to 1000, got -1",
        ),
        ("[[group]]\ncount = 1\nradius = 'big'", r"group\[0\].radius: expected a number, got 'big'"),
        ("[[group]]\ncount = 1\nradius = 'null'", r"group\[0\].radius: expected a number, got 'null'"),
        ("[[group]]\ncount = 9000\n[[group]]\ncount = 9000", "expected at most 10000 robots, got 18000"),
        ("[[group]]\ncount = 1\nmass = 1" + 400 * "0", r"group\[0\].mass: expected a number, got 1000"),
        ("[[groups]]\ncount = 1", "unknown key 'groups': did you mean 'group'"),
        ("[[group]\n", "team.toml: not TOML"),
    ],
)
def test_mistakes_in_team_files_are_reported(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read_team(write_file(tmp_path, text))
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "team.toml"))


def test_unreadable_files_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(RobocovError, match="no such file"):
        read_team(tmp_path / "none.toml")
    with pytest.raises(RobocovError, match=r"bad.json"):
        read_team(write_file(tmp_path, "[1,", "bad.json"))
    with pytest.raises(InputError, match='expected an object with a list "group"'):
        read_team(write_file(tmp_path, "[1]", "list.json"))
    (tmp_path / "latin.toml").write_bytes(b"# \xff")
    with pytest.raises(InputError, match="not UTF-8"):
        read_team(tmp_path / "latin.toml")
