"""Records of runs: saving, loading, earlier formats and rejected files."""

from __future__ import annotations

import json
import os
import sys
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robocov.conditions import Conditions, JoinedRobot
from robocov.controllers import IndividualControllerAdapter, Rapf, Rpf, get_gain_values, make_controller
from robocov.environment import Environment
from robocov.errors import InputError, OutputError, ParameterError, RobocovError
from robocov.files.writing import replace_file
from robocov.mapfile import from_json
from robocov.metrics import select_sampled_steps
from robocov.observation import Decision, Observations, Snapshot
from robocov.record import ARRAYS, Record, Recorder
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.voronoi import partition_by_travel_time


@pytest.fixture(scope="module")
def record(cluttered: Environment) -> Record:
    team = Team.homogeneous(4, communication_range=3.0)
    starts = cluttered.start().sample(4, seed=2)
    simulation = Simulation(cluttered, Rapf(k_rep=0.2, attraction_limit=None), starts, team, 0.02)
    return simulation.run(2.0, start="corner", seed=2)


def test_a_saved_record_can_be_loaded(record: Record, tmp_path: Path) -> None:
    record.save(tmp_path, {"mean_distance_m": 1.0})
    loaded = Record.load(tmp_path)
    for name in ARRAYS:
        assert getattr(loaded, name).tobytes() == getattr(record, name).tobytes()
    assert loaded.environment == record.environment
    assert loaded.gains == get_gain_values(Rapf(k_rep=0.2, attraction_limit=None))
    assert loaded.gains["attraction_limit"] is None
    assert loaded.gains["target"] == "centroid"
    assert (loaded.controller, loaded.label) == ("rapf", "RAPF")
    assert (loaded.start, loaded.seed, loaded.dt) == ("corner", 2, 0.02)
    assert loaded.team.to_dict() == record.team.to_dict()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["record.npz", "run.json"]


def test_a_summary_that_json_cannot_contain_leaves_the_saved_run_unchanged(
    record: Record, tmp_path: Path
) -> None:
    record.save(tmp_path / "run")
    for folder in (tmp_path / "run", tmp_path / "new"):
        with pytest.raises(ValueError, match="JSON compliant"):
            record.until(1.0).save(folder, {"mean_distance_m": float("nan")})
    assert len(Record.load(tmp_path / "run")) == len(record)
    assert not (tmp_path / "new").exists()


def test_the_number_of_lattice_sites_may_be_an_integer_of_numpy(record: Record, tmp_path: Path) -> None:
    record.save(tmp_path, lattice=np.int64(64))
    assert json.loads((tmp_path / "run.json").read_text())["lattice"] == 64


def test_gains_with_a_former_spelling_are_loaded_with_the_present_one(record: Record, tmp_path: Path) -> None:
    record.save(tmp_path)
    run = json.loads((tmp_path / "run.json").read_text())
    run["controller"] = {"name": "poduri", "gains": {"neighbours": 3.0}}
    (tmp_path / "run.json").write_text(json.dumps(run))
    assert Record.load(tmp_path).gains == {"neighbors": 3.0}


def test_keys_of_earlier_formats_are_read(record: Record, tmp_path: Path) -> None:
    session = {
        "edits": [{"from_s": 0.0, "to_s": 0.5, "robots": [1]}],
        "placements": [{"time_s": 0.2, "robots": [1]}],
    }
    conditions = Conditions(joins=((2, 0.5, (1.0, 1.0)),))
    joined_robot = JoinedRobot(robot=2, time=0.5, position=(1.0, 1.5), requested_position=(1.0, 1.0))
    joined = (joined_robot,)
    saved = replace(record, session=session, conditions=conditions, joined=joined)
    saved.save(tmp_path)
    run = json.loads((tmp_path / "run.json").read_text())
    run["session"] = {"touched": run["session"]["edits"], "placed": run["session"]["placements"]}
    (join,) = run["conditions"]["joins"]
    join["place_m"] = join.pop("position_m")
    (event,) = run["events"]
    event["place_m"] = event.pop("position_m")
    event["requested_m"] = event.pop("requested_position_m")
    (tmp_path / "run.json").write_text(json.dumps(run))
    loaded = Record.load(tmp_path)
    assert (loaded.session, loaded.conditions, loaded.joined) == (session, conditions, joined)


def test_run_json_suffices_to_repeat_the_run(record: Record, tmp_path: Path) -> None:
    record.save(tmp_path)
    run = json.loads((tmp_path / "run.json").read_text())
    assert run["team"]["max_speed_m_per_s"] == 1.0
    assert run["team"]["communication_range_m"] == 3.0
    environment = from_json(run["map"], "map")
    simulation = Simulation(
        environment,
        make_controller(run["controller"]["name"], run["controller"]["gains"]),
        environment.start(run["start"]).sample(run["team"]["robots"], seed=run["seed"]),
        Team.from_dict(run["team"]),
        run["dt_s"],
    )
    repeated = simulation.run(run["duration_s"])
    for name in ARRAYS:
        assert getattr(repeated, name).tobytes() == getattr(record, name).tobytes()


def test_snapshots_of_the_record_equal_those_of_the_run(record: Record, cluttered: Environment) -> None:
    simulation = Simulation(
        cluttered, Rapf(k_rep=0.2, attraction_limit=None), record.positions[0], record.team, 0.02
    )
    for _ in range(17):
        simulation.step()
    expected = simulation.observe_and_decide()
    snapshot = record.snapshot(17)
    assert snapshot.time == expected.time
    np.testing.assert_array_equal(snapshot.positions, expected.positions)
    np.testing.assert_array_equal(snapshot.decision.forces, expected.decision.forces)
    np.testing.assert_array_equal(snapshot.decision.goals, expected.decision.goals)
    for i in range(4):
        neighbors = snapshot.seen.neighbors.list_neighbors(i)
        assert list(neighbors) == list(expected.seen.neighbors.list_neighbors(i))


def test_samples_of_a_record_refer_to_the_robots_that_worked_at_that_time(empty: Environment) -> None:
    team = replace(Team.homogeneous(3), max_speed=np.array([0.3, 0.6, 1.5]))
    starts = [[2.0, 2.0], [4.0, 2.0], [3.0, 4.0]]
    conditions = Conditions(failures=((1, 0.1),))
    record = Simulation(empty, Rapf(cells="time"), starts, team, 0.05, conditions=conditions).run(0.2)
    assert record.has_travel_time_cells
    assert not replace(record, team=Team.homogeneous(3)).has_travel_time_cells
    assert record.snapshot(-1).seen.neighbors.list_pairs()[0].tolist() == [1, 2]
    expected = partition_by_travel_time(record.positions[-1, 1:], team.max_speed[1:], empty.region)
    assert record.compute_cells().masses.tolist() == expected.masses.tolist()
    for excerpt in (record.until(0.1), record.thin(10.0)):
        assert not any(np.shares_memory(getattr(excerpt, name), getattr(record, name)) for name in ARRAYS)


def test_gains_of_individual_controllers_are_recorded(empty: Environment) -> None:
    @dataclass(frozen=True)
    class Drift:
        pull: float = 0.5

        def force(self, own: object) -> list[float]:
            return [self.pull, 0.0]

    record = Simulation(empty, IndividualControllerAdapter(Drift(pull=0.25)), [[2.0, 2.0]]).run(0.1)
    assert record.gains == {"pull": 0.25}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"seed": "first"}, "seed: expected a whole number of at least 0, got 'first'"),
        ({"seed": -1}, "seed: expected a whole number of at least 0, got -1"),
        ({"start": 3}, "start: expected the name of a start, or None, got 3"),
    ],
)
def test_runs_that_could_not_be_loaded_again_do_not_start(
    empty: Environment, options: dict[str, Any], message: str
) -> None:
    simulation = Simulation(empty, Rpf(), [[1.0, 1.0]])
    with pytest.raises(ParameterError, match=message):
        simulation.run(0.1, **options)
    assert simulation.time == 0.0


def test_records_of_controllers_without_goals_have_no_goals(empty: Environment) -> None:
    record = Simulation(empty, Rpf(), empty.start().sample(3)).run(0.5)
    assert np.isnan(record.goals).all()
    assert record.snapshot(0).decision.goals is None


def test_a_stopped_run_equals_a_shorter_run(empty: Environment) -> None:
    simulation = Simulation(empty, Rapf(), empty.start().sample(3))
    recorder = Recorder(empty, simulation.team, simulation.controller, simulation.dt)
    for snapshot in simulation.snapshots(10.0):
        recorder.add(snapshot)
        if snapshot.time > 1.0:
            break
    complete = Simulation(empty, Rapf(), empty.start().sample(3)).run(10.0)
    stopped = recorder.record()
    np.testing.assert_array_equal(stopped.positions, complete.positions[: len(stopped)])


def edit_document(*path: str | int, to: object = None):
    """Return a function that sets one value in the ``run.json`` of a folder; None deletes it."""

    def damage(folder: Path) -> None:
        run = json.loads((folder / "run.json").read_text())
        parent = run
        for step in path[:-1]:
            parent = parent.setdefault(step, {}) if isinstance(parent, dict) else parent[step]
        if to is None:
            del parent[path[-1]]
        else:
            parent[path[-1]] = to
        (folder / "run.json").write_text(json.dumps(run))

    return damage


def edit_arrays(**changes):
    """Return a function that applies functions to arrays in the ``record.npz`` of a folder."""

    def damage(folder: Path) -> None:
        with np.load(folder / "record.npz") as archive:
            arrays = dict(archive)
        for name, change in changes.items():
            arrays[name] = change(arrays[name])
            if arrays[name] is None:
                del arrays[name]
        np.savez(folder / "record.npz", **arrays)

    return damage


CONDITIONS = Conditions(loss=0.1, failures=((1, 0.5),), joins=((2, 0.5, (1.0, 1.0)),)).to_dict()


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (
            lambda folder: (folder / "run.json").unlink(),
            "got a folder without run.json",
        ),
        (
            lambda folder: (folder / "record.npz").unlink(),
            "the folder of a run, got a folder without record.npz",
        ),
        (lambda folder: (folder / "run.json").write_text("{"), "run.json:1:2: end of file: not JSON: "),
        (
            lambda folder: (folder / "run.json").write_text("[1]"),
            "run.json: expected a JSON object with a run",
        ),
        (lambda folder: (folder / "run.json").write_text("[" * 99), "run.json:1:"),
        (
            edit_document("format", to="robocov-map"),
            'run.json: format: expected "robocov-run", got "robocov-map"',
        ),
        (
            edit_document("version", to=99),
            "run.json: version: expected 1, got 99; it was written by a newer robocov",
        ),
        (edit_document("version", to=True), "run.json: version: expected 1, got true"),
        (edit_document("dt_s"), "run.json: dt_s: missing"),
        (edit_document("dt_s", to=-1), "run.json: dt_s: expected a number above 0 (s), got -1"),
        (edit_document("dt_s", to="0.02"), 'run.json: dt_s: expected a number above 0 (s), got "0.02"'),
        (
            edit_document("seed", to=-3),
            "run.json: seed: expected a whole number of at least 0, or null, got -3",
        ),
        (
            edit_document("start", to=["corner"]),
            'run.json: start: expected the name of a start, or null, got ["corner"]',
        ),
        (edit_document("lattice", to=1), "run.json: lattice: expected a whole number from 2 to 2048, got 1"),
        (edit_document("map", "boundary", 0, 0, to="x"), "run.json: map: boundary[0][0]: "),
        (edit_document("map", to=[]), "run.json: map: expected an object, got []"),
        (edit_document("controller", to="rapf"), 'run.json: controller: expected an object, got "rapf"'),
        (edit_document("controller", "name", to=3), "run.json: controller.name: expected a name, got 3"),
        (
            edit_document("controller", "gains", "k_rep", to=[1.0]),
            "run.json: controller.gains.k_rep: expected a number, a word or null, got [1.0]",
        ),
        (
            edit_document("team", "robots", to=10**12),
            "run.json: team.robots: expected a whole number from 1 to 10000, got 1000000000000",
        ),
        (
            edit_document("team", "mass_kg"),
            "run.json: team.mass_kg: expected a number from 0.000001 to 1000000, or one ",
        ),
        (
            edit_document("team", "radius_m", to=-1),
            "run.json: team.radius_m: expected a number from 0.001 to 1000, or one for each of 4 ",
        ),
        (
            edit_document("team", "radius_m", to=[0.1] * 3),
            "run.json: team.radius_m: expected a number from 0.001 to 1000, or one for each of 4 ",
        ),
        (edit_document("team", "mass_kg", to=[1, 1, 1, "1"]), "run.json: team.mass_kg: "),
        (
            edit_document("conditions", to={**CONDITIONS, "loss": 2}),
            "run.json: conditions.loss: expected a number from 0",
        ),
        (
            edit_document("conditions", to={**CONDITIONS, "failures": [{"robot": 0, "time_s": 1}]}),
            "run.json: conditions.failures[0].robot: expected the number of a robot, from 1, got 0",
        ),
        (
            edit_document("conditions", to={**CONDITIONS, "failures": [{"robot": 9, "time_s": 1}]}),
            "run.json: conditions.failures[0]: expected a robot from 1 to 4, got robot 9",
        ),
        (
            edit_document(
                "conditions", to={**CONDITIONS, "joins": [{"robot": 1, "time_s": 0.0, "position_m": [1]}]}
            ),
            "run.json: conditions.joins[0].position_m: expected a point [x, y], got [1]",
        ),
        (edit_document("session", to=[1]), "run.json: session: expected an object, got [1]"),
        (
            edit_document("session", "control_dt_s", to="often"),
            "run.json: session.control_dt_s: expected a number",
        ),
        (
            edit_document("session", "robots", to="1234"),
            'run.json: session.robots: expected a list, got "1234"',
        ),
        (
            edit_document("session", to={"robots": [1, 2, 3, 4, 5]}),
            "run.json: session.robots: expected 4 different numbers, one for each robot, got [1, 2, 3, 4, 5]",
        ),
        (
            edit_document("session", to={"robots": [1, 1, 2, 3]}),
            "run.json: session.robots: expected 4 different numbers, one for each robot, got [1, 1, 2, 3]",
        ),
        (edit_document("session", "failed", to={"x": [1.0, 1.0]}), "run.json: session.failed.x: "),
        (
            edit_document("session", "failed", to={"4": [1.0]}),
            'run.json: session.failed["4"]: expected a point [x, y]',
        ),
        (
            edit_document("session", "edits", to=[{"from_s": 0, "to_s": "soon", "robots": [1]}]),
            'run.json: session.edits[0].to_s: expected a number of at least 0 (s), got "soon"',
        ),
        (
            lambda folder: (folder / "record.npz").write_bytes(b"PK\x03\x04 no"),
            "record.npz: cannot be read: ",
        ),
        (edit_arrays(goals=lambda values: None), "record.npz: there is no array goals"),
        (
            edit_arrays(forces=lambda values: values[:, :3]),
            "record.npz: forces: expected shape (101, 4, 2) of float64, got (101, 3, 2) of float64",
        ),
        (
            edit_arrays(time=lambda values: values[None]),
            "record.npz: time: expected shape (T,) of float64, got (1, 101) of float64",
        ),
        (
            edit_arrays(goals=lambda values: values.astype("f4")),
            "record.npz: goals: expected shape (101, 4, 2) of float64, got (101, 4, 2) of float32",
        ),
        (
            edit_arrays(**{name: lambda values: values[:0] for name in ARRAYS}),
            "record.npz: time: expected shape (T,) of float64, got (0,) of float64",
        ),
        (edit_arrays(time=lambda values: 0 * values), "record.npz: time: expected ascending numbers"),
        (
            edit_arrays(positions=lambda values: values * 1e9),
            "record.npz: positions: expected finite numbers up to 10000000, got ",
        ),
        (
            edit_arrays(velocities=lambda values: values * np.nan),
            "record.npz: velocities: expected finite numbers up to 1e+300, got nan",
        ),
    ],
)
def test_damaged_folders_are_rejected(record: Record, tmp_path: Path, damage, message: str) -> None:
    record.save(tmp_path)
    damage(tmp_path)
    with pytest.raises(InputError) as caught:
        Record.load(tmp_path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path))
    assert message in str(caught.value)


def test_additions_of_later_versions_are_ignored(record: Record, tmp_path: Path) -> None:
    """Keys that earlier versions did not write may be missing."""
    record.save(tmp_path)
    for path in (("mood",), ("controller", "label"), ("team", "color_rgb"), ("session", "weather")):
        edit_document(*path, to={"fine": [1, None]})(tmp_path)
    for name in ("lattice", "versions", "summary", "starts_m", "duration_s"):
        edit_document(name)(tmp_path)
    edit_arrays()(tmp_path)
    with np.load(tmp_path / "record.npz") as archive:
        np.savez_compressed(tmp_path / "record.npz", **archive, moods=np.arange(3))
    loaded = Record.load(tmp_path)
    assert loaded.positions.tobytes() == record.positions.tobytes()
    assert loaded.session == {"weather": {"fine": [1, None]}}


def test_loading_a_run_does_not_load_its_controller(record: Record, tmp_path: Path) -> None:
    replace(record, controller="somewhere/mine.py:Mine").save(tmp_path)
    loaded = Record.load(tmp_path)
    assert (loaded.controller, loaded.label) == ("somewhere/mine.py:Mine", "Mine")


def test_the_mask_of_working_robots_is_read_only(record: Record) -> None:
    """Snapshots contain views of the mask."""
    failing = replace(record, conditions=Conditions(failures=((1, 0.5),)))
    for mask in (failing.is_working, failing.is_present, failing.snapshot(3).is_working, record.is_working):
        with pytest.raises(ValueError, match="read-only"):
            mask[...] = False


@dataclass(frozen=True)
class ReusingController:
    """A controller that changes its memory in place and returns it as forces, goals and terms."""

    name = label = "reusing"
    summary = ""

    def begin(self, region: object, team: Team) -> np.ndarray:
        return np.zeros((len(team), 2))

    def decide(self, seen: Observations, memory: np.ndarray) -> Decision:
        memory += 0.01
        return Decision(memory, memory, {"attraction": memory}, memory=memory)


class TestReusedArrays:
    """A controller may use the same array for all of its decisions."""

    def test_every_step_is_recorded(self, empty: Environment) -> None:
        record = Simulation(empty, ReusingController(), empty.start().sample(2), dt=0.02).run(0.2)
        steps = 0.01 * np.arange(1, 12)
        for values in (record.forces, record.goals):
            np.testing.assert_allclose(values, np.broadcast_to(steps[:, None, None], values.shape))

    def test_the_recorder_copies_its_arguments(self, empty: Environment) -> None:
        simulation = Simulation(empty, Rapf(), empty.start().sample(2))
        recorder = Recorder(empty, simulation.team, simulation.controller, simulation.dt)
        decision = Decision(np.ones((2, 2)), np.ones((2, 2)))
        recorder.add(Snapshot(simulation.observe(), decision))
        decision.forces[:] = 7.0
        decision.goals[:] = 7.0
        assert (recorder.record().forces == 1.0).all()
        assert (recorder.record().goals == 1.0).all()

    def test_snapshots_do_not_change_later(self, empty: Environment) -> None:
        simulation = Simulation(empty, ReusingController(), empty.start().sample(2), dt=0.02)
        snapshots = []
        copies = []
        for snapshot in simulation.snapshots(0.1):
            snapshots.append(snapshot)
            copies.append(deepcopy(snapshot))
        for snapshot, copy in zip(snapshots, copies, strict=True):
            np.testing.assert_array_equal(snapshot.decision.forces, copy.decision.forces)
            np.testing.assert_array_equal(snapshot.decision.terms["attraction"], copy.decision.forces)

    def test_a_copy_continues_identically_also_after_the_decision(self, empty: Environment) -> None:
        simulation = Simulation(empty, ReusingController(), empty.start().sample(2), dt=0.02)
        simulation.step()
        assert simulation.observe_and_decide().decision.forces.max() == pytest.approx(0.02)
        copies = [simulation.copy(), simulation.with_changes(), simulation.with_memory(simulation.memory)]
        for copy in copies:
            copy.step()
            assert copy.observe_and_decide().decision.forces.max() == pytest.approx(0.03)
        simulation.step()
        assert simulation.observe_and_decide().decision.forces.max() == pytest.approx(0.03)


def test_files_are_complete_or_missing(tmp_path: Path) -> None:
    target = tmp_path / "result.txt"
    target.write_text("old")
    with pytest.raises(RuntimeError), replace_file(target) as partial_file:
        partial_file.write_text("half")
        raise RuntimeError
    assert target.read_text() == "old"
    with (
        pytest.raises(OutputError, match=r"result.txt: cannot be written: No space left on device"),
        replace_file(target) as partial_file,
    ):
        partial_file.write_text("half")
        raise OSError(28, os.strerror(28))
    assert [path.name for path in tmp_path.iterdir()] == ["result.txt"]
    with replace_file(target) as partial_file:
        partial_file.write_text("new")
    assert target.read_text() == "new"
    with (
        pytest.raises(OutputError, match="cannot be written"),
        replace_file(tmp_path / "no" / "x.txt") as partial_file,
    ):
        partial_file.write_text("")


class TestSamples:
    def test_a_thinned_record_contains_samples_of_the_complete_one(self, record: Record) -> None:
        thin = record.thin(5.0)
        assert thin.time == pytest.approx(np.arange(11) * 0.2)
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(thin, name), getattr(record, name)[::10])
        assert replace(thin, **{name: getattr(record, name) for name in ARRAYS}).to_json() == record.to_json()
        assert thin.dt == record.dt
        assert np.shares_memory(thin.positions, record.positions) is False
        assert len(record) == 101

    @pytest.mark.parametrize("rate", [50.0, 50.1, 1e6, 1e308])
    def test_thinning_adds_no_samples(self, record: Record, rate: float) -> None:
        assert record.thin(rate).time.tolist() == record.time.tolist()

    def test_thinning_keeps_the_first_and_the_last_sample(self, record: Record) -> None:
        assert record.thin(0.0).time.tolist() == [record.time[0], record.time[-1]]
        assert record.thin(1e-9).time.tolist() == [record.time[0], record.time[-1]]
        assert record.thin(0.3).time.tolist() == [record.time[0], record.time[-1]]
        assert record.until(0.0).thin(0.0).time.tolist() == [0.0]

    def test_thinning_twice_equals_thinning_once(self, record: Record) -> None:
        once = record.thin(7.0)
        assert once.thin(7.0).time.tolist() == once.time.tolist()

    def test_a_thinned_record_is_saved_and_sampled(self, record: Record, tmp_path: Path) -> None:
        thin = record.thin(5.0)
        thin.save(tmp_path)
        loaded = Record.load(tmp_path)
        assert loaded.positions.tobytes() == thin.positions.tobytes()
        # Costs are computed at the same times as those of the complete record.
        for rate in (1.0, 2.5, 5.0):
            times = record.time[select_sampled_steps(record, rate)]
            loaded_times = loaded.time[select_sampled_steps(loaded, rate)]
            assert loaded_times.tolist() == times.tolist()

    @pytest.mark.parametrize("rate", [-1.0, np.inf, np.nan])
    def test_invalid_rates_are_rejected(self, record: Record, rate: float) -> None:
        with pytest.raises(
            ParameterError, match=r"^rate: expected a finite number of at least 0 Hz, got .*$"
        ):
            record.thin(rate)

    def test_the_nearest_sample_to_a_time_is_returned(self, record: Record) -> None:
        assert record.at(1.0).time == 1.0
        assert record.at(1.008).time == 1.0
        assert record.at(1.012).time == pytest.approx(1.02)
        # The earlier one of two equally near samples is returned.
        assert record.thin(0.0).at(1.0).time == 0.0
        np.testing.assert_array_equal(record.at(2.0).positions, record.positions[-1])
        for time in (-0.1, 2.1, np.nan, "1"):
            with pytest.raises(ParameterError, match="time: expected a number from 0 to 2 s"):
                record.at(time)

    def test_until_returns_the_record_of_a_shorter_run(self, record: Record) -> None:
        excerpt = record.until(1.0)
        controller = Rapf(k_rep=0.2, attraction_limit=None)
        simulation = Simulation(record.environment, controller, record.positions[0], record.team, 0.02)
        expected = simulation.run(1.0)
        for name in ARRAYS:
            assert getattr(excerpt, name).tobytes() == getattr(expected, name).tobytes()
        assert record.until(99.0).time.tolist() == record.time.tolist()
        for time in (-0.1, np.nan, "1"):
            with pytest.raises(ParameterError, match="time: expected a number of at least 0 s"):
                record.until(time)


class TestDataFrame:
    def test_the_data_frame_contains_every_number_once(self, record: Record) -> None:
        frame = record.to_pandas()
        assert list(frame.columns) == [
            *("time_s", "robot", "x_m", "y_m", "vx_m_s", "vy_m_s", "fx_N", "fy_N"),
            *("goal_x_m", "goal_y_m", "obstacle_x_m", "obstacle_y_m"),
        ]
        assert len(frame) == len(record) * 4
        assert frame.index.equals(frame.reset_index().index)
        assert not frame.duplicated(["time_s", "robot"]).any()
        assert frame["robot"].dtype == np.int64
        for sample, robot in ((0, 0), (0, 3), (57, 1), (100, 3)):
            (row,) = frame[(frame.time_s == record.time[sample]) & (frame.robot == robot)].to_numpy()
            values = np.concatenate([getattr(record, name)[sample, robot] for name in ARRAYS[1:]])
            np.testing.assert_array_equal(row, [record.time[sample], robot, *values])

    def test_the_data_frame_is_tidy(self, record: Record) -> None:
        """The path of one robot and a column for each robot are selected in one step."""
        frame = record.to_pandas()
        path = frame[frame.robot == 2][["x_m", "y_m"]].to_numpy()
        np.testing.assert_array_equal(path, record.positions[:, 2])
        wide = frame.pivot(index="time_s", columns="robot", values="fy_N").to_numpy()
        np.testing.assert_array_equal(wide, record.forces[:, :, 1])

    def test_changes_of_the_data_frame_do_not_change_the_record(self, record: Record) -> None:
        before = record.positions.copy()
        frame = record.to_pandas()
        frame["x_m"] += 1.0
        frame.loc[:, "y_m"] = 0.0
        np.testing.assert_array_equal(record.positions, before)

    def test_a_data_frame_without_goals_has_no_goal_columns(self, empty: Environment) -> None:
        frame = Simulation(empty, Rpf(), empty.start().sample(3)).run(0.1).to_pandas()
        assert frame[["goal_x_m", "goal_y_m"]].isna().all(axis=None)

    def test_without_pandas_the_error_says_what_to_install(
        self, record: Record, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setitem(sys.modules, "pandas", None)
        with pytest.raises(RobocovError) as caught:
            record.to_pandas()
        assert str(caught.value) == 'pandas is not installed: pip install "robocov[pandas]"'


def test_the_repr_is_short(record: Record, empty: Environment) -> None:
    assert repr(record) == "<Record rapf on cluttered, 4 robots, 2.0 s>"
    assert repr(record.at(1.0)) == "<Snapshot at 1.00 s, 4 robots>"
    assert repr(Simulation(empty, Rpf(), [[5.0, 5.0]]).run(0.1)) == "<Record rpf on empty, 1 robot, 0.1 s>"


def test_records_of_unicycles_contain_their_headings(cluttered: Environment, tmp_path: Path) -> None:
    team = Team.homogeneous(3, kinematics="unicycle", turning_rate=2.0)
    record = Simulation(cluttered, Rapf(), cluttered.start().sample(3, seed=2), team).run(1.0)
    record.save(tmp_path)
    loaded = Record.load(tmp_path)
    assert record.steering is not None
    assert loaded.steering is not None
    assert record.steering.tobytes() == loaded.steering.tobytes()
    assert record.steering[-1].any()
    assert loaded.team.track_width.tolist() == team.track_width.tolist()
    assert loaded.team.turning_rate[0] == 2.0
    assert (loaded.snapshot(7).steering == record.steering[7]).all()
    thin = loaded.thin(5.0)
    assert len(thin.steering) == len(thin.time) == 6  # type: ignore[arg-type]
    pytest.importorskip("pandas")
    frame = record.to_pandas()
    assert list(frame)[-2:] == ["heading_rad", "turning_rate_rad_s"]
    assert frame.heading_rad.iloc[-1] == record.steering[-1, -1, 0]
    arrays = dict(np.load(tmp_path / "record.npz"))
    del arrays["steering"]
    np.savez(tmp_path / "record.npz", **arrays)
    with pytest.raises(InputError, match="there is no array steering"):
        Record.load(tmp_path)


def test_records_of_points_have_no_steering(record: Record, tmp_path: Path) -> None:
    record.save(tmp_path)
    assert set(np.load(tmp_path / "record.npz")) == set(ARRAYS)
    assert not {"track_width_m", "turning_rate_rad_per_s"} & set(record.to_json()["team"])
