"""The page on real robots prints what its code prints."""

from __future__ import annotations

import re
from typing import Any

import pytest

from robocov_app.commands.handbook import find_page_sources

PAGE = (find_page_sources() / "robots.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_code_prints_the_results_on_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    for code in re.findall(r"```python\n(.*?)```", PAGE, re.S):
        exec(code, names)
    first_line, last_line = capsys.readouterr().out.splitlines()
    assert f"period=0.1))  # {first_line}\n" in PAGE
    assert f"```text\n{last_line}\n```" in PAGE
