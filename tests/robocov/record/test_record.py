from __future__ import annotations

import json
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robocov.controllers import Rapf, Rpf, gain_values, make_controller
from robocov.environment import Environment
from robocov.errors import InputError, OutputError, ParameterError, RobocovError
from robocov.files.atomic import written
from robocov.mapfile import from_json
from robocov.metrics import sample_moments
from robocov.record import ARRAYS, Record
from robocov.record.recorder import Recorder
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
    assert again.gains == gain_values(Rapf(k_rep=0.2, attraction_limit=None))
    assert again.gains["attraction_limit"] is None and again.gains["target"] == "centroid"
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


class TestMoments:
    def test_a_thinned_record_has_moments_of_the_whole_one(self, record: Record) -> None:
        thin = record.thinned(5.0)
        assert thin.time == pytest.approx(np.arange(11) * 0.2)
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(thin, name), getattr(record, name)[::10])
        assert replace(thin, **{name: getattr(record, name) for name in ARRAYS}).to_json() == record.to_json()
        assert thin.dt == record.dt
        assert np.shares_memory(thin.positions, record.positions) is False
        assert len(record) == 101

    @pytest.mark.parametrize("rate", [50.0, 50.1, 1e6, 1e308])
    def test_more_moments_than_there_are_are_not_made_up(self, record: Record, rate: float) -> None:
        assert record.thinned(rate).time.tolist() == record.time.tolist()

    def test_the_first_and_the_last_stay_whatever_the_rate(self, record: Record) -> None:
        assert record.thinned(0.0).time.tolist() == [record.time[0], record.time[-1]]
        assert record.thinned(1e-9).time.tolist() == [record.time[0], record.time[-1]]
        assert record.thinned(0.3).time.tolist() == [record.time[0], record.time[-1]]
        assert record.until(0.0).thinned(0.0).time.tolist() == [0.0]

    def test_thinning_twice_is_thinning_once(self, record: Record) -> None:
        once = record.thinned(7.0)
        assert once.thinned(7.0).time.tolist() == once.time.tolist()

    def test_a_thinned_record_is_saved_and_sampled(self, record: Record, tmp_path: Path) -> None:
        thin = record.thinned(5.0)
        thin.save(tmp_path)
        again = Record.load(tmp_path)
        assert again.positions.tobytes() == thin.positions.tobytes()
        # costs are asked for at the same times as those of the whole record
        for rate in (1.0, 2.5, 5.0):
            times = [run.time[sample_moments(run, rate)].tolist() for run in (record, again)]
            assert times[0] == times[1]

    @pytest.mark.parametrize("rate", [-1.0, np.inf, np.nan])
    def test_a_rate_that_is_none_is_refused(self, record: Record, rate: float) -> None:
        with pytest.raises(ParameterError, match=r"^rate: .* Hz, but a finite number from 0 was wanted$"):
            record.thinned(rate)

    def test_the_moment_at_a_time(self, record: Record) -> None:
        assert record.at(1.0).time == 1.0
        assert record.at(1.008).time == 1.0
        assert record.at(1.012).time == pytest.approx(1.02)
        np.testing.assert_array_equal(record.at(2.0).positions, record.positions[-1])
        for time in (-0.1, 2.1, np.nan):
            with pytest.raises(ParameterError, match="but a number from 0 to 2 s was wanted"):
                record.at(time)

    def test_a_run_until_a_time_is_the_run_that_was_stopped_then(self, record: Record) -> None:
        part = record.until(1.0)
        again = Simulation(
            record.environment, Rapf(k_rep=0.2, attraction_limit=None), record.positions[0], record.team, 0.02
        ).run(1.0)
        for name in ARRAYS:
            assert getattr(part, name).tobytes() == getattr(again, name).tobytes()
        assert record.until(99.0).time.tolist() == record.time.tolist()
        for time in (-0.1, np.nan):
            with pytest.raises(ParameterError, match="but a number from 0 s was wanted"):
                record.until(time)


class TestFrame:
    def test_every_number_of_the_record_is_in_one_row_and_column(self, record: Record) -> None:
        frame = record.to_pandas()
        assert list(frame.columns) == [
            *("time_s", "robot", "x_m", "y_m", "vx_m_s", "vy_m_s", "fx_N", "fy_N"),
            *("goal_x_m", "goal_y_m", "obstacle_x_m", "obstacle_y_m"),
        ]
        assert len(frame) == len(record) * 4
        assert frame.index.equals(frame.reset_index().index)
        assert not frame.duplicated(["time_s", "robot"]).any()
        assert frame["robot"].dtype == np.int64
        for moment, robot in ((0, 0), (0, 3), (57, 1), (100, 3)):
            (row,) = frame[(frame.time_s == record.time[moment]) & (frame.robot == robot)].to_numpy()
            wanted = [getattr(record, name)[moment, robot] for name in ARRAYS[1:]]
            np.testing.assert_array_equal(row, [record.time[moment], robot, *np.concatenate(wanted)])

    def test_it_is_tidy(self, record: Record) -> None:
        """What is asked of it every day: one robot's path, and the team by robots."""
        frame = record.to_pandas()
        path = frame[frame.robot == 2][["x_m", "y_m"]].to_numpy()
        np.testing.assert_array_equal(path, record.positions[:, 2])
        wide = frame.pivot(index="time_s", columns="robot", values="fy_N").to_numpy()
        np.testing.assert_array_equal(wide, record.forces[:, :, 1])

    def test_what_is_done_to_it_leaves_the_record_alone(self, record: Record) -> None:
        before = record.positions.copy()
        frame = record.to_pandas()
        frame["x_m"] += 1.0
        frame.loc[:, "y_m"] = 0.0
        np.testing.assert_array_equal(record.positions, before)

    def test_a_law_without_goals_has_none_in_it(self, empty: Environment) -> None:
        frame = Simulation(empty, Rpf(), empty.start().sample(3)).run(0.1).to_pandas()
        assert frame[["goal_x_m", "goal_y_m"]].isna().all(axis=None)

    def test_without_pandas_it_says_what_brings_it(
        self, record: Record, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setitem(sys.modules, "pandas", None)
        with pytest.raises(RobocovError) as caught:
            record.to_pandas()
        assert str(caught.value) == 'pandas is not installed: pip install "robocov[pandas]"'


def test_it_is_short_in_words(record: Record, empty: Environment) -> None:
    assert repr(record) == "<Record rapf on cluttered, 4 robots, 2.0 s>"
    assert repr(record.at(1.0)) == "<Snapshot at 1.00 s, 4 robots>"
    assert repr(Simulation(empty, Rpf(), [[5.0, 5.0]]).run(0.1)) == "<Record rpf on empty, 1 robot, 0.1 s>"
