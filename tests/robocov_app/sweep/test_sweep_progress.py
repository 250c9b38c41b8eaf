from __future__ import annotations

import io
import sys

import pytest

from robocov_app.sweep import sweeping as telling
from robocov_app.sweep.sweeping import Count, sweep_progress


class Clock:
    """Time that passes when it is told to."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        monkeypatch.setattr(telling.time, "perf_counter", lambda: self.now)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    return Clock(monkeypatch)


def test_what_is_left_is_estimated_from_what_was_done_now(clock: Clock) -> None:
    count = Count(100, began=clock.now)
    assert (count.rate, count.left) == (0.0, None)
    count.reused, count.done, count.failed = 40, 8, 2
    clock.now += 5.0
    assert count.rate == 2.0
    assert count.left == 25.0
    assert str(count) == "50 of 100 runs, 2 failed, 40 were there, 2 a second"


def test_where_there_is_no_terminal_a_line_comes_now_and_then(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    count = Count(1000, began=clock.now)
    with sweep_progress("sweep", count, quiet=False) as tell:
        for _ in range(100):
            clock.now += 0.5
            count.done += 1
            tell(count)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 5 + 1
    assert lines[0] == "sweep: 20 of 1000 runs, 2 a second, 8 min 10 s left"
    assert lines[-1] == "sweep: 100 of 1000 runs, 2 a second, 7 min 30 s left"


def test_a_wait_is_told_once_in_place_of_an_estimate(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    count = Count(10, began=clock.now, done=2, waiting="nobody is there; waiting")
    with sweep_progress("sweep", count, quiet=False) as tell:
        for _ in range(100):
            clock.now += 1.0
            tell(count)
        count.waiting, count.lost = "", 3
    assert capsys.readouterr().err.splitlines() == [
        "sweep: 2 of 10 runs, 2 a second, nobody is there; waiting",
        "sweep: 2 of 10 runs, 3 workers lost, 0.02 a second, 6 min 40 s left",
    ]


def test_nobody_is_told_when_nobody_wants_to_know(capsys: pytest.CaptureFixture[str]) -> None:
    with sweep_progress("sweep", Count(1), quiet=True) as tell:
        tell(Count(1))
    assert capsys.readouterr() == ("", "")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_gets_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "120")
    count = Count(4)
    with sweep_progress("[bold]mine[/] [/x]", count, quiet=False) as tell:
        count.done, count.failed = 1, 1
        tell(count)
    said = terminal.getvalue()
    assert "2 of 4 runs, 1 failed" in said
    assert "[bold]mine[/] [/x]" in said
