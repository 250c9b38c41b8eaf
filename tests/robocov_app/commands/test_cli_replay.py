"""`robocov replay`: frames and videos, windows, and rejected folders."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_calls import read_error, read_json
from PIL import Image
from sample_sessions import HALL, LLOYD, RAPF, RPF, advance_session, start_session
from session_records import build_records

from robocov_app.cli import main
from robocov_app.runs.artifacts import start_comparison
from robocov_app.terminal.output import write_csv
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.window.window import ViewerWindow

EMPTY = replace(HALL, obstacles=())
SMALL = ("--size", "480x320", "--fps", "10", "--video-speed", "1")


@pytest.fixture(autouse=True)
def no_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """Close windows immediately that open by mistake."""
    monkeypatch.setattr(ViewerWindow, "run", ViewerWindow.close)


def write_history(folder: Path) -> None:
    rows = [(0.1 * k, 3.0 - 0.1 * k, 40.0 - k, 0.0) for k in range(11)]
    write_csv(folder / "cost.csv", "time_s,mean_distance_m,cost_m3,uncovered_area_m2", rows)


@pytest.fixture(scope="module")
def saved_results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a run, and with a comparison in which a robot failed."""
    folder = tmp_path_factory.mktemp("saved")
    (record,) = build_records(advance_session(start_session(), 60))
    (folder / "run").mkdir()
    record.save(folder / "run")
    write_history(folder / "run")
    session = advance_session(start_session(RPF, LLOYD), 30)
    session.fail_robot(1)
    names = ["rpf", "lloyd"]
    (folder / "both").mkdir()
    start_comparison(folder / "both", names)
    for name, each in zip(names, build_records(advance_session(session, 60)), strict=True):
        (folder / "both" / name).mkdir()
        each.save(folder / "both" / name)
    write_history(folder / "both" / "lloyd")
    return folder


@pytest.fixture
def run(saved_results: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(saved_results / "run", tmp_path / "run"))


@pytest.fixture
def both(saved_results: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(saved_results / "both", tmp_path / "both"))


def read_frames(folder: Path) -> list[np.ndarray]:
    return [np.asarray(Image.open(path)) for path in sorted((folder / "frames").iterdir())]


# Frames and videos


def test_frames_and_a_video_of_a_run_are_saved(saved_results: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "video"
    assert main(["replay", str(saved_results / "run"), "--frames", "--video", *SMALL, "--out", str(out)]) == 0
    printed = capsys.readouterr()
    assert printed.out == f"saved in {out}/: frames, replay.json, run.mp4\n"
    assert "video: 21 of 21" in printed.err
    frames = read_frames(out)
    assert len(frames) == 11 + 10
    assert frames[0].shape == (320, 480, 3)
    assert (frames[0] != frames[10]).any()
    assert (frames[10] == frames[20]).all()
    assert (out / "run.mp4").stat().st_size > 1000


def test_a_comparison_is_shown_side_by_side_with_distances(
    saved_results: Path, tmp_path: Path, capsys
) -> None:
    """Both runs share one map, although a robot failed at different positions."""
    out = tmp_path / "video"
    arguments = ("--frames", *SMALL, "--show", "distances", "--fps", "5", "--theme", "dark")
    printed = read_json(capsys, "replay", str(saved_results / "both"), *arguments, "--out", str(out))
    assert printed == {"out": str(out), "interrupted": False}
    frames = read_frames(out)
    assert len(frames) == 6 + 5
    left, right = np.array_split(frames[5].astype(int), 2, axis=1)
    assert (left != right).mean() > 0.05


def test_a_run_can_be_given_by_its_json_file(saved_results: Path, tmp_path: Path, capsys) -> None:
    for name, source in (("one", "run/run.json"), ("two", "both/comparison.json")):
        arguments = ("--frames", *SMALL, "--fps", "1", "--out", str(tmp_path / name))
        read_json(capsys, "replay", str(saved_results / source), *arguments)
        assert len(read_frames(tmp_path / name)) == 3


def test_an_earlier_video_is_replaced_only_with_overwrite(
    saved_results: Path, tmp_path: Path, capsys
) -> None:
    out = tmp_path / "video"
    arguments = ("replay", str(saved_results / "run"), "--frames", *SMALL, "--fps", "2", "--out", str(out))
    read_json(capsys, *arguments)
    (out / "notes.txt").write_text("mine")
    assert "is not empty" in read_error(capsys, *arguments)
    read_json(capsys, *arguments, "--overwrite", "--video-speed", "4")
    assert len(read_frames(out)) == 2 + 2
    assert (out / "notes.txt").read_text() == "mine"


def test_frames_are_never_saved_in_the_folder_of_the_run(run: Path, both: Path, capsys) -> None:
    for source, out in ((run, run), (run, run.parent), (both, both / "lloyd"), (both / "lloyd", both)):
        arguments = ("--frames", *SMALL, "--overwrite", "--out", str(out))
        assert read_error(capsys, "replay", str(source), *arguments).endswith(
            "expected a folder that does not contain the run"
        )
    assert (run / "record.npz").exists()
    assert (both / "lloyd" / "record.npz").exists()


def test_runs_of_different_lengths_can_be_rendered_but_not_opened(both: Path, tmp_path: Path, capsys) -> None:
    (short_record,) = build_records(advance_session(start_session(RPF), 30))
    (whole_record,) = build_records(advance_session(start_session(LLOYD), 60))
    short_record.save(both / "rpf")
    whole_record.save(both / "lloyd")
    read_json(capsys, "replay", str(both), "--frames", *SMALL, "--fps", "2", "--out", str(tmp_path / "video"))
    assert len(read_frames(tmp_path / "video")) == 3 + 2
    assert read_error(capsys, "replay", str(both)) == (
        f"{both}/lloyd: states: expected 31 as in {both}/rpf, got 61; --frames and --video show both"
    )


def test_the_finished_runs_of_a_killed_comparison_can_be_replayed(both: Path, tmp_path: Path, capsys) -> None:
    shutil.rmtree(both / "lloyd")
    read_json(capsys, "replay", str(both), "--frames", *SMALL, "--fps", "1", "--out", str(tmp_path / "video"))
    assert len(read_frames(tmp_path / "video")) == 3


# Windows


@pytest.fixture
def opened_sessions(monkeypatch: pytest.MonkeyPatch) -> list[Session]:
    """Collect the sessions of windows, which close after ten frames on a dummy display."""
    sessions: list[Session] = []

    def run(window: ViewerWindow) -> None:
        for _ in range(10):
            window.run_frame(1 / 30)
        sessions.append(window.viewer.session)
        window.close()

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("ROBOCOV_SETTINGS", "")
    monkeypatch.setattr(ViewerWindow, "run", run)
    return sessions


def test_the_window_shows_a_run(run: Path, opened_sessions: list[Session]) -> None:
    assert main(["replay", str(run), "--size", "900x600", "--theme", "dark", "--hide", "cells"]) == 0
    (session,) = opened_sessions
    assert 0.0 < session.displayed.time < session.timeline.end_time == 1.0
    assert len(session.timeline.panes[0].distance_curve) == 11


def test_the_window_shows_a_comparison(both: Path, opened_sessions: list[Session]) -> None:
    assert main(["replay", str(both), "--size", "900x600"]) == 0
    (session,) = opened_sessions
    assert [pane.controller.name for pane in session.timeline.panes] == ["rpf", "lloyd"]
    assert session.displayed.numbers == (2, 3)
    assert len(session.timeline.panes[1].distance_curve) == 11


@pytest.mark.skipif("sys.platform != 'linux'", reason="other systems always have a display")
def test_without_a_display_alternatives_are_suggested(run: Path, monkeypatch, capsys) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    printed = read_error(capsys, "replay", str(run))
    assert printed.startswith(
        "no display: the window needs one. Add --serve to use it in a browser, or try ssh -X over ssh. "
    )


# Invalid options and damaged results


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--frames", "--out: expected a folder for the frames and the video"),
        ("--out video", "--out: requires --frames or --video"),
        ("--json", "--json: requires --frames or --video"),
        (
            "--frames --out video --controller a.py:A",
            "--controller: cannot be combined with --frames or --video",
        ),
        ("--controller gone.py:Mine", "gone.py: no such file"),
        ("--controller lloyd", "--controller: expected the controller of a run (rapf), got lloyd"),
        ("--size 480x320", "--size: expected a number from 900 to 7680 pixels wide, got 480"),
        ("--frames --out video --fps 0", "--fps: expected a number from 1 to 240, got 0"),
        ("--frames --out video --show cell", "--show: unknown layer 'cell'"),
    ],
)
def test_inapplicable_options_are_rejected(run: Path, capsys, arguments: str, message: str) -> None:
    assert read_error(capsys, "replay", str(run), *arguments.split()).startswith(message)


def edit_json(path: Path, **changes) -> None:
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))


def edit_arrays(folder: Path, **changes) -> None:
    with np.load(folder / "record.npz") as arrays:
        content = {**arrays, **changes}
    np.savez(folder / "record.npz", **content)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (shutil.rmtree, "{run}: expected the folder of a run or comparison, got a path that does not exist"),
        (lambda run: (run / "run.json").write_text("{"), "{run}/run.json:1:2: end of file: not JSON: "),
        (
            lambda run: (run / "record.npz").unlink(),
            "{run}: expected the folder of a run, got a folder without record.npz",
        ),
        (
            lambda run: edit_json(run / "run.json", session=[1]),
            "{run}/run.json: session: expected an object, got [1]",
        ),
        (
            lambda run: edit_arrays(run, time=np.zeros(61)),
            "{run}/record.npz: time: expected ascending numbers",
        ),
        (
            lambda run: edit_arrays(run, velocities=np.full((61, 3, 2), np.nan)),
            "{run}/record.npz: velocities: expected finite numbers up to 1e+300, got nan",
        ),
        (
            lambda run: edit_arrays(
                run,
                time=np.zeros(0),
                **{
                    name: np.zeros((0, 3, 2))
                    for name in "positions velocities forces goals obstacle_points".split()
                },
            ),
            "{run}/record.npz: time: expected shape (T,) of float64, got (0,)",
        ),
        (
            lambda run: (run / "cost.csv").write_text("t,J\n"),
            "{run}/cost.csv: line 1: expected the header time_s,mean_distance_m,cost_m3,uncovered_area_m2",
        ),
        (
            lambda run: (run / "cost.csv").write_text(
                "time_s,mean_distance_m,cost_m3,uncovered_area_m2\n0,1,2,3\n1,2,3\n"
            ),
            "{run}/cost.csv: line 3: expected 4 numbers, got '1,2,3'",
        ),
        (
            lambda run: (run / "cost.csv").write_text(
                "time_s,mean_distance_m,cost_m3,uncovered_area_m2\n7\n"
            ),
            "{run}/cost.csv: line 2: expected 4 numbers, got '7'",
        ),
        (lambda run: (run / "cost.csv").write_bytes(b"\xff\xfe"), "{run}/cost.csv: cannot be read"),
        (
            lambda run: edit_json(run / "run.json", dt_s=0.1),
            "{run}/record.npz: time: expected times 0.1 s apart",
        ),
    ],
)
def test_a_damaged_run_is_rejected_in_one_line(run: Path, capsys, damage, message: str) -> None:
    damage(run)
    assert read_error(capsys, "replay", str(run)).startswith(message.format(run=run))


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (
            lambda both: (both / "comparison.json").write_text("["),
            "{both}/comparison.json:1:2: end of file: not JSON: ",
        ),
        (
            lambda both: (both / "comparison.json").write_text("[]"),
            "{both}/comparison.json: expected a JSON object with a comparison, got []",
        ),
        (
            lambda both: edit_json(both / "comparison.json", folders=["rpf", "../run"]),
            '{both}/comparison.json: folders[1]: expected the name of a folder, got "../run"',
        ),
        (
            lambda both: edit_json(both / "comparison.json", folders=[".."]),
            '{both}/comparison.json: folders[0]: expected the name of a folder, got ".."',
        ),
        (
            lambda both: edit_json(both / "comparison.json", version=99),
            "{both}/comparison.json: version: expected 1, got 99; it was written by a newer robocov",
        ),
        (
            lambda both: edit_json(both / "comparison.json", folders=["gone"]),
            "{both}/comparison.json: expected at least one run, got none",
        ),
        (
            lambda both: edit_json(both / "comparison.json", folders=["gone"], runs=[{}]),
            "{both}/gone: expected the folder of a run, got a path that does not exist",
        ),
        (
            lambda both: build_records(advance_session(start_session(RAPF, environment=EMPTY), 60))[0].save(
                both / "lloyd"
            ),
            "{both}/lloyd/run.json: expected the same map as in {both}/rpf",
        ),
    ],
)
def test_a_damaged_comparison_is_rejected_in_one_line(both: Path, capsys, damage, message: str) -> None:
    damage(both)
    assert read_error(capsys, "replay", str(both)).startswith(message.format(both=both))
