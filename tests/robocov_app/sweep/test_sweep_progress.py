"""The printed progress of a sweep."""

from __future__ import annotations

import io
import sys

import pytest

from robocov_app.sweep import progress as progress_module
from robocov_app.sweep.progress import SweepProgress, report_progress


class Clock:
    """A clock that the test sets."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        monkeypatch.setattr(progress_module.time, "perf_counter", lambda: self.now)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    return Clock(monkeypatch)


def test_the_remaining_time_is_estimated_from_the_runs_of_this_call(clock: Clock) -> None:
    progress = SweepProgress(100, start_time=clock.now)
    assert (progress.rate, progress.remaining_time) == (0.0, None)
    progress.reused = 40
    progress.done = 8
    progress.failed = 2
    clock.now += 5.0
    assert progress.rate == 2.0
    assert progress.remaining_time == 25.0
    assert progress.describe() == "50 of 100 runs, 2 failed, 40 reused, 2 per second"


def test_without_a_terminal_lines_are_printed_from_time_to_time(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    progress = SweepProgress(1000, start_time=clock.now)
    with report_progress("sweep", progress, quiet=False) as reporter:
        for _ in range(100):
            clock.now += 0.5
            progress.done += 1
            reporter.update(progress)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 5 + 1
    assert lines[0] == "sweep: 20 of 1000 runs, 2 per second, 8 min 10 s left"
    assert lines[-1] == "sweep: 100 of 1000 runs, 2 per second, 7 min 30 s left"


def test_the_reason_of_a_wait_is_printed_once_instead_of_an_estimate(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    progress = SweepProgress(
        10, start_time=clock.now, done=2, waiting_reason="no workers are connected; waiting"
    )
    with report_progress("sweep", progress, quiet=False) as reporter:
        for _ in range(100):
            clock.now += 1.0
            reporter.update(progress)
        progress.waiting_reason = ""
        progress.lost_workers = 3
    assert capsys.readouterr().err.splitlines() == [
        "sweep: 2 of 10 runs, 2 per second, no workers are connected; waiting",
        "sweep: 2 of 10 runs, 3 workers lost, one every 50 s, 6 min 40 s left",
    ]


def test_a_quiet_sweep_prints_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with report_progress("sweep", SweepProgress(1), quiet=True) as reporter:
        reporter.update(SweepProgress(1))
    assert capsys.readouterr() == ("", "")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_shows_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "120")
    progress = SweepProgress(4)
    with report_progress("[bold]mine[/] [/x]", progress, quiet=False) as reporter:
        progress.done = 1
        progress.failed = 1
        reporter.update(progress)
    output = terminal.getvalue()
    assert "2 of 4 runs, 1 failed" in output
    assert "[bold]mine[/] [/x]" in output
