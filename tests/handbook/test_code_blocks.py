"""The code and the commands of the README and the handbook run, page by page."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from fuzz_seeds import IMDF, build_imdf_zip
from markdown_pages import (
    INDEX_DESCRIPTION,
    README,
    find_code,
    find_code_blocks,
    find_file_name,
    list_commands,
    list_handbook_pages,
    read_handbook_page,
)
from small_studies import DirectExecutor
from tiny_paper import TINY

from robocov.errors import InputError
from robocov_app.benchmark import suite
from robocov_app.cli import COMMANDS, main
from robocov_app.terminal.arguments import parse_options

PAGES = [README, INDEX_DESCRIPTION, *list_handbook_pages()]
WINDOW_COMMANDS = {"demo", "edit", "handbook"}
"""Commands that open a window or a browser: their arguments are only parsed."""
SHORT_RUN = ("--duration", "1", "--lattice", "16")
BENCHMARK_DURATION_S = 2.0
FAILURE_S = 1.0
"""Time at which robots fail in the benchmark."""
ADDED_OPTIONS = {"run": SHORT_RUN, "compare": SHORT_RUN, "optimum": ("--lattice", "16")}
"""Options that make a command faster."""
FIGURE_COMMANDS = ("run", "compare")
"""Commands that save figures, which take longer than short runs."""
PAGES_WITH_FIGURES = ("first-run", "density", "own-controller")
"""Pages whose commands also save their figures here."""
PAGE_WITH_CHECKED_CODE = "robots"
"""Page whose Python code another test runs, which also checks what it prints."""
REPLACEMENTS = {
    ", duration=60)": ", duration=2)",
    "run(60.0)": "run(20.0)",
    "--study full": "--study quick",
    "seeds = 10 ": "seeds = 1 ",
    "duration = 60.0": "duration = 0.5",
    "samples = 8": "samples = 1",
    "--count 20": "--count 2",
    "[0.1, 0.3, 1.0]": "[0.1]",
    "lattice=128": "lattice=32",
}
"""Long-running parts of the code, and their replacements in the test."""


@pytest.fixture(autouse=True)
def working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder, sweeps in this process, and small studies and benchmarks."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("robocov_app.replication.design.plan.QUICK", TINY)
    monkeypatch.setattr("robocov_app.sweep.sweeping.LocalPool", DirectExecutor)
    monkeypatch.setattr(suite, "_select_one_per_family", lambda maps: maps[:1])
    # Bundled results are those of longer runs, so that the page of the benchmark has only the new one.
    monkeypatch.setattr("robocov_app.benchmark.results.load_bundled_results", list)
    for name, track in suite.TRACKS.items():
        failures = tuple((robot, FAILURE_S) for robot, _ in track.failures)
        short_track = replace(track, duration=BENCHMARK_DURATION_S, failures=failures)
        monkeypatch.setitem(suite.TRACKS, name, short_track)  # type: ignore[arg-type]
    return tmp_path


def check_arguments(words: Sequence[str]) -> None:
    """Parse the arguments of a command without running it."""
    name, *arguments = words
    module = import_module(f"robocov_app.commands.{COMMANDS[name].module}")
    parse_options(module.Arguments, name, arguments)


def make_files_of_other_pages(page: Path) -> None:
    """Make the files that a page expects from the reader's earlier steps."""
    blocks = find_code_blocks(page.read_text(encoding="utf-8"))
    uses_first_run = any("first-run" in block.code for block in blocks)
    makes_first_run = page.stem in ("README", "package", "first-run")
    if uses_first_run and not makes_first_run:
        command = "run rooms --duration 25 --no-figures --out first-run"
        assert main(command.split()) == 0
    if page.stem == "python":
        Path("study.toml").write_text('maps = ["square"]\ncontrollers = ["rapf"]\nduration = 0.5\n')
        assert main(["sweep", "study.toml", "--out", "study"]) == 0
    elif page.stem == "benchmark":
        controller = find_code(read_handbook_page("own-controller"), "python", "# mine.py\n")
        Path("mine.py").write_text(controller)
    elif page.stem == "real-maps":
        Path("downloads").mkdir()
        Path("maps").mkdir()
    elif page.stem == "maps":
        Path("museum.zip").write_bytes(build_imdf_zip(IMDF))


def run_commands(code: str, *, saves_figures: bool) -> None:
    """Run the commands in a block of shell code."""
    for command in list_commands(code):
        _, *words = shlex.split(command)
        name = words[0]
        if name in WINDOW_COMMANDS:
            check_arguments(words)
            continue
        words += ADDED_OPTIONS.get(name, ())
        if name in FIGURE_COMMANDS and not saves_figures and "--no-figures" not in words:
            words.append("--no-figures")
        assert main(words) == 0, command


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_blocks_of_a_page_run_one_after_the_other(page: Path) -> None:
    make_files_of_other_pages(page)
    names: dict[str, Any] = {}
    for block in find_code_blocks(page.read_text(encoding="utf-8")):
        code = block.code
        for long_part, short_part in REPLACEMENTS.items():
            code = code.replace(long_part, short_part)
        file_name = find_file_name(block)
        if file_name is not None:
            Path(file_name).write_text(code)
        elif block.language == "python":
            if page.stem != PAGE_WITH_CHECKED_CODE:
                exec(code, names)
        elif block.language == "sh":
            run_commands(code, saves_figures=page.stem in PAGES_WITH_FIGURES)
        else:
            assert block.language in ("text", "bibtex")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_arguments_of_commands_in_sentences_are_valid(page: Path) -> None:
    text = page.read_text(encoding="utf-8").replace("\n", " ")
    for command in re.findall(r"`robocov ([a-z]+ [^`…|]*)`", text):
        words = shlex.split(command)
        if words[0] not in COMMANDS or ">" in words:
            continue
        try:
            check_arguments(words)
        except InputError as error:
            # Files of the sentence's own do not exist here.
            assert "no such file" in str(error), command
