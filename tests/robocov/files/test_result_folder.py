"""Folders of results: interruptions, replacement of earlier results, and simultaneous processes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from interrupted_results import FOREIGN, NEW, NUMBERS, OLD, ExitStatus, read_contents, write_files
from property_examples import count_examples

from robocov.errors import InputError, OutputError, RobocovError
from robocov.files.result_folder import complete_commit, create_result, extend_result

SCRIPT = Path(__file__).parents[1] / "interrupted_results.py"

METRICS = "time_s,sensed_area_m2,range_area_m2\n"

posix = pytest.mark.skipif(os.name == "nt", reason="forks, links and signals of POSIX")


@pytest.fixture(autouse=True, scope="module")
def no_power_failure() -> Iterator[None]:
    """Do not wait for the disk."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda descriptor: None)
        yield


def save_result(folder: Path, files: dict[str, str], *, kind: Any = "run", overwrite: bool = True) -> None:
    with create_result(folder, kind, overwrite=overwrite) as result:
        write_files(result.staging, files)


def list_names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


# The folder contains the old result or the new one, whatever happens.


@pytest.mark.slow
@posix
@pytest.mark.parametrize("outcome", ["kill", "fail"])
@pytest.mark.parametrize(
    ("scenario", "states"),
    [
        ("empty folder", [{}, NUMBERS, NEW]),
        ("old result", [OLD | FOREIGN, NEW | FOREIGN]),
        ("no manifest", [OLD | FOREIGN, NEW | FOREIGN]),
        ("extension", [OLD | FOREIGN, OLD | FOREIGN | {"metrics.csv": "new"}]),
    ],
)
def test_after_an_interruption_the_folder_contains_the_old_or_the_new_result(
    tmp_path: Path, outcome: str, scenario: str, states: list[dict[str, str]]
) -> None:
    command = [sys.executable, str(SCRIPT), str(tmp_path / "x"), outcome, scenario]
    report = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert all(state in report["states"] for state in states)
    assert all(state in states for state in report["states"])
    assert report["states_after_retry"] == [states[-1]]
    *statuses, last_status = report["statuses"]
    assert len(statuses) >= 12 and last_status == ExitStatus.COMPLETED
    expected_statuses = {ExitStatus.TOLERATED, ExitStatus.REPORTED}
    if outcome == "kill":
        expected_statuses = {ExitStatus.KILLED}
    assert set(statuses) == expected_statuses


@pytest.mark.parametrize("has_manifest", [True, False])
def test_a_branch_with_the_former_file_name_is_replaced(tmp_path: Path, has_manifest: bool) -> None:
    former = {"story.json": '{"format": "robocov-story"}', "session.robocov": "session", "notes.txt": "mine"}
    write_files(tmp_path, former)
    if has_manifest:
        manifest = {"format": "robocov-folder", "version": 1, "files": ["session.robocov", "story.json"]}
        (tmp_path / ".robocov.json").write_text(json.dumps(manifest))
    branch = {"branch.json": '{"format": "robocov-branch"}', "session.robocov": "new"}
    save_result(tmp_path, branch, kind="branch")
    assert read_contents(tmp_path) == branch | {"notes.txt": "mine"}


def test_an_error_keeps_the_old_result_and_saved_progress(tmp_path: Path) -> None:
    save_result(tmp_path, OLD)
    with pytest.raises(KeyboardInterrupt), create_result(tmp_path, overwrite=True) as result:
        write_files(result.staging, NEW)
        result.save_progress()
        raise KeyboardInterrupt
    assert read_contents(tmp_path) == OLD
    with pytest.raises(KeyboardInterrupt), create_result(tmp_path / "new", overwrite=True) as result:
        write_files(result.staging, NUMBERS)
        result.save_progress()
        write_files(result.staging, NEW)
        raise KeyboardInterrupt
    assert read_contents(tmp_path / "new") == NUMBERS


def test_an_empty_folder_is_removed_after_an_error(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), create_result(tmp_path / "a" / "b", overwrite=False):
        raise RuntimeError
    assert list_names(tmp_path / "a") == []


@posix
def test_a_part_of_a_comparison_whose_replacement_was_interrupted_is_not_read(tmp_path: Path) -> None:
    save_result(tmp_path, {"comparison.json": "", "rapf/run.json": "old"}, kind="comparison")
    (tmp_path / ".robocov-commit.json").write_bytes((tmp_path / ".robocov.json").read_bytes())
    with pytest.raises(InputError, match=f"open {tmp_path} to complete it"):
        complete_commit(tmp_path / "rapf")
    complete_commit(tmp_path)
    complete_commit(tmp_path / "rapf")


# Only one process writes at a time.


@posix
def test_a_second_process_gets_an_error(tmp_path: Path) -> None:
    script = (
        "import sys\nfrom pathlib import Path\nfrom robocov.files.result_folder import create_result\n"
        "with create_result(Path(sys.argv[1]), overwrite=True):\n"
        "    print('started', flush=True)\n    input()\n"
    )
    command = [sys.executable, "-c", script, str(tmp_path / "x")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None and process.stdout is not None
        assert process.stdout.readline() == "started\n"
        with pytest.raises(OutputError, match="another process is using this folder"):
            save_result(tmp_path / "x", NEW)
        process.stdin.write("\n")
    assert not (tmp_path / "x").exists()
    save_result(tmp_path / "x", NEW)
    assert ".robocov.lock" not in list_names(tmp_path / "x")


# Files of the user are never changed.


def test_a_folder_in_use_needs_overwrite(tmp_path: Path) -> None:
    (tmp_path / "x").touch()
    with pytest.raises(InputError, match="not empty; choose another --out or pass --overwrite"):
        save_result(tmp_path, NEW, overwrite=False)


@pytest.mark.parametrize("file", ["cost.csv", "run.json", "notes.txt", "record.npz", "report.html"])
def test_folders_without_a_result_are_rejected(tmp_path: Path, file: str) -> None:
    (tmp_path / file).write_text("{}")
    save_result(tmp_path / "project" / "run", OLD)
    for folder in (tmp_path, tmp_path / "project"):
        with pytest.raises(InputError, match="not a robocov result, so --overwrite does not replace it"):
            save_result(folder, NEW)
    assert (tmp_path / file).read_text() == "{}"
    assert read_contents(tmp_path / "project" / "run") == OLD


def test_an_emptied_result_folder_can_be_used_again(tmp_path: Path) -> None:
    save_result(tmp_path, NUMBERS)
    for name in NUMBERS:
        (tmp_path / name).unlink()
    save_result(tmp_path, NEW, overwrite=False)
    assert read_contents(tmp_path) == NEW


def test_a_file_instead_of_a_folder_is_rejected(tmp_path: Path) -> None:
    (tmp_path / "x").touch()
    with pytest.raises(OutputError, match="x: expected a folder, got a file"):
        save_result(tmp_path / "x", NEW)


def test_names_that_are_too_long_give_an_error(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written: File name too long"):
        save_result(tmp_path / ("x" * 256), NEW)


@pytest.mark.parametrize("name", ["run.mp4", "frames", "cost.csv/x", "frames/000001.png/x"])
def test_files_in_the_way_are_reported_before_any_work(tmp_path: Path, name: str) -> None:
    save_result(tmp_path, NUMBERS)
    blocker = tmp_path / name
    blocker.parent.mkdir(parents=True, exist_ok=True)
    blocker.write_text("mine")
    with pytest.raises(OutputError, match="is in the way"), create_result(tmp_path, overwrite=True):
        pytest.fail("the work has started")
    assert read_contents(tmp_path) == NUMBERS | {name: "mine"}


@posix
@pytest.mark.parametrize("link", ["frames", "rapf", ".robocov-new"])
def test_links_in_the_folder_are_not_followed(tmp_path: Path, link: str) -> None:
    outside = tmp_path / "outside"
    out = tmp_path / "out"
    files = {"run.json": "theirs", "000000.png": "theirs", "comparison.json": "theirs"}
    write_files(outside, files)
    save_result(out, {"comparison.json": "old", "rapf/run.json": "old", "frames/000000.png": "old"})
    if (out / link).exists():
        (out / link).rename(out / "moved")
    (out / link).symlink_to(outside)
    with (
        pytest.raises(OutputError, match="link"),
        create_result(out, "comparison", overwrite=True, run_names=["rapf"]) as result,
    ):
        pytest.fail(f"the work has started in {result.staging}")
    assert read_contents(outside) == files


@posix
@pytest.mark.parametrize("name", ["../mine.txt", "frames/../../mine.txt", "/mine.txt", "link/mine.txt", ".."])
@pytest.mark.parametrize("list_file", [".robocov.json", ".robocov-commit.json"])
def test_lists_of_files_cannot_lead_out_of_the_folder(tmp_path: Path, list_file: str, name: str) -> None:
    out = tmp_path / "out"
    mine = tmp_path / "mine.txt"
    save_result(out, OLD)
    mine.write_text("mine")
    (out / "link").symlink_to(tmp_path)
    manifest = {"format": "robocov-folder", "version": 1, "files": [name, *OLD], "removed": [name]}
    (out / list_file).write_text(json.dumps(manifest))
    try:
        save_result(out, NEW)
    except RobocovError as error:
        assert "mine.txt" in str(error) or "link" in str(error) or "'..'" in str(error)
    assert mine.read_text() == "mine"
    assert list_names(tmp_path) == ["mine.txt", "out"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ([], "expected a JSON object, got []"),
        ({}, "format: expected 'robocov-folder', got None"),
        ({"format": "robocov-folder", "version": 2}, "version: expected 1, got 2"),
        ({"format": "robocov-folder", "version": 1}, "files: expected a list of files, got None"),
        (
            {"format": "robocov-folder", "version": 1, "files": [1]},
            "files: expected a list of files, got [1]",
        ),
    ],
)
def test_errors_name_what_is_wrong_with_a_journal(tmp_path: Path, content: object, message: str) -> None:
    save_result(tmp_path, OLD)
    (tmp_path / ".robocov-commit.json").write_text(json.dumps(content))
    with pytest.raises(InputError) as caught:
        complete_commit(tmp_path)
    assert str(caught.value) == f"{tmp_path / '.robocov-commit.json'}: cannot be used: {message}"


@pytest.mark.parametrize("list_file", [".robocov.json", ".robocov-commit.json"])
def test_forged_lists_of_files_remove_nothing_else(tmp_path: Path, list_file: str) -> None:
    save_result(tmp_path, OLD)
    (tmp_path / "thesis.docx").write_text("mine")
    manifest = {"format": "robocov-folder", "version": 1, "removed": ["thesis.docx"]}
    (tmp_path / list_file).write_text(json.dumps(manifest | {"files": ["thesis.docx", *OLD]}))
    for act in (complete_commit, lambda folder: save_result(folder, NEW)):
        with suppress(RobocovError):
            act(tmp_path)
        assert (tmp_path / "thesis.docx").read_text() == "mine"


FOREIGN_NAMES = (
    "frames/2024-holiday.png",
    "frames/000000.png",
    "frames/000007.png",
    "frames",
    "run.mp4",
    "cost.csv",
    ".x.part.zip",
    ".run.77.part.mp4",
    "rapf/notes.txt",
    "rapf/run.json",
    "rapf",
    "report.html",
    "metrics.csv",
    "comparison.json",
    "notes.txt",
    "000000.png",
    ".robocov-mine",
)

ACTIONS: dict[str, Callable[[Path], None]] = {
    "run": lambda folder: save_result(folder, NEW),
    "film": lambda folder: save_result(folder, OLD),
    "comparison": lambda folder: save_comparison(folder),
    "replay": lambda folder: save_result(folder, {"replay.json": "", "frames/000000.png": ""}, kind="replay"),
    "metrics": lambda folder: add_metrics(folder),
}


def save_comparison(folder: Path) -> None:
    with create_result(folder, "comparison", overwrite=True, run_names=["rapf"]) as result:
        write_files(
            result.staging, {"comparison.json": '{"format": "robocov-comparison"}', "rapf/run.json": "new"}
        )


def add_metrics(folder: Path) -> None:
    with extend_result(folder) as result:
        write_files(result.staging, {"metrics.csv": METRICS, "report.html": ""})


@settings(max_examples=count_examples(60), deadline=None)
@given(st.lists(st.one_of(st.sampled_from(FOREIGN_NAMES), st.sampled_from(sorted(ACTIONS))), max_size=12))
def test_files_of_the_user_survive_all_actions(tmp_path_factory: Any, steps: list[str]) -> None:
    """A step is an action, or the name of a file that the user adds unless it exists. Actions may fail."""
    folder = tmp_path_factory.mktemp("results") / "x"
    save_result(folder, NEW)
    foreign_names: set[str] = set()
    for step in steps:
        path = folder / step
        if step in ACTIONS:
            try:
                ACTIONS[step](folder)
            except RobocovError:
                assert foreign_names, "there are no files of the user in the way"
        elif not os.path.lexists(path) and not any(part.is_file() for part in path.parents):
            path.parent.mkdir(exist_ok=True)
            path.write_text("mine")
            foreign_names.add(step)
        assert all((folder / name).read_text() == "mine" for name in foreign_names)
        assert {name for name in list_names(folder) if name.startswith(".robocov")} - foreign_names == {
            ".robocov.json"
        }


def test_a_run_is_replaced_with_its_extensions_but_not_with_files_of_the_user(tmp_path: Path) -> None:
    save_result(tmp_path, NUMBERS)
    with extend_result(tmp_path) as result:
        write_files(result.staging, {"metrics.csv": METRICS})
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(OutputError, match=r"report.html: is in the way"), extend_result(tmp_path) as result:
        write_files(result.staging, {"report.html": "ours"})
    save_result(tmp_path, NEW)
    assert read_contents(tmp_path) == NEW | {"report.html": "mine"}


def test_a_run_of_a_comparison_can_be_extended_but_not_replaced_alone(tmp_path: Path) -> None:
    save_result(tmp_path, {"comparison.json": "", "rapf/run.json": "old"}, kind="comparison")
    with extend_result(tmp_path / "rapf") as result:
        write_files(result.staging, {"metrics.csv": METRICS})
    assert list_names(tmp_path / "rapf") == ["metrics.csv", "run.json"]
    with pytest.raises(InputError, match="belongs to the comparison in"):
        save_result(tmp_path / "rapf", NEW)
    save_result(tmp_path, NEW)
    assert read_contents(tmp_path) == NEW


# Broken results, and results without a manifest.


@pytest.mark.parametrize("broken", ["run.json", ".robocov.json"])
def test_a_broken_result_can_be_replaced(tmp_path: Path, broken: str) -> None:
    save_result(tmp_path, OLD)
    (tmp_path / broken).write_text('{"format": "robo')
    (tmp_path / "notes.txt").write_text("mine")
    save_result(tmp_path, NEW)
    assert read_contents(tmp_path) == NEW | {"notes.txt": "mine"}


def test_a_comparison_without_a_manifest_is_replaced_with_its_runs_only(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "comparison"
    elsewhere = tmp_path / "elsewhere"
    for run in (folder / "rapf", folder / "kept", elsewhere):
        write_files(run, OLD)
    (folder / "linked").symlink_to(elsewhere)
    write_files(tmp_path, {"run.json": "mine"})
    comparison = {
        "format": "robocov-comparison",
        "folders": ["rapf", "linked", "../elsewhere", "..", ".", ""],
    }
    write_files(
        folder,
        {"comparison.json": json.dumps(comparison), "comparison.csv": "", "mine.txt": "", ".x.part.zip": ""},
    )
    save_result(folder, NEW)
    assert not (folder / "rapf").exists() and not (folder / "comparison.csv").exists()
    assert read_contents(folder / "kept") == read_contents(elsewhere) == OLD
    assert (folder / "mine.txt").exists() and (folder / ".x.part.zip").exists()
    assert read_contents(tmp_path)["run.json"] == "mine"
