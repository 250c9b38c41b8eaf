"""Scripts for shells complete the names of commands, their options and values."""

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


def complete_words(script: str, *arguments: str) -> list[str]:
    assert BASH is not None
    line = " ".join(f"'{word}'" for word in arguments)
    code = f"{script}\nCOMP_WORDS=({line}); COMP_CWORD={len(arguments) - 1}; _robocov; echo ${{COMPREPLY[@]}}"
    process = subprocess.run(
        [BASH, "--norc"], input=code, capture_output=True, text=True, timeout=60, check=True
    )
    return process.stdout.split()


@pytest.mark.parametrize("name", COMMANDS)
def test_completed_options_are_those_in_the_help(
    name: str, script: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main([name, "--help"])
    output = capsys.readouterr().out
    in_help = set(re.findall(r"--[a-z][a-z-]+", output))
    match = re.search(rf"^ +{name}\) names=\"(--[^\"]*)\" ;;$", script, re.MULTILINE)
    assert match is not None
    completed = set(match[1].split())
    assert completed <= in_help
    documented = set(re.findall(r"^\W*(?:-\w(?: \S+)?, )?(--[a-z][a-z-]+)", output, re.MULTILINE))
    assert "--help" in documented
    assert documented <= completed


@pytest.mark.skipif(BASH is None, reason="not installed: bash")
@pytest.mark.parametrize(
    ("arguments", "expected"),
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
def test_bash_completes_commands_options_and_values(
    script: str, arguments: tuple[str, ...], expected: list[str]
) -> None:
    assert complete_words(script, *arguments) == expected


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_scripts_of_other_shells_contain_all_commands(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in COMMANDS)
    assert "-l robots" in out if shell == "fish" else "bashcompinit" in out
