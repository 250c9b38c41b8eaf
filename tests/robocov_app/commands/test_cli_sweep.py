import csv
import errno
import json
import os
from pathlib import Path

import pytest
from called import read_error, read_json
from swept import ROOM, list_run_folders, read_tables, write_controller

from robocov.mapfile import save_map
from robocov.metrics.results import read_results
from robocov_app.cli import main

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
    said = capsys.readouterr()
    assert said.out.splitlines() == ["8 runs done", f"table: {out}/results.csv"]
    assert not (out / "results.parquet").exists()
    assert said.err.splitlines()[-1].startswith("sweep: 8 of 8 runs, ")
    assert main(["sweep", str(study), "--out", str(out)]) == 0
    assert capsys.readouterr().out.startswith("0 runs done, 8 reused\n")
    pytest.importorskip("pyarrow")
    assert main(["sweep", str(study), "--out", str(out), "--parquet"]) == 0
    assert capsys.readouterr().out.endswith(f"/results.csv; as Parquet: {out}/results.parquet\n")
    assert (out / "results.parquet").is_file()


@pytest.mark.slow
def test_a_sweep_answers_in_json(
    study: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(study.parent)
    found = read_json(capsys, "sweep", "study.toml", "--workers", "1")
    (versions,) = found.pop("versions")
    assert versions.startswith("robocov ") and ", numpy " in versions and ", pymunk " in versions
    assert found == {
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
    laws = [row["controller"] for row in results.rows(["controller"])]
    assert laws == ["rapf", "rpf", "rpf", "mine.py:Mine"] * 2


def test_failures_are_reported_each_time_with_an_exit_status(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study.write_text(STUDY.replace("robots = 3", "robots = [3, 900]"))
    words = ["sweep", str(study), "--out", str(study.parent / "out"), "--workers", "1"]
    for again, count in (
        ([], "8 runs done"),
        ([], "0 runs done, 8 reused"),
        (["--retry-failed"], ""),
    ):
        assert main([*words, *again]) == 1
        said = capsys.readouterr().out.splitlines()
        assert said[0] == count or again
        assert said[1] == "8 of 16 runs failed:"
        assert said[2].startswith("  room-rapf-900-corner-0-")
        assert ": start 'corner': space for about 45 robots" in said[2]
        assert said[3].startswith("--retry-failed runs them again")
    assert main([*words, "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert (found["done"], found["failed"], found["reused"]) == (0, 8, 8)
    (error,) = found["errors"].values()
    assert error.startswith("start 'corner'")


def test_a_dry_run_writes_nothing(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(study.parent.rglob("*"))
    out = str(study.parent / "out")
    found = read_json(capsys, "sweep", str(study), "--out", out, "--dry-run", "--workers", "3")
    assert (found["runs"], found["left"], found["workers"]) == (8, 8, 3)
    assert found["seconds"] == pytest.approx(found["seconds_per_run"] * 8 / 3)
    assert main(["sweep", str(study), "--out", out, "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "gains of rpf               2\n" in said
    assert "runs                       8\n" in said
    assert "all remaining runs: about" in said
    assert sorted(study.parent.rglob("*")) == before

    study.write_text(STUDY.replace("robots = 3", "robots = 900"))
    assert main(["sweep", str(study), "--out", out, "--dry-run"]) == 0
    assert "failed: start 'corner': space for about" in capsys.readouterr().out


def test_a_dry_run_counts_finished_runs(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(study.parent / "out")
    read_json(capsys, "sweep", str(study), "--out", out, "--workers", "1")
    study.write_text(STUDY.replace("seeds = 2", "seeds = 3"))
    assert main(["sweep", str(study), "--out", out, "--dry-run"]) == 0
    assert "runs                      12   (8 of them already done)\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--workers", "0"), "--workers: expected a number from 1 to 1024, got 0"),
        (("--workers", "2", "--scheduler", "tcp://here:1"), "--workers: cannot be combined with --scheduler"),
        (("--seeds", "3"), "unknown option --seeds"),
    ],
)
def test_options_are_checked(
    study: Path, words: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert message in read_error(capsys, "sweep", str(study), "--out", str(study.parent / "out"), *words)
    assert not (study.parent / "out").exists()


def test_mistakes_in_the_study_are_one_line(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    study.write_text(STUDY.replace("k_rep", "k_rap"))
    said = read_error(capsys, "sweep", str(study), "--out", str(study.parent / "out"))
    assert said.startswith(f"{study}: gains.rpf: unknown gain 'k_rap': did you mean 'k_rep'?")
    assert "no such file" in read_error(capsys, "sweep", str(study.parent / "none.toml"))
    assert not (study.parent / "out").exists()


@pytest.mark.slow
def test_a_full_disk_is_reported_and_the_sweep_can_be_resumed(
    study: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail_as_disk_is_full(path: Path, content: bytes) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    out = study.parent / "out"
    words = ("sweep", str(study), "--out", str(out), "--workers", "1")
    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", fail_as_disk_is_full)
        said = read_error(capsys, *words, "--json")
    assert said.endswith("cannot be written: No space left on device")
    assert list_run_folders(out) == []
    assert read_json(capsys, *words)["done"] == 8
    again = study.parent / "again"
    read_json(capsys, "sweep", str(study), "--out", str(again), "--workers", "1")
    assert read_tables(again) == read_tables(out)


@pytest.mark.parametrize("name", ["results.csv", "results.parquet", "runs", "study.json", ".lock"])
@pytest.mark.parametrize("finished", [True, False])
def test_a_foreign_file_with_a_reserved_name_is_rejected_in_one_line(
    study: Path, name: str, finished: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    out = study.parent / "out"
    words = ("sweep", str(study), "--out", str(out), "--workers", "1")
    out.mkdir()
    if finished:
        (out / "study.json").write_text('{"format": "robocov-study"}')
    (out / name).unlink(missing_ok=True)
    if name == "runs":
        (out / name).touch()
    else:
        (out / name / "mine").mkdir(parents=True)
    assert str(out) in read_error(capsys, *words)
    assert (out / name).exists() and (name == "runs" or (out / name / "mine").is_dir())


@pytest.mark.slow
def test_a_run_of_a_sweep_can_be_replayed(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = study.parent / "out"
    read_json(capsys, "sweep", str(study), "--out", str(out), "--workers", "1")
    with (out / "results.csv").open(newline="") as file:
        run = out / "runs" / next(csv.DictReader(file))["run"]
    content = json.loads((run / "run.json").read_text())
    assert content["record_hz"] == 2.0
    frames = study.parent / "frames"
    words = ("replay", str(run), "--frames", "--fps", "4", "--video-speed", "1", "--size", "320x240")
    assert read_json(capsys, *words, "--out", str(frames))["interrupted"] is False
    assert len(list((frames / "frames").iterdir())) == 4 + 1 + 4, "as many as of a run with all moments"
