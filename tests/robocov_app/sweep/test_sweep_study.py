"""Studies: values, defaults, documents and rejected studies."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from small_studies import HALL, ROOM, build_small_study, write_controller

from robocov.errors import InputError, ParameterError
from robocov_app.sweep.study.parameters import build_swept_team, format_parameter
from robocov_app.sweep.study.sampling import Range, Sampling
from robocov_app.sweep.study.study import Study, StudyMap
from robocov_app.sweep.tasks import generate_tasks

MAPS = (StudyMap("room", ROOM), StudyMap("hall", HALL))


def test_a_study_accepts_lists_and_single_values() -> None:
    study = build_small_study(robots=[1, 2], max_speed=[0.5, 1], radius=0.2, communication_range="null")
    assert study.robots == (1, 2)
    assert [team["max_speed"] for team in study.teams] == [0.5, 1.0]
    assert all(team["radius"] == 0.2 and team["communication_range"] is None for team in study.teams)
    assert study.varied_parameters == ("max_speed",)
    assert len(study) == 2 * 2 * 2 * 2


def test_the_number_of_runs_counts_starts_and_gains() -> None:
    study = build_small_study(maps=MAPS, starts="*", gains={"rapf": {"k_rep": [1, 2, 3]}}, seeds=range(5))
    assert [study.list_starts(each) for each in study.maps] == [("corner", "spread"), ("door",)]
    assert len(study) == 3 * 5 * (3 + 1)


def test_the_first_start_of_each_map_is_the_default() -> None:
    study = build_small_study(maps=MAPS)
    assert [study.list_starts(each) for each in study.maps] == [("corner",), ("door",)]
    bare = StudyMap("bare", replace(ROOM, starts={}))
    for starts in ((), ("*",)):
        assert build_small_study(maps=(bare,), starts=starts).list_starts(bare) == ("uniform",)
    assert build_small_study(maps=MAPS, starts=("uniform",)).list_starts(MAPS[1]) == ("uniform",)


def test_a_team_has_the_parameters_of_the_study() -> None:
    (parameters,) = build_small_study(sensing_range=float("inf"), communication_range=2).teams
    team = build_swept_team(3, parameters)
    assert len(team) == 3
    assert team.sensing_range.tolist() == [float("inf")] * 3
    assert team.communication_range.tolist() == [2.0] * 3


def test_a_custom_controller_is_read_when_the_study_is_built(tmp_path: Path) -> None:
    write_controller(tmp_path, "")
    study = build_small_study(
        controllers=("mine.py:Mine",), folder=tmp_path, gains={"mine.py:Mine": {"pull": [1, 2]}}
    )
    source = study.sources["mine.py:Mine"]
    assert source.text == (tmp_path / "mine.py").read_text()
    (tmp_path / "mine.py").unlink()
    assert study.load_controller_class("mine.py:Mine")().pull == 1.0
    assert len(study) == 4


def test_the_document_of_a_study_is_complete(tmp_path: Path) -> None:
    name = write_controller(tmp_path, "")
    study = build_small_study(
        controllers=("rpf", name),
        gains={"rpf": {"k_rep": Range(1, 2, "log")}},
        sampling=Sampling(samples=3),
        sensing_range=float("inf"),
    )
    content = json.loads(json.dumps(study.to_json(), allow_nan=False))
    assert content["format"] == "robocov-study"
    assert content["runs"] == len(study) == 2 * 4
    assert content["maps"][0]["map"]["name"] == "A room"
    assert content["controllers"][1]["source"] == (tmp_path / "mine.py").read_text()
    assert content["gains"]["rpf"]["ranges"] == {"k_rep": {"low": 1.0, "high": 2.0, "scale": "log"}}
    assert len(content["gains"]["rpf"]["choices"]) == 3
    assert content["sampling"] == {"method": "sobol", "samples": 3, "seed": 0}
    assert content["teams"][0]["sensing_range"] is None


WRONG = [
    ({"maps": ()}, "maps: expected at least one, got none"),
    ({"maps": (MAPS[0], MAPS[0])}, "maps[1]: duplicate value 'room', already given at maps[0]"),
    (
        {"maps": (StudyMap("a\nb", ROOM),)},
        "maps[0]: expected a string of 1 to 100 characters on one line",
    ),
    ({"controllers": ()}, "controllers: expected at least one, got none"),
    ({"controllers": ("rapf", "rapff")}, "controllers[1]: unknown controller 'rapff': did you mean 'rapf'?"),
    (
        {"controllers": ("rapf", "rapf")},
        "controllers[1]: duplicate value 'rapf', already given at controllers[0]",
    ),
    ({"controllers": (3,)}, "controllers[0]: expected a string, got 3"),
    ({"controllers": ("none.py:Mine",)}, "controllers[0]: 'none.py:Mine': "),
    ({"controllers": ("none.py",)}, "controllers[0]: controller 'none.py': expected a file and a class, "),
    ({"robots": (6, 0)}, "robots[1]: expected a whole number from 1 to 10000, got 0"),
    ({"robots": (True,)}, "robots[0]: expected a whole number"),
    ({"robots": ()}, "robots: expected at least one, got none"),
    ({"seeds": (1, -2)}, "seeds[1]: expected a whole number from 0 to "),
    ({"seeds": (1, 2, 1)}, "seeds[2]: duplicate value 1, already given at seeds[0]"),
    (
        {"starts": ("corner", "conrer")},
        "starts[1]: map 'A room': unknown start 'conrer': did you mean 'corner'?",
    ),
    ({"starts": ("corner", "*")}, "starts[1]: '*' selects all starts. "),
    ({"starts": ("corner", "corner")}, "starts[1]: duplicate value 'corner', already given at starts[0]"),
    ({"duration": -1}, "duration: expected a number from 0 to 1000000, got -1"),
    ({"duration": float("nan")}, "duration: expected a number"),
    (
        {"duration": 1e6, "dt": 1e-3},
        "duration: expected a record of at most 20 million rows, got 1000000 s of 2 robots at",
    ),
    ({"dt": 0.0}, "dt: expected a number from 0.0001 to 1 s, got 0.0"),
    ({"lattice": 1}, "lattice: expected a whole number from 2 to 2048, got 1"),
    ({"cost_hz": -1}, "cost_hz: expected a number from 0 to 10000, got -1"),
    ({"record_hz": "often"}, "record_hz: expected a number"),
    ({"max_speed": -1}, "team.max_speed: expected a number from 0.000001 to 1000, got -1.0 m/s"),
    ({"max_speed": (1, -1)}, "team.max_speed[1]: expected a number from 0.000001 to 1000, got -1.0 m/s"),
    ({"max_speed": (1, 1.0)}, "team.max_speed[1]: duplicate value 1.0, already given at team.max_speed[0]"),
    ({"max_speed": None}, "team.max_speed: expected a number, got None"),
    ({"max_speed": 10**400}, "team.max_speed: expected a number, got 1000"),
    ({"radius": ()}, "team.radius: expected at least one value, got none"),
    ({"gains": {"rapff": {}}}, "gains.rapff: unknown controller of the study 'rapff': did you mean 'rapf'?"),
    ({"gains": {"rapf": {"k_rep": -1}}}, "gains.rapf.k_rep: expected a number from "),
    ({"sampling": Sampling()}, "sampling: expected at least one gain with a range {low, high}, got none"),
    (
        {"seeds": range(1000), "robots": range(1, 1001)},
        "runs: expected at most 100000, got 2000000 (1000 robots x 1000 seeds x 2 sets of gains)",
    ),
]


@pytest.mark.parametrize(("changes", "message"), WRONG)
def test_invalid_studies_are_rejected_with_their_place(changes: dict, message: str) -> None:
    with pytest.raises(InputError) as caught:
        build_small_study(**changes)
    assert str(caught.value).startswith(message)


def test_a_file_of_a_controller_must_be_text(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_bytes(b"\xff\xfe")
    with pytest.raises(ParameterError, match=r"controllers\[0\]: 'mine.py:Mine': .*mine.py: not UTF-8"):
        build_small_study(controllers=("mine.py:Mine",), folder=tmp_path)


def test_a_study_cannot_be_changed() -> None:
    study = build_small_study()
    with pytest.raises(AttributeError):
        study.seeds = (1,)
    assert isinstance(study, Study)


GROUPS = ({"count": 1, "max_speed": 1.0, "radius": 0.15}, {"count": 2, "max_speed": 0.4})


def test_groups_are_listed_without_blanks_before_commas() -> None:
    groups = json.dumps([{"count": 2, "kinematics": "unicycle", "max_speed": 0.5}, {"count": 1}])
    assert (
        format_parameter("groups", groups) == "2 with kinematics unicycle, max speed 0.5 m/s; 1 as the rest"
    )


def test_a_team_of_groups() -> None:
    study = build_small_study(group=GROUPS, robots=(6,), viscosity=(1.0, 2.0))
    assert study.robots == (3,)
    assert study.has_mixed_speeds
    assert study.varied_parameters == ("viscosity",)
    task = next(generate_tasks(study))
    team = build_swept_team(task.robots, task.team)
    assert team.max_speed.tolist() == [1.0, 0.4, 0.4]
    assert team.radius.tolist() == [0.15, 0.1, 0.1]
    assert team.viscosity.tolist() == [1.0, 1.0, 1.0]
    assert not build_small_study().has_mixed_speeds
    with pytest.raises(
        ParameterError, match=r"robots: expected 3 as in the groups of the team, got \[2, 4\]"
    ):
        build_small_study(group=GROUPS, robots=(2, 4))
    with pytest.raises(InputError, match=r"team.group\[1\].max_speed: expected .* got -1.0 m/s"):
        build_small_study(group=(GROUPS[0], {"count": 2, "max_speed": -1.0}), robots=(3,))


def test_metrics_change_the_hash_of_a_task() -> None:
    tasks = [next(generate_tasks(build_small_study(metrics=value))) for value in (False, True)]
    assert [task.metrics for task in tasks] == [False, True]
    assert tasks[0].input_hash != tasks[1].input_hash
    with pytest.raises(ParameterError, match="metrics: expected true or false, got 1"):
        build_small_study(metrics=1)


def test_kinematics_can_be_swept() -> None:
    study = build_small_study(kinematics=["point", "unicycle"], turning_rate=2.0)
    assert study.varied_parameters == ("kinematics",)
    assert [build_swept_team(2, team).track_width[1] for team in study.teams] == [0.0, pytest.approx(0.16)]
    assert all(build_swept_team(1, team).turning_rate[0] == 2.0 for team in study.teams)
    assert not {"kinematics", "track_width", "turning_rate"} & set(build_small_study().teams[0])
    with pytest.raises(ParameterError, match=r"team.kinematics: expected point or unicycle, got 'car'"):
        build_small_study(kinematics="car")
