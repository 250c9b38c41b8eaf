"""The page on writing a controller prints the tables that its commands print."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from markdown_pages import find_code_blocks, read_handbook_page

from robocov_app.cli import main

PAGE = read_handbook_page("own-controller")
TABLES = re.findall(r"```sh\n(robocov compare .*?)\n```\n\n```text\n(.*?)```", PAGE, re.DOTALL)
"""Each command on the page, and the table below it."""


@pytest.mark.slow
@pytest.mark.parametrize(("command", "table"), TABLES)
def test_each_command_prints_its_table(
    command: str,
    table: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for block in find_code_blocks(PAGE):
        comment = re.match(r"# (\w+\.py)\n", block.code)
        if comment is not None:
            Path(comment[1]).write_text(block.code)
    _, *words = command.split()
    assert main([*words, "--no-figures"]) == 0
    assert capsys.readouterr().out.startswith(table)


def test_every_table_stands_below_its_command() -> None:
    assert len(TABLES) == PAGE.count("mean distance  above lowest")
