"""The page on real robots prints what its code prints."""

from __future__ import annotations

from typing import Any

import pytest
from markdown_pages import find_code_blocks, read_handbook_page

PAGE = read_handbook_page("robots")


@pytest.mark.slow
def test_the_code_runs_and_prints_the_results_on_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    for block in find_code_blocks(PAGE):
        if block.language == "python":
            exec(block.code, names)
    first_line, last_line = capsys.readouterr().out.splitlines()
    assert f"period=0.1))  # {first_line}\n" in PAGE
    assert f"```text\n{last_line}\n```" in PAGE
