"""Controllers that terminate Python exit with status 1, ordinary exceptions with 2.

Both are reported in one line.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from command_calls import COMMAND

from robocov.text import escape_controls
from robocov_app.cli import main
from robocov_app.terminal.supervision import find_user_controllers

HEAD = """
import ctypes, os, signal, sys
from dataclasses import dataclass

class Odd(BaseException):
    pass

class Unspeakable(Exception):
    def __str__(self):
        raise ValueError("no message")

@dataclass(frozen=True)
class Mine:
    def force(self, own):
        if own.time > 0.1:
            BODY
        return 0.0, 0.0
"""
SMALL = ["--duration", "0.3", "--robots", "2", "--lattice", "16", "--no-figures", "--out", "out"]
RAISED_EXITS = {
    "sys.exit()": "it tried to terminate Python by raising SystemExit (mine.py, line 16) for robot 1 at 0.",
    "raise Odd('hm')": "'Mine': it tried to terminate Python by raising Odd: hm (mine.py, line 16)",
    "raise GeneratorExit": "'Mine': it tried to terminate Python by raising GeneratorExit (mine.py, line 16)",
}
EXITS = {
    "raise KeyboardInterrupt": "it tried to terminate Python by raising KeyboardInterrupt (mine.py, line 16)",
    "sys.exit(0)": "'Mine': it tried to terminate Python by raising SystemExit: 0 (mine.py, line 16)",
    "sys.stdout.close()": "controller mine.py:Mine: it closed the standard output",
    "os.close(1)": "controller mine.py:Mine: it closed the standard output",
    "os.close(2)": "controller mine.py:Mine: it closed the standard error",
}
TERMINATIONS = {
    "os._exit(0)": "mine.py:Mine: it terminated Python (exit status 0) before the command had finished",
    "os._exit(3)": "controller mine.py:Mine: it terminated Python (exit status 3)",
    "os.kill(os.getpid(), signal.SIGKILL)": "it terminated Python (killed by signal 9 (SIGKILL))",
    "os.abort()": "it terminated Python (killed by signal 6 (SIGABRT))",
}
EXCEPTIONS = {
    "self.force(own)": "controller 'Mine': RecursionError: ",
    "bytearray(1 << 62)": "controller 'Mine': MemoryError (mine.py, line 16)",
    "raise Unspeakable": "controller 'Mine': Unspeakable (no message) (mine.py, line 16)",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write_controller(folder: Path, body: str) -> None:
    (folder / "mine.py").write_text(HEAD.replace("BODY", body))


def run_command(folder: Path, body: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    write_controller(folder, body)
    return subprocess.run([*COMMAND, *arguments], cwd=folder, capture_output=True, text=True, timeout=300)


def find_error_line(messages: str) -> str:
    assert "Traceback" not in messages
    assert "fault of robocov" not in messages
    errors = [line for line in messages.splitlines() if line.startswith("robocov: error: ")]
    assert len(errors) == 1, messages
    assert escape_controls(errors[0]) == errors[0]
    return errors[0]


@pytest.mark.slow
@pytest.mark.parametrize(("body", "message"), [*EXITS.items(), *TERMINATIONS.items()])
def test_a_controller_that_terminates_python_is_reported_in_one_line(
    folder: Path, body: str, message: str
) -> None:
    result = run_command(folder, body, "run", "square", "--controller", "mine.py:Mine", *SMALL)
    assert result.returncode == 1, result.stderr
    assert message in find_error_line(result.stderr)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "message", "status"),
    [
        *((body, message, 1) for body, message in RAISED_EXITS.items()),
        *((body, message, 2) for body, message in EXCEPTIONS.items()),
    ],
)
def test_a_failing_controller_is_reported_in_one_line(
    folder: Path, body: str, message: str, status: int, capsys: pytest.CaptureFixture[str]
) -> None:
    write_controller(folder, body)
    assert main(["run", "square", "--controller", "mine.py:Mine", *SMALL]) == status
    assert message in find_error_line(capsys.readouterr().err)


@pytest.mark.skipif(sys.platform == "win32", reason="commands are not supervised there")
def test_a_comparison_terminated_by_a_controller_is_reported(folder: Path) -> None:
    result = run_command(
        folder, "os._exit(0)", "compare", "square", "--controllers", "rpf", "mine.py:Mine", *SMALL
    )
    assert result.returncode == 1
    assert TERMINATIONS["os._exit(0)"] in find_error_line(result.stderr)


@pytest.mark.parametrize("words", [["--controller", "mine.py:Mine"], ["--controller=mine.py:Mine"]])
def test_the_name_of_an_option_is_not_part_of_the_controller(words: list[str]) -> None:
    assert find_user_controllers(["run", "square", *words]) == ["mine.py:Mine"]


@pytest.mark.skipif(sys.platform == "win32", reason="commands are not supervised there")
def test_supervision_does_not_change_the_output_of_a_correct_controller(folder: Path) -> None:
    result = run_command(folder, "pass", "run", "square", "--controller", "mine.py:Mine", *SMALL, "--json")
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith('{"out": "out"')
    wrong = run_command(folder, "pass", "run", "square", "--controller", "mine.py:Yours", *SMALL)
    assert wrong.returncode == 2
    assert "unknown class 'Yours' (known: Mine" in find_error_line(wrong.stderr)


@pytest.mark.slow
def test_a_sweep_reports_the_controller_that_ends_its_worker(folder: Path) -> None:
    study = 'maps = ["square"]\ncontrollers = ["mine.py:Mine"]\nduration = 0.3\nrobots = 2\nlattice = 16\n'
    (folder / "study.toml").write_text(study)
    result = run_command(folder, "os._exit(0)", "sweep", "study.toml", "--workers", "1", "--out", "out")
    assert result.returncode == 1
    row = (folder / "out" / "results.csv").read_text().splitlines()[1]
    assert "mine.py:Mine" in row and "its process ended (" in row
