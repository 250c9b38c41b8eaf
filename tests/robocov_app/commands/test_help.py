"""The help of every command."""

import re

import pytest

from robocov_app.cli import COMMANDS, main


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_contains_no_internal_types(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    main([name, "--help"])
    text = capsys.readouterr().out
    assert not re.findall(r"\{\[.*|\[(?:STR|FLOAT|INT|PATH) \[.*|\{(?:FLOAT|INT) .*", text)


@pytest.mark.parametrize("columns", [60, 80, 200])
@pytest.mark.parametrize("name", COMMANDS)
def test_no_line_is_longer_than_the_terminal(
    name: str, columns: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    main([name, "--help"])
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if len(line) > columns] == []
    assert [line for line in lines if re.fullmatch("│ *│", line)] == [], "boxes have no empty lines"


@pytest.mark.parametrize("name", COMMANDS)
def test_the_example_is_on_one_line(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    main([name, "--help"])
    paragraphs = capsys.readouterr().out.split("\n\n")
    examples = [paragraph for paragraph in paragraphs if paragraph.startswith("Example: ")]
    assert len(examples) == 1
    assert "\n" not in examples[0]


def test_the_overview_is_at_most_80_columns_wide(capsys: pytest.CaptureFixture[str]) -> None:
    main(["--help"])
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if len(line) > 80] == []


def test_without_a_command_a_terminal_shows_five_first_commands(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert main([]) == 2
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 5
    assert all(line.startswith("robocov ") for line in lines)
