"""The benchmark end to end: runs, result, verification and page; forged results are detected."""

from __future__ import annotations

import gzip
import json
import os
import re
import subprocess
import time
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from benchmark_results import MAPS
from command_calls import COMMAND, read_error, read_json
from small_studies import HEAD, PULL, DirectExecutor

from robocov.conditions.communication import POSITION_BYTES
from robocov.controllers import load_controller_class
from robocov.errors import InputError
from robocov_app.benchmark import suite
from robocov_app.benchmark.coverage_control_cvt import CentralizedCvt, ClairvoyantCvt, DecentralizedCvt
from robocov_app.benchmark.learned import Learned
from robocov_app.benchmark.oracle import Oracle
from robocov_app.benchmark.rated_controller import COVERAGE_CONTROL_FILES, RatedController, Selection
from robocov_app.benchmark.results import (
    ENTRIES,
    RESULT_FILE,
    compute_gaps,
    load_bundled_results,
    read_result,
)
from robocov_app.benchmark.running import TRACKS_FOLDER, run_benchmark
from robocov_app.benchmark.verification.verification import Verification, VerificationOptions, verify_result
from robocov_app.cli import main
from robocov_app.terminal.interruption import Interruption

BENCHMARK_LABELS = {
    kind.name: kind.label for kind in (Oracle, Learned, ClairvoyantCvt, CentralizedCvt, DecentralizedCvt)
}
"""Labels of the controllers that only the benchmark has."""
ROBOTS = 6
"""Number of robots on the tracks of these tests."""
MESSAGES_PER_S = {"ideal": 60, "lossy": 2}
"""Number of messages that each robot sends per second, by track."""


@pytest.fixture
def short_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Limit two tracks to two maps and runs of one second, and run them in this process."""
    for name in ("ideal", "lossy"):
        track = replace(suite.TRACKS[name], duration=1.0, seeds=(0,), maps=MAPS)
        monkeypatch.setitem(suite.TRACKS, name, track)  # type: ignore[arg-type]
    monkeypatch.setattr("robocov_app.sweep.sweeping.LocalPool", DirectExecutor)


def run_short_benchmark(out: Path, controller: str = "rapf", *tracks: str, **gains: float) -> dict[str, Any]:
    selection = Selection(tracks=tracks or ("ideal",), maps=MAPS)
    with Interruption() as stop:
        result = run_benchmark(RatedController(controller, gains), selection, out, stop=stop, quiet=True)
    assert result is not None
    return result


def verify(out: Path, sample: int, controller: str | None = None) -> tuple[int, list[str]]:
    """Repeat some runs; return their number and the differences."""
    options = VerificationOptions(sample=sample, robots=0, new_maps=0)
    with Interruption() as stop:
        verification = verify_result(out, controller=controller, options=options, stop=stop, quiet=True)
    return verification.runs, verification.differences


def change_result(out: Path, change: Any) -> None:
    result = json.loads((out / RESULT_FILE).read_text())
    change(result)
    (out / RESULT_FILE).write_text(json.dumps(result))


@pytest.mark.usefixtures("short_runs")
def test_runs_are_rated_verified_and_shown_on_a_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run_short_benchmark(tmp_path / "a", "rapf", "ideal", "lossy")
    run_short_benchmark(tmp_path / "b", "rapf", "ideal", k_rep=0.5)
    result = read_result(tmp_path / "a")
    assert [(row["track"], row["map"]) for row in result["rows"]] == [
        (track, name) for track in ("ideal", "lossy") for name in MAPS
    ]
    for row in result["rows"]:
        references = suite.load_frozen_maps()[row["map"]]["references"]
        reference_distance = references[str(ROBOTS)]["mean_distance_m"]
        assert row["gap"] == row["mean_distance_m"] / reference_distance - 1.0
        assert row["gap"] > 0.0
        # RAPF sends only positions, here during one second.
        expected_bytes = ROBOTS * POSITION_BYTES * MESSAGES_PER_S[row["track"]]
        assert row["sent_bytes"] == pytest.approx(expected_bytes)
        assert row["deciding_s"] > 0.0
    assert verify(tmp_path / "a", sample=1) == (1, [])
    page = str(tmp_path / "page.html")
    folders = [str(tmp_path / name) for name in "ab"]
    assert read_json(capsys, "benchmark", "page", *folders, "--alone", "--out", page)["entries"] == 2
    text = Path(page).read_text()
    assert "RAPF (k_rep 0.5)" in text and "Gap and path length" in text


def test_bundled_results_are_complete() -> None:
    """Each result has all runs of the core tracks, with gaps that agree with the costs.

    Only the controllers of CoverageControl have no runs on these tracks.
    """
    results = load_bundled_results()
    assert {"rapf", "lloyd", "rpf", "oracle"} <= {result["entry"]["controller"] for result in results}
    runs = set()
    for track, maps, seeds in Selection().list_runs():
        runs |= {(track, map_name, seed) for map_name, seed in product(maps, seeds)}
    for result in results:
        # `verify` needs no file for controllers that are part of robocov.
        assert result["entry"]["source_sha256"] is None
        controller = result["entry"]["controller"]
        if controller in BENCHMARK_LABELS:
            assert result["entry"]["label"] == BENCHMARK_LABELS[controller]
        else:
            assert result["entry"]["label"] == load_controller_class(controller).label
        rows = {(row["track"], row["map"], row["seed"]) for row in result["rows"]}
        if controller in COVERAGE_CONTROL_FILES:
            assert {row[0] for row in rows} == {"open-square"}
        else:
            assert {row for row in rows if row[0] in suite.RANKED_TRACKS["core"]} == runs
        # On each other track, an entry has either all runs or none.
        for track in {row[0] for row in rows - runs}:
            assert {row[1] for row in rows if row[0] == track} == set(suite.TRACKS[track].maps)
        for row in result["rows"]:
            assert "error" in row or row.items() >= compute_gaps(row["track"], row["map"], row).items()


@pytest.mark.slow
def test_bundled_results_are_reproducible(monkeypatch: pytest.MonkeyPatch) -> None:
    # The gap on a new map is not compared with anything here.
    monkeypatch.setattr("robocov_app.benchmark.verification.verification.RESTARTS", 2)
    path = ENTRIES / "rapf.json.gz"
    options = VerificationOptions(sample=1, robots=1, new_maps=1, seed=3, workers=2)
    with Interruption() as stop:
        verification = verify_result(path, options=options, quiet=True, stop=stop)
    assert verification.runs == 1
    assert verification.robots == 2
    assert verification.comparison is not None
    # Libraries of linear algebra may round the last bit differently on other processors.
    for difference in verification.differences:
        numbers = re.search(r": expected ([\d.e-]+), got ([\d.e-]+)$", difference)
        are_close = numbers and float(numbers[1]) == pytest.approx(float(numbers[2]), rel=1e-3)
        assert difference.startswith("made with") or are_close, difference


@pytest.mark.usefixtures("short_runs")
@pytest.mark.parametrize(("controller", "information"), [("oracle", "whole map"), ("learned", "own")])
def test_controllers_of_the_benchmark_can_be_rated_and_verified(
    tmp_path: Path, controller: str, information: str
) -> None:
    run_short_benchmark(tmp_path / "out", controller)
    assert verify(tmp_path / "out", sample=1) == (1, [])
    entry = read_result(tmp_path / "out")["entry"]
    assert entry["information"] == information
    assert entry["label"] == BENCHMARK_LABELS[controller]


@pytest.mark.slow
def test_robots_of_the_oracle_reach_their_goals_through_corridors(tmp_path: Path) -> None:
    selection = Selection(tracks=("ideal",), maps=("mazes-7006",))
    with Interruption() as stop:
        result = run_benchmark(RatedController("oracle", {}), selection, tmp_path, stop=stop, quiet=True)
    assert result is not None and max(row["gap"] for row in result["rows"]) < 1e-3


@pytest.mark.usefixtures("short_runs")
def test_forged_results_are_detected(tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_short_benchmark(out)
    honest = (out / RESULT_FILE).read_text()
    for change, message in (
        (lambda result: result["rows"][1].update(work_J=1.0), "blocks-b, seed 0: work_J: expected"),
        (lambda result: result["rows"][0].update(gap=0.01), "blocks-a, seed 0: gap: expected"),
        (lambda result: result["rows"].pop(), "blocks-b, seed 0: missing row"),
        (
            lambda result: result["selection"].update(maps=["blocks-a"]),
            "blocks-b, seed 0: a row of a run that was not selected",
        ),
        (lambda result: result["versions"].update(numpy="1.0"), "made with numpy 1.0 instead of"),
    ):
        (out / RESULT_FILE).write_text(honest)
        change_result(out, change)
        _, differences = verify(out, sample=9 if "work_J" in message else 0)
        assert any(message in difference for difference in differences), message


@pytest.mark.parametrize(("runs", "status"), [(0, 1), (1, 0)])
def test_a_verification_without_runs_has_the_exit_status_of_a_failure(
    runs: int, status: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "robocov_app.benchmark.verification.verification.verify_result",
        lambda *_, **__: Verification(seed=0, rows=1, runs=runs),
    )
    assert main(["benchmark", "verify", "entry"]) == status


@pytest.mark.usefixtures("short_runs")
def test_the_page_rejects_gaps_that_do_not_follow_from_costs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    run_short_benchmark(out)
    change_result(out, lambda result: result["rows"][0].update(gap=0.01))
    message = read_error(
        capsys, "benchmark", "page", str(out), "--alone", "--out", str(tmp_path / "page.html")
    )
    assert "rows[0]: gap: expected" in message


@pytest.mark.usefixtures("short_runs")
def test_controllers_in_files_are_verified_only_if_named_and_unchanged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine.py"
    out = tmp_path / "out"
    mine.write_text(HEAD + PULL)
    run_short_benchmark(out, f"{mine}:Mine")
    assert str(tmp_path) not in (out / RESULT_FILE).read_text()
    assert "pass --controller FILE.py:CLASS" in read_error(capsys, "benchmark", "verify", str(out))
    assert verify(out, sample=1, controller=f"{mine}:Mine") == (1, [])
    mine.write_text(HEAD + PULL + "\n# changed\n")
    message = read_error(capsys, "benchmark", "verify", str(out), "--controller", f"{mine}:Mine")
    assert "is not the file that was rated" in message


def select_part(result: dict[str, Any], part: str) -> dict[str, Any]:
    """Return the result itself, one of its objects, or its first row."""
    if part == "rows":
        return result["rows"][0]
    return result[part] if part else result


@pytest.mark.usefixtures("short_runs")
def test_damaged_results_are_rejected_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    run_short_benchmark(out)
    honest = json.loads((out / RESULT_FILE).read_text())
    for part in ("", "entry", "selection", "rows"):
        for name in select_part(honest, part):
            damaged = json.loads(json.dumps(honest))
            select_part(damaged, part).pop(name)
            (out / RESULT_FILE).write_text(json.dumps(damaged))
            assert str(out / RESULT_FILE) in read_error(capsys, "benchmark", "verify", str(out)), name
            if name not in ("gains", "set", "entry", "selection", "versions"):
                select_part(damaged, part)[name] = {"x": []}
                (out / RESULT_FILE).write_text(json.dumps(damaged))
                assert str(out / RESULT_FILE) in read_error(capsys, "benchmark", "verify", str(out)), name


@pytest.mark.usefixtures("short_runs")
def test_finished_runs_are_reused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = run_short_benchmark(tmp_path / "out")
    monkeypatch.setattr("robocov_app.sweep.sweeping.LocalPool", None)
    assert run_short_benchmark(tmp_path / "out") == expected


@pytest.mark.usefixtures("short_runs")
def test_the_result_of_another_controller_or_of_other_gains_is_kept(tmp_path: Path) -> None:
    run_short_benchmark(tmp_path, "rapf", k_rep=0.5)
    content = (tmp_path / RESULT_FILE).read_bytes()
    expectation = "expected no result or that of {}, got that of rapf with k_rep=0.5; choose another --out"
    for controller in ("lloyd", "rapf"):
        with pytest.raises(InputError, match=expectation.format(controller)):
            run_short_benchmark(tmp_path, controller)
    assert (tmp_path / RESULT_FILE).read_bytes() == content


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--controller", "rapff"), "--controller: unknown controller 'rapff': did you mean 'rapf'"),
        (("--controller", "rapf", "--set", "k_re=1"), "unknown gain 'k_re'"),
        (("--controller", "rapf", "--track", "idael"), "did you mean 'ideal'"),
        ((), "--controller: expected a controller name or FILE.py:CLASS"),
        (("verify",), "DIR: expected one result"),
        (("page", "--alone"), "DIR: expected results"),
        (
            ("page", "nowhere"),
            "nowhere: expected the folder or the file of a result of the benchmark, got a path that does not",
        ),
        (("page", "TORN"), "torn.json.gz: cannot be unpacked: Compressed file ended"),
        (("suite", "--quick"), "--quick: not an option of robocov benchmark suite"),
        (("--controller", "rapf", "--out", "FOREIGN"), "expected an empty folder or a benchmark"),
        (("verify", "OTHER"), "expected a result of robocov benchmark"),
    ],
)
def test_invalid_commands_are_rejected(
    arguments: tuple[str, ...], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "letter.txt").write_text("Dear")
    (tmp_path / "other.json").write_text("{}")
    (tmp_path / "torn.json.gz").write_bytes(gzip.compress(b"{}" * 99)[:-9])
    paths = {"FOREIGN": str(tmp_path), "OTHER": str(tmp_path / "other.json")}
    paths["TORN"] = str(tmp_path / "torn.json.gz")
    assert message in read_error(
        capsys, "benchmark", *(paths.get(argument, argument) for argument in arguments)
    )


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="kills a process")
def test_a_killed_benchmark_is_resumed(tmp_path: Path) -> None:
    options = "--controller lloyd --track one-robot --workers 1 --json"
    maps = ("blocks-a", "blocks-b")
    arguments = ["benchmark", *options.split(), "--maps", *maps]
    command = [*COMMAND, *arguments, "--out", str(tmp_path / "killed")]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        runs = tmp_path / "killed" / TRACKS_FOLDER / "one-robot" / "runs"
        end = time.monotonic() + 120.0
        while not (runs.is_dir() and any(not path.name.startswith(".") for path in runs.iterdir())):
            assert time.monotonic() < end and process.poll() is None
            time.sleep(0.02)
        process.kill()
    assert not (tmp_path / "killed" / RESULT_FILE).exists()
    assert main([*arguments, "--out", str(tmp_path / "killed")]) == 0
    assert main([*arguments, "--out", str(tmp_path / "whole")]) == 0
    rows = {}
    for name in ("killed", "whole"):
        rows[name] = [{**row, "deciding_s": None} for row in read_result(tmp_path / name)["rows"]]
    assert rows["killed"] == rows["whole"] and len(rows["whole"]) == len(maps)
