"""The help of every command."""

import re

import pytest

from robocov_app.cli import COMMANDS, main


@pytest.mark.parametrize("name", COMMANDS)
def test_values_of_options_have_names_that_users_understand(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
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
def test_an_example_can_be_copied_from_one_line(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    main([name, "--help"])
    paragraphs = capsys.readouterr().out.split("\n\n")
    examples = [paragraph for paragraph in paragraphs if paragraph.startswith("Example: ")]
    assert len(examples) == 1
    assert "\n" not in examples[0]


def test_no_line_of_the_overview_is_longer_than_a_usual_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    main(["--help"])
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if len(line) > 80] == []
