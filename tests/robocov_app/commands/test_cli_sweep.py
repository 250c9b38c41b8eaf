"""`robocov sweep`: printed results, failed runs, dry runs and rejected options."""

import csv
import errno
import json
import os
from pathlib import Path

import pytest
from command_calls import read_error, read_json
from small_studies import ROOM, list_run_folders, read_tables, write_controller

from robocov.mapfile import save_map
from robocov.metrics.results import read_results
from robocov_app.cli import main
from robocov_app.commands.sweep import _describe_totals
from robocov_app.sweep.sweeping import Totals


def test_a_single_run_is_counted_in_the_singular() -> None:
    assert _describe_totals(Totals(1, 0, 0, False), 1) == ["1 run done"]


STUDY = """
maps = ["room.json"]
controllers = ["rapf", "rpf", "mine.py:Mine"]
robots = 3
seeds = 2
duration = 1
dt = 0.05
lattice = 8
record_hz = 2
[gains.rpf]
k_rep = [1, 3]
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    save_map(ROOM, tmp_path / "room.json")
    write_controller(tmp_path, "")
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


def test_a_sweep_prints_its_results(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = study.parent / "out"
    assert main(["sweep", str(study), "--out", str(out), "--workers", "1"]) == 0
    output = capsys.readouterr()
    assert output.out.splitlines() == ["8 runs done", f"table: {out}/results.csv"]
    assert not (out / "results.parquet").exists()
    assert output.err.splitlines()[-1].startswith("sweep: 8 of 8 runs, ")
    assert main(["sweep", str(study), "--out", str(out)]) == 0
    assert capsys.readouterr().out.startswith("0 runs done, 8 reused\n")
    pytest.importorskip("pyarrow")
    assert main(["sweep", str(study), "--out", str(out), "--parquet"]) == 0
    assert capsys.readouterr().out.endswith(f"/results.csv; as Parquet: {out}/results.parquet\n")
    assert (out / "results.parquet").is_file()


@pytest.mark.slow
def test_a_sweep_prints_a_json_summary(
    study: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(study.parent)
    summary = read_json(capsys, "sweep", "study.toml", "--workers", "1")
    (versions,) = summary.pop("versions")
    assert versions.startswith("robocov ") and ", numpy " in versions and ", pymunk " in versions
    assert summary == {
        "out": "study",
        "runs": 8,
        "done": 8,
        "failed": 0,
        "reused": 0,
        "interrupted": False,
        "errors": {},
        "damaged": [],
        "table_replaced": True,
    }
    results = read_results("study")
    assert len(results) == 8
    controllers = [row["controller"] for row in results.rows(["controller"])]
    assert controllers == ["rapf", "rpf", "rpf", "mine.py:Mine"] * 2


def test_failed_runs_are_reported_by_every_call_with_status_1(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study.write_text(STUDY.replace("robots = 3", "robots = [3, 900]"))
    arguments = ["sweep", str(study), "--out", str(study.parent / "out"), "--workers", "1"]
    for options, first_line in (
        ([], "8 runs done"),
        ([], "0 runs done, 8 reused"),
        (["--retry-failed"], ""),
    ):
        assert main([*arguments, *options]) == 1
        output = capsys.readouterr().out.splitlines()
        assert output[0] == first_line or options
        assert output[1] == "8 of 16 runs failed:"
        assert output[2].startswith("  room-rapf-900-corner-0-")
        assert ": start 'corner': space for about 45 robots" in output[2]
        assert output[3].startswith("--retry-failed runs them again")
    assert main([*arguments, "--json"]) == 1
    summary = json.loads(capsys.readouterr().out)
    assert (summary["done"], summary["failed"], summary["reused"]) == (0, 8, 8)
    (error,) = summary["errors"].values()
    assert error.startswith("start 'corner'")


def test_a_dry_run_writes_nothing(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(study.parent.rglob("*"))
    out = str(study.parent / "out")
    summary = read_json(capsys, "sweep", str(study), "--out", out, "--dry-run", "--workers", "3")
    assert (summary["runs"], summary["left"], summary["workers"]) == (8, 8, 3)
    seconds = sum(trial["left"] * trial["seconds_per_run"] for trial in summary["controllers"].values())
    assert summary["seconds"] == pytest.approx(seconds / 3)
    assert main(["sweep", str(study), "--out", out, "--dry-run"]) == 0
    output = capsys.readouterr().out
    assert "numbers of robots                   1\n" in output
    assert "sets of gains of rpf                2\n" in output
    assert "runs                                8\n" in output
    assert "\ncontroller    runs left  s per run  kB per run\n" in output
    assert "all remaining runs: about" in output
    assert sorted(study.parent.rglob("*")) == before

    study.write_text(STUDY.replace("robots = 3", "robots = 900"))
    assert main(["sweep", str(study), "--out", out, "--dry-run"]) == 0
    assert "failed: start 'corner': space for about" in capsys.readouterr().out


def test_a_dry_run_counts_finished_runs(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(study.parent / "out")
    read_json(capsys, "sweep", str(study), "--out", out, "--workers", "1")
    study.write_text(STUDY.replace("seeds = 2", "seeds = 3"))
    assert main(["sweep", str(study), "--out", out, "--dry-run"]) == 0
    assert "runs                               12   (8 of them already done)\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--workers", "0"), "--workers: expected a number from 1 to 1024, got 0"),
        (("--workers", "2", "--scheduler", "tcp://here:1"), "--workers: cannot be combined with --scheduler"),
        (("--seeds", "3"), "unknown option --seeds"),
    ],
)
def test_invalid_options_are_rejected(
    study: Path, arguments: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert message in read_error(capsys, "sweep", str(study), "--out", str(study.parent / "out"), *arguments)
    assert not (study.parent / "out").exists()


def test_errors_in_the_study_are_reported_in_one_line(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study.write_text(STUDY.replace("k_rep", "k_rap"))
    message = read_error(capsys, "sweep", str(study), "--out", str(study.parent / "out"))
    assert message.startswith(f"{study}: gains.rpf: unknown gain 'k_rap': did you mean 'k_rep'?")
    assert "no such file" in read_error(capsys, "sweep", str(study.parent / "none.toml"))
    assert not (study.parent / "out").exists()


@pytest.mark.slow
def test_a_full_disk_is_reported_and_the_sweep_can_be_resumed(
    study: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail_as_disk_is_full(path: Path, content: bytes) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    out = study.parent / "out"
    arguments = ("sweep", str(study), "--out", str(out), "--workers", "1")
    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", fail_as_disk_is_full)
        message = read_error(capsys, *arguments, "--json")
    assert message.endswith("cannot be written: No space left on device")
    assert list_run_folders(out) == []
    assert read_json(capsys, *arguments)["done"] == 8
    undisturbed = study.parent / "undisturbed"
    read_json(capsys, "sweep", str(study), "--out", str(undisturbed), "--workers", "1")
    assert read_tables(undisturbed) == read_tables(out)


@pytest.mark.parametrize("name", ["results.csv", "results.parquet", "runs", "study.json", ".lock"])
@pytest.mark.parametrize("finished", [True, False])
def test_files_of_others_with_reserved_names_are_reported_and_stay(
    study: Path, name: str, finished: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    out = study.parent / "out"
    arguments = ("sweep", str(study), "--out", str(out), "--workers", "1")
    out.mkdir()
    if finished:
        (out / "study.json").write_text('{"format": "robocov-study"}')
    (out / name).unlink(missing_ok=True)
    if name == "runs":
        (out / name).touch()
    else:
        (out / name / "mine").mkdir(parents=True)
    assert str(out) in read_error(capsys, *arguments)
    assert (out / name).exists()
    assert name == "runs" or (out / name / "mine").is_dir()


@pytest.mark.slow
def test_a_run_of_a_sweep_can_be_replayed(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = study.parent / "out"
    read_json(capsys, "sweep", str(study), "--out", str(out), "--workers", "1")
    with (out / "results.csv").open(newline="") as file:
        run = out / "runs" / next(csv.DictReader(file))["run"]
    content = json.loads((run / "run.json").read_text())
    assert content["record_hz"] == 2.0
    frames = study.parent / "frames"
    arguments = ("replay", str(run), "--frames", "--fps", "4", "--video-speed", "1", "--size", "320x240")
    assert read_json(capsys, *arguments, "--out", str(frames))["interrupted"] is False
    assert len(list((frames / "frames").iterdir())) == 4 + 1 + 4, (
        "as many frames as of a run that records every step"
    )
