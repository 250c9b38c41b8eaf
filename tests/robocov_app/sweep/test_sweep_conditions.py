"""Sweeps over conditions: combinations, files and rejected values."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_studies import build_small_study

from robocov.conditions import Conditions
from robocov.errors import InputError, ParameterError
from robocov_app.sweep.ledger import Entry
from robocov_app.sweep.study.parameters import CONDITIONS, build_conditions, parse_condition_axes
from robocov_app.sweep.study.study_file import build_study
from robocov_app.sweep.table import build_columns, build_row
from robocov_app.sweep.tasks import generate_tasks
from robocov_app.sweep.worker import perform


def test_all_combinations_are_run() -> None:
    study = build_small_study(conditions={"loss": [0.0, 0.5], "fail": ["", "1@0.2"], "delay": 0.1})
    assert len(study.teams) == 4
    assert study.varied_parameters == ("loss", "fail")
    assert len(list(generate_tasks(study))) == len(study) == 16
    columns = [column.name for column in build_columns(study)]
    assert "loss" in columns
    assert "fail" in columns
    assert "delay_s" not in columns
    row = build_row(list(generate_tasks(study))[-1], Entry({}, None))
    assert (row["loss"], row["fail"], row["delay_s"]) == (0.5, "1@0.2", 0.1)


def test_empty_conditions_do_not_change_the_tasks() -> None:
    """What was done before there were conditions is not done again."""
    assert [task.input_hash for task in generate_tasks(build_small_study())] == [
        task.input_hash for task in generate_tasks(build_small_study(conditions={}))
    ]
    assert "loss" not in next(generate_tasks(build_small_study())).team


def test_conditions_apply_to_the_run() -> None:
    study = build_small_study(conditions={"loss": 0.5, "fail": "2@0.2"}, controllers=("rapf",), seeds=[3])
    (task,) = generate_tasks(study)
    assert build_conditions(task.team, task.seed, task.robots) == Conditions(
        loss=0.5, failures=((2, 0.2),), seed=3
    )
    outcome = perform(task)
    assert outcome.error is None
    assert b'"failures": [\n   {\n    "robot": 2' in outcome.files["run.json"]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"lost": 1}, r"conditions: unknown condition 'lost': did you mean 'loss'\?"),
        ({"loss": [0.1, 2]}, r"conditions.loss\[1\]: expected a number from 0 to 1, got 2"),
        ({"loss": []}, "conditions.loss: expected at least one"),
        ({"loss": [0.1, 0.1]}, r"conditions.loss\[1\]"),
        ({"fail": 3}, "conditions.fail: expected a string"),
        ({"fail": ["3@1", "3"]}, r"conditions.fail\[1\]: expected ROBOT@SECONDS, as in 3@20, got '3'"),
        ({"density": ["known", "no"]}, r"conditions.density\[1\]: expected known or sensed, got 'no'"),
        ({"delay": "null"}, "conditions.delay: expected a number"),
    ],
)
def test_invalid_conditions_are_rejected_with_their_place(given: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        parse_condition_axes(given)


def test_a_failure_of_an_unknown_robot_is_rejected() -> None:
    with pytest.raises(ParameterError, match="expected a robot from 1 to 2, got robot 3"):
        build_small_study(conditions={"fail": "3@0.1"})


def test_conditions_are_read_from_a_table() -> None:
    document = {
        "maps": "rooms",
        "controllers": "rapf",
        "conditions": {"loss": [0, 0.2], "message_rate": ["null", 2], "join": "2@1 3@2:1,1"},
    }
    study = build_study(document, Path(), "study.toml")
    assert [team["message_rate"] for team in study.teams] == [None, 2.0, None, 2.0]
    assert study.teams[0]["join"] == "2@1 3@2:1,1"
    for broken, message in (
        (
            {"loss": {"low": 0}},
            "study.toml: conditions.loss: expected a number or a string, or a list of them",
        ),
        ({"lost": 1}, "study.toml: conditions: unknown key 'lost': did you mean 'loss'"),
        (3, r"study.toml: conditions: expected a table \[conditions\], got 3"),
    ):
        with pytest.raises(InputError, match=message):
            build_study({**document, "conditions": broken}, Path(), "study.toml")


def test_all_conditions_can_be_swept() -> None:
    usual = {"fail": "1@1", "join": "2@1", "message_rate": 2.0, "density": "sensed"}
    for name in CONDITIONS:
        assert parse_condition_axes({name: usual.get(name, 1.0)})[name] == [usual.get(name, 1.0)]
