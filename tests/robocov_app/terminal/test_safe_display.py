"""Names and messages of others in everything that is displayed: terminals do not obey them."""

from __future__ import annotations

import json
import re
import xml.dom.minidom
from pathlib import Path

import pytest

from robocov.text import escape_controls
from robocov_app.cli import main

CONTROLLER = """
from dataclasses import dataclass

@dataclass(frozen=True)
class Mine:
    label = "red\\x1b[31m\\u202elabel"
    summary = "red\\x1b[31m\\u202esummary"
    fails: float = 0.0

    def force(self, own):
        if self.fails:
            raise ValueError("boom\\x1b[31m\\u202egnp")
        return 0.0, 0.0
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "mine.py").write_text(CONTROLLER)
    square = {"format": "robocov-map", "version": 1, "name": "back\u202ewards\x85"}
    square["boundary"] = [[0, 0], [4, 0], [4, 4], [0, 4]]
    (tmp_path / "evil.json").write_text(json.dumps(square))
    monkeypatch.chdir(tmp_path)
    return tmp_path


RUN = ["--controller", "mine.py:Mine", "--robots", "2", "--duration", "0.2", "--lattice", "16"]


@pytest.mark.parametrize(
    "words",
    [
        ["check", "evil.json"],
        ["run", "evil.json", *RUN, "--no-figures"],
        ["run", "evil.json", *RUN, "--set", "fails=1"],
        ["run", "no\x1b[31m.json"],
        ["run", "evil.json", "--set", "k\x1b[31m=1"],
        ["compare", "evil.json", "--controllers", "mine.py:Mine", "rpf", *RUN[2:], "--no-figures"],
        ["\x1b[31mrun"],
        ["run", "--\u202ebots"],
        ["convert", "evil\x1b.svg", "-o", "a.json"],
    ],
    ids=lambda words: words[0].strip("\x1b[31m"),
)
def test_terminals_get_no_controls(
    folder: Path, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    main(words)
    said = "".join(capsys.readouterr())
    assert said
    assert escape_controls(said) == said


def test_figures_and_pages_get_no_controls(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "evil.json", *RUN, "--out", "run"]) == 0
    for file in sorted((folder / "run").glob("*.svg")):
        xml.dom.minidom.parse(str(file))
        assert escape_controls(text := file.read_text("utf-8")) == text
    assert main(["report", "run", "--out", "page.html"]) == 0
    page = (folder / "page.html").read_text("utf-8")
    assert escape_controls(page) == page
    # A script would convert JSON escapes back to the characters.
    assert not re.search(r"(?<!\\)(\\\\)*\\u(202e|001b)", page.replace("back\\u202ewards", ""))
