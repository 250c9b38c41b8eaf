"""`robocov run` and `robocov compare`: files, printed results and earlier results."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from command_calls import SHORT, read_error, read_json

from robocov.controllers import CONTROLLERS, get_gains
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.commands import options

FILES = "run.json record.npz cost.csv trajectories.png trajectories.svg cost.png cost.svg".split()


def test_run_saves_all_files_and_prints_the_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    arguments = "--frames --video --fps 10 --video-speed 1 --out".split()
    assert main(["run", "rooms", *SHORT, *arguments, str(out)]) == 0
    output = capsys.readouterr()
    assert str(out) in output.out
    assert "mean distance" in output.out
    names = sorted(path.name for path in out.glob("[!.]*"))
    assert names == sorted([*FILES, "frames", "run.mp4"])
    frames = sorted(path.name for path in (out / "frames").iterdir())
    assert frames == [f"{k:06d}.png" for k in range(len(frames))]
    assert len(frames) == 11 + 10, "ten frames of the run and one second of the last frame"
    header, *rows = (out / "cost.csv").read_text().splitlines()
    assert header == "time_s,mean_distance_m,cost_m3,uncovered_area_m2"
    assert len(rows) == 11
    run = json.loads((out / "run.json").read_text())
    assert run["summary"]["mean_distance_m"] == float(rows[-1].split(",")[1])
    gains = {gain.name: gain.default for gain in get_gains(CONTROLLERS["rapf"]).values()}
    assert run["controller"] == {"name": "rapf", "gains": gains}
    assert len(Record.load(out)) == 61


@pytest.mark.usefixtures("no_figures")
def test_run_prints_only_json_on_request(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    summary = read_json(capsys, "run", "square", *SHORT, "--out", str(tmp_path / "run"))
    assert {"out", "mean_distance_m", "cost_m3", "settled_at_s", "contacts", "min_clearance_m"} <= set(
        summary
    )
    assert summary["settled_at_s"] is None
    assert summary["interrupted"] is False


def test_a_single_robot_is_counted_in_the_singular(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = "--robots 1 --duration 0.2 --lattice 16 --no-figures --out"
    assert main(["run", "square", *options.split(), str(tmp_path / "run")]) == 0
    assert "on Square, 1 robot, 0.2 s" in capsys.readouterr().out


def test_a_run_without_figures_saves_its_numbers(tmp_path: Path) -> None:
    out = tmp_path / "run"
    options = "--duration 0.2 --lattice 16 --no-figures --out"
    assert main(["run", "square", *options.split(), str(out)]) == 0
    assert {file.name for file in out.iterdir()} == {".robocov.json", "run.json", "record.npz", "cost.csv"}


def test_only_runs_with_stuck_robots_mention_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = "--controller lloyd --robots 3 --lattice 16 --no-figures --out".split()
    assert main(["run", "trap", "--duration", "15", *options, str(tmp_path / "stuck")]) == 0
    count = json.loads((tmp_path / "stuck" / "run.json").read_text())["summary"]["stuck_robots"]
    assert count > 0
    assert f"stuck robots    {count}   (at rest away from their goals)" in capsys.readouterr().out
    assert main(["run", "square", "--duration", "1", *options, str(tmp_path / "moving")]) == 0
    assert "stuck robots" not in capsys.readouterr().out


@pytest.mark.slow
def test_the_same_command_gives_the_same_bytes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("one", "two"):
        read_json(capsys, "run", "rooms", *SHORT, "--seed", "5", "--out", str(tmp_path / name))
    for file in FILES:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes(), file


def test_compare_gives_every_controller_the_same_starts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "compare"
    rows = read_json(
        capsys, "compare", "rooms", *SHORT, "--set", "k_rep=1", "rpf.k_rep=2", "--video", "--out", str(out)
    )
    assert [row["controller"] for row in rows["runs"]] == ["rapf", "rpf", "lloyd"]
    assert [row["gains"].get("k_rep") for row in rows["runs"]] == [1.0, 2.0, None]
    assert min(row["above_best"] for row in rows["runs"]) == 0.0
    records = [Record.load(out / name) for name in ("rapf", "rpf", "lloyd")]
    assert all((record.positions[0] == records[0].positions[0]).all() for record in records)
    names = {path.name for path in out.iterdir()}
    assert {"comparison.json", "comparison.csv", "comparison.mp4", "cost.svg", "trajectories.png"} <= names
    assert len((out / "comparison.csv").read_text().splitlines()) == 4


@pytest.mark.usefixtures("no_figures")
def test_overwrite_removes_only_the_earlier_result(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    read_json(capsys, "run", "square", *SHORT, "--frames", "--out", str(out))
    own_files = [out / name for name in ("notes.txt", ".x.part.zip", "frames/2024-holiday.png")]
    for path in own_files:
        path.write_text("mine")
    read_json(capsys, "metrics", str(out))
    assert "not empty" in read_error(capsys, "run", "square", *SHORT, "--out", str(out))
    read_json(capsys, "run", "square", *SHORT, "--out", str(out), "--overwrite")
    assert [path.read_text() for path in own_files] == ["mine"] * 3
    assert list((out / "frames").iterdir()) == [own_files[2]]
    assert not (out / "metrics.csv").exists(), "the metrics belonged to the overwritten run"


@pytest.mark.skipif(os.name == "nt", reason="links of POSIX")
@pytest.mark.usefixtures("no_figures")
def test_the_earlier_result_stays_if_the_new_one_cannot_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    elsewhere = tmp_path / "elsewhere"
    arguments = ("run", "square", *SHORT, "--video", "--frames", "--out", str(out), "--overwrite")
    read_json(capsys, "run", "square", *SHORT, "--out", str(out))
    elsewhere.mkdir()
    before = (out / "run.json").read_bytes()
    (out / "run.mp4").mkdir()
    assert "run.mp4: is in the way" in read_error(capsys, *arguments)
    (out / "run.mp4").rmdir()
    (out / "frames").symlink_to(elsewhere)
    assert "frames: is a link, which is not followed" in read_error(capsys, *arguments)
    assert (out / "run.json").read_bytes() == before
    assert list(elsewhere.iterdir()) == []


@pytest.mark.usefixtures("no_figures")
def test_a_comparison_never_refers_to_folders_outside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    read_json(capsys, "run", "square", *SHORT, "--out", str(tmp_path / "run"))
    inner = tmp_path / "run" / "inner"
    inner.mkdir()
    (inner / "comparison.json").write_text(
        '{"format": "robocov-comparison", "version": 1, "folders": [".."]}'
    )
    assert "folders[0]: expected the name of a folder" in read_error(capsys, "metrics", str(inner))
    read_json(capsys, "run", "square", *SHORT, "--out", str(inner), "--overwrite")
    assert len(Record.load(tmp_path / "run")) == len(Record.load(inner)) == 61
    (inner / "comparison.json").write_text(
        '{"format": "robocov-comparison", "version": 1, "folders": ["on"]}'
    )
    (inner / "on").symlink_to(tmp_path / "run")
    assert "on: expected a subfolder of the comparison, got a symbolic link" in read_error(
        capsys, "metrics", str(inner)
    )


@pytest.mark.usefixtures("no_figures")
def test_a_custom_controller_can_be_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text(
        "from dataclasses import dataclass\n"
        "@dataclass(frozen=True)\n"
        "class Mine:\n"
        "    pull: float = 0.5\n"
        "    def force(self, own):\n"
        "        return self.pull * (own.centroid - own.position)\n"
    )
    out = tmp_path / "run"
    read_json(
        capsys, "run", "square", *SHORT, "--controller", f"{mine}:Mine", "--set", "pull=2", "--out", str(out)
    )
    record = Record.load(out)
    assert record.controller == f"{mine}:Mine", "the run can be repeated from its record"
    assert record.label == "Mine"
    assert record.gains == {"pull": 2.0}
    assert not np.isnan(record.goals).any()


@pytest.mark.parametrize(
    ("body", "part"),
    [
        (
            "def __post_init__(self): raise ValueError('no')",
            "'Mine' cannot be created: ValueError: no (mine.py, line 7)",
        ),
        (
            "def __post_init__(self): exit(0)",
            "cannot be created: it tried to terminate Python by raising SystemExit: 0 (mine.py, line 7)",
        ),
        (
            "def __post_init__(self): raise TypeError('no')",
            "'Mine' cannot be created: TypeError: no (mine.py, line 7)",
        ),
        (
            "def __init__(self): 1 / 0",
            "'Mine' cannot be created: ZeroDivisionError: division by zero (mine.py, line 7)",
        ),
        ("k: float", "'Mine' cannot be created: TypeError: "),
        (
            "k: list = []",
            "mine.py cannot be run: ValueError: mutable default <class 'list'> for field k is not",
        ),
        ("k: float = float('inf')", "mine.py:Mine': k: expected a finite number, got inf"),
        (
            "label = property(lambda self: 1 / 0)",
            "your own: ZeroDivisionError: division by zero (mine.py, line 7)",
        ),
        (
            "scanning = property(lambda self: 1 / 0)",
            "'Mine': ZeroDivisionError: division by zero (mine.py, line 7)",
        ),
        ("scanning = 5", "controller 'Mine': scanning: expected a Scanning, got 5"),
        (
            "def begin(self, region, team): exit(1)",
            "'Mine': it tried to terminate Python by raising SystemExit: 1 (mine.py, line 7) at 0.000 s",
        ),
        (
            "def decide(self, seen, memory): return 3",
            "controller 'Mine': decide(observations, memory) returned 3 at 0.000 s (mine.py, line 7)",
        ),
    ],
)
def test_an_invalid_controller_class_is_reported_with_its_line(
    body: str, part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine.py"
    out = tmp_path / "run"
    base = "class Base:\n def begin(self, region, team): pass\n def decide(self, seen, memory): pass\n"
    head = "from dataclasses import dataclass\n@dataclass(frozen=True)\nclass Mine(Base):\n"
    mine.write_text(f"{base}{head}    {body}\n")
    arguments = ("run", "square", *SHORT, "--json", "--controller", f"{mine}:Mine", "--out", str(out))
    assert part in read_error(capsys, *arguments, status=1 if "terminate Python" in part else 2)
    assert not out.exists()


def test_a_traceback_is_shown_on_request(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROBOCOV_TRACEBACK", "1")
    assert main(["run", "square", "--set", "k_rap=1"]) == 2
    output = capsys.readouterr().err
    assert output.startswith("Traceback")
    assert output.splitlines()[-1].startswith("robocov: error: rapf: unknown gain")


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("9" * 5000, "--set k_rep: expected a number (or null), or a word, got '99999"),
        ("9" * 4000, "rapf.k_rep: expected a number from"),
        ("[" * 100_000, "--set k_rep: expected a number (or null), or a word, got '[[["),
        ("[" * 9 + "]" * 9, "rapf.k_rep: expected a number from"),
        ("NaN", "rapf.k_rep: expected a number from"),
        ("-Infinity", "rapf.k_rep: expected a number from"),
        ("1e999", "rapf.k_rep: expected a number from"),
        ('{"a": 1}', "rapf.k_rep: expected a number from"),
        ("", "--set k_rep: expected a number (or null), or a word, got ''"),
    ],
    ids=range(9),
)
def test_an_invalid_value_of_a_gain_is_rejected_in_a_short_line(
    value: str, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    message = read_error(capsys, "run", "square", "--set", f"k_rep={value}")
    assert message.startswith(expected)
    assert len(message) < 200


@pytest.mark.parametrize(
    ("body", "part"),
    [
        (
            "return 1 / 0",
            "controller 'Mine': ZeroDivisionError: division by zero (mine.py, line 5) for robot 1 at 0.000 s",
        ),
        (
            "return [1.0]",
            "controller 'Mine': force(own) returned [1.0] for robot 1 at 0.000 s (mine.py, line 4)",
        ),
        (
            "return None",
            "controller 'Mine': force(own) returned None (is a return statement missing?) for robot 1",
        ),
        (
            "raise SystemExit(0)",
            "controller 'Mine': it tried to terminate Python by raising SystemExit: 0 (mine.py, line 5)",
        ),
        (
            "return [float('nan'), 0]",
            "controller 'Mine': force(own) returned [nan, 0] for robot 1 at 0.000 s",
        ),
        ("return 'east'", "controller 'Mine': force(own) returned 'east' for robot 1"),
        ("return [1j, 0]", "controller 'Mine': force(own) returned [1j, 0] for robot 1"),
    ],
)
def test_a_failing_controller_is_reported_with_its_line(
    body: str, part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text(
        "from dataclasses import dataclass\n"
        "@dataclass(frozen=True)\n"
        "class Mine:\n"
        "    def force(self, own):\n"
        f"        {body}\n"
    )
    out = tmp_path / "run"
    arguments = ("run", "square", *SHORT, "--json", "--controller", f"{mine}:Mine", "--out", str(out))
    assert part in read_error(capsys, *arguments, status=1 if "terminate Python" in part else 2)
    assert not out.exists(), "no empty folder is left behind"


@pytest.mark.slow
@pytest.mark.usefixtures("no_figures")
def test_records_contain_fewer_steps_at_a_lower_rate_or_of_large_teams(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = ["run", "rooms", "--robots", "3", "--duration", "0.5", "--lattice", "16"]
    assert main([*arguments, "--out", str(tmp_path / "every-step")]) == 0
    assert "the record" not in capsys.readouterr().out
    assert main([*arguments, "--record-hz", "20", "--out", str(tmp_path / "at-20-hz")]) == 0
    assert "the record has one step in 3" in capsys.readouterr().out
    monkeypatch.setattr(options, "MAX_DEFAULT_RECORD_ROWS", 30.0)
    assert main([*arguments, "--out", str(tmp_path / "large-team")]) == 0
    whole = Record.load(tmp_path / "every-step")
    at_lower_rate = Record.load(tmp_path / "at-20-hz")
    of_large_team = Record.load(tmp_path / "large-team")
    assert [len(each.time) for each in (whole, at_lower_rate, of_large_team)] == [31, 11, 11]
    for thin in (at_lower_rate, of_large_team):
        np.testing.assert_array_equal(thin.positions, whole.positions[::3])
        np.testing.assert_array_equal(thin.time, whole.time[::3])
