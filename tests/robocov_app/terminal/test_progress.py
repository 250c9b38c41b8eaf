"""Progress bars, and progress without a terminal."""

import re
from typing import Any

import pytest

from robocov.compiled import kernel
from robocov_app.terminal import progress
from robocov_app.terminal.progress import show_progress


def test_one_plain_line_where_there_is_no_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    with show_progress("counting", 3) as update:
        for done in (1, 2, 3):
            update(done)
    said = capsys.readouterr()
    assert said.out == ""
    assert re.fullmatch(r"counting: 3 of 3 in \d+\.\d s\n", said.err)


def test_quiet_is_quiet(capsys: pytest.CaptureFixture[str]) -> None:
    with show_progress("counting", 3, quiet=True) as update:
        update(3)
    assert capsys.readouterr() == ("", "")


def test_a_bar_in_a_terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    with show_progress("counting", 3) as update:
        update(3)
    said = capsys.readouterr()
    assert said.out == ""
    assert "counting" in said.err
    assert "3/3" in said.err


def test_only_the_first_compiled_kernel_of_a_command_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    notices: list[str] = []
    monkeypatch.setattr(progress, "_print_compilation_notice", lambda: notices.append("compiling"))
    # Functions without a file are not cached, so that they are compiled each time the test runs.
    namespace: dict[str, Any] = {}
    exec("def halve(x): return 0.5 * x\ndef double(x): return 2.0 * x", namespace)
    halve = kernel(namespace["halve"])
    double = kernel(namespace["double"])
    with progress.report_compilation():
        assert halve(3.0) == 1.5
        assert double(3.0) == 6.0
    assert notices == ["compiling"]
