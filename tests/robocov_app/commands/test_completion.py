"""Completion: what the script offers is what the commands take."""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest

from robocov.mapfile import list_bundled_maps
from robocov_app.cli import main
from robocov_app.commands import COMMANDS

BASH = shutil.which("bash")


@pytest.fixture(scope="module")
def script() -> str:
    from contextlib import redirect_stdout
    from io import StringIO

    with redirect_stdout(StringIO()) as out:
        assert main(["completion", "bash"]) == 0
    return out.getvalue()


def complete_words(script: str, *words: str) -> list[str]:
    assert BASH is not None
    line = " ".join(f"'{word}'" for word in words)
    ask = f"{script}\nCOMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; _robocov; echo ${{COMPREPLY[@]}}"
    run = subprocess.run([BASH, "--norc"], input=ask, capture_output=True, text=True, timeout=60, check=True)
    return run.stdout.split()


@pytest.mark.parametrize("name", COMMANDS)
def test_the_options_of_a_command_are_those_of_its_help(
    name: str, script: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main([name, "--help"])
    said = capsys.readouterr().out
    told = set(re.findall(r"--[a-z][a-z-]+", said))
    found = re.search(rf"^ +{name}\) names=\"(--[^\"]*)\" ;;$", script, re.MULTILINE)
    assert found is not None
    flags = set(found[1].split())
    assert flags <= told
    head = set(re.findall(r"^\W*(?:-\w(?: \S+)?, )?(--[a-z][a-z-]+)", said, re.MULTILINE))
    assert "--help" in head and head <= flags


@pytest.mark.skipif(BASH is None, reason="not installed: bash")
@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        (("robocov", "com"), ["compare", "completion"]),
        (("robocov", "run", "--rob"), ["--robots"]),
        (("robocov", "run", "--controller", "atlas"), ["atlas", "atlas-shared"]),
        (("robocov", "benchmark", "ver"), ["verify"]),
        (("robocov", "controllers", "rap"), ["rapf"]),
        (("robocov", "check", ""), list(list_bundled_maps())),
        (("robocov", "run", "--json", "roo"), ["rooms"]),
    ],
)
def test_the_shell_completes(script: str, words: tuple[str, ...], wanted: list[str]) -> None:
    assert complete_words(script, *words) == wanted


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_have_all_commands(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in COMMANDS)
    assert "-l robots" in out if shell == "fish" else "bashcompinit" in out
