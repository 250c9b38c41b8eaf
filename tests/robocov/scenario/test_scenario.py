"""Scenarios: the same run however it is described, JSON in and out, and errors that name the place."""

from __future__ import annotations

import json
import pickle
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

import robocov as rc
from robocov.conditions import Conditions, Failure
from robocov.environment import Environment
from robocov.errors import InputError, MapError, ParameterError, StartError
from robocov.mapfile import to_json
from robocov.observation import Decision, Observations
from robocov.team import Team
from robocov.typing import FloatArray

ROOM = Environment("room", ((0, 0), (6, 0), (6, 4), (0, 4)))
MINIMAL: dict[str, Any] = {"format": "robocov-scenario", "version": 1, "map": "rooms"}


def test_sampled_and_given_starts_give_the_same_run() -> None:
    scenario = rc.Scenario(ROOM, "lloyd", {"k_prop": 2.0}, robots=3, seed=4, duration=0.5)
    record = scenario.run()
    assert (record.start, record.seed, record.controller, len(record)) == ("uniform", 4, "lloyd", 31)
    with_given_starts = scenario.replace(starts=scenario.starts, seed=None)
    second_record = with_given_starts.run()
    assert (second_record.start, second_record.seed) == (None, None)
    np.testing.assert_array_equal(second_record.positions, record.positions)


def test_a_run_continues_from_its_state() -> None:
    scenario = rc.Scenario(ROOM, "lloyd", robots=3, seed=4, duration=0.5)
    record = scenario.run()
    simulation = scenario.build_simulation()
    for _ in range(10):
        simulation.step()
    rest = scenario.replace(
        starts=simulation.positions,
        velocities=simulation.velocities,
        duration=0.5 - simulation.time,
    )
    rest_record = rest.run(rest.build_simulation(steps=10, is_computed=True))
    np.testing.assert_array_equal(rest_record.time, record.time[10:])
    np.testing.assert_array_equal(rest_record.positions, record.positions[10:])


@dataclass(frozen=True)
class Homing:
    """Drives each robot to the origin."""

    pull: float = 1.0

    def force(self, own: rc.OwnView) -> FloatArray:
        return -self.pull * own.position


class SlowRapf(rc.Rapf):
    """RAPF with smaller forces, and with the inherited name."""

    def decide(self, seen: Observations, memory: Any) -> Decision:
        decision = super().decide(seen, memory)
        return replace(decision, forces=0.1 * decision.forces)


def test_a_subclass_of_a_built_in_controller_is_not_recorded_as_that_controller() -> None:
    record = rc.run(ROOM, SlowRapf(), robots=2, duration=0.1)
    assert record.controller == "SlowRapf"
    with pytest.raises(ParameterError, match="unknown controller 'SlowRapf'"):
        rc.Scenario.from_record(record)


def test_gains_of_a_controller_may_be_numpy_numbers(tmp_path: Path) -> None:
    scenario = rc.Scenario(ROOM, Homing(np.float32(0.5)), robots=2, duration=0.1)  # type: ignore[arg-type]
    scenario.save(tmp_path / "scenario.json")
    assert scenario.run().gains == {"pull": 0.5}


def test_numbers_of_numpy_are_saved(tmp_path: Path) -> None:
    gains = {"neighbors": np.int64(3)}
    scenario = rc.Scenario(
        ROOM, "poduri", gains, robots=2, seed=np.int64(4), duration=0.1, dt=np.float32(0.05)
    )
    scenario.save(tmp_path / "scenario.json")
    assert rc.Scenario.load(tmp_path / "scenario.json").to_json() == scenario.to_json()
    scenario.run().save(tmp_path / "run")
    assert rc.Record.load(tmp_path / "run").seed == 4
    batch = rc.SimulationBatch(ROOM, rc.Rapf(), [scenario.starts])
    batch.run(0.1, seeds=np.arange(1))[0].save(tmp_path / "batch")
    assert rc.Record.load(tmp_path / "batch").seed == 0


def test_a_record_that_starts_after_a_failure_is_no_scenario() -> None:
    scenario = rc.Scenario(ROOM, robots=2, conditions=Conditions(failures=(Failure(2, 0.1),)))
    simulation = scenario.build_simulation()
    simulation.run(0.2)
    with pytest.raises(ParameterError, match=r"expected a run that starts at 0 s, got 0\.2 s"):
        rc.Scenario.from_record(simulation.run(0.2))


def test_a_record_is_thinned_and_a_run_is_stopped() -> None:
    scenario = rc.Scenario(ROOM, robots=2, duration=0.5)
    steps: list[int] = []

    def stop_at_16(step: int) -> bool:
        steps.append(step)
        return step == 16

    record = scenario.run(every=7, on_step=stop_at_16)
    assert steps == list(range(17))
    assert record.time.tolist() == pytest.approx([0.0, 7 / 60, 14 / 60, 16 / 60])
    assert len(scenario.run(every=7)) == 6


def test_a_duration_is_not_a_simulation() -> None:
    expected = r"simulation: expected a Simulation \(the duration is an attribute of the scenario\), got 30.0"
    with pytest.raises(ParameterError, match=expected):
        rc.Scenario(ROOM, robots=1).run(30.0)  # type: ignore[arg-type]


@pytest.mark.parametrize("every", [0, -2, 1.5, None])
def test_the_interval_of_recorded_steps_is_a_positive_whole_number(every: object) -> None:
    with pytest.raises(ParameterError, match="every: expected a whole number of at least 1, got"):
        rc.Scenario(ROOM, robots=1, duration=0.1).run(every=every)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"controller": "mine.py:Missing"}, ParameterError),
        ({"start": "corner"}, StartError),
        ({"team": Team.homogeneous(900)}, StartError),
    ],
)
def test_check_finds_what_is_only_known_at_the_start(changes: dict[str, Any], error: type[Exception]) -> None:
    scenario = rc.Scenario(ROOM, **changes)
    with pytest.raises(error):
        scenario.check()


def test_check_accepts_what_can_run() -> None:
    rc.Scenario(ROOM, conditions=Conditions(loss=0.5)).check()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"controller": "lloid"}, r"unknown controller"),
        ({"gains": {"k": 1.0}}, r"unknown gain 'k'"),
        ({"controller": Homing(pull=float("inf"))}, r"gains: pull: expected a finite number, got inf"),
        ({"controller": "mine.py:Mine", "gains": "k_rep"}, r"gains: expected a mapping"),
        ({"controller": "mine.py:Mine", "gains": {1: 0.3}}, r"gains: expected names as keys, got 1"),
        ({"controller": rc.Rapf(), "gains": {"k_rep": 1.0}}, r"gains: expected none"),
        ({"source": "class Mine: ..."}, r"source: expected a ControllerSource"),
        ({"controller": rc.Rapf}, r"controller: expected a controller"),
        ({"robots": 0}, r"robots: expected a whole number from 1"),
        ({"robots": 3, "team": Team.homogeneous(2)}, r"robots: expected 2 as in the team, got 3"),
        ({"team": 3}, r"team: expected a Team"),
        ({"starts": [[1, 1]], "robots": 2}, r"starts: expected one for each of 2 robots, got 1"),
        ({"starts": [[1, float("nan")]]}, r"starts\[0\]: expected finite numbers"),
        ({"velocities": [[1, 1]]}, r"velocities: expected starts as well"),
        ({"steering": [[0, 0]]}, r"steering: expected starts as well"),
        ({"dt": 2.0}, r"dt: expected"),
        ({"seed": -1}, r"seed: expected"),
        ({"duration": float("inf")}, r"duration: expected"),
        ({"conditions": {"loss": 0.5}}, r"conditions: expected Conditions"),
        ({"conditions": Conditions(failures=(Failure(9, 1.0),))}, r"expected a robot from 1 to 6"),
    ],
)
def test_wrong_arguments_are_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(rc.RobocovError, match=message):
        rc.Scenario(ROOM, **arguments)


def test_unknown_keyword_arguments_are_reported_by_the_function_that_was_called() -> None:
    with pytest.raises(TypeError, match=r"^run\(\) got .* 'durtion'. Did you mean 'duration'\?$"):
        rc.run(ROOM, durtion=3)
    with pytest.raises(TypeError, match=r"^compare\(\) got an unexpected keyword argument 'xyz'$"):
        rc.compare(ROOM, xyz=3)
    with pytest.raises(TypeError, match=r"^replace\(\) got .* 'robot'. Did you mean 'robots'\?$"):
        rc.Scenario(ROOM).replace(robot=3)


def test_maps_are_found_by_name_and_path(tmp_path: Path) -> None:
    rc.save_map(ROOM, tmp_path / "room.json")
    assert rc.Scenario("rooms").environment.name == "Rooms"
    assert rc.Scenario(tmp_path / "room.json").environment == ROOM


def test_a_controller_object_runs_with_its_own_gains() -> None:
    scenario = rc.Scenario(ROOM, rc.Rapf(k_rep=0.3), robots=2, duration=0.2)
    assert (scenario.controller, scenario.gains["k_rep"]) == ("rapf", 0.3)
    by_name = rc.run(ROOM, "rapf", gains={"k_rep": 0.3}, robots=2, duration=0.2)
    np.testing.assert_array_equal(scenario.run().positions, by_name.positions)


def test_another_controller_has_its_default_gains() -> None:
    scenario = rc.Scenario(ROOM, "rapf", {"k_rep": 0.3}, robots=2)
    assert scenario.replace(duration=2.0).gains == {"k_rep": 0.3}
    assert scenario.replace(controller="lloyd").gains == {}
    assert scenario.replace(robots=5).robots == 5


def test_other_robots_and_sampled_starts_do_not_keep_the_velocities() -> None:
    team = Team.homogeneous(2, kinematics="unicycle")
    moving = rc.Scenario(
        ROOM,
        team=team,
        starts=[[1.0, 1.0], [2.0, 2.0]],
        velocities=[[0.1, 0.0], [0.0, 0.0]],
        steering=[[0.0, 0.0], [1.0, 0.0]],
    )
    more = moving.replace(robots=3, starts=[[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]])
    assert more.velocities is None and more.steering is None
    sampled = moving.replace(starts=None)
    assert sampled.velocities is None and sampled.steering is None
    shifted = moving.replace(starts=[[1.5, 1.0], [2.5, 2.0]])
    np.testing.assert_array_equal(shifted.velocities, moving.velocities)
    np.testing.assert_array_equal(shifted.steering, moving.steering)


@settings(max_examples=count_examples(40))
@given(
    robots=st.integers(1, 4),
    seed=st.integers(0, 2**40),
    duration=st.floats(0.0, 1e5),
    dt=st.floats(1e-3, 0.5),
    max_speed=st.floats(0.1, 9.0),
    loss=st.sampled_from([None, 0.25]),
    has_starts=st.booleans(),
    unicycles=st.booleans(),
)
def test_a_scenario_survives_json(
    robots: int,
    seed: int,
    duration: float,
    dt: float,
    max_speed: float,
    loss: float | None,
    has_starts: bool,
    unicycles: bool,
) -> None:
    kinematics = "unicycle" if unicycles else "point"
    starts = np.column_stack([np.arange(robots) + 1.0, np.full(robots, 2.0)]) if has_starts else None
    scenario = rc.Scenario(
        ROOM,
        "rapf",
        {"k_rep": 0.125, "attraction_limit": None},
        team=Team.homogeneous(robots, max_speed=max_speed, kinematics=kinematics),
        seed=seed,
        starts=starts,
        velocities=None if starts is None else 0.1 * starts,
        steering=starts if unicycles else None,
        duration=duration,
        dt=dt,
        conditions=None if loss is None else Conditions(loss=loss, seed=3),
    )
    document = json.loads(json.dumps(scenario.to_json()))
    assert rc.Scenario.from_json(document).to_json() == scenario.to_json()


def test_all_conditions_survive_json() -> None:
    conditions = Conditions(
        loss=0.1,
        delay=0.2,
        message_rate=5.0,
        bandwidth=200.0,
        forget_after=2.0,
        position_noise=0.01,
        sensing_noise=0.02,
        failure_rate=0.001,
        failures=((1, 2.0),),
        joins=((2, 1.0, (1.0, 1.0)), (3, 1.5)),
        seed=4,
        density="sensed",
    )
    scenario = rc.Scenario(ROOM, robots=3, conditions=conditions)
    assert rc.Scenario.from_json(scenario.to_json()).conditions == conditions


def test_a_file_gives_the_same_run(tmp_path: Path) -> None:
    scenario = rc.Scenario("gaps", "lloyd", robots=2, duration=0.2)
    scenario.save(tmp_path / "scenario.json")
    loaded = rc.Scenario.load(tmp_path / "scenario.json")
    np.testing.assert_array_equal(loaded.run().positions, scenario.run().positions)


def test_a_short_file_has_the_defaults_of_the_library(tmp_path: Path) -> None:
    rc.save_map(ROOM, tmp_path / "room.json")
    content = {**MINIMAL, "map": "room.json", "team": {"robots": 3}, "conditions": {"loss": 0.25}}
    path = tmp_path / "scenario.json"
    path.write_text(json.dumps(content))
    scenario = rc.Scenario.load(path)
    expected = rc.Scenario(ROOM, robots=3, conditions=Conditions(loss=0.25))
    assert scenario.to_json() == expected.to_json()


def test_a_map_without_a_suffix_is_found_in_the_folder_of_the_document(tmp_path: Path) -> None:
    rc.save_map(ROOM, tmp_path / "room.json")
    (tmp_path / "room.json").rename(tmp_path / "room")
    scenario = rc.Scenario.from_json({**MINIMAL, "map": "room"}, folder=tmp_path)
    assert scenario.environment == ROOM


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": "robocov-run"}, r'^s: format: expected "robocov-scenario", got "robocov-run"'),
        ({"version": 2}, r"^s: version: expected 1, got 2; it was written by a newer robocov"),
        ({"map": 3}, r"^s: map: expected a map, its name, or the path of its file, got 3"),
        ({"map": "nowhere"}, r"^s: map: unknown map 'nowhere'"),
        ({"map": {"name": 1}}, r"^s: map: "),
        ({"foo": 1}, r"^s: foo: unknown key"),
        ({"controller": {"gain": {}}}, r"^s: controller.gain: unknown key"),
        ({"controller": {"gains": {"k": 1}}}, r"^s: rapf: unknown gain 'k'"),
        ({"controller": {"name": "mine.py:M"}}, r"^s: controller.name: expected a built-in controller"),
        ({"team": {"robot": 3}}, r"^s: team: unknown key 'robot': did you mean 'robots'\?"),
        ({"team": {"robots": "3"}}, r"^s: team.robots: expected a whole number"),
        ({"team": {"robots": 2}, "starts_m": [[1, 1]]}, r"^s: starts: expected one for each of 2 robots"),
        ({"starts_m": []}, r"^s: starts: expected an array of shape"),
        ({"seed": -3}, r"^s: seed: expected a whole number of at least 0, or null, got -3"),
        ({"starts_m": [[1, 2, 3]]}, r"^s: starts_m: expected a list of points"),
        ({"duration_s": -1}, r"^s: duration_s: expected a number of at least 0 \(s\), got -1"),
        ({"dt_s": 2}, r"^s: dt: expected a number from 0.0001 to 1 s, got 2"),
        ({"conditions": {"los": 1}}, r"^s: conditions: unknown key 'los': did you mean 'loss'\?"),
        ({"conditions": {"loss": "1"}}, r"^s: conditions.loss: expected a number from 0 to 1, got \"1\""),
        ({"conditions": {"joins": 3}}, r"^s: conditions.joins: expected a list, got 3"),
        ({"conditions": {"joins": [{"robot": 1}]}}, r"^s: conditions.joins\[0\].time_s: missing"),
        ({"conditions": {"density": "?"}}, r'^s: conditions.density: expected "known" or "sensed", got "\?"'),
    ],
)
def test_wrong_documents_are_explained(changes: dict[str, Any], message: str) -> None:
    with pytest.raises((InputError, MapError), match=message):
        rc.Scenario.from_json({**MINIMAL, **changes}, "s")


def test_a_document_runs_code_only_if_the_user_names_it_too(tmp_path: Path) -> None:
    module = tmp_path / "mine.py"
    module.write_text(
        "import robocov as rc\n"
        "open(__file__ + '.ran', 'w').close()\n"
        "class Mine(rc.Rapf):\n"
        "    name = 'mine'\n"
    )
    name = f"{module}:Mine"
    content = {**MINIMAL, "controller": {"name": name}, "team": {"robots": 2}, "duration_s": 0.1}
    with pytest.raises(InputError, match="does not run code unless the user also names the controller"):
        rc.Scenario.from_json(content)
    assert not Path(f"{module}.ran").exists()
    scenario = rc.Scenario.from_json(content, controllers=[name])
    assert scenario.run().controller == name


def test_a_recorded_run_can_be_repeated(tmp_path: Path) -> None:
    record = rc.run(ROOM, "rapf", robots=3, duration=0.3, conditions=Conditions(position_noise=0.05, seed=7))
    record.save(tmp_path / "run")
    scenario = rc.Scenario.from_record(rc.Record.load(tmp_path / "run"))
    np.testing.assert_array_equal(scenario.run().positions, record.positions)


def test_a_scenario_can_be_pickled_and_shows_what_it_is() -> None:
    scenario = rc.Scenario(ROOM, robots=2, duration=2.5)
    assert repr(scenario) == "<Scenario rapf on room, 2 robots, 2.5 s>"
    assert pickle.loads(pickle.dumps(scenario)).to_json() == scenario.to_json()
    assert scenario.to_json()["map"] == to_json(ROOM)
