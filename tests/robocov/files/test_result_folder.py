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
from struck_folder import FOREIGN, NEW, NUMBERS, OLD, content, write

from robocov.errors import InputError, OutputError, RobocovError
from robocov.files.result_folder import complete_commit, create_result, extend_result

SCRIPT = Path(__file__).parents[1] / "struck_folder.py"

METRICS = "time_s,sensed_area_m2,range_area_m2\n"

posix = pytest.mark.skipif(os.name == "nt", reason="forks, links and signals of POSIX")


@pytest.fixture(autouse=True, scope="module")
def no_power_failure() -> Iterator[None]:
    """Nothing waits for the disk."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda descriptor: None)
        yield


def saved(folder: Path, files: dict[str, str], *, kind: Any = "run", overwrite: bool = True) -> None:
    with create_result(folder, kind, overwrite=overwrite) as result:
        write(result.staging, files)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


# old or new, whatever happens


@pytest.mark.slow
@posix
@pytest.mark.parametrize("outcome", ["kill", "fail"])
@pytest.mark.parametrize(
    ("scenario", "states"),
    [
        ("fresh", [{}, NUMBERS, NEW]),
        ("replaced", [OLD | FOREIGN, NEW | FOREIGN]),
        ("earlier", [OLD | FOREIGN, NEW | FOREIGN]),
        ("added", [OLD | FOREIGN, OLD | FOREIGN | {"metrics.csv": "new"}]),
    ],
)
def test_after_any_call_there_is_the_old_result_or_the_new_one(
    tmp_path: Path, outcome: str, scenario: str, states: list[dict[str, str]]
) -> None:
    command = [sys.executable, str(SCRIPT), str(tmp_path / "x"), outcome, scenario]
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert all(state in found["states"] for state in states)
    assert all(state in states for state in found["states"])
    assert found["again"] == [states[-1]], "whatever has happened, it can be replaced"
    *statuses, last = found["statuses"]
    assert len(statuses) >= 12 and last == 100
    assert set(statuses) == ({9} if outcome == "kill" else {0, 2})


def test_a_failure_leaves_the_old_result_and_an_interruption_what_was_kept(tmp_path: Path) -> None:
    saved(tmp_path, OLD)
    with pytest.raises(KeyboardInterrupt), create_result(tmp_path, overwrite=True) as result:
        write(result.staging, NEW)
        result.save_progress()
        raise KeyboardInterrupt
    assert content(tmp_path) == OLD
    with pytest.raises(KeyboardInterrupt), create_result(tmp_path / "new", overwrite=True) as result:
        write(result.staging, NUMBERS)
        result.save_progress()
        write(result.staging, NEW)
        raise KeyboardInterrupt
    assert content(tmp_path / "new") == NUMBERS


def test_a_folder_that_nothing_comes_into_goes_again(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), create_result(tmp_path / "a" / "b", overwrite=False):
        raise RuntimeError
    assert names(tmp_path / "a") == []


@posix
def test_a_part_of_a_comparison_whose_replacement_was_interrupted_is_not_read(tmp_path: Path) -> None:
    saved(tmp_path, {"comparison.json": "", "rapf/run.json": "old"}, kind="comparison")
    (tmp_path / ".robocov-commit.json").write_bytes((tmp_path / ".robocov.json").read_bytes())
    with pytest.raises(InputError, match=f"open {tmp_path} to complete it"):
        complete_commit(tmp_path / "rapf")
    complete_commit(tmp_path)
    complete_commit(tmp_path / "rapf")


# one process at a time


@posix
def test_a_second_process_is_told_that_the_folder_is_in_use(tmp_path: Path) -> None:
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
            saved(tmp_path / "x", NEW)
        process.stdin.write("\n")
    assert not (tmp_path / "x").exists()
    saved(tmp_path / "x", NEW)
    assert ".robocov.lock" not in names(tmp_path / "x")


# nobody else's files


def test_a_folder_in_use_needs_overwrite(tmp_path: Path) -> None:
    (tmp_path / "x").touch()
    with pytest.raises(InputError, match="not empty; choose another --out or pass --overwrite"):
        saved(tmp_path, NEW, overwrite=False)


@pytest.mark.parametrize("file", ["cost.csv", "run.json", "notes.txt", "record.npz", "report.html"])
def test_what_is_no_result_is_left_alone(tmp_path: Path, file: str) -> None:
    (tmp_path / file).write_text("{}")
    saved(tmp_path / "project" / "run", OLD)
    for folder in (tmp_path, tmp_path / "project"):
        with pytest.raises(InputError, match="not a result of robocov, so --overwrite leaves it alone"):
            saved(folder, NEW)
    assert (tmp_path / file).read_text() == "{}"
    assert content(tmp_path / "project" / "run") == OLD


def test_a_folder_that_was_emptied_can_be_used_again(tmp_path: Path) -> None:
    saved(tmp_path, NUMBERS)
    for name in NUMBERS:
        (tmp_path / name).unlink()
    saved(tmp_path, NEW, overwrite=False)
    assert content(tmp_path) == NEW


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "x").touch()
    with pytest.raises(OutputError, match="cannot be used for results"):
        saved(tmp_path / "x", NEW)


def test_names_that_are_too_long_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be used for results: File name too long"):
        saved(tmp_path / ("x" * 256), NEW)


@pytest.mark.parametrize("name", ["run.mp4", "frames", "cost.csv/x", "frames/000001.png/x"])
def test_what_is_in_the_way_is_named_before_any_work_is_done(tmp_path: Path, name: str) -> None:
    saved(tmp_path, NUMBERS)
    blocker = tmp_path / name
    blocker.parent.mkdir(parents=True, exist_ok=True)
    blocker.write_text("mine")
    with pytest.raises(OutputError, match="is in the way"), create_result(tmp_path, overwrite=True):
        pytest.fail("it has begun")
    assert content(tmp_path) == NUMBERS | {name: "mine"}


@posix
@pytest.mark.parametrize("link", ["frames", "rapf", ".robocov-new"])
def test_links_in_the_folder_are_not_followed(tmp_path: Path, link: str) -> None:
    outside, out = tmp_path / "outside", tmp_path / "out"
    files = {"run.json": "theirs", "000000.png": "theirs", "comparison.json": "theirs"}
    write(outside, files)
    saved(out, {"comparison.json": "old", "rapf/run.json": "old", "frames/000000.png": "old"})
    if (out / link).exists():
        (out / link).rename(out / "moved")
    (out / link).symlink_to(outside)
    with (
        pytest.raises(OutputError, match="link"),
        create_result(out, "comparison", overwrite=True, parts=["rapf"]) as result,
    ):
        pytest.fail(f"it has begun in {result.staging}")
    assert content(outside) == files


@posix
@pytest.mark.parametrize("name", ["../mine.txt", "frames/../../mine.txt", "/mine.txt", "link/mine.txt", ".."])
@pytest.mark.parametrize("which", [".robocov.json", ".robocov-commit.json"])
def test_no_list_leads_out_of_the_folder(tmp_path: Path, which: str, name: str) -> None:
    out, mine = tmp_path / "out", tmp_path / "mine.txt"
    saved(out, OLD)
    mine.write_text("mine")
    (out / "link").symlink_to(tmp_path)
    listed = {"format": "robocov-folder", "version": 1, "files": [name, *OLD], "removed": [name]}
    (out / which).write_text(json.dumps(listed))
    try:
        saved(out, NEW)
    except RobocovError as error:
        assert "mine.txt" in str(error) or "link" in str(error) or "'..'" in str(error)
    assert mine.read_text() == "mine"
    assert names(tmp_path) == ["mine.txt", "out"]


@pytest.mark.parametrize("which", [".robocov.json", ".robocov-commit.json"])
def test_no_list_of_whoever_sent_a_folder_has_other_files_removed(tmp_path: Path, which: str) -> None:
    saved(tmp_path, OLD)
    (tmp_path / "thesis.docx").write_text("mine")
    listed = {"format": "robocov-folder", "version": 1, "removed": ["thesis.docx"]}
    (tmp_path / which).write_text(json.dumps(listed | {"files": ["thesis.docx", *OLD]}))
    for act in (complete_commit, lambda folder: saved(folder, NEW)):
        with suppress(RobocovError):
            act(tmp_path)
        assert (tmp_path / "thesis.docx").read_text() == "mine"


FOREIGN_NAMES = (
    *("frames/2024-holiday.png", "frames/000000.png", "frames/000007.png", "frames", "run.mp4", "cost.csv"),
    *(".x.part.zip", ".run.77.part.mp4", "rapf/notes.txt", "rapf/run.json", "rapf", "report.html"),
    *("metrics.csv", "comparison.json", "notes.txt", "000000.png", ".robocov-mine"),
)

ACTIONS: dict[str, Callable[[Path], None]] = {
    "run": lambda folder: saved(folder, NEW),
    "film": lambda folder: saved(folder, OLD),
    "comparison": lambda folder: compared(folder),
    "replay": lambda folder: saved(folder, {"replay.json": "", "frames/000000.png": ""}, kind="replay"),
    "metrics": lambda folder: measured(folder),
}


def compared(folder: Path) -> None:
    with create_result(folder, "comparison", overwrite=True, parts=["rapf"]) as result:
        write(result.staging, {"comparison.json": '{"format": "robocov-comparison"}', "rapf/run.json": "new"})


def measured(folder: Path) -> None:
    with extend_result(folder) as result:
        write(result.staging, {"metrics.csv": METRICS, "report.html": ""})


@settings(max_examples=60, deadline=None)
@given(st.lists(st.one_of(st.sampled_from(FOREIGN_NAMES), st.sampled_from(sorted(ACTIONS))), max_size=12))
def test_files_of_others_survive_whatever_is_done(tmp_path_factory: Any, steps: list[str]) -> None:
    """A name puts a file of somebody else there, unless there is something; an action may be refused."""
    folder = tmp_path_factory.mktemp("results") / "x"
    saved(folder, NEW)
    mine: set[str] = set()
    for step in steps:
        path = folder / step
        if step in ACTIONS:
            try:
                ACTIONS[step](folder)
            except RobocovError:
                assert mine, "nothing is in the way"
        elif not os.path.lexists(path) and not any(part.is_file() for part in path.parents):
            path.parent.mkdir(exist_ok=True)
            path.write_text("mine")
            mine.add(step)
        assert all((folder / name).read_text() == "mine" for name in mine)
        assert {name for name in names(folder) if name.startswith(".robocov")} - mine == {".robocov.json"}


def test_a_run_is_replaced_with_what_was_added_to_it_and_not_with_what_others_have(tmp_path: Path) -> None:
    saved(tmp_path, NUMBERS)
    with extend_result(tmp_path) as result:
        write(result.staging, {"metrics.csv": METRICS})
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(OutputError, match=r"report.html: is in the way"), extend_result(tmp_path) as result:
        write(result.staging, {"report.html": "ours"})
    saved(tmp_path, NEW)
    assert content(tmp_path) == NEW | {"report.html": "mine"}


def test_a_run_of_a_comparison_is_extended_there_and_not_replaced_alone(tmp_path: Path) -> None:
    saved(tmp_path, {"comparison.json": "", "rapf/run.json": "old"}, kind="comparison")
    with extend_result(tmp_path / "rapf") as result:
        write(result.staging, {"metrics.csv": METRICS})
    assert names(tmp_path / "rapf") == ["metrics.csv", "run.json"]
    with pytest.raises(InputError, match="belongs to the comparison in"):
        saved(tmp_path / "rapf", NEW)
    saved(tmp_path, NEW)
    assert content(tmp_path) == NEW


# broken results, and those without a manifest


@pytest.mark.parametrize("broken", ["run.json", ".robocov.json"])
def test_a_broken_result_of_ours_can_be_replaced(tmp_path: Path, broken: str) -> None:
    saved(tmp_path, OLD)
    (tmp_path / broken).write_text('{"format": "robo')
    (tmp_path / "notes.txt").write_text("mine")
    saved(tmp_path, NEW)
    assert content(tmp_path) == NEW | {"notes.txt": "mine"}


def test_a_comparison_without_a_manifest_is_replaced_with_its_runs_and_nothing_else(
    tmp_path: Path,
) -> None:
    folder, elsewhere = tmp_path / "comparison", tmp_path / "elsewhere"
    for run in (folder / "rapf", folder / "kept", elsewhere):
        write(run, OLD)
    (folder / "linked").symlink_to(elsewhere)
    write(tmp_path, {"run.json": "mine"})
    listed = {"format": "robocov-comparison", "folders": ["rapf", "linked", "../elsewhere", "..", "."]}
    write(
        folder,
        {"comparison.json": json.dumps(listed), "comparison.csv": "", "mine.txt": "", ".x.part.zip": ""},
    )
    saved(folder, NEW)
    assert not (folder / "rapf").exists() and not (folder / "comparison.csv").exists()
    assert content(folder / "kept") == content(elsewhere) == OLD
    assert (folder / "mine.txt").exists() and (folder / ".x.part.zip").exists()
    assert content(tmp_path)["run.json"] == "mine"
