"""Files that are watched, with a clock of the test's own: what happens while it sleeps is written down."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from robocov_app.terminal.file_watching import (
    MAX_SETTLING_TIME_S,
    POLLING_INTERVAL_S,
    SETTLING_TIME_S,
    watch_files,
)


class EndedError(Exception):
    pass


class Clock:
    """Does one thing in each sleep."""

    def __init__(self, *acts: Callable[[], object] | None) -> None:
        self.acts = list(acts)
        self.slept: list[float] = []

    def __call__(self, seconds: float) -> None:
        self.slept.append(seconds)
        if not self.acts:
            raise EndedError
        act = self.acts.pop(0)
        if act is not None:
            act()


def found(clock: Clock, *paths: Path) -> list[tuple[Path, ...]]:
    seen: list[tuple[Path, ...]] = []

    def watched() -> Iterator[None]:
        for changed in watch_files(paths, sleep=clock):
            seen.append(changed)
            yield

    with pytest.raises(EndedError):
        list(watched())
    return seen


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.json"
    path.write_text("old")
    return path


def replaced(path: Path, text: str) -> None:
    """Write as most editors do."""
    path.with_suffix(".tmp").write_text(text)
    path.with_suffix(".tmp").replace(path)


def moved_away_and_written(path: Path) -> None:
    """Write as vim does with a backup copy."""
    path.rename(path.with_suffix(".bak"))
    path.write_text("new")


def test_at_first_all_files_are_there_and_then_nothing_happens(file: Path, tmp_path: Path) -> None:
    clock = Clock(*[None] * 20)
    assert found(clock, file, tmp_path / "none.json") == [(file, tmp_path / "none.json")]
    assert set(clock.slept) == {POLLING_INTERVAL_S}


@pytest.mark.parametrize(
    "act",
    [
        lambda path: path.write_text("newer"),
        lambda path: replaced(path, "old"),  # the same text
        moved_away_and_written,
        lambda path: path.unlink(),
        lambda path: os.utime(path, ns=(1, 1)),
    ],
)
def test_a_change_is_told_once(act: Callable[[Path], object], file: Path) -> None:
    clock = Clock(None, lambda: act(file), *[None] * 5)
    assert found(clock, file) == [(file,), (file,)]


def test_each_save_is_a_change_of_its_file_alone(file: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    clock = Clock(lambda: replaced(file, "1"), None, None, lambda: other.write_text("2"), *[None] * 4)
    assert found(clock, file, other) == [(file, other), (file,), (other,)]


def test_what_is_written_in_pieces_or_by_removing_first_is_one_change(file: Path) -> None:
    pieces = [lambda: file.unlink(), lambda: file.write_text("a"), lambda: file.write_text("ab"), None]
    clock = Clock(*pieces, None, None)
    assert found(clock, file) == [(file,), (file,)]
    assert clock.slept[:4] == [POLLING_INTERVAL_S, SETTLING_TIME_S, SETTLING_TIME_S, SETTLING_TIME_S]


def test_a_second_file_that_is_saved_meanwhile_comes_with_it(file: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    clock = Clock(lambda: replaced(file, "1"), lambda: other.write_text("2"), *[None] * 4)
    assert found(clock, file, other) == [(file, other), (file, other)]


def test_a_file_that_never_settles_is_told_all_the_same(file: Path) -> None:
    grown: list[Callable[[], object]] = [lambda k=k: file.write_text("x" * k) for k in range(4, 80)]
    clock = Clock(*grown)
    assert len(found(clock, file)) == 1 + int(76 // (1 + MAX_SETTLING_TIME_S / SETTLING_TIME_S))


def test_a_link_is_followed(file: Path, tmp_path: Path) -> None:
    link = tmp_path / "link.json"
    link.symlink_to(file)
    clock = Clock(lambda: replaced(file, "newer"), *[None] * 4)
    assert found(clock, link) == [(link,), (link,)]


def test_a_name_that_no_file_can_have_is_a_file_that_is_not_there() -> None:
    assert len(found(Clock(None, None), Path("a\0b"), Path("x" * 5000))) == 1
