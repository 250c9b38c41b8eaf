from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kept_run import COUNTING, record_of, records_of, repeated, said_by, same_arrays
from touched_run import HALL, LLOYD, RAPF, RPF, begun, stepped

from robocov.environment import CircleObstacle, PointsStart
from robocov.mapfile import save_map
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.runs.saved import load_saved, roster_of
from robocov_app.viewer.session import history
from robocov_app.viewer.session.history import History
from robocov_app.viewer.session.keep_process import kept
from robocov_app.viewer.session.keeping import Keeper, since_words, tell, untouched_since, wanted_of
from robocov_app.viewer.session.kept import Kept
from robocov_app.viewer.session.map_edits import with_obstacle
from robocov_app.viewer.session.scenario import Law

FILES = (
    ".robocov.json",
    "run.json",
    "record.npz",
    "cost.csv",
    *(f"{stem}.{end}" for stem in ("trajectories", "cost") for end in ("png", "svg")),
)
SHORT = ("--duration", "0.8", "--lattice", "16", "--json")
STEPS = 48


@pytest.fixture
def hall(tmp_path: Path) -> str:
    path = tmp_path / "hall.json"
    save_map(HALL, path)
    return str(path)


@pytest.fixture
def counting(tmp_path: Path) -> Law:
    path = tmp_path / "mine.py"
    path.write_text(COUNTING)
    return Law(f"{path}:Counting")


def dragged(session, number, point, frames=12):
    """Let a hand pull a robot for some frames."""
    session.playing = True
    session.grab(number, point)
    for _ in range(frames):
        session.advance(session.scenario.dt)
    session.release()
    session.playing = False
    return session


# as robocov run and compare write it


def test_what_was_left_alone_is_saved_byte_for_byte_as_run_does(
    hall: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Eight robots, so that the controller's triangulation goes from step to step."""
    session = stepped(begun(RAPF, robots=8, start="spread", seed=5), STEPS)
    keeper = Keeper(16)
    assert keeper.save(session, tmp_path, "maps/hall.json") == f"saving the run: {tmp_path}/hall-rapf-1/"
    said = said_by(keeper)
    assert said == (f"run saved: {tmp_path}/hall-rapf-1/ (record, cost, pictures)", False)
    words = ("--robots", "8", "--start", "spread", "--seed", "5", "--out", str(tmp_path / "run"))
    assert main(["run", hall, *SHORT, *words]) == 0
    assert sorted(path.name for path in (tmp_path / "hall-rapf-1").iterdir()) == sorted(FILES)
    for file in FILES:
        assert (tmp_path / "hall-rapf-1" / file).read_bytes() == (tmp_path / "run" / file).read_bytes(), file
    keeper.finish()


def test_several_panes_are_saved_as_compare_does(
    hall: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    session = stepped(begun(RAPF, RPF), STEPS)
    stream, folder = io.BytesIO(), tmp_path / "saved"
    folder.mkdir()
    tell(stream, wanted_of(session, folder, 16))
    stream.seek(0)
    assert kept(stream) == Kept(())
    words = ("--controllers", "rapf", "rpf", "--robots", "3", "--out", str(tmp_path / "compared"))
    assert main(["compare", hall, *SHORT, *words]) == 0
    files = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    assert len(files) == 7 + 2 * 3
    for file in files:
        assert (folder / file).read_bytes() == (tmp_path / "compared" / file).read_bytes(), file


@pytest.mark.parametrize("law", [RAPF, RPF, LLOYD], ids=lambda law: law.name)
def test_a_run_left_alone_says_nothing_of_a_session(law: Law) -> None:
    record = record_of(stepped(begun(law, robots=4, seed=2), 30))
    assert record.session == {}
    assert (record.start, record.seed) == ("corner", 2)
    assert same_arrays(record, repeated(record))


def test_the_first_moment_alone_can_be_saved() -> None:
    record = record_of(begun())
    assert len(record) == 1
    assert record.session == {}


# since the last touch


def touched_by_name(session, name):
    touches = {
        "wall": lambda: session.edit(with_obstacle(HALL, CircleObstacle((3.6, 3.0), 0.3)), "circle drawn"),
        "failure": lambda: session.fail_robot(2),
        "robot": lambda: session.add_robot((4.0, 3.0)),
        "gone": lambda: session.remove_robot(1),
        "gain": lambda: session.set_law(session.lanes[0], Law("rapf", {"k_rep": 1.0})),
        "law": lambda: session.set_law(session.lanes[0], LLOYD),
        "limits": lambda: session.set_limits(
            replace(session.circumstances(session.lanes[0]).limits, max_speed=0.5, communication_range=2.0)
        ),
    }
    touches[name]()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("wall", ", since 0.5 s, when circle drawn"),
        ("failure", ", since 0.5 s, when robot 2 failed"),
        ("robot", ", since 0.5 s, when robot 5 joined"),
        ("gone", ", since 0.5 s, when robot 1 taken out"),
        ("gain", ", since 0.5 s (RAPF: k_rep = 1)"),
        ("law", ", since 0.5 s, when LA takes over"),
        ("limits", ", since 0.5 s, when limits changed"),
    ],
)
def test_a_record_begins_at_the_last_touch_and_can_be_repeated(name: str, words: str) -> None:
    session = stepped(begun(robots=4), 30)
    touched_by_name(session, name)
    stepped(session, 40)
    assert wanted_of(session, Path("somewhere")).since == words
    record = record_of(session)
    assert len(record) == 41
    assert record.time[0] == 0.0
    assert record.session["began_at_s"] == 30 * session.scenario.dt
    assert record.session["repeatable"] is True
    assert (record.start, record.seed) == (None, None)
    np.testing.assert_array_equal(record.positions[-1], session.lanes[0].simulation.positions)
    np.testing.assert_array_equal(record.forces[-1], session.lanes[0].simulation.snapshot.decision.forces)
    assert same_arrays(record, repeated(record))


def test_who_failed_is_an_obstacle_with_a_name_and_keeps_its_number(tmp_path: Path) -> None:
    session = stepped(begun(robots=4), 20)
    session.fail_robot(2)
    stepped(session, 20)
    record = record_of(session)
    assert record.environment.obstacles[-1].name == "failed robot 2"
    assert len(record.team) == 3
    record.save(tmp_path)
    roster = roster_of(Record.load(tmp_path))
    assert roster.numbers == (1, 3, 4)
    assert roster.failed == session.circumstances(session.lanes[0]).failed
    assert roster.environment.obstacles == HALL.obstacles


def test_a_robot_that_fails_on_a_start_takes_only_that_start_away(tmp_path: Path) -> None:
    """Else the saved map would be refused: a start in an obstacle."""
    places = {"here": PointsStart(((1.0, 1.0), (2.0, 1.0), (1.0, 2.0))), **HALL.starts}
    session = begun(environment=replace(HALL, starts=places))
    session.fail_robot(1)
    stepped(session, 5)
    record_of(session).save(tmp_path)
    again = Record.load(tmp_path)
    assert list(again.environment.starts) == ["corner", "far", "spread"]
    assert again.start is None


def test_touched_at_the_very_beginning_it_is_said_what_differs() -> None:
    session = begun()
    session.place(1, (4.0, 3.4))
    record = record_of(stepped(session, 10))
    assert (record.start, record.seed) == (None, None)
    assert record.positions[0, 0].tolist() == [4.0, 3.4]
    assert same_arrays(record, repeated(record))


def test_only_the_panes_that_are_there_count() -> None:
    session = stepped(begun(RAPF, RPF), 10)
    session.set_law(session.lanes[1], LLOYD)
    stepped(session, 10)
    assert untouched_since(session) == 10
    assert [record.controller for record in records_of(session)] == ["rapf", "lloyd"]
    session.remove_pane(session.lanes[1])
    assert untouched_since(session) == 0
    assert len(record_of(session)) == 21


def test_after_going_on_from_the_past_only_what_is_still_true_is_saved() -> None:
    session = stepped(begun(), 40)
    session.fail_robot(1)
    stepped(session, 20)
    session.look_at(0.5)
    session.branch()
    stepped(session, 10)
    record = record_of(session)
    assert len(record) == 41
    assert record.session == {}
    assert same_arrays(record, repeated(record))


def test_a_touch_that_nobody_remembers_is_still_a_time() -> None:
    session = stepped(begun(), 12)
    session.fail_robot(1)
    session.events.clear()
    assert since_words(session, 12) == ", since 0.2 s"


# what a hand did


def test_a_run_with_a_hand_in_it_says_so() -> None:
    session = stepped(begun(), 20)
    dragged(session, 2, (3.0, 1.0))
    stepped(session, 30)
    record = record_of(session)
    (touched,) = record.session["touched"]
    assert touched["robots"] == [2]
    assert touched["from_s"] == pytest.approx(20 / 60)
    assert touched["to_s"] == pytest.approx(32 / 60)
    assert record.session["repeatable"] is False
    assert not same_arrays(record, repeated(record))
    for k, moment in enumerate(session.history.since(0)):
        np.testing.assert_array_equal(record.positions[k], moment.states[0].positions)
    session.look_at(25 / 60)
    seen = session.snapshot(session.lanes[0])
    np.testing.assert_array_equal(record.forces[25], seen.decision.forces)
    np.testing.assert_array_equal(record.goals[25], seen.decision.goals)
    np.testing.assert_array_equal(record.obstacle_points[25], seen.seen.obstacle_points)


def test_a_robot_put_elsewhere_while_paused_was_touched_too() -> None:
    session = stepped(begun(), 20)
    session.place(3, (5.4, 0.6))
    record = record_of(stepped(session, 20))
    assert record.session["touched"] == [
        {"from_s": pytest.approx(19 / 60), "to_s": pytest.approx(20 / 60), "robots": [3]}
    ]


def test_who_was_touched_before_the_record_begins_was_not_in_it() -> None:
    session = dragged(stepped(begun(), 10), 1, (3.0, 1.0))
    session.fail_robot(3)
    record = record_of(stepped(session, 20))
    assert "touched" not in record.session
    assert same_arrays(record, repeated(record))


# old moments


@pytest.fixture
def short_memory(monkeypatch: pytest.MonkeyPatch):
    """Let sessions keep few moments."""
    monkeypatch.setattr(history, "_FEWEST", 40)
    monkeypatch.setattr(history.History.__init__, "__defaults__", (30_000,))


@pytest.mark.usefixtures("short_memory")
def test_moments_that_were_thinned_out_are_found_again() -> None:
    session = stepped(begun(robots=4), 400)
    assert session.history.thinned > 100
    record = record_of(session)
    assert len(record) == 401
    assert record.session == {}
    assert same_arrays(record, repeated(record))


@pytest.mark.usefixtures("short_memory")
def test_what_cannot_be_found_again_makes_the_record_coarser() -> None:
    session = dragged(stepped(begun(), 60), 2, (3.0, 1.0), 30)
    stepped(session, 300)
    wanted = wanted_of(session, Path("somewhere"))
    there = {moment.step for moment in wanted.moments}
    record = record_of(session)
    stride = round(record.dt * 60)
    assert stride > 1
    assert stride & (stride - 1) == 0, "a power of two"
    assert record.session["control_dt_s"] == session.scenario.dt
    np.testing.assert_allclose(record.time, np.arange(len(record)) * record.dt)
    assert record.time[-1] > 350 / 60
    assert record.session["touched"][0]["robots"] == [2]
    for step in sorted(there):
        if step % stride == 0:
            state = next(moment for moment in wanted.moments if moment.step == step).states[0]
            np.testing.assert_array_equal(record.positions[step // stride], state.positions)


# controllers of the user's


def test_what_a_controller_remembers_goes_on(counting: Law) -> None:
    session = stepped(begun(counting), 20)
    record = record_of(session)
    assert record.session == {}
    assert same_arrays(record, repeated(record))
    session.set_limits(replace(session.circumstances(session.lanes[0]).limits, max_speed=0.5))
    stepped(session, 15)
    record = record_of(session)
    live = session.lanes[0].simulation.snapshot.decision.forces
    np.testing.assert_array_equal(record.forces[-1], live)
    assert record.session["repeatable"] is False, "no file tells what it remembered"


def test_what_cannot_be_sent_is_done_without(tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(
        COUNTING.replace("return 0", "return [0, lambda: 0]")
        .replace("memory + 1", "memory")
        .replace("0.05 * memory", "0.05")
    )
    session = stepped(begun(Law(f"{path}:Counting")), 10)
    record = record_of(session)
    assert len(record) == 11
    assert record.session == {"repeatable": False}


def test_a_comparison_whose_robots_failed_at_different_places_is_whole(tmp_path: Path) -> None:
    session = stepped(begun(RAPF, LLOYD), 30)
    session.fail_robot(1)
    stepped(session, 20)
    stream, folder = io.BytesIO(), tmp_path / "saved"
    folder.mkdir()
    tell(stream, wanted_of(session, folder, 16))
    stream.seek(0)
    assert kept(stream) == Kept(())
    one, two = load_saved(folder)
    assert one.record.environment != two.record.environment
    assert roster_of(one.record).environment.obstacles == roster_of(two.record).environment.obstacles
    run = json.loads((folder / "lloyd" / "run.json").read_text())
    assert run["map"]["obstacles"][-1]["name"] == "failed robot 1"
    assert run["session"]["failed"] == {"1": run["map"]["obstacles"][-1]["center"]}
    assert run["summary"]["mean_distance_m"] == two.history.mean_distance[-1]


def test_a_session_keeps_its_history() -> None:
    """Saving takes moments, it does not take them away."""
    session = stepped(begun(), 20)
    before = session.history.since(0)
    record_of(session)
    assert all(a is b for a, b in zip(session.history.since(0), before, strict=True))
    assert isinstance(session.history, History)
