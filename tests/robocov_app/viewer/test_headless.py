"""Saved sessions that are replayed without a window: `robocov run SESSION.robocov`."""

from __future__ import annotations

import errno
import json
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sample_sessions import HALL, LLOYD, RAPF, advance_session, advance_with_costs, start_session
from session_records import build_record, have_same_arrays, select_present_branch

from robocov.cost import CoverageCost, TimeVaryingCost
from robocov.environment import CircleObstacle, ObstaclePath
from robocov.errors import OutputError, ParameterError
from robocov.metrics import compute_path_lengths
from robocov.metrics.results import read_history
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.runs.settings import VideoSettings
from robocov_app.viewer.branch_output.parts import split_branch
from robocov_app.viewer.branch_output.video import count_video_frames, draw_branch_frames
from robocov_app.viewer.session.editing.edits import PlaceRobot
from robocov_app.viewer.session.editing.map_edits import add_obstacle
from robocov_app.viewer.session.files.run_saver import RunSaver
from robocov_app.viewer.session.files.session_file import load_session, save_session
from robocov_app.viewer.session.session import Session

SMALL = ["--lattice", "16", "--size", "320x240"]


def save_session_file(session: Session, folder: Path) -> str:
    session.timeline.cache_present()
    path = folder / "session.robocov"
    save_session(path, session.timeline.document, session.timeline.head, session.timeline.step, {})
    return str(path)


def build_branched_session() -> Session:
    """Build a session in which a robot fails; in another branch a circle is drawn and a robot joins."""
    session = advance_session(start_session(RAPF, LLOYD), 12)
    session.fail_robot(2)
    advance_session(session, 12)
    session.undo()
    session.edit_map(add_obstacle(HALL, CircleObstacle((1.5, 3.0), 0.3)), "circle drawn")
    advance_session(session, 12).add_robot((5.0, 3.0))
    return advance_session(session, 12)


def test_a_session_without_edits_is_saved_byte_for_byte_like_a_run(tmp_path: Path) -> None:
    from robocov.mapfile import load_map

    session = advance_session(start_session(RAPF, environment=load_map("rooms"), robots=6), 30)
    plain = ["run", "rooms", "--duration", "0.5", *SMALL, "--out", str(tmp_path / "run")]
    assert main(plain) == 0
    assert (
        main(["run", save_session_file(session, tmp_path), *SMALL, "--out", str(tmp_path / "replayed")]) == 0
    )
    for name in ("run.json", "record.npz", "cost.csv", "trajectories.png", "cost.svg"):
        assert (tmp_path / "replayed" / name).read_bytes() == (tmp_path / "run" / name).read_bytes(), name
    assert (tmp_path / "replayed" / "session.robocov").is_file()


@pytest.mark.slow
def test_a_branch_is_saved_with_its_parts_costs_and_video(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    session = build_branched_session()
    out = tmp_path / "out"
    command = ["run", save_session_file(session, tmp_path), *SMALL, "--out", str(out), "--video", "--json"]
    assert main([*command, "--fps", "10", "--video-speed", "1"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [part["description"] for part in answer["parts"]] == ["started", "circle drawn", "robot 4 joined"]
    assert [part["from_s"] for part in answer["parts"]] == pytest.approx([0.0, 0.2, 0.4])
    last = Record.load(out / "03-robot-4-joined" / "lloyd")
    np.testing.assert_array_equal(last.positions[-1], session.timeline.panes[1].simulation.positions)
    assert len(last.team) == 4
    assert last.session["began_at_s"] == pytest.approx(0.4)
    rows = (out / "cost.csv").read_text().splitlines()
    assert rows[0].startswith("controller,time_s,")
    assert {row.split(",")[0] for row in rows[1:]} == {"rapf", "lloyd"}
    assert (out / "comparison.mp4").stat().st_size > 1000
    assert load_session(out / "session.robocov").step == session.timeline.step


def test_branches_without_a_name_are_not_found_by_an_empty_name() -> None:
    document = build_branched_session().timeline.document
    with pytest.raises(ParameterError, match=r"branch: expected one of 1 \(.*\), got ''"):
        document.find_branch("")


def test_a_branch_whose_name_is_the_number_of_another_one_is_found_by_its_name() -> None:
    document = build_branched_session().timeline.document
    first, *_, last = document.list_branches()
    assert document.find_branch("1").node is first.node
    last.node.name = "1"
    assert document.find_branch("1").node is last.node


@pytest.mark.slow
def test_each_branch_is_saved_in_its_own_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = save_session_file(build_branched_session(), tmp_path)
    assert main(["run", path, *SMALL, "--out", str(tmp_path / "all"), "--all-branches"]) == 0
    assert sorted(path.name for path in tmp_path.glob("all-*")) == ["all-1", "all-2"]
    assert main(["run", path, *SMALL, "--out", str(tmp_path / "one"), "--branch", "1"]) == 0
    assert (tmp_path / "one" / "02-robot-2-failed").is_dir()
    capsys.readouterr()
    assert main(["run", path, *SMALL, "--out", str(tmp_path / "no"), "--branch", "9"]) == 2
    assert (
        "branch: expected one of 1 (robot 2 failed), 2 (robot 4 joined), got '9'" in capsys.readouterr().err
    )
    assert not (tmp_path / "no").exists()


@pytest.mark.slow
def test_reports_contain_saved_branches_and_sessions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = save_session_file(build_branched_session(), tmp_path)
    assert main(["run", path, *SMALL, "--out", str(tmp_path / "branch")]) == 0
    assert main(["report", str(tmp_path / "branch")]) == 0
    page = (tmp_path / "branch" / "report.html").read_text()
    titles = ["0.0 to 0.2 s, started", "0.2 to 0.4 s, circle drawn", "0.4 to 0.6 s, robot 4 joined"]
    assert all(f" · {title}</h2>" in page for title in titles)
    capsys.readouterr()
    assert main(["report", path]) == 0
    assert capsys.readouterr().out.startswith(Path(path).stem)
    page = (tmp_path / "session.html").read_text()
    assert "0.2 to 0.4 s, robot 2 failed</h2>" in page
    assert titles[2] in page, "the report contains all branches"
    assert str(tmp_path) not in page
    assert "/robocov-" not in page, "the report contains no path of a temporary folder"
    branch_file = tmp_path / "branch" / "branch.json"
    former_text = branch_file.read_text().replace("robocov-branch", "robocov-story")
    branch_file.unlink()
    (tmp_path / "branch" / "story.json").write_text(former_text.replace('"description"', '"words"'))
    assert main(["report", str(tmp_path / "branch")]) == 0
    former_page = (tmp_path / "branch" / "report.html").read_text()
    assert all(f" · {title}</h2>" in former_page for title in titles), "the former file name is read"
    branch_file.write_text('{"format": "robocov-branch"}')
    capsys.readouterr()
    assert main(["report", str(tmp_path / "branch")]) == 2
    assert "branch.json: cannot be read" in capsys.readouterr().err


def test_a_video_has_a_legend_and_names_the_edits(tmp_path: Path) -> None:
    session = build_branched_session()
    settings = VideoSettings(size=(640, 360), fps=10, speed=1.0)
    branch = select_present_branch(session)
    frames = list(draw_branch_frames(branch, split_branch(branch), [], settings))
    assert {frame.shape for frame in frames} == {(360, 640, 3)}
    first = frames[0].astype(int)
    last = frames[-1].astype(int)
    header = first[:20]
    assert (header.min(axis=2) < 100).sum() > 100
    assert (header == last[:20]).all(), "all frames have the same legend"
    bottom = slice(360 - 14, 360)
    assert (first[bottom].min(axis=2) > 200).all(), "the first frame names no edit"
    assert (last[bottom].min(axis=2) < 100).sum() > 50


@pytest.mark.parametrize("speed", [1.0, 0.1])
def test_a_video_in_slow_motion_has_more_frames(speed: float) -> None:
    branch = select_present_branch(build_branched_session())
    settings = VideoSettings(size=(320, 180), fps=30, speed=speed)
    frames = list(draw_branch_frames(branch, split_branch(branch), [], settings))
    assert len(frames) == pytest.approx(count_video_frames(branch, settings), abs=1)


def test_a_drag_belongs_to_the_part_before_and_is_recorded_there() -> None:
    session = advance_session(start_session(RAPF), 6)
    session.playback.is_playing = True
    for k in range(6):
        session.drag_robot(2, (3.0 + 0.1 * k, 3.0))
        session.playback.advance(1 / 60)
    session.release()
    advance_session(session, 6)
    (part,) = split_branch(select_present_branch(session))
    record = build_record(session)
    assert part.first_step == 0
    assert len(record) == 19
    (drag,) = record.session["edits"]
    assert drag["robots"] == [2]
    assert drag["from_s"] == pytest.approx(0.1)
    assert record.session["repeatable"] is False
    assert have_same_arrays(record, build_record(session))


def test_cost_curves_are_saved_and_loaded(tmp_path: Path) -> None:
    session = start_session(RAPF)
    advance_with_costs(session, 200)
    session.fail_robot(1)
    advance_with_costs(session, 30)
    loaded = Session.open(load_session(Path(save_session_file(session, tmp_path))))
    curve = loaded.timeline.panes[0].distance_curve
    assert 30 < len(curve) <= 61
    assert curve.last_time == pytest.approx(229 / 60, abs=1e-3)
    assert curve.interpolate(2.0) == pytest.approx(1.0, abs=1e-3)


def test_replay_shows_a_session_from_its_beginning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from robocov_app.commands import replay

    path = save_session_file(build_branched_session(), tmp_path)
    opened = []
    monkeypatch.setattr(replay, "_open_window", lambda _, session, file: opened.append((session, file)) or 0)
    assert main(["replay", path]) == 0
    ((session, file),) = opened
    assert str(file) == path
    assert session.displayed.time == 0.0
    assert session.playback.is_playing
    for _ in range(60):
        session.playback.advance(1 / 60)
    assert session.timeline.is_at_record_end
    assert not session.playback.is_playing, "the playback stops at the end of the record"
    assert main(["replay", path, "--video", "--out", str(tmp_path / "film")]) == 2


@pytest.mark.slow
def test_moving_obstacles_of_a_later_part_start_where_they_are_then(tmp_path: Path) -> None:
    # At the start of the second part, the pillar covers the start "corner".
    path = ObstaclePath(((4.2, 1.2), (1.2, 1.2)), 8.0, "back-and-forth")
    pillar = CircleObstacle((4.2, 1.2), 0.9, "pillar", path)
    hall = replace(HALL, obstacles=(pillar, HALL.obstacles[1]))
    session = advance_session(start_session(RAPF, environment=hall, start="far", robots=2), 22)
    session.add_robot((5.0, 3.6))
    advance_session(session, 30)
    start_time = 22 / 60
    file = save_session_file(session, tmp_path)
    assert main(["run", file, *SMALL, "--out", str(tmp_path / "out")]) == 0
    record = Record.load(tmp_path / "out" / "02-robot-3-joined")
    environment = record.environment
    assert set(environment.starts) == {"far", "spread"}
    for time in (0.0, 0.2, 0.5):
        moved = environment.at(time).obstacles[0].polygon
        expected = hall.at(start_time + time).obstacles[0].polygon
        np.testing.assert_allclose(moved.bounds, expected.bounds, atol=1e-8)
    assert record.session["repeatable"] is False
    history = read_history(tmp_path / "out" / "02-robot-3-joined" / "cost.csv")
    cost = TimeVaryingCost(CoverageCost(hall, 16, radius=record.team.min_radius))
    for index in (0, -1):
        result = cost(start_time + history.time[index], record.positions[index])
        assert history.mean_distance[index] == pytest.approx(result.mean_distance, abs=1e-4)


@pytest.mark.slow
def test_a_run_is_saved_by_another_process_without_temporary_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    temporary_folder = tmp_path / "temporary"
    temporary_folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary_folder))
    saver = RunSaver(16)
    message = saver.save(build_branched_session(), tmp_path)
    assert message == f"saving the run: {tmp_path / 'hall-comparison-1'}/"
    assert saver.poll() == []
    saver.finish()
    ((message, is_error),) = saver.poll()
    assert message.startswith("run saved: ")
    assert not is_error
    assert (tmp_path / "hall-comparison-1" / "session.robocov").is_file()
    assert not list(temporary_folder.iterdir())


def raise_memory_error(*arguments: object, **options: object) -> None:
    raise OSError(errno.ENOMEM, "Cannot allocate memory")


def raise_full_disk(*arguments: object, **options: object) -> None:
    raise OutputError("session.robocov: cannot be written: No space left on device")


@pytest.mark.parametrize(
    ("name", "fail", "expected"),
    [
        ("subprocess.Popen", raise_memory_error, "the run cannot be saved: Cannot allocate memory"),
        ("tempfile.TemporaryDirectory", raise_memory_error, "the run cannot be saved: Cannot allocate"),
        ("save_session", raise_full_disk, "session.robocov: cannot be written"),
    ],
)
def test_a_run_that_cannot_be_saved_leaves_no_folder(
    name: str,
    fail: Callable[..., None],
    expected: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    temporary_folder = tmp_path / "temporary"
    temporary_folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary_folder))
    monkeypatch.setattr(f"robocov_app.viewer.session.files.run_saver.{name}", fail)
    saver = RunSaver(16)
    with pytest.raises(OutputError, match=expected):
        saver.save(start_session(RAPF), tmp_path / "runs")
    assert not list((tmp_path / "runs").iterdir())
    assert not list(temporary_folder.iterdir())
    saver.finish()
    assert saver.poll() == []


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_the_message_says_that_the_process_of_a_run_was_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start_process = subprocess.Popen

    def start_and_kill(command: list[str], **options: Any) -> subprocess.Popen[bytes]:
        process = start_process([sys.executable, "-c", "import time; time.sleep(60)"], **options)
        process.send_signal(signal.SIGKILL)
        return process

    monkeypatch.setattr("robocov_app.viewer.session.files.run_saver.subprocess.Popen", start_and_kill)
    saver = RunSaver(16)
    saver.save(start_session(RAPF), tmp_path)
    saver.finish()
    target = tmp_path / "hall-rapf-1"
    reason = "the process has ended: killed by signal 9 (SIGKILL)"
    assert saver.poll() == [(f"run not saved: {target}/: {reason}", True)]
    assert not target.exists()


def test_a_run_that_is_still_being_saved_after_the_first_one_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    start_process = subprocess.Popen
    processes: list[subprocess.Popen[bytes]] = []

    def start_quick_and_then_slow_process(command: list[str], **options: Any) -> subprocess.Popen[bytes]:
        seconds = len(processes)
        process = start_process([sys.executable, "-c", f"import time; time.sleep({seconds})"], **options)
        processes.append(process)
        return process

    module = "robocov_app.viewer.session.files.run_saver"
    monkeypatch.setattr(f"{module}.subprocess.Popen", start_quick_and_then_slow_process)
    monkeypatch.setattr(f"{module}.FIRST_WAIT_S", 0.05)
    saver = RunSaver(16)
    for _ in range(2):
        saver.save(start_session(RAPF), tmp_path)
    processes[0].wait()
    saver.finish()
    assert capsys.readouterr().err == "saving runs; press Ctrl+C to cancel\n"


def test_the_path_length_excludes_placing_a_robot() -> None:
    session = advance_session(start_session(RAPF), 12)
    session.apply(PlaceRobot(2, (5.0, 3.0)), "hand", "robot 2 placed")
    advance_session(session, 12)
    record = build_record(session)
    assert len(record) == 25
    (placed,) = record.session["placements"]
    assert placed["robots"] == [2]
    assert placed["time_s"] == pytest.approx(0.2)
    steps = np.diff(record.positions[:, 1], axis=0)
    jump = np.linalg.norm(steps, axis=1)
    assert jump.max() > 1.0
    assert compute_path_lengths(record.positions, record.traveled)[1] < 0.5
