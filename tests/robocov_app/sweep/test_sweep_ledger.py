from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from swept import run_folders, small_study

from robocov import __version__
from robocov.errors import InputError, OutputError
from robocov_app.sweep import ledger as ledger_module
from robocov_app.sweep.ledger import Entry, Ledger, Survey, is_sweep, open_ledger
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import Outcome, perform

STUDY = small_study().to_json()
DONE = Outcome(
    {"run.json": b"{}", "cost.csv": b"time_s\n"}, {"mean_distance_m": 0.1 + 0.2, "stuck_robots": None}
)
FAILED = Outcome({"error.json": b"{}"}, {}, "it broke")


@pytest.fixture
def task() -> Task:
    return next(generate_tasks(small_study()))


def test_a_run_is_kept_and_found_again(tmp_path: Path, task: Task) -> None:
    with open_ledger(tmp_path / "deep" / "out", STUDY) as ledger:
        assert ledger.read_entry(task) is None
        ledger.store(task, DONE)
    with open_ledger(tmp_path / "deep" / "out", STUDY) as ledger:
        assert ledger.read_entry(task) == Entry(DONE.figures, None, DONE.versions)
    folder = tmp_path / "deep" / "out" / "runs" / task.name
    assert sorted(path.name for path in folder.iterdir()) == ["cost.csv", "row.json", "run.json"]


def test_a_run_takes_the_place_of_an_earlier_one(tmp_path: Path, task: Task) -> None:
    with open_ledger(tmp_path, STUDY) as ledger:
        ledger.store(task, FAILED)
        assert ledger.read_entry(task) == Entry({}, "it broke", FAILED.versions)
        ledger.store(task, DONE)
        assert ledger.read_entry(task) == Entry(DONE.figures, None, DONE.versions)
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
def test_what_cannot_be_read_is_not_done(tmp_path: Path, task: Task, content: str) -> None:
    with open_ledger(tmp_path, STUDY) as ledger:
        ledger.store(task, DONE)
        (tmp_path / "runs" / task.name / "row.json").write_text(content.replace("DIGEST", task.digest))
        assert ledger.read_entry(task) is None
        ledger.store(task, DONE)
        assert ledger.read_entry(task) is not None


def kept(folder: Path, task: Task, outcome: Outcome | None = None) -> Path:
    """Keep a run that was done; return its folder."""
    with open_ledger(folder, STUDY) as ledger:
        ledger.store(task, outcome or perform(task))
    return folder / "runs" / task.name


def surveyed(folder: Path, task: Task, **options: bool) -> Survey:
    return Ledger(folder).survey([task], **options)


def of_version_1(run: Path) -> None:
    """Make the row of a run what it was before there were check sums."""
    row = json.loads((run / "row.json").read_text())
    old = {name: row[name] for name in ("format", "version", "digest", "figures", "error")}
    (run / "row.json").write_text(json.dumps({**old, "version": 1}) + "\n")


@pytest.mark.parametrize("version", [1, 2])
def test_no_bit_of_a_row_can_flip_unnoticed(tmp_path: Path, task: Task, version: int) -> None:
    run = kept(tmp_path, task)
    if version == 1:
        of_version_1(run)
    row, ledger = run / "row.json", Ledger(tmp_path)
    whole, expected = row.read_bytes(), ledger.read_entry(task)
    assert expected is not None and expected.has_checksums == (version == 2)
    for bit in range(version, 8 * len(whole), 7):
        flipped = bytearray(whole)
        flipped[bit // 8] ^= 1 << bit % 8
        row.write_bytes(flipped)
        assert ledger.read_entry(task) in (None, expected), flipped


@pytest.mark.parametrize("name", ["run.json", "record.npz", "cost.csv", "row.json"])
@pytest.mark.parametrize("damage", ["flipped", "cut", "removed", "folder"])
def test_a_run_of_which_a_file_is_damaged_is_done_again(
    tmp_path: Path, task: Task, name: str, damage: str
) -> None:
    file = kept(tmp_path, task) / name
    assert surveyed(tmp_path, task) == Survey(bytearray([0]))
    content = file.read_bytes()
    file.unlink()
    if damage == "folder":
        file.mkdir()
    elif damage != "removed":
        whole = bytes([content[-3] ^ 1]) + content[-2:]
        file.write_bytes(content[:-3] + whole * (damage == "flipped"))
    survey = surveyed(tmp_path, task)
    assert survey == Survey(bytearray([1]), [task.name])
    assert survey.describe(keep_versions=False) == [f"1 damaged run will be repeated: {task.name}"]
    kept(tmp_path, task)
    assert surveyed(tmp_path, task) == Survey(bytearray([0]))


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
def test_wrong_types_in_a_row_are_damage(tmp_path: Path, task: Task, change: dict[str, object]) -> None:
    row = kept(tmp_path, task) / "row.json"
    row.write_text(json.dumps(json.loads(row.read_text()) | change))
    assert surveyed(tmp_path, task).damaged == [task.name]


def test_runs_of_version_1_can_be_kept_and_it_is_told_that_they_have_no_check_sums(
    tmp_path: Path, task: Task
) -> None:
    of_version_1(kept(tmp_path, task))
    survey = surveyed(tmp_path, task)
    assert (survey.is_left, survey.damaged, survey.without_checksums) == (bytearray([1]), [], 0)
    assert survey.describe(keep_versions=False)[0].startswith(
        f"1 run made with robocov {__version__} instead of "
    )
    survey = surveyed(tmp_path, task, keep_versions=True)
    assert (survey.is_left, survey.without_checksums) == (bytearray([0]), 1)
    told = survey.describe(keep_versions=True)[-1]
    assert told.startswith("1 run of an earlier version of robocov without checksums will be used; damage")


def test_runs_of_other_versions_are_done_again_unless_they_are_to_be_kept(tmp_path: Path, task: Task) -> None:
    kept(tmp_path, task, Outcome(DONE.files, DONE.figures, versions={**DONE.versions, "numpy": "1.9"}))
    difference = f"numpy 1.9 instead of {DONE.versions['numpy']}"
    survey = surveyed(tmp_path, task)
    assert survey == Survey(bytearray([1]), outdated=Counter([difference]))
    assert survey.describe(keep_versions=False) == [
        f"1 run made with {difference} will be repeated",
        "--keep-versions uses them as they are",
    ]
    survey = surveyed(tmp_path, task, keep_versions=True)
    assert survey == Survey(bytearray([0]), outdated=Counter([difference]))
    assert survey.describe(keep_versions=True) == [f"1 run made with {difference} will be used nevertheless"]


def test_a_run_is_on_the_disk_before_it_counts(
    tmp_path: Path, task: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its files and its folder, before the folder gets its name."""
    synced: set[int] = set()
    fsync, rename = os.fsync, Path.rename

    def watched(descriptor: int) -> None:
        synced.add(os.fstat(descriptor).st_ino)
        fsync(descriptor)

    def last(path: Path, target: Path) -> Path:
        assert {each.stat().st_ino for each in (path, *path.iterdir())} <= synced
        return rename(path, target)

    with open_ledger(tmp_path, STUDY) as ledger:
        monkeypatch.setattr(os, "fsync", watched)
        monkeypatch.setattr(Path, "rename", last)
        ledger.store(task, DONE)
    assert run_folders(tmp_path) == [task.name]


def test_a_full_disk_leaves_nothing_of_a_run(
    tmp_path: Path, task: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = Path.write_bytes

    def full(path: Path, content: bytes) -> int:
        if path.name == "row.json":
            written(path, content[:3])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return written(path, content)

    with open_ledger(tmp_path, STUDY) as ledger:
        monkeypatch.setattr(Path, "write_bytes", full)
        with pytest.raises(OutputError, match=f"{task.name}: cannot be written: No space left"):
            ledger.store(task, DONE)
        assert run_folders(tmp_path) == []
        monkeypatch.undo()
        ledger.store(task, DONE)
    assert run_folders(tmp_path) == [task.name]


def test_what_was_left_half_written_goes(tmp_path: Path, task: Task) -> None:
    with open_ledger(tmp_path, STUDY) as ledger:
        ledger.store(task, DONE)
    (tmp_path / "runs" / ".mine.part").mkdir()
    (tmp_path / ".x.part.zip").touch()
    half = tmp_path / "runs" / ".room-rapf-2-corner-0-0123456789.part"
    half.mkdir()
    (half / "run.json").write_text("{")
    (tmp_path / ".results.123.part.parquet").write_text("PAR1")
    with open_ledger(tmp_path, STUDY):
        assert run_folders(tmp_path) == [".mine.part", task.name]
        assert [path.name for path in tmp_path.glob(".*.part.*")] == [".x.part.zip"], "it is not ours"


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
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
        pytest.raises(OutputError, match="cannot be used for results"),
        open_ledger(tmp_path / "notes.txt", STUDY),
    ):
        pass


def test_the_study_of_an_earlier_sweep_is_replaced(tmp_path: Path) -> None:
    with open_ledger(tmp_path, STUDY):
        assert is_sweep(tmp_path)
    with open_ledger(tmp_path, small_study(seeds=(5,)).to_json()):
        pass
    assert json.loads((tmp_path / "study.json").read_text())["seeds"] == [5]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written_to_is_said_so(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="Permission denied"), open_ledger(tmp_path, STUDY):
        pass


def test_one_process_is_at_work_in_a_folder(tmp_path: Path) -> None:
    busy = pytest.raises(OutputError, match="another process is using")
    with open_ledger(tmp_path, STUDY), busy, open_ledger(tmp_path, STUDY):
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


def test_where_files_know_no_locks_the_sweep_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fcntl = pytest.importorskip("fcntl")

    def unknown(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", unknown)
    with open_ledger(tmp_path, STUDY):
        pass


def test_a_study_that_cannot_be_written_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: Path, *_: object, **__: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(ledger_module.Path, "write_text", full)
    with (
        pytest.raises(OutputError, match=r"study.json: cannot be written: No space left"),
        open_ledger(tmp_path, STUDY),
    ):
        pass
