"""Every block of code and every command in the README and the handbook does what it says, page by page."""

from __future__ import annotations

import re
import shlex
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from fuzz_seeds import IMDF, build_imdf_zip
from swept import DirectExecutor

from robocov.errors import InputError
from robocov_app.benchmark import suite
from robocov_app.cli import COMMANDS, main
from robocov_app.commands.handbook import find_page_sources
from robocov_app.terminal.arguments import parse_options

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / ".readme/package.md", *sorted(find_page_sources().glob("*.md"))]

_SHOWN = {"demo", "edit", "handbook"}  # they open windows: their words are parsed
_SHORTER = {
    "run": ["--duration", "1", "--lattice", "16"],
    "compare": ["--duration", "1", "--lattice", "16"],
}
_FASTER = (
    (", duration=60)", ", duration=2)"),
    *(("run(60.0)", "run(20.0)"), ("several, 60.0", "several, 1.0"), ("--study full", "--study quick")),
    *(("seeds = 10 ", "seeds = 1 "), ("duration = 60.0", "duration = 0.5"), ("samples = 8", "samples = 1")),
    *(("--count 20", "--count 2"), ("[0.1, 0.3, 1.0]", "[0.1]"), ("lattice=128", "lattice=32")),
)


def split_words(line: str) -> list[str]:
    return shlex.split(line.partition(" # ")[0].partition("  #")[0])[1:]


def parse_alone(words: list[str]) -> None:
    parse_options(
        import_module(f"robocov_app.commands.{COMMANDS[words[0]].module}").Arguments, words[0], words[1:]
    )


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder; sweeps in this process, tracks of half a second."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("robocov_app.sweep.sweeping.LocalPool", DirectExecutor)
    for name in suite.QUICK_TRACKS:
        track = replace(suite.TRACKS[name], duration=0.5, maps=suite.TRACKS[name].maps[:1])
        monkeypatch.setitem(suite.TRACKS, name, track)  # type: ignore[arg-type]
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_blocks_of_a_page_run_one_after_the_other(page: Path, folder: Path) -> None:
    text = page.read_text()
    if "first-run" in text and page.stem not in ("README", "package", "first-run"):
        assert main(["run", "rooms", "--duration", "25", "--no-figures", "--out", "first-run"]) == 0
    if page.stem == "python":
        (folder / "study.toml").write_text('maps = ["square"]\ncontrollers = ["rapf"]\nduration = 0.5\n')
        assert main(["sweep", "study.toml", "--out", "study"]) == 0
    if page.stem == "benchmark":
        mine = (find_page_sources() / "own-controller.md").read_text()
        (folder / "mine.py").write_text(next(re.finditer(r"```python\n(# mine.py.*?)```", mine, re.S))[1])
    if page.stem == "maps":
        (folder / "museum.zip").write_bytes(build_imdf_zip(IMDF))
    names: dict[str, Any] = {}
    for found in re.finditer(r"```(\w+)\n(.*?)```", text, re.S):
        kind, code = found.groups()
        for slow, fast in _FASTER:
            code = code.replace(slow, fast)
        named = re.match(r"# ([\w.-]+)\n", code)
        if kind in ("text", "bibtex"):
            continue
        if kind in ("json", "toml") or named:
            before = re.findall(r"`([\w-]+\.(?:json|toml|robocov))`", text[: found.start()])
            (folder / (named[1] if named else ["map.json", *before][-1])).write_text(code)
        elif kind == "python":
            exec(code, names)
        else:
            assert kind == "sh"
            for line in code.replace("\\\n", " ").splitlines():
                if line.startswith("robocov "):
                    words = split_words(line)
                    if words[0] in _SHOWN:
                        parse_alone(words)
                    else:
                        assert main([*words, *_SHORTER.get(words[0], [])]) == 0, line


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_in_the_text_are_such_that_they_are_understood(page: Path) -> None:
    for line in re.findall(r"`robocov ([a-z]+ [^`…|]*)`", page.read_text().replace("\n", " ")):
        words = shlex.split(line)
        if words[0] in COMMANDS and ">" not in words:
            try:
                parse_alone(words)
            except InputError as error:  # of the text's own
                assert "no such file" in str(error), line
