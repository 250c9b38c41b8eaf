"""After any interruption, the same command ends with the same table, byte for byte."""

from __future__ import annotations

import csv
import errno
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from small_studies import ROOM, build_small_study, list_run_folders, read_tables, write_controller

from robocov.errors import InputError, OutputError, ParameterError
from robocov.mapfile import save_map
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.sweep import sweeping
from robocov_app.sweep.executor import Executor, Result
from robocov_app.sweep.ledger import open_ledger
from robocov_app.sweep.progress import SweepProgress
from robocov_app.sweep.study.study import Study
from robocov_app.sweep.sweeping import Totals, execute_tasks, sweep
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import build_failure, list_result_versions, perform
from robocov_app.terminal.interruption import Interruption

HANG_LIMIT_S = 60.0

COMMAND = (sys.executable, "-m", "robocov_app", "sweep")

POSIX = pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
TOGETHER = pytest.mark.xdist_group("longer sweeps")
LINUX = pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="reads processes from /proc")


class StackExecutor(Executor):
    """Executes tasks in this process, the last one first."""

    def __init__(self, capacity: int = 5) -> None:
        super().__init__()
        self._capacity = capacity
        self._stack: list[Task] = []
        self.max_length = 0
        self.before_result: Callable[[], None] = lambda: None
        self.waits = 0

    def __exit__(self, *exception: object) -> None: ...

    @property
    def capacity(self) -> int:
        return self._capacity

    @property
    def waiting_reason(self) -> str:
        return "no workers are connected; waiting" if self.waits else ""

    def _start(self, task: Task) -> None:
        self._stack.append(task)
        self.max_length = max(self.max_length, len(self._stack))

    def _wait_for_result(self, timeout: float) -> Result | None:
        self.before_result()
        if self.waits:
            self.waits -= 1
            return None
        task = self._stack.pop()
        return task, perform(task)


@pytest.fixture
def executor(monkeypatch: pytest.MonkeyPatch) -> StackExecutor:
    """Let sweeps execute their runs in this process."""
    executor = StackExecutor()
    monkeypatch.setattr(sweeping, "LocalPool", lambda workers: executor)
    return executor


@pytest.fixture(scope="module")
def study() -> Study:
    return build_small_study(seeds=range(6), gains={"rapf": {"k_rep": [0.1, 1.0]}})


@pytest.fixture(scope="module")
def undisturbed(study: Study, tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    folder = tmp_path_factory.mktemp("undisturbed")
    assert sweep(study, folder, workers=1, quiet=True) == Totals(18, 0, 0, False)
    return read_tables(folder)


def test_the_rate_of_runs_excludes_the_time_before_the_first_one(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 100.0
    monkeypatch.setattr(sweeping.time, "perf_counter", lambda: now)
    progress = SweepProgress(2, start_time=now)
    now += 60.0  # The folder is surveyed.

    class InstantExecutor(StackExecutor):
        def _wait_for_result(self, timeout: float) -> Result | None:
            return self._stack.pop(), build_failure("not executed", "")

    def open_executor() -> InstantExecutor:
        nonlocal now
        now += 30.0  # The kernels are compiled.
        return InstantExecutor()

    tasks = list(generate_tasks(study))[:2]
    for _ in execute_tasks(tasks, open_executor, progress, Interruption(), lambda task, outcome: None):
        now += 5.0
    assert progress.rate == 2 / 10.0


def read_rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "results.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_the_number_of_workers_changes_nothing(
    study: Study, undisturbed: list[bytes], tmp_path: Path
) -> None:
    assert sweep(study, tmp_path, workers=2, quiet=True) == Totals(18, 0, 0, False)
    assert read_tables(tmp_path) == undisturbed
    assert list_run_folders(tmp_path) == sorted(task.name for task in generate_tasks(study))
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        ".lock",
        "results.csv",
        "runs",
        "study.json",
    ]


def test_rows_have_the_order_of_the_study_for_any_order_of_the_runs(
    study: Study, undisturbed: list[bytes], tmp_path: Path, executor: StackExecutor
) -> None:
    sweep(study, tmp_path, quiet=True)
    assert read_tables(tmp_path) == undisturbed
    assert [row["run"] for row in read_rows(tmp_path)] == [task.name for task in generate_tasks(study)]
    assert executor.max_length == 5, "tasks are generated when they can be executed"


def test_finished_runs_are_reused(
    study: Study,
    undisturbed: list[bytes],
    tmp_path: Path,
    executor: StackExecutor,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sweep(study, tmp_path, quiet=True)
    monkeypatch.setattr(sweeping, "LocalPool", None)  # No process is started.
    assert sweep(study, tmp_path, quiet=True) == Totals(0, 0, 18, False)
    assert read_tables(tmp_path) == undisturbed


def test_a_larger_study_executes_new_runs_and_a_smaller_one_none(
    study: Study, undisturbed: list[bytes], tmp_path: Path, executor: StackExecutor
) -> None:
    small = build_small_study(seeds=range(2, 5), gains={"rapf": {"k_rep": [1.0]}})
    assert sweep(small, tmp_path, quiet=True) == Totals(6, 0, 0, False)
    assert sweep(study, tmp_path, quiet=True) == Totals(12, 0, 6, False)
    assert read_tables(tmp_path) == undisturbed
    assert sweep(small, tmp_path, quiet=True) == Totals(0, 0, 6, False)
    assert len(read_rows(tmp_path)) == 6
    assert len(list_run_folders(tmp_path)) == 18, "unused runs are kept"


def test_damaged_and_removed_runs_are_repeated_and_reported(
    study: Study,
    undisturbed: list[bytes],
    tmp_path: Path,
    executor: StackExecutor,
    capsys: pytest.CaptureFixture[str],
) -> None:
    sweep(study, tmp_path, quiet=True)
    folders = [tmp_path / "runs" / task.name for task in generate_tasks(study)]
    first = folders[0]
    second = folders[1]
    (first / "cost.csv").write_bytes((first / "cost.csv").read_bytes().replace(b"1", b"2", 1))
    for path in second.iterdir():
        path.unlink()
    second.rmdir()
    totals = sweep(study, tmp_path)
    assert (totals, totals.damaged) == (Totals(2, 0, 16, False), [first.name])
    assert f"sweep: 1 damaged run will be repeated: {first.name}\n" in capsys.readouterr().err
    assert read_tables(tmp_path) == undisturbed


def test_a_finished_table_stays_until_all_runs_are_repeated(
    study: Study, undisturbed: list[bytes], tmp_path: Path, executor: StackExecutor
) -> None:
    sweep(study, tmp_path, quiet=True)
    for task in generate_tasks(study):
        (tmp_path / "runs" / task.name / "row.json").unlink()
    stop = Interruption()
    checks = 0

    def check_tables() -> None:
        nonlocal checks
        checks += 1
        assert read_tables(tmp_path) == undisturbed
        stop.requested = checks == 3

    executor.before_result = check_tables
    totals = sweep(study, tmp_path, quiet=True, stop=stop)
    assert (totals, totals.table_replaced) == (Totals(3, 0, 0, True), False)
    assert read_tables(tmp_path) == undisturbed
    executor.__init__()
    assert sweep(study, tmp_path, quiet=True).table_replaced
    assert read_tables(tmp_path) == undisturbed


def test_after_an_upgrade_runs_are_repeated_and_mixed_versions_are_rejected(
    tmp_path: Path, executor: StackExecutor, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = build_small_study()
    old = {**list_result_versions(), "pymunk": "6.0"}
    with open_ledger(tmp_path, study.to_json()) as ledger:
        for task in generate_tasks(study):
            ledger.store(task, replace(perform(task), versions=old))
    more = build_small_study(seeds=range(3))
    totals = sweep(more, tmp_path, quiet=True, keep_versions=True)
    assert (totals, sorted(totals.versions.values())) == (Totals(2, 0, 4, False), [2, 4])
    totals = sweep(more, tmp_path, quiet=True)
    assert (totals, list(totals.versions.values())) == (Totals(4, 0, 2, False), [6])
    monkeypatch.setattr(sweeping, "describe_version_differences", lambda versions: "numpy 1.9 instead of 2.3")
    with pytest.raises(OutputError, match=r"expected the same versions everywhere, or --keep-versions"):
        sweep(build_small_study(seeds=(9,)), tmp_path, quiet=True)


def test_finished_runs_of_an_interrupted_sweep_are_in_the_table(
    study: Study, undisturbed: list[bytes], tmp_path: Path, executor: StackExecutor
) -> None:
    last = build_small_study(seeds=(5,))
    sweep(last, tmp_path, quiet=True)  # The last rows of the study are there already.
    stop = Interruption()
    calls = 0

    def interrupt() -> None:
        nonlocal calls
        calls += 1
        stop.requested = calls == 7

    executor.before_result = interrupt
    assert sweep(study, tmp_path, quiet=True, stop=stop) == Totals(7, 0, 1, True)
    executor.before_result = lambda: None
    finished = [task.name for task in generate_tasks(study) if task.name in list_run_folders(tmp_path)]
    assert len(finished) == 7 + 1
    assert [row["run"] for row in read_rows(tmp_path)] == finished
    executor._stack.clear()
    executor.__init__()
    assert sweep(study, tmp_path, quiet=True) == Totals(10, 0, 8, False)
    assert read_tables(tmp_path) == undisturbed


def test_failures_are_recorded_and_repeated_on_request(tmp_path: Path, executor: StackExecutor) -> None:
    flag = tmp_path / "well"
    code = f"        if not Path({str(flag)!r}).exists():\n            raise ValueError('not well')\n"
    name = write_controller(tmp_path, code)
    study = build_small_study(controllers=("rapf", name), robots=(2, 400))
    out = tmp_path / "out"
    assert sweep(study, out, quiet=True) == Totals(2, 6, 0, False)
    rows_by_controller = {(row["robots"], row["controller"]): row for row in read_rows(out)}
    assert rows_by_controller["400", "rapf"]["error"].startswith("start 'corner': space for about")
    assert rows_by_controller["2", name]["error"].startswith(
        "controller 'Mine': ValueError: not well (mine.py, line "
    )
    assert rows_by_controller["2", name]["mean_distance_m"] == rows_by_controller["2", name]["contacts"] == ""
    assert rows_by_controller["2", "rapf"]["error"] == ""
    failed = out / "runs" / rows_by_controller["2", name]["run"]
    assert sorted(path.name for path in failed.iterdir()) == ["error.json", "row.json"]

    before = read_tables(out)
    totals = sweep(study, out, quiet=True)
    assert totals == Totals(0, 6, 2, False)
    assert [error.partition(":")[0] for error in totals.errors.values()] == [
        "controller 'Mine'",
        "start 'corner'",
    ]
    assert read_tables(out) == before
    flag.touch()
    assert sweep(study, out, quiet=True, retry_failed=True) == Totals(2, 4, 2, False)
    assert [row["error"] == "" for row in read_rows(out)] == [True] * 4 + [False] * 4
    assert len(Record.load(failed)) == 3
    undisturbed = tmp_path / "undisturbed"
    sweep(study, undisturbed, quiet=True)
    assert read_tables(undisturbed) == read_tables(out)


def test_a_full_disk_stops_the_sweep_and_the_same_call_resumes_it(
    study: Study,
    undisturbed: list[bytes],
    tmp_path: Path,
    executor: StackExecutor,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    write_bytes = Path.write_bytes
    writes_left = 30

    def fill_disk(path: Path, content: bytes) -> int:
        nonlocal writes_left
        writes_left -= 1
        if writes_left < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write_bytes(path, content)

    monkeypatch.setattr(Path, "write_bytes", fill_disk)
    with pytest.raises(OutputError, match="cannot be written: No space left on device"):
        sweep(study, tmp_path, quiet=True)
    monkeypatch.undo()
    finished = list_run_folders(tmp_path)
    assert len(finished) == 30 // 4
    assert sorted(row["run"] for row in read_rows(tmp_path)) == finished
    assert not list(tmp_path.rglob("*.part*"))
    monkeypatch.setattr(sweeping, "LocalPool", lambda workers: StackExecutor())
    assert sweep(study, tmp_path, quiet=True) == Totals(18 - len(finished), 0, len(finished), False)
    assert read_tables(tmp_path) == undisturbed


def test_a_sweep_without_workers_is_reported_once(
    tmp_path: Path, executor: StackExecutor, capsys: pytest.CaptureFixture[str]
) -> None:
    executor.waits = 4
    assert sweep(build_small_study(seeds=(0,)), tmp_path) == Totals(2, 0, 0, False)
    assert capsys.readouterr().err.count("sweep: 0 of 2 runs, no workers are connected; waiting\n") == 1


def test_two_sweeps_do_not_share_a_folder(study: Study, tmp_path: Path, executor: StackExecutor) -> None:
    def sweep_again() -> None:
        with pytest.raises(OutputError, match="another process is using this folder"):
            sweep(study, tmp_path, quiet=True)

    executor.before_result = sweep_again
    assert sweep(build_small_study(seeds=(0,)), tmp_path, quiet=True) == Totals(2, 0, 0, False)


@pytest.mark.parametrize("workers", [0, 2000, -1])
def test_the_number_of_workers_is_checked(workers: int, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"workers: expected a whole number from 1 to 1024, got .*"):
        sweep(build_small_study(), tmp_path / "out", workers=workers)
    assert not (tmp_path / "out").exists()


def test_a_folder_with_other_files_is_rejected(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"format": "robocov-run"}')
    with pytest.raises(InputError, match="expected an empty folder or a sweep"):
        sweep(build_small_study(), tmp_path)


STUDY = """
maps = ["room.json"]
controllers = ["rapf", "rpf"]
robots = 3
seeds = 12
duration = 4
lattice = 8
record_hz = 1
"""
STUDY_RUNS = 24


@pytest.fixture(scope="module")
def longer(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[bytes]]:
    """A study file of some seconds, and the tables of an undisturbed sweep."""
    folder = tmp_path_factory.mktemp("longer")
    save_map(ROOM, folder / "room.json")
    file = folder / "study.toml"
    file.write_text(STUDY)
    assert main(["sweep", str(file), "--out", str(folder / "out"), "--workers", "2", "--json"]) == 0
    return file, read_tables(folder / "out")


def start_sweep(file: Path, out: Path, min_runs: int = 5) -> subprocess.Popen[str]:
    """Start a sweep in a process of its own, and wait until some runs are finished."""
    process = subprocess.Popen(
        [*COMMAND, str(file), "--out", str(out), "--workers", "2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    end = time.monotonic() + HANG_LIMIT_S
    while len(list_finished(out)) < min_runs:
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.01)
    return process


def list_finished(out: Path) -> list[str]:
    return [name for name in list_run_folders(out) if not name.startswith(".")]


def list_workers(process: subprocess.Popen[str]) -> list[int]:
    """Return the processes that execute the runs."""
    workers: list[int] = []
    for path in Path(f"/proc/{process.pid}/task").glob("*/children"):
        workers += [int(pid) for pid in path.read_text().split()]
    return workers


def is_running(pid: int) -> bool:
    """Return whether a process has not ended yet; it may stay as a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.slow
@TOGETHER
@LINUX
def test_a_killed_sweep_is_resumed(longer: tuple[Path, list[bytes]], tmp_path: Path) -> None:
    file, expected = longer
    process = start_sweep(file, tmp_path / "out")
    with process:
        workers = list_workers(process)
        assert len(workers) == 2
        process.kill()
    assert 5 <= len(list_finished(tmp_path / "out")) < STUDY_RUNS
    end = time.monotonic() + HANG_LIMIT_S
    while any(is_running(worker) for worker in workers):
        assert time.monotonic() < end, "workers end together with the sweep"
        time.sleep(0.02)
    assert main(["sweep", str(file), "--out", str(tmp_path / "out"), "--workers", "2", "--json"]) == 0
    assert read_tables(tmp_path / "out") == expected


@pytest.mark.slow
@TOGETHER
@LINUX
def test_a_worker_that_is_killed_is_replaced(longer: tuple[Path, list[bytes]], tmp_path: Path) -> None:
    file, expected = longer
    with start_sweep(file, tmp_path / "out") as process:
        os.kill(list_workers(process)[0], signal.SIGKILL)
        output, errors = process.communicate(timeout=HANG_LIMIT_S)
    assert process.returncode == 0, errors
    assert f"{STUDY_RUNS} runs done" in output
    assert "Traceback" not in errors
    assert read_tables(tmp_path / "out") == expected


@pytest.mark.slow
@TOGETHER
@POSIX
def test_ctrl_c_keeps_finished_runs_and_explains_how_to_resume(
    longer: tuple[Path, list[bytes]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, expected = longer
    out = tmp_path / "out"
    with start_sweep(file, out) as process:
        os.killpg(process.pid, signal.SIGINT)  # As a terminal does.
        output, errors = process.communicate(timeout=HANG_LIMIT_S)
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    assert "Run the same command to resume." in output
    count = len(list_finished(out))
    assert 5 <= count < STUDY_RUNS
    assert f"{count} runs done" in output
    runs_left = STUDY_RUNS - count
    assert f"Interrupted with {runs_left} runs left. Partial results are in {out}/." in output
    assert len(read_rows(out)) == count
    assert main(["sweep", str(file), "--out", str(out), "--workers", "2"]) == 0
    assert f"{count} reused" in capsys.readouterr().out
    assert read_tables(out) == expected
