"""Watching files, with a clock that changes files while the watcher sleeps."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from robocov_app.terminal.file_watching import (
    MAX_SETTLING_TIME_S,
    POLLING_INTERVAL_S,
    SETTLING_TIME_S,
    watch_files,
)


class ClockEndedError(Exception):
    """The clock has no more actions."""


class Clock:
    """Executes one action in each sleep."""

    def __init__(self, *actions: Callable[[], object] | None) -> None:
        self.actions = list(actions)
        self.slept: list[float] = []

    def __call__(self, seconds: float) -> None:
        self.slept.append(seconds)
        if not self.actions:
            raise ClockEndedError
        action = self.actions.pop(0)
        if action is not None:
            action()


def watch_until_end(clock: Clock, *paths: Path) -> list[tuple[Path, ...]]:
    """Watch files until the clock ends, and return all reported changes."""
    reports: list[tuple[Path, ...]] = []
    with pytest.raises(ClockEndedError):
        for changed in watch_files(paths, sleep=clock):
            reports.append(changed)  # noqa: PERF402 - the loop ends with the exception
    return reports


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.json"
    path.write_text("old")
    return path


def replace(path: Path, text: str) -> None:
    """Write a file as most editors do."""
    path.with_suffix(".tmp").write_text(text)
    path.with_suffix(".tmp").replace(path)


def move_away_and_write(path: Path) -> None:
    """Write a file as vim does with a backup copy."""
    path.rename(path.with_suffix(".bak"))
    path.write_text("new")


def test_all_files_are_reported_first_and_unchanged_files_not_again(file: Path, tmp_path: Path) -> None:
    clock = Clock(*[None] * 20)
    assert watch_until_end(clock, file, tmp_path / "none.json") == [(file, tmp_path / "none.json")]
    assert set(clock.slept) == {POLLING_INTERVAL_S}


@pytest.mark.parametrize(
    "change",
    [
        lambda path: path.write_text("newer"),
        lambda path: replace(path, "old"),  # the same text
        move_away_and_write,
        lambda path: path.unlink(),
        lambda path: os.utime(path, ns=(1, 1)),
    ],
)
def test_a_change_is_reported_once(change: Callable[[Path], object], file: Path) -> None:
    clock = Clock(None, lambda: change(file), *[None] * 5)
    assert watch_until_end(clock, file) == [(file,), (file,)]


def test_only_the_saved_file_is_reported(file: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    clock = Clock(lambda: replace(file, "1"), None, None, lambda: other.write_text("2"), *[None] * 4)
    assert watch_until_end(clock, file, other) == [(file, other), (file,), (other,)]


def test_a_file_that_is_removed_and_written_in_pieces_has_one_change(file: Path) -> None:
    pieces = [lambda: file.unlink(), lambda: file.write_text("a"), lambda: file.write_text("ab"), None]
    clock = Clock(*pieces, None, None)
    assert watch_until_end(clock, file) == [(file,), (file,)]
    assert clock.slept[:4] == [POLLING_INTERVAL_S, SETTLING_TIME_S, SETTLING_TIME_S, SETTLING_TIME_S]


def test_files_that_are_saved_together_are_reported_together(file: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    clock = Clock(lambda: replace(file, "1"), lambda: other.write_text("2"), *[None] * 4)
    assert watch_until_end(clock, file, other) == [(file, other), (file, other)]


def test_a_file_that_keeps_changing_is_reported_in_the_end(file: Path) -> None:
    writes: list[Callable[[], object]] = [lambda k=k: file.write_text("x" * k) for k in range(4, 80)]
    clock = Clock(*writes)
    assert len(watch_until_end(clock, file)) == 1 + int(76 // (1 + MAX_SETTLING_TIME_S / SETTLING_TIME_S))


def test_a_link_is_followed(file: Path, tmp_path: Path) -> None:
    link = tmp_path / "link.json"
    link.symlink_to(file)
    clock = Clock(lambda: replace(file, "newer"), *[None] * 4)
    assert watch_until_end(clock, link) == [(link,), (link,)]


def test_an_impossible_file_name_counts_as_a_missing_file() -> None:
    assert len(watch_until_end(Clock(None, None), Path("a\0b"), Path("x" * 5000))) == 1
