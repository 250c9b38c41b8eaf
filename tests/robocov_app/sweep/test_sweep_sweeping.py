"""Whatever happens to a sweep, the same command ends with the same table, byte for byte."""

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
from swept import ROOM, controller, run_folders, small_study, tables

from robocov.errors import InputError, OutputError, ParameterError
from robocov.mapfile import save_map
from robocov.record import Record
from robocov_app.cli import main
from robocov_app.sweep import sweeping
from robocov_app.sweep.executor import Executor, Result
from robocov_app.sweep.ledger import open_ledger
from robocov_app.sweep.study import Study
from robocov_app.sweep.sweeping import Totals, sweep
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import list_result_versions, perform
from robocov_app.terminal.interruption import Interruption

PATIENCE = 60.0

COMMAND = (sys.executable, "-m", "robocov_app", "sweep")

POSIX = pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
TOGETHER = pytest.mark.xdist_group("longer sweeps")
LINUX = pytest.mark.skipif(
    not Path("/proc/self/fd").exists(), reason="looks at processes as Linux shows them"
)


class Here(Executor):
    """Does tasks in this process, the last one first, as many at once as it may."""

    def __init__(self, most: int = 5) -> None:
        super().__init__()
        self._most = most
        self._stack: list[Task] = []
        self.longest = 0
        self.before: Callable[[], None] = lambda: None
        self.lonesome = 0

    def __exit__(self, *exception: object) -> None: ...

    @property
    def capacity(self) -> int:
        return self._most

    @property
    def waiting_reason(self) -> str:
        return "nobody is there; waiting" if self.lonesome else ""

    def _start(self, task: Task) -> None:
        self._stack.append(task)
        self.longest = max(self.longest, len(self._stack))

    def _wait_for_result(self, timeout: float) -> Result | None:
        self.before()
        if self.lonesome:
            self.lonesome -= 1
            return None
        task = self._stack.pop()
        return task, perform(task)


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> Here:
    """Sweeps are done in this process."""
    executor = Here()
    monkeypatch.setattr(sweeping, "LocalPool", lambda workers: executor)
    return executor


@pytest.fixture(scope="module")
def study() -> Study:
    return small_study(seeds=range(6), gains={"rapf": {"k_rep": [0.1, 1.0]}})


@pytest.fixture(scope="module")
def undisturbed(study: Study, tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    folder = tmp_path_factory.mktemp("undisturbed")
    assert sweep(study, folder, workers=1, quiet=True) == Totals(18, 0, 0, False)
    return tables(folder)


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "results.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_the_number_of_workers_changes_nothing(
    study: Study, undisturbed: list[bytes], tmp_path: Path
) -> None:
    assert sweep(study, tmp_path, workers=2, quiet=True) == Totals(18, 0, 0, False)
    assert tables(tmp_path) == undisturbed
    assert run_folders(tmp_path) == sorted(task.name for task in generate_tasks(study))
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        ".lock",
        "results.csv",
        "runs",
        "study.json",
    ]


def test_rows_stand_in_the_order_of_the_study_whatever_the_order_of_runs(
    study: Study, undisturbed: list[bytes], tmp_path: Path, here: Here
) -> None:
    sweep(study, tmp_path, quiet=True)
    assert tables(tmp_path) == undisturbed
    assert [row["run"] for row in rows(tmp_path)] == [task.name for task in generate_tasks(study)]
    assert here.longest == 5, "tasks are made when somebody can do them"


def test_what_is_done_is_not_done_again(
    study: Study, undisturbed: list[bytes], tmp_path: Path, here: Here, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep(study, tmp_path, quiet=True)
    monkeypatch.setattr(sweeping, "LocalPool", None)  # nobody is hired
    assert sweep(study, tmp_path, quiet=True) == Totals(0, 0, 18, False)
    assert tables(tmp_path) == undisturbed


def test_a_study_that_grows_does_what_is_new_and_one_that_shrinks_nothing(
    study: Study, undisturbed: list[bytes], tmp_path: Path, here: Here
) -> None:
    small = small_study(seeds=range(2, 5), gains={"rapf": {"k_rep": [1.0]}})
    assert sweep(small, tmp_path, quiet=True) == Totals(6, 0, 0, False)
    assert sweep(study, tmp_path, quiet=True) == Totals(12, 0, 6, False)
    assert tables(tmp_path) == undisturbed
    assert sweep(small, tmp_path, quiet=True) == Totals(0, 0, 6, False)
    assert len(rows(tmp_path)) == 6
    assert len(run_folders(tmp_path)) == 18, "they may be wanted again"


def test_a_run_that_was_damaged_or_removed_is_done_again_and_that_is_told(
    study: Study, undisturbed: list[bytes], tmp_path: Path, here: Here, capsys: pytest.CaptureFixture[str]
) -> None:
    sweep(study, tmp_path, quiet=True)
    first, second, *_ = (tmp_path / "runs" / task.name for task in generate_tasks(study))
    (first / "cost.csv").write_bytes((first / "cost.csv").read_bytes().replace(b"1", b"2", 1))
    for path in second.iterdir():
        path.unlink()
    second.rmdir()
    totals = sweep(study, tmp_path)
    assert (totals, totals.damaged) == (Totals(2, 0, 16, False), [first.name])
    assert f"sweep: 1 damaged run will be repeated: {first.name}\n" in capsys.readouterr().err
    assert tables(tmp_path) == undisturbed


def test_a_finished_table_stays_until_all_is_done_again(
    study: Study, undisturbed: list[bytes], tmp_path: Path, here: Here
) -> None:
    sweep(study, tmp_path, quiet=True)
    for task in generate_tasks(study):
        (tmp_path / "runs" / task.name / "row.json").unlink()
    stop = Interruption()
    looks = 0

    def look() -> None:
        nonlocal looks
        looks += 1
        assert tables(tmp_path) == undisturbed
        stop.requested = looks == 3

    here.before = look
    totals = sweep(study, tmp_path, quiet=True, stop=stop)
    assert (totals, totals.table_replaced) == (Totals(3, 0, 0, True), False)
    assert tables(tmp_path) == undisturbed
    here.__init__()
    assert sweep(study, tmp_path, quiet=True).table_replaced
    assert tables(tmp_path) == undisturbed


def test_after_an_upgrade_all_is_done_again_and_a_mixed_table_is_told(
    tmp_path: Path, here: Here, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = small_study()
    old = {**list_result_versions(), "pymunk": "6.0"}
    with open_ledger(tmp_path, study.to_json()) as ledger:
        for task in generate_tasks(study):
            ledger.store(task, replace(perform(task), versions=old))
    more = small_study(seeds=range(3))
    totals = sweep(more, tmp_path, quiet=True, keep_versions=True)
    assert (totals, sorted(totals.versions.values())) == (Totals(2, 0, 4, False), [2, 4])
    totals = sweep(more, tmp_path, quiet=True)
    assert (totals, list(totals.versions.values())) == (Totals(4, 0, 2, False), [6])
    monkeypatch.setattr(sweeping, "describe_version_differences", lambda versions: "numpy 1.9 instead of 2.3")
    told = pytest.raises(OutputError, match=r"expected the same versions everywhere, or --keep-versions")
    with told:
        sweep(small_study(seeds=(9,)), tmp_path, quiet=True)


def test_a_stop_keeps_what_is_done_in_the_table(
    study: Study, undisturbed: list[bytes], tmp_path: Path, here: Here
) -> None:
    last = small_study(seeds=(5,))
    sweep(last, tmp_path, quiet=True)  # rows of the end, done before
    stop = Interruption()
    calls = 0

    def press() -> None:
        nonlocal calls
        calls += 1
        stop.requested = calls == 7

    here.before = press
    assert sweep(study, tmp_path, quiet=True, stop=stop) == Totals(7, 0, 1, True)
    here.before = lambda: None
    # rapf with k_rep 0.3 is not in the study
    done = [task.name for task in generate_tasks(study) if task.name in run_folders(tmp_path)]
    assert len(done) == 7 + 1
    assert [row["run"] for row in rows(tmp_path)] == done
    here._stack.clear()
    here.__init__()
    assert sweep(study, tmp_path, quiet=True) == Totals(10, 0, 8, False)
    assert tables(tmp_path) == undisturbed


def test_failures_are_recorded_and_done_again_when_that_is_wanted(tmp_path: Path, here: Here) -> None:
    flag = tmp_path / "well"
    law = f"        if not Path({str(flag)!r}).exists():\n            raise ValueError('not well')\n"
    name = controller(tmp_path, law)
    study = small_study(controllers=("rapf", name), robots=(2, 400))
    out = tmp_path / "out"
    assert sweep(study, out, quiet=True) == Totals(2, 6, 0, False)
    found = {(row["robots"], row["controller"]): row for row in rows(out)}
    assert found["400", "rapf"]["error"].startswith("start 'corner': room for about")
    assert found["2", name]["error"].startswith("controller 'Mine': ValueError: not well (mine.py, line ")
    assert found["2", name]["mean_distance_m"] == found["2", name]["contacts"] == ""
    assert found["2", "rapf"]["error"] == ""
    failed = out / "runs" / found["2", name]["run"]
    assert sorted(path.name for path in failed.iterdir()) == ["error.json", "row.json"]

    before = tables(out)
    totals = sweep(study, out, quiet=True)
    assert totals == Totals(0, 6, 2, False)
    assert [error.partition(":")[0] for error in totals.errors.values()] == [
        "controller 'Mine'",
        "start 'corner'",
    ]
    assert tables(out) == before
    flag.touch()
    assert sweep(study, out, quiet=True, retry_failed=True) == Totals(2, 4, 2, False)
    assert [row["error"] == "" for row in rows(out)] == [True] * 4 + [False] * 4
    assert len(Record.load(failed)) == 3
    undisturbed = tmp_path / "undisturbed"
    sweep(study, undisturbed, quiet=True)
    assert tables(undisturbed) == tables(out)


def test_a_full_disk_stops_the_sweep_and_the_same_call_goes_on(
    study: Study, undisturbed: list[bytes], tmp_path: Path, here: Here, monkeypatch: pytest.MonkeyPatch
) -> None:
    written, room = Path.write_bytes, 30

    def full(path: Path, content: bytes) -> int:
        nonlocal room
        room -= 1
        if room < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return written(path, content)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OutputError, match="cannot be written: No space left on device"):
        sweep(study, tmp_path, quiet=True)
    monkeypatch.undo()
    done = run_folders(tmp_path)
    assert len(done) == 30 // 4
    assert sorted(row["run"] for row in rows(tmp_path)) == done
    assert not list(tmp_path.rglob("*.part*"))
    monkeypatch.setattr(sweeping, "LocalPool", lambda workers: Here())
    assert sweep(study, tmp_path, quiet=True) == Totals(18 - len(done), 0, len(done), False)
    assert tables(tmp_path) == undisturbed


def test_where_nobody_does_runs_that_is_told_once(
    tmp_path: Path, here: Here, capsys: pytest.CaptureFixture[str]
) -> None:
    here.lonesome = 4
    assert sweep(small_study(seeds=(0,)), tmp_path) == Totals(2, 0, 0, False)
    assert capsys.readouterr().err.count("sweep: 0 of 2 runs, nobody is there; waiting\n") == 1


def test_two_sweeps_do_not_share_a_folder(study: Study, tmp_path: Path, here: Here) -> None:
    def another() -> None:
        with pytest.raises(OutputError, match="another process is using this folder"):
            sweep(study, tmp_path, quiet=True)

    here.before = another
    assert sweep(small_study(seeds=(0,)), tmp_path, quiet=True) == Totals(2, 0, 0, False)


@pytest.mark.parametrize("workers", [0, 2000, -1])
def test_the_number_of_workers_is_checked(workers: int, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"workers: expected a whole number from 1 to 1024, got .*"):
        sweep(small_study(), tmp_path / "out", workers=workers)
    assert not (tmp_path / "out").exists()


def test_a_folder_of_something_else_is_no_place_for_a_sweep(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"format": "robocov-run"}')
    with pytest.raises(InputError, match="expected an empty folder or a sweep"):
        sweep(small_study(), tmp_path)


STUDY = """
maps = ["room.json"]
controllers = ["rapf", "rpf"]
robots = 3
seeds = 30
duration = 4
lattice = 8
record_hz = 1
"""


@pytest.fixture(scope="module")
def longer(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[bytes]]:
    """A study file of some seconds, and the tables of an undisturbed sweep."""
    folder = tmp_path_factory.mktemp("longer")
    save_map(ROOM, folder / "room.json")
    file = folder / "study.toml"
    file.write_text(STUDY)
    assert main(["sweep", str(file), "--out", str(folder / "out"), "--workers", "2", "--json"]) == 0
    return file, tables(folder / "out")


def begun(file: Path, out: Path, least: int = 5) -> subprocess.Popen[str]:
    """Begin a sweep in a process of its own, and wait until some runs are done."""
    process = subprocess.Popen(
        [*COMMAND, str(file), "--out", str(out), "--workers", "2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    end = time.monotonic() + PATIENCE
    while len(done(out)) < least:
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.01)
    return process


def done(out: Path) -> list[str]:
    return [name for name in run_folders(out) if not name.startswith(".")]


def workers_of(process: subprocess.Popen[str]) -> list[int]:
    """Return the processes that do the runs."""
    found: list[int] = []
    for path in Path(f"/proc/{process.pid}/task").glob("*/children"):
        found += [int(pid) for pid in path.read_text().split()]
    return found


def runs(pid: int) -> bool:
    """Return whether a process has not ended yet; somebody may still have to take notice of that."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.slow
@TOGETHER
@LINUX
def test_a_sweep_that_is_killed_goes_on(longer: tuple[Path, list[bytes]], tmp_path: Path) -> None:
    file, expected = longer
    process = begun(file, tmp_path / "out")
    with process:
        workers = workers_of(process)
        assert len(workers) == 2
        process.kill()
    assert 5 <= len(done(tmp_path / "out")) < 60
    end = time.monotonic() + PATIENCE
    while any(map(runs, workers)):
        assert time.monotonic() < end, "workers end with whom they work for"
        time.sleep(0.02)
    assert main(["sweep", str(file), "--out", str(tmp_path / "out"), "--workers", "2", "--json"]) == 0
    assert tables(tmp_path / "out") == expected


@pytest.mark.slow
@TOGETHER
@LINUX
def test_a_worker_that_is_killed_is_replaced(longer: tuple[Path, list[bytes]], tmp_path: Path) -> None:
    file, expected = longer
    with begun(file, tmp_path / "out") as process:
        os.kill(workers_of(process)[0], signal.SIGKILL)
        said, complaints = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, complaints
    assert "60 runs done" in said
    assert "Traceback" not in complaints
    assert tables(tmp_path / "out") == expected


@pytest.mark.slow
@TOGETHER
@POSIX
def test_ctrl_c_keeps_what_is_done_and_says_how_to_go_on(
    longer: tuple[Path, list[bytes]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, expected = longer
    out = tmp_path / "out"
    with begun(file, out) as process:
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        said, complaints = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130, complaints
    assert "Traceback" not in complaints
    assert "Run the same command to resume." in said
    count = len(done(out))
    assert 5 <= count < 60
    assert f"{count} runs done" in said
    assert f"Interrupted with {60 - count} runs left. Partial results are in {out}/." in said
    assert len(rows(out)) == count
    assert main(["sweep", str(file), "--out", str(out), "--workers", "2"]) == 0
    assert f"{count} reused" in capsys.readouterr().out
    assert tables(out) == expected
