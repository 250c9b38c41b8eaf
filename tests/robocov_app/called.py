"""Calling the command in tests, in this process or in one of its own."""

import json
import sys

import pytest

from robocov_app.cli import main

SHORT = ("--duration", "1.0", "--lattice", "16", "--size", "480x320")
COMMAND = (sys.executable, "-m", "robocov_app")


def read_complaint(capsys: pytest.CaptureFixture[str], *words: str, status: int = 2) -> str:
    """Call the command with something wrong; return the one line that it must say."""
    assert main(list(words)) == status
    said = capsys.readouterr()
    assert said.out == ""
    lines = said.err.strip().splitlines()
    assert len(lines) == 1, said.err
    assert lines[0].startswith("robocov: error: ")
    return lines[0].removeprefix("robocov: error: ")


def answer(capsys: pytest.CaptureFixture[str], *words: str) -> dict:
    assert main([*words, "--json"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    return json.loads(said.out)
