"""The page on writing a controller prints the tables that its commands print."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from robocov_app.cli import main
from robocov_app.commands.handbook import find_page_sources

PAGE = (find_page_sources() / "own-controller.md").read_text(encoding="utf-8")
TABLES = re.findall(r"```sh\n(robocov compare .*?)\n```\n\n```text\n(.*?)```", PAGE, re.S)


@pytest.mark.slow
@pytest.mark.parametrize(("command", "table"), TABLES)
def test_tables_are_those_of_the_commands(
    command: str,
    table: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, code in re.findall(r"```python\n# (\w+\.py)\n(.*?)```", PAGE, re.S):
        Path(name).write_text(code)
    assert main([*command.split()[1:], "--no-figures"]) == 0
    assert capsys.readouterr().out.startswith(table)


def test_every_table_has_its_command() -> None:
    assert len(TABLES) == PAGE.count("mean distance  above lowest")
