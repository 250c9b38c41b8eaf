from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from robocov.atomic import written
from robocov.controllers import Rapf, Rpf, make_controller
from robocov.environment import Environment
from robocov.errors import InputError, OutputError
from robocov.mapfile import from_json
from robocov.record import ARRAYS, Record, Recorder
from robocov.robots import Team
from robocov.simulation import Simulation


@pytest.fixture(scope="module")
def record(cluttered: Environment) -> Record:
    team = Team.homogeneous(4, communication_range=3.0)
    starts = cluttered.start().sample(4, seed=2)
    return Simulation(cluttered, Rapf(k_rep=0.2, attraction_limit=None), starts, team, 0.02).run(
        2.0, start="corner", seed=2
    )


def test_load_gives_what_was_saved(record: Record, tmp_path: Path) -> None:
    record.save(tmp_path, {"mean_distance_m": 1.0})
    again = Record.load(tmp_path)
    for name in ARRAYS:
        assert getattr(again, name).tobytes() == getattr(record, name).tobytes()
    assert again.environment == record.environment
    assert again.gains == {"k_rep": 0.2, "rho_0": 2.0, "k_att": 30.0, "attraction_limit": None}
    assert (again.controller, again.label, again.start, again.seed, again.dt) == (
        "rapf",
        "RAPF",
        "corner",
        2,
        0.02,
    )
    assert again.team.to_dict() == record.team.to_dict()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["record.npz", "run.json"]


def test_run_json_is_all_that_is_needed_to_repeat_the_run(record: Record, tmp_path: Path) -> None:
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


def test_a_snapshot_of_the_record_is_the_one_of_the_run(record: Record, cluttered: Environment) -> None:
    simulation = Simulation(
        cluttered, Rapf(k_rep=0.2, attraction_limit=None), record.positions[0], record.team, 0.02
    )
    for _ in range(17):
        simulation.step()
    live, saved = simulation.snapshot, record.snapshot(17)
    assert live.time == saved.time
    np.testing.assert_array_equal(live.positions, saved.positions)
    np.testing.assert_array_equal(live.decision.forces, saved.decision.forces)
    np.testing.assert_array_equal(live.decision.goals, saved.decision.goals)
    assert [list(live.seen.neighbours.of(i)) for i in range(4)] == [
        list(saved.seen.neighbours.of(i)) for i in range(4)
    ]


def test_a_law_without_goals_has_none_in_its_record(empty: Environment) -> None:
    record = Simulation(empty, Rpf(), empty.start().sample(3)).run(0.5)
    assert np.isnan(record.goals).all()
    assert record.snapshot(0).decision.goals is None


def test_a_stopped_run_is_a_shorter_run(empty: Environment) -> None:
    simulation = Simulation(empty, Rapf(), empty.start().sample(3))
    recorder = Recorder(empty, simulation.team, simulation.controller, simulation.dt)
    for snapshot in simulation.snapshots(10.0):
        recorder.add(snapshot)
        if snapshot.time > 1.0:
            break
    whole = Simulation(empty, Rapf(), empty.start().sample(3)).run(10.0)
    part = recorder.record()
    np.testing.assert_array_equal(part.positions, whole.positions[: len(part)])


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda folder: (folder / "run.json").unlink(), "not the folder of a run"),
        (lambda folder: (folder / "record.npz").unlink(), "there is no record.npz"),
        (lambda folder: (folder / "run.json").write_text("{"), "the run cannot be read"),
        (lambda folder: (folder / "run.json").write_text("{}"), "the run cannot be read"),
        (lambda folder: (folder / "record.npz").write_bytes(b"PK\x03\x04 no"), "the run cannot be read"),
        (lambda folder: np.savez(folder / "record.npz", time=np.zeros(3)), "the run cannot be read"),
    ],
)
def test_a_spoilt_folder_is_refused_in_one_line(record: Record, tmp_path: Path, spoil, message: str) -> None:
    record.save(tmp_path)
    spoil(tmp_path)
    with pytest.raises(InputError, match=message) as caught:
        Record.load(tmp_path)
    assert "\n" not in str(caught.value)
    assert str(tmp_path) in str(caught.value)


def test_arrays_that_do_not_fit_the_team_are_refused(record: Record, tmp_path: Path) -> None:
    record.save(tmp_path)
    arrays = {name: getattr(record, name) for name in ARRAYS}
    arrays["forces"] = arrays["forces"][:, :3]
    np.savez(tmp_path / "record.npz", **arrays)
    with pytest.raises(InputError, match="forces has shape"):
        Record.load(tmp_path)


def test_a_file_is_there_whole_or_not_at_all(tmp_path: Path) -> None:
    target = tmp_path / "result.txt"
    target.write_text("old")
    with pytest.raises(RuntimeError), written(target) as part:
        part.write_text("half")
        raise RuntimeError
    assert target.read_text() == "old"
    with (
        pytest.raises(OutputError, match=r"result.txt: cannot be written: No space left on device"),
        written(target) as part,
    ):
        part.write_text("half")
        raise OSError(28, os.strerror(28))
    assert [path.name for path in tmp_path.iterdir()] == ["result.txt"]
    with written(target) as part:
        part.write_text("new")
    assert target.read_text() == "new"
    with pytest.raises(OutputError, match="cannot be written"), written(tmp_path / "no" / "x.txt") as part:
        part.write_text("")
