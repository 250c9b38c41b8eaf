"""Options for the conditions of a run."""

import json
from pathlib import Path

import pytest
from command_calls import read_error, read_json

from robocov.conditions import Conditions
from robocov.controllers import Rapf
from robocov.errors import ParameterError
from robocov.record import Record
from robocov.simulation import Simulation
from robocov_app.cli import main
from robocov_app.commands.options import ConditionOptions


def test_without_options_there_are_no_conditions() -> None:
    assert ConditionOptions().build_conditions(3, 6) is None
    assert ConditionOptions(forget_after=1.0).build_conditions(3, 6) is None


def test_options_become_conditions() -> None:
    options = ConditionOptions(loss=0.2, delay=0.3, bandwidth=1e4, fail=("3@20",), join=("5@30:2.5,1", "6@4"))
    assert options.build_conditions(7, 6) == Conditions(
        loss=0.2,
        delay=0.3,
        bandwidth=1e4,
        failures=((3, 20.0),),
        joins=((5, 30.0, (2.5, 1.0)), (6, 4.0)),
        seed=7,
    )


def test_an_unknown_density_is_a_condition() -> None:
    assert ConditionOptions(density="sensed").build_conditions(7, 6) == Conditions(density="sensed", seed=7)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (ConditionOptions(fail=("3",)), "--fail: expected ROBOT@SECONDS, as in 3@20, got '3'"),
        (ConditionOptions(join=("3@x",)), "--join: expected ROBOT@SECONDS or ROBOT@SECONDS:X,Y, got '3@x'"),
        (ConditionOptions(fail=("9@1",)), "expected a robot from 1 to 6, got robot 9"),
        (ConditionOptions(loss=2.0), "conditions.loss: expected a number from 0 to 1"),
    ],
)
def test_invalid_conditions_are_rejected(options: ConditionOptions, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        options.build_conditions(0, 6)


@pytest.mark.slow
def test_a_run_under_conditions_can_be_repeated_from_its_record(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = "run rooms --robots 3 --duration 1 --lattice 16 --loss 0.5 --fail 2@0.5 --join 3@0.3 --seed 4"
    assert read_json(capsys, *arguments.split(), "--out", str(tmp_path / "a"))["contacts"] == 0
    saved = json.loads((tmp_path / "a" / "run.json").read_text())["conditions"]
    assert saved["loss"] == 0.5
    assert saved["failures"] == [{"robot": 2, "time_s": 0.5}]
    assert saved["seed"] == 4
    record = Record.load(tmp_path / "a")
    assert record.is_working[-1].tolist() == [True, False, True]
    simulation = Simulation(
        record.environment, Rapf(), record.positions[0], record.team, conditions=record.conditions
    )
    assert simulation.run(1.0).positions.tobytes() == record.positions.tobytes()


def test_errors_are_reported_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    message = read_error(capsys, "run", "rooms", "--fail", "3@x")
    assert message == "--fail: expected ROBOT@SECONDS, as in 3@20, got '3@x'"


@pytest.mark.slow
def test_distances_are_drawn_on_a_map_with_moving_obstacles(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    arguments = "run forklifts --robots 2 --duration 0.4 --lattice 12 --frames --fps 3 --size 320x240"
    summary = read_json(
        capsys, *arguments.split(), "--video-speed", "1", "--show", "distances", "--out", str(out)
    )
    assert summary["mean_distance_m"] > 0.0
    assert len(list((out / "frames").iterdir())) > 2


def test_a_robot_that_joins_outside_the_map_is_rejected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    message = read_error(capsys, "run", "rooms", "--join", "6@30:100,100", "--out", str(out))
    assert message.startswith(
        "--join: expected a position inside the boundary of map 'Rooms' (x from 0 to 12 m"
    )
    assert message.endswith("got [100, 100] for robot 6")
    assert not out.exists()


def test_a_changed_joining_position_is_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    arguments = ["run", "rooms", "--join", "6@0.5:1,8", "--duration", "1", "--lattice", "16", "--no-figures"]
    assert main([*arguments, "--out", str(out)]) == 0
    note = "Robot 6 joined at 0.5 s at [1, 7.499], 0.5 m from [1, 8], which is too close to a wall"
    assert f"note: {note}" in capsys.readouterr().out
    run = json.loads((out / "run.json").read_text())
    assert run["summary"]["notes"][0].startswith(note)
    (event,) = run["events"]
    assert event["kind"] == "join"
    assert event["robot"] == 6
    assert event["requested_position_m"] == [1.0, 8.0]
    assert run["summary"]["path_length_m"][5] < 0.5
