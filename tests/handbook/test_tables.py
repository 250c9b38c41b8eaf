"""Pages print the tables that their commands print."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from markdown_pages import find_code_blocks, find_file_name, list_handbook_pages

from robocov_app.cli import main
from robocov_app.runs import execution

COMMAND_WITH_TABLE = re.compile(
    r"```sh\n(robocov (?:compare|cost) [^\n]*)\n```\n"  # the command
    r"(?:\n|!\[[^\n]*\n)*"  # figures
    r"```text\n(.*?)```",  # its table
    re.DOTALL,
)


class PrintedTable(NamedTuple):
    """A table on a page, and the command that prints it."""

    page: Path
    command: str
    table: str


def list_tables() -> Iterator[PrintedTable]:
    """Yield the tables of all pages that follow the command that prints them."""
    for page in list_handbook_pages():
        for command, table in COMMAND_WITH_TABLE.findall(page.read_text(encoding="utf-8")):
            yield PrintedTable(page, command, table)


TABLES = list(list_tables())
TABLES_BY_COMMAND = {
    table.command: [other for other in TABLES if other.command == table.command] for table in TABLES
}
"""Tables of each command. A command that is on several pages runs once."""


def save_files_of_page(page: Path) -> None:
    """Save the files that a page shows."""
    for block in find_code_blocks(page.read_text(encoding="utf-8")):
        file_name = find_file_name(block)
        if file_name is not None:
            Path(file_name).write_text(block.code)


@pytest.mark.slow
@pytest.mark.parametrize("command", TABLES_BY_COMMAND)
def test_each_command_prints_its_table(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    # The tables contain final costs. Costs over time take longer than the runs.
    monkeypatch.setattr(execution, "DEFAULT_RATE_HZ", 0.1)
    tables = TABLES_BY_COMMAND[command]
    save_files_of_page(tables[0].page)
    _, *words = command.split()
    if words[0] == "compare":
        words.append("--no-figures")
    assert main(words) == 0
    output = capsys.readouterr().out
    for table in tables:
        assert output.startswith(table.table), table.page


def test_tables_of_all_these_pages_are_found() -> None:
    pages = {table.page.stem for table in TABLES}
    assert pages == {"cost", "exercises", "first-run", "own-controller", "where-controllers-fail"}
    own_controller_page = (list_handbook_pages()[0].parent / "own-controller.md").read_text(encoding="utf-8")
    table_count = sum(table.page.stem == "own-controller" for table in TABLES)
    assert table_count == own_controller_page.count("mean distance  above best")


def test_the_exercise_with_a_dragged_robot_prints_its_costs(capsys: pytest.CaptureFixture[str]) -> None:
    (page,) = (page for page in list_handbook_pages() if page.stem == "exercises")
    blocks = list(find_code_blocks(page.read_text(encoding="utf-8")))
    (number,) = (number for number, block in enumerate(blocks) if "dragged = rc.run" in block.code)
    exec(blocks[number].code, {})
    assert capsys.readouterr().out == blocks[number + 1].code
