"""The ledger of a sweep: stored runs, damaged files, and runs of other versions."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from small_studies import build_small_study, list_run_folders

from robocov import __version__
from robocov.errors import InputError, OutputError
from robocov_app.sweep import ledger as ledger_module
from robocov_app.sweep.ledger import Entry, Ledger, Survey, is_sweep, open_ledger
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import Outcome, perform

STUDY = build_small_study().to_json()
DONE = Outcome(
    {"run.json": b"{}", "cost.csv": b"time_s\n"}, {"mean_distance_m": 0.1 + 0.2, "stuck_robots": None}
)
FAILED = Outcome({"error.json": b"{}"}, {}, "it broke")


@pytest.fixture
def task() -> Task:
    return next(generate_tasks(build_small_study()))


def test_stored_runs_are_found_when_the_ledger_is_opened_again(tmp_path: Path, task: Task) -> None:
    with open_ledger(tmp_path / "deep" / "out", STUDY) as ledger:
        assert ledger.read_entry(task) is None
        ledger.store(task, DONE)
    with open_ledger(tmp_path / "deep" / "out", STUDY) as ledger:
        assert ledger.read_entry(task) == Entry(DONE.metrics, None, DONE.versions)
    folder = tmp_path / "deep" / "out" / "runs" / task.name
    assert sorted(path.name for path in folder.iterdir()) == ["cost.csv", "row.json", "run.json"]


def test_a_run_replaces_an_earlier_one(tmp_path: Path, task: Task) -> None:
    with open_ledger(tmp_path, STUDY) as ledger:
        ledger.store(task, FAILED)
        assert ledger.read_entry(task) == Entry({}, "it broke", FAILED.versions)
        ledger.store(task, DONE)
        assert ledger.read_entry(task) == Entry(DONE.metrics, None, DONE.versions)
    assert not (tmp_path / "runs" / task.name / "error.json").exists()


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "[]",
        "{}",
        '{"format": "robocov-row", "digest": "another", "figures": {}, "error": null}',
        '{"format": "else", "digest": "DIGEST", "figures": {}, "error": null}',
        '{"format": "robocov-row", "digest": "DIGEST", "figures": 3, "error": null}',
        "[" * 100_000,
    ],
)
def test_runs_with_unreadable_rows_count_as_not_done(tmp_path: Path, task: Task, content: str) -> None:
    with open_ledger(tmp_path, STUDY) as ledger:
        ledger.store(task, DONE)
        (tmp_path / "runs" / task.name / "row.json").write_text(content.replace("DIGEST", task.input_hash))
        assert ledger.read_entry(task) is None
        ledger.store(task, DONE)
        assert ledger.read_entry(task) is not None


def store_run(folder: Path, task: Task, outcome: Outcome | None = None) -> Path:
    """Store a run in a ledger, and return the folder of the run."""
    with open_ledger(folder, STUDY) as ledger:
        ledger.store(task, outcome or perform(task))
    return folder / "runs" / task.name


def survey_folder(folder: Path, task: Task, **options: bool) -> Survey:
    return Ledger(folder).survey([task], **options)


def convert_to_version_1(run: Path) -> None:
    """Convert the row of a run to the format without checksums."""
    row = json.loads((run / "row.json").read_text())
    old = {name: row[name] for name in ("format", "version", "digest", "figures", "error")}
    (run / "row.json").write_text(json.dumps({**old, "version": 1}) + "\n")


@pytest.mark.parametrize("version", [1, 2])
def test_every_flipped_bit_of_a_row_is_detected(tmp_path: Path, task: Task, version: int) -> None:
    run = store_run(tmp_path, task)
    if version == 1:
        convert_to_version_1(run)
    row = run / "row.json"
    ledger = Ledger(tmp_path)
    content = row.read_bytes()
    expected = ledger.read_entry(task)
    assert expected is not None and expected.has_checksums == (version == 2)
    for bit in range(version, 8 * len(content), 7):
        flipped = bytearray(content)
        flipped[bit // 8] ^= 1 << bit % 8
        row.write_bytes(flipped)
        assert ledger.read_entry(task) in (None, expected), flipped


@pytest.mark.parametrize("name", ["run.json", "record.npz", "cost.csv", "row.json"])
@pytest.mark.parametrize("damage", ["flipped", "cut", "removed", "folder"])
def test_a_run_with_a_damaged_file_must_be_repeated(
    tmp_path: Path, task: Task, name: str, damage: str
) -> None:
    file = store_run(tmp_path, task) / name
    assert survey_folder(tmp_path, task) == Survey(must_execute=bytearray([0]))
    content = file.read_bytes()
    if damage == "cut":
        file.write_bytes(content[:-3])
    elif damage == "flipped":
        file.write_bytes(content[:-3] + bytes([content[-3] ^ 1]) + content[-2:])
    elif damage == "folder":
        file.unlink()
        file.mkdir()
    else:
        file.unlink()
    survey = survey_folder(tmp_path, task)
    assert survey == Survey(must_execute=bytearray([1]), damaged=[task.name])
    assert survey.describe(keep_versions=False) == [f"1 damaged run will be repeated: {task.name}"]
    store_run(tmp_path, task)
    assert survey_folder(tmp_path, task) == Survey(must_execute=bytearray([0]))


@pytest.mark.parametrize(
    "change",
    [
        {"figures": {"mean_distance_m": "1.0"}},
        {"figures": [["mean_distance_m", 1.0]]},
        {"figures": None},
        {"error": 3},
        {"version": "2"},
        {"files": {"run.json": None}},
        {"check_sum": None},
    ],
)
def test_rows_with_wrong_types_count_as_damaged(
    tmp_path: Path, task: Task, change: dict[str, object]
) -> None:
    row = store_run(tmp_path, task) / "row.json"
    row.write_text(json.dumps(json.loads(row.read_text()) | change))
    assert survey_folder(tmp_path, task).damaged == [task.name]


def test_runs_without_checksums_can_be_used_with_a_remark(tmp_path: Path, task: Task) -> None:
    convert_to_version_1(store_run(tmp_path, task))
    survey = survey_folder(tmp_path, task)
    assert (survey.must_execute, survey.damaged, survey.without_checksums) == (bytearray([1]), [], 0)
    assert survey.describe(keep_versions=False)[0].startswith(
        f"1 run made with robocov {__version__} instead of "
    )
    survey = survey_folder(tmp_path, task, keep_versions=True)
    assert (survey.must_execute, survey.without_checksums) == (bytearray([0]), 1)
    remark = survey.describe(keep_versions=True)[-1]
    assert remark.startswith("1 run of an earlier version of robocov without checksums will be used; damage")


def test_runs_of_other_versions_are_repeated_unless_they_are_to_be_used(tmp_path: Path, task: Task) -> None:
    store_run(tmp_path, task, Outcome(DONE.files, DONE.metrics, versions={**DONE.versions, "numpy": "1.9"}))
    difference = f"numpy 1.9 instead of {DONE.versions['numpy']}"
    survey = survey_folder(tmp_path, task)
    assert survey == Survey(bytearray([1]), outdated=Counter([difference]))
    assert survey.describe(keep_versions=False) == [
        f"1 run made with {difference} will be repeated",
        "--keep-versions reuses them as they are",
    ]
    survey = survey_folder(tmp_path, task, keep_versions=True)
    assert survey == Survey(bytearray([0]), outdated=Counter([difference]))
    assert survey.describe(keep_versions=True) == [f"1 run made with {difference} will be reused anyway"]


def test_a_run_is_on_the_disk_before_its_folder_gets_its_name(
    tmp_path: Path, task: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: set[int] = set()
    fsync = os.fsync
    rename = Path.rename

    def record_sync(descriptor: int) -> None:
        synced.add(os.fstat(descriptor).st_ino)
        fsync(descriptor)

    def check_and_rename(path: Path, target: Path) -> Path:
        assert {item.stat().st_ino for item in (path, *path.iterdir())} <= synced
        return rename(path, target)

    with open_ledger(tmp_path, STUDY) as ledger:
        monkeypatch.setattr(os, "fsync", record_sync)
        monkeypatch.setattr(Path, "rename", check_and_rename)
        ledger.store(task, DONE)
    assert list_run_folders(tmp_path) == [task.name]


def test_a_full_disk_leaves_no_partial_run(
    tmp_path: Path, task: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_bytes = Path.write_bytes

    def fill_disk(path: Path, content: bytes) -> int:
        if path.name == "row.json":
            write_bytes(path, content[:3])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write_bytes(path, content)

    with open_ledger(tmp_path, STUDY) as ledger:
        monkeypatch.setattr(Path, "write_bytes", fill_disk)
        with pytest.raises(OutputError, match=f"{task.name}: cannot be written: No space left"):
            ledger.store(task, DONE)
        assert list_run_folders(tmp_path) == []
        monkeypatch.undo()
        ledger.store(task, DONE)
    assert list_run_folders(tmp_path) == [task.name]


def test_incomplete_files_of_sweeps_are_removed(tmp_path: Path, task: Task) -> None:
    with open_ledger(tmp_path, STUDY) as ledger:
        ledger.store(task, DONE)
    (tmp_path / "runs" / ".mine.part").mkdir()
    (tmp_path / ".x.part.zip").touch()
    incomplete = tmp_path / "runs" / ".room-rapf-2-corner-0-0123456789.part"
    incomplete.mkdir()
    (incomplete / "run.json").write_text("{")
    (tmp_path / ".results.123.part.parquet").write_text("PAR1")
    with open_ledger(tmp_path, STUDY):
        assert list_run_folders(tmp_path) == [".mine.part", task.name]
        assert [path.name for path in tmp_path.glob(".*.part.*")] == [".x.part.zip"], "not a file of a sweep"


def test_other_folders_are_not_changed(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with (
        pytest.raises(InputError, match="expected an empty folder or a sweep"),
        open_ledger(tmp_path, STUDY),
    ):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
    (tmp_path / "study.json").write_text('{"format": "robocov-map"}')
    assert not is_sweep(tmp_path)
    with (
        pytest.raises(OutputError, match="expected a folder, got a file"),
        open_ledger(tmp_path / "notes.txt", STUDY),
    ):
        pass


def test_the_study_of_an_earlier_sweep_is_replaced(tmp_path: Path) -> None:
    with open_ledger(tmp_path, STUDY):
        assert is_sweep(tmp_path)
    with open_ledger(tmp_path, build_small_study(seeds=(5,)).to_json()):
        pass
    assert json.loads((tmp_path / "study.json").read_text())["seeds"] == [5]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_write_permission_is_rejected(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="Permission denied"), open_ledger(tmp_path, STUDY):
        pass


def test_only_one_process_can_use_a_folder(tmp_path: Path) -> None:
    with (
        open_ledger(tmp_path, STUDY),
        pytest.raises(OutputError, match="another process is using"),
        open_ledger(tmp_path, STUDY),
    ):
        pass
    with open_ledger(tmp_path, STUDY):
        pass


def test_a_lock_ends_with_its_process(tmp_path: Path) -> None:
    script = (
        "import sys, time\nfrom pathlib import Path\nfrom robocov.files.folder_lock import lock_folder\n"
        "with lock_folder(Path(sys.argv[1])):\n    print('locked', flush=True)\n    time.sleep(60)\n"
    )
    command = [sys.executable, "-c", script, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "locked\n"
        with pytest.raises(OutputError, match="another process is using"), open_ledger(tmp_path, STUDY):
            pass
        process.kill()
        process.wait()
    with open_ledger(tmp_path, STUDY):
        pass


def test_file_systems_without_locks_can_be_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fcntl = pytest.importorskip("fcntl")

    def fail(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", fail)
    with open_ledger(tmp_path, STUDY):
        pass


def test_an_error_while_the_study_is_written_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(self: Path, *_: object, **__: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(ledger_module.Path, "write_text", fail)
    with (
        pytest.raises(OutputError, match=r"study.json: cannot be written: No space left"),
        open_ledger(tmp_path, STUDY),
    ):
        pass
