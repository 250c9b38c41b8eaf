"""Calls of the command in this process or in another one."""

import json
import sys

import pytest

from robocov_app.cli import main

SHORT = ("--duration", "1.0", "--lattice", "16", "--size", "480x320")
COMMAND = (sys.executable, "-m", "robocov_app")


def read_error(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 2) -> str:
    """Call the command with an error, and return its error message, which has to be one line."""
    assert main(list(arguments)) == status
    output = capsys.readouterr()
    assert output.out == ""
    lines = output.err.strip().splitlines()
    assert len(lines) == 1, output.err
    assert lines[0].startswith("robocov: error: ")
    return lines[0].removeprefix("robocov: error: ")


def read_json(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict:
    """Call the command with ``--json``, and return its parsed output."""
    assert main([*arguments, "--json"]) == 0
    output = capsys.readouterr()
    assert output.err == ""
    return json.loads(output.out)
