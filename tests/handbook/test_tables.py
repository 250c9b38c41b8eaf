"""Pages print the tables that their commands print."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from markdown_pages import find_code_blocks, find_file_name, list_handbook_pages

from robocov_app.cli import main

COMMAND_WITH_TABLE = re.compile(
    r"```sh\n(robocov (?:compare|cost) [^\n]*)\n```\n"  # the command
    r"(?:\n|!\[[^\n]*\n)*"  # figures
    r"```text\n(.*?)```",  # its table
    re.DOTALL,
)


def list_commands_with_tables() -> Iterator[tuple[Path, str, str]]:
    """Yield each command that is followed by its table, with the file of the page."""
    for page in list_handbook_pages():
        for command, table in COMMAND_WITH_TABLE.findall(page.read_text(encoding="utf-8")):
            yield page, command, table


CASES = list(list_commands_with_tables())


def save_files_of_page(page: Path) -> None:
    """Save the files that a page shows."""
    for block in find_code_blocks(page.read_text(encoding="utf-8")):
        file_name = find_file_name(block)
        if file_name is not None:
            Path(file_name).write_text(block.code)


@pytest.mark.slow
@pytest.mark.parametrize(("page", "command", "table"), CASES, ids=[command for _, command, _ in CASES])
def test_each_command_prints_its_table(
    page: Path,
    command: str,
    table: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    save_files_of_page(page)
    _, *words = command.split()
    if words[0] == "compare":
        words.append("--no-figures")
    assert main(words) == 0
    assert capsys.readouterr().out.startswith(table)


def test_tables_of_all_these_pages_are_found() -> None:
    pages = {page.stem for page, _, _ in CASES}
    assert pages == {"cost", "exercises", "first-run", "own-controller", "where-controllers-fail"}
    own_controller_page = (list_handbook_pages()[0].parent / "own-controller.md").read_text(encoding="utf-8")
    table_count = sum(page.stem == "own-controller" for page, _, _ in CASES)
    assert table_count == own_controller_page.count("mean distance  above best")
